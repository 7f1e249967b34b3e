#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-convert --sidecar: what is known of a volume, and where each plane comes from; never the patient.
. "$srcdir/tests/tap.sh"
ct-phantom -q --size 6x5x4 --spacing 2 marks a.nii
# sidecars of NIfTI: what they say, pipes, refusals
exits 0 'ct-convert --sidecar writes a sidecar of NIfTI' ct-convert --sidecar a.json a.nii b.nii
has a.json '"SourceFile": "a.nii"' 'the sidecar of NIfTI names its source file'
has a.json '"ConversionSoftware": "ctsr"' 'the sidecar of NIfTI names the software'
! grep -q Units a.json; ok $? 'the sidecar of NIfTI has no units that nobody stated'
exits 0 'ct-convert --sidecar accepts --units' ct-convert --units hu --sidecar h.json a.nii h.nii
has h.json '"Units": "HU"' 'the sidecar has the units of --units'
! grep -q Slice a.json; ok $? 'the sidecar of NIfTI has no slices'
exits 0 'ct-convert --sidecar accepts --reorient and --iso' ct-convert --reorient PIL --iso 3 --sidecar i.json a.nii i.nii
cmp -s i.json a.json; ok $? 'the sidecar describes the input before its grid is changed'
exits 0 'ct-convert --sidecar accepts --units other' ct-convert --units other --sidecar u.json a.nii u.nii
has u.json '"Units": "other"' 'the sidecar has the units other'
exits 0 'ct-convert --sidecar - writes the sidecar to standard output' sh -c 'ct-convert --sidecar - a.nii c.nii >s.json'
cmp -s s.json a.json; ok $? 'the sidecar on standard output is that of the file'
exits 0 'ct-convert --sidecar accepts a volume from a pipe' sh -c 'ct-convert --sidecar p.json - - <a.nii >c2.nii'
! grep -q SourceFile p.json; ok $? 'the sidecar of a pipe names no source file'
tail -c 240 b.nii >1
tail -c 240 c.nii | cmp -s - 1
ok $? 'the volume is the same with the sidecar in a file or on standard output'
exits 2 'sidecar and volume on standard output are refused with status 2' ct-convert --sidecar - a.nii -
exits 4 'an existing sidecar is not overwritten' ct-convert --sidecar a.json a.nii d.nii
has err 'a.json: exists' 'the error of an existing sidecar names it'
[ ! -e d.nii ]; ok $? 'an existing sidecar is refused before the volume is written'
ln a.nii n.json
exits 4 'a sidecar that is the input is refused even with --force' ct-convert -f --sidecar n.json a.nii d.nii
exits 2 'a sidecar named .nii is refused with status 2' ct-convert --sidecar x.nii a.nii d.nii
ln -s /dev/full full.json
exits 4 'a full disk ends ct-convert --sidecar with status 4' ct-convert --sidecar full.json a.nii d.nii
# sidecars of ct-sr
exits 0 'ct-sr --sidecar writes a sidecar of its result' ct-sr -q -Q draft -x 1,1,2 --sidecar r.json a.nii r.nii
for i in '"SourceFile": "a.nii"' '"Factor": "1,1,2"' '"Method": "' '"DERIVED"' '"Units": "HU"'; do
	has r.json "$i" "the sidecar of a refined scan says $i"
done
exits 2 'ct-sr --sidecar with --paper is refused with status 2' ct-sr --sidecar no.json --paper a.nii no.nii
exits 4 'a full disk ends ct-sr --sidecar with status 4' ct-sr -q -Q draft -x 1,1,2 --sidecar full.json a.nii r2.nii
# sidecars of DICOM series
python_with pydicom && python_with nibabel && "$PY" -c 'import pydicom, numpy' 2>/dev/null && with_dicom || {
	skip 'the sidecar of a series names its slices' 'no pydicom, nibabel or vtk-dicom'; done_testing; exit $?; }
