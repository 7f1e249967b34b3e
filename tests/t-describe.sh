#!/bin/sh
# What commands say of themselves to programs: JSON, and the form of 3D Slicer, which runs them.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
py() { PYTHONDONTWRITEBYTECODE=1 python3 "$srcdir/tests/describe.py" "$@"; }
for t in $CT_TOOLS; do
	exits 0 "$t --describe" py described "$t"
	exits 0 "$t --xml" py form "$t"
done
ct-phantom -q --size 16x16x16 --spacing 2 ellipsoids hr.nii && ct-degrade -q -x 2 hr.nii lr.nii
ct-convert -q lr.nii lr.nrrd
slicer() { exits 0 "as Slicer runs $1" env SLICER_HOME=/ sh -c "$(py slicer "$@")"; }
slicer ct-sr quality=draft lr.nrrd o.nrrd
has out '^<filter-progress>1.000</filter-progress>$' 'with its progress'
ct-sr -q -Q draft lr.nrrd plain.nrrd; exits 0 'the same' ct-metrics -q --min psnr=1000 plain.nrrd o.nrrd
slicer ct-upsample factor=2 lr.nrrd up.nii; [ -s up.nii ]; ok $? 'is made'
slicer ct-convert o.nrrd c.nii.gz; [ -s c.nii.gz ]; ok $? 'is made'
slicer ct-degrade factor=2 o.nrrd d.nii; [ -s d.nii ]; ok $? 'is made'
SLICER_HOME=/ ct-sr -q -Q draft lr.nii - >stream.nii; exits 0 'a stream is not spoilt' ct-info stream.nii
SLICER_HOME=/ ct-project -q -f -n 4 hr.nii /dev/stdout | cat >again.exr; exits 0 'by another name, too' ct-info again.exr
exits 0 'nor is a report' env SLICER_HOME=/ ct-metrics --json hr.nii o.nrrd; python3 -c 'import json; json.load(open("out"))'; ok $? 'of JSON'
ct-sr -q -Q draft -f lr.nii o.nrrd >out; [ ! -s out ]; ok $? 'without Slicer nothing is printed'
done_testing
