#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What commands say of themselves to programs: JSON, and from it Boutiques and nipype; the form of 3D Slicer. These run them.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
py() { PYTHONDONTWRITEBYTECODE=1 python3 "$srcdir/tests/describe.py" "$@"; }
for t in $CT_TOOLS; do
	exits 0 "$t --describe" py described "$t"
	exits 0 "$t --xml" py form "$t"
done
ct-sr --describe | python3 -c 'import json, sys
sys.exit([o["ends"] for o in json.load(sys.stdin)["options"] if o["name"] == "report"] != [[{"names": ["html"]}]])'
ok $? 'an output of one kind tells how its name ends'
ct-phantom -q --size 16x16x16 --spacing 2 ellipsoids hr.nii && ct-degrade -q -x 2 hr.nii lr.nii
ct-convert -q lr.nii lr.nrrd
slicer() { exits 0 "as Slicer runs $1" env SLICER_HOME=/ sh -c "$(py slicer "$@")"; }
slicer ct-sr quality=draft lr.nrrd o.nrrd
has out '^<filter-progress>1.000</filter-progress>$' 'ct-sr tells 3D Slicer its progress'
ct-sr -q -Q draft lr.nrrd plain.nrrd; exits 0 'ct-sr run by a 3D Slicer form gives the same CT' ct-metrics -q --min psnr=1000 plain.nrrd o.nrrd
slicer ct-upsample factor=2 lr.nrrd up.nii; [ -s up.nii ]; ok $? 'ct-upsample run by a 3D Slicer form makes OUT'
slicer ct-convert o.nrrd c.nii.gz; [ -s c.nii.gz ]; ok $? 'ct-convert run by a 3D Slicer form makes OUT'
slicer ct-degrade factor=2 o.nrrd d.nii; [ -s d.nii ]; ok $? 'ct-degrade run by a 3D Slicer form makes OUT'
SLICER_HOME=/ ct-sr -q -Q draft lr.nii - >stream.nii; exits 0 'a stream is not spoilt' ct-info stream.nii
SLICER_HOME=/ ct-project -q -f -n 4 hr.nii /dev/stdout | cat >again.exr; exits 0 'by another name, too' ct-info again.exr
exits 0 'a report is not spoilt under 3D Slicer' env SLICER_HOME=/ ct-metrics --json hr.nii o.nrrd; python3 -c 'import json; json.load(open("out"))'; ok $? 'a report stays JSON under 3D Slicer'
ct-sr -q -Q draft -f lr.nii o.nrrd >out; [ ! -s out ]; ok $? 'without Slicer nothing is printed'
lib=$(ls "$builddir"/libctsr.so.0 "$builddir"/.libs/libctsr.so.0 2>/dev/null | head -n 1)
NO_ET=1 NIPYPE_NO_ET=1 HOME=$PWD; export NO_ET NIPYPE_NO_ET HOME # nipype asks the network for news, and writes there
for PY in /usr/bin/python3 python3; do "$PY" -c 'import nipype' 2>/dev/null && break; done
py() { CTSR_LIBRARY=$lib PYTHONPATH=$srcdir/python PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/describe.py" "$@"; }
if [ -n "$lib" ] && "$PY" -c 'import numpy' 2>/dev/null && ! sanitized ct-sr; then
	for t in $CT_TOOLS; do exits 0 "$t of Boutiques" py boutiques "$t"; done
	exits 0 'as Boutiques runs ct-sr' sh -c "$(py invocation ct-sr IN=lr.nii OUT=b.nii quality=draft quiet=yes threads=1)"
	exits 0 'ct-sr run by Boutiques gives the same CT' ct-metrics -q --min psnr=1000 o.nrrd b.nii
	exits 0 'as Boutiques runs ct-convert' sh -c "$(py invocation ct-convert IN=b.nii OUT=b.mha)"; [ -s b.mha ]; ok $? 'ct-convert run by Boutiques makes OUT'
	exits 0 'ctsr.boutiques prints a descriptor of ct-sr' env CTSR_LIBRARY="$lib" PYTHONPATH="$srcdir/python" PYTHONDONTWRITEBYTECODE=1 "$PY" -m ctsr.boutiques ct-sr; has out '"schema-version": "0.5"'
else
	skip 'Boutiques' 'no shared library, or no numpy'
fi
if [ -n "$lib" ] && "$PY" -c 'import nipype' 2>/dev/null && ! sanitized ct-sr; then
	for t in $CT_TOOLS; do exits 0 "$t of nipype" py nipype "$t"; done
	exits 0 'as nipype runs them' py run_nipype
	exits 0 'ct-sr run by nipype gives the same CT' ct-metrics -q --min psnr=1000 o.nrrd n.nii
else
	skip 'nipype' 'no nipype, or no shared library'
fi
done_testing