py() { "$PY" "$srcdir/tests/t-sidecar.py" "$@"; }
py make
exits 0 'ct-convert --sidecar writes a sidecar of a series' ct-convert --sidecar even.json even even.nii
exits 0 'the sidecar of an even series gives the slice of each plane' py trace even even.nii even.json
has out '^9 9$' 'each plane of an even series comes from one slice'
for i in '"Manufacturer": "ACME Med"' '"KVP": 120' '"SliceThickness": 9' '"SpacingBetweenSlices": 2.5' \
	'"GantryDetectorTilt": 0' '"ReconstructionDiameter": 350' '"PatientPosition": "HFS"' '"Units": "HU"' \
	'"ManufacturersModelName": "CT-9"' '"SeriesNumber": 7'; do
	has even.json "$i" "the sidecar of an even series says $i"
done
tr -d ' \n' <even.json | grep -qF '"PixelSpacing":[0.75,0.5]'
ok $? 'the pixel spacing is that of rows, then of columns'
exits 0 'ct-convert --sidecar writes a sidecar of uneven slices' ct-convert --sidecar uneven.json uneven uneven.nii
exits 0 'the sidecar of uneven slices gives the two slices of each plane' py trace uneven uneven.nii uneven.json
grep -q '0\.[0-9]' uneven.json; ok $? 'the sidecar of uneven slices has weights between 0 and 1'
exits 0 'ct-convert --sidecar writes a sidecar of files named after a patient' ct-convert --sidecar named.json named named.nii
[ "$(grep -c InstanceNumber named.json)" -eq 9 ]; ok $? 'the sidecar numbers the slices of files named after a patient'
! grep -q '"File"' named.json; ok $? 'the sidecar does not name files that are named after a patient'
exits 0 'ct-sr --sidecar writes a sidecar of a refined series' ct-sr -q -Q draft -x 1,1,2 --sidecar thin.json named thin.nii
for i in '"Manufacturer": "ACME Med"' '"KVP": 120' '"Factor": "1,1,2"'; do
	has thin.json "$i" "the sidecar of thin slices says $i"
done
! grep -E 'SliceThickness|Spacing|ConvolutionKernel|ORIGINAL' thin.json
ok $? 'the sidecar of a refined series does not say how its slices were sampled'
exits 0 'ct-info -e accepts a refined series with its sidecar' ct-info -e thin.nii
! grep -q 'says the scanner' err
ok $? 'the sidecar of a refined series says nothing of the scanner'
exits 0 'ct-sr --deid --sidecar writes a sidecar of NIfTI' ct-sr -q -Q draft -x 1,1,2 --deid --sidecar hidden.json even.nii hidden/
! grep -q SourceFile hidden.json; ok $? 'the sidecar of ct-sr --deid names no source file'
exits 0 'ct-sr --deid --sidecar writes a sidecar of a series' ct-sr -q -Q draft -x 1,1,2 --deid --sidecar bare.json even bare/
grep -q '"Position"' bare.json && ! grep -q '"File"' bare.json
ok $? 'the sidecar of ct-sr --deid gives places of slices without file names'
exits 0 'ct-convert --deid --sidecar writes a sidecar of a series' ct-convert -q --deid --sidecar own.json even own/
exits 0 'ct-convert --deid --sidecar accepts --template' ct-convert -q --deid --template even --sidecar file.json even.nii file/
! grep -E 'SourceFile|"File"' own.json file.json; ok $? 'the sidecars of ct-convert --deid name no file'
for f in even uneven named thin hidden bare; do
	! grep -iE 'doering|jane|secret77|1960|2020|acc1|hosp|"op"|"s1"|ref"|1\.2\.[0-9]|synthetic' "$f.json"
	ok $? "$f.json holds nothing that identifies the patient"
done
if command -v dcm2niix >/dev/null; then
	dcm2niix -z n -f peer -o . even >/dev/null 2>&1
	exits 0 'the sidecar of a series agrees with that of dcm2niix' py peer even.json peer.json
	sed 's/^/# /' out
else
	skip 'the sidecar of a series agrees with that of dcm2niix' 'no dcm2niix'
fi
done_testing
