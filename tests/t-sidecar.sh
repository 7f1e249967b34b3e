#!/bin/sh
# ct-convert --sidecar: what is known of a volume, and where each plane comes from; never the patient.
. "$srcdir/tests/tap.sh"
ct-phantom -q --size 6x5x4 --spacing 2 marks a.nii
exits 0 'of NIfTI' ct-convert --sidecar a.json a.nii b.nii
has a.json '"SourceFile": "a.nii"' 'names its file'
has a.json '"ConversionSoftware": "ctsr"' 'and the software'
! grep -q Units a.json; ok $? 'and no units that nobody said'
exits 0 'unless' ct-convert --units hu --sidecar h.json a.nii h.nii
has h.json '"Units": "HU"' 'they are told'
! grep -q Slice a.json; ok $? 'and no slices'
exits 0 'before what changes the grid' ct-convert --reorient PIL --iso 3 --sidecar i.json a.nii i.nii
cmp -s i.json a.json; ok $? 'is what is told'
exits 0 'what is not HU' ct-convert --units other --sidecar u.json a.nii u.nii
has u.json '"Units": "other"' 'says so'
exits 0 'to a stream' sh -c 'ct-convert --sidecar - a.nii c.nii >s.json'
cmp -s s.json a.json; ok $? 'the same'
exits 0 'of a stream' sh -c 'ct-convert --sidecar p.json - - <a.nii >c2.nii'
! grep -q SourceFile p.json; ok $? 'which has no name'
tail -c 240 b.nii >1; tail -c 240 c.nii | cmp -s - 1; ok $? 'OUT is as without'
exits 2 'both to one stream' ct-convert --sidecar - a.nii -
exits 4 'which is there' ct-convert --sidecar a.json a.nii d.nii
has err 'a.json: exists' 'is told'
[ ! -e d.nii ]; ok $? 'before OUT is made'
ln a.nii n.json
exits 4 'the input is not written over' ct-convert -f --sidecar n.json a.nii d.nii
exits 2 'nor is it NIfTI' ct-convert --sidecar x.nii a.nii d.nii
ln -s /dev/full full.json
exits 4 'no room' ct-convert --sidecar full.json a.nii d.nii
exits 0 'of what ct-sr makes' ct-sr -q -Q draft -x 1,1,2 --sidecar r.json a.nii r.nii
for i in '"SourceFile": "a.nii"' '"Factor": "1,1,2"' '"Method": "' '"DERIVED"' '"Units": "HU"'; do has r.json "$i" "the sidecar of a refined scan says $i"; done
exits 2 'not by projections' ct-sr --sidecar no.json --paper a.nii no.nii
exits 4 'no room for it' ct-sr -q -Q draft -x 1,1,2 --sidecar full.json a.nii r2.nii
python_with pydicom && python_with nibabel && "$PY" -c 'import pydicom, numpy' 2>/dev/null &&
	ct-convert "$srcdir/tests/t-sidecar.sh" s.nii 2>&1 | grep -qv 'reads no DICOM' || {
	skip 'of DICOM' 'no pydicom, nibabel or vtk-dicom'; done_testing; exit $?; }
py() { "$PY" "$srcdir/tests/t-sidecar.py" "$@"; }
py make
exits 0 'of a series' ct-convert --sidecar even.json even even.nii
exits 0 'each plane is its slice' py trace even even.nii even.json
has out '^9 9$' 'one of one'
for i in '"Manufacturer": "ACME Med"' '"KVP": 120' '"SliceThickness": 9' '"SpacingBetweenSlices": 2.5' \
	'"GantryDetectorTilt": 0' '"ReconstructionDiameter": 350' '"PatientPosition": "HFS"' '"Units": "HU"' \
	'"ManufacturersModelName": "CT-9"' '"SeriesNumber": 7'; do
	has even.json "$i" "the sidecar of an even series says $i"
done
tr -d ' \n' <even.json | grep -qF '"PixelSpacing":[0.75,0.5]'; ok $? 'rows, then columns'
exits 0 'of uneven slices' ct-convert --sidecar uneven.json uneven uneven.nii
exits 0 'each plane is two, by their weights' py trace uneven uneven.nii uneven.json
grep -q '0\.[0-9]' uneven.json; ok $? 'in parts'
exits 0 'of names that tell' ct-convert --sidecar named.json named named.nii
[ "$(grep -c InstanceNumber named.json)" -eq 9 ]; ok $? 'slices are numbered'
! grep -q '"File"' named.json; ok $? 'and not named'
exits 0 'of a series, refined' ct-sr -q -Q draft -x 1,1,2 --sidecar thin.json named thin.nii
for i in '"Manufacturer": "ACME Med"' '"KVP": 120' '"Factor": "1,1,2"'; do has thin.json "$i" "the sidecar of thin slices says $i"; done
! grep -E 'SliceThickness|Spacing|ConvolutionKernel|ORIGINAL' thin.json; ok $? 'not how the slices were sampled'
exits 0 'read again' ct-info -e thin.nii; ! grep -q 'says the scanner' err; ok $? 'it says nothing of the scanner'
exits 0 'without a name' ct-sr -q -Q draft -x 1,1,2 --deid --sidecar hidden.json even.nii hidden/
! grep -q SourceFile hidden.json; ok $? 'of a file'
exits 0 'nor of slices' ct-sr -q -Q draft -x 1,1,2 --deid --sidecar bare.json even bare/
grep -q '"Position"' bare.json && ! grep -q '"File"' bare.json; ok $? 'which are told, unnamed'
exits 0 'of ct-convert' ct-convert -q --deid --sidecar own.json even own/
exits 0 'nor' ct-convert -q --deid --template even --sidecar file.json even.nii file/
! grep -E 'SourceFile|"File"' own.json file.json; ok $? 'which names none either'
for f in even uneven named thin hidden bare; do
	! grep -iE 'doering|jane|secret77|1960|2020|acc1|hosp|"op"|"s1"|ref"|1\.2\.[0-9]|synthetic' "$f.json"
	ok $? "$f: nothing of the patient"
done
if command -v dcm2niix >/dev/null; then
	dcm2niix -z n -f peer -o . even >/dev/null 2>&1
	exits 0 'what dcm2niix says, too' py peer even.json peer.json
	sed 's/^/# /' out
else
	skip 'what dcm2niix says, too' 'no dcm2niix'
fi
done_testing
