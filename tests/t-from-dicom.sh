#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What DICOM says of the scanner, from a series, a converted file or a sidecar: used, joined with edges, or refused.
. "${srcdir:?}/tests/tap.sh"
ct-phantom -q --size 96x96x96 --spacing 1 shepp-logan hi.nii || exit 99
ct-degrade -q -x 1,1,4 --sigma 0,0,1.48 --decimate point hi.nii lr.nii || exit 99
bare() { ct-convert -q --type f32 "$1" - | tail -c $((96 * 96 * 24 * 4)) >raw; ct-convert -q -f --raw "96x96x24:f32:1,1,4" --orient RAS raw "$2"; }
bare lr.nii s.nii
sr() { exits 0 "$1" ct-sr -f -Q draft -x 1,1,4 --noise 0 "$2" sr.nii; grep '^ct-sr: assumed' err | sed 's/^/# /'; } # sr NAME IN
line() { awk -v k="$2" '$1 == k {$1 = ""; sub(/^ /, ""); print}' "$1"; } # line FILE KEY
sr 'ct-sr refines a scan without any DICOM attribute' s.nii
has err 'assumed: profile .*; measured on edges; ' 'without DICOM attributes the profile is measured on edges'
cp sr.nii alone.nii; ct-info -e -x 1,1,4 s.nii >alone
! grep -q '^dicom-' alone; ok $? 'without DICOM attributes ct-info expects no width'

# a sidecar, as dcm2niix and ct-convert write it
side='{"Modality": "CT", "Manufacturer": "Philips", "ConvolutionKernel": "UB", "SliceThickness": 4, "SpacingBetweenSlices": 4}'
echo "$side" >s.json
sr 'ct-sr refines a scan with a sidecar' s.nii
has err 'DICOM (Philips, 4 mm, kernel UB) expects 3.5[0-9] mm within [0-9]* %, edges show [0-9.]* within [0-9]* %' 'ct-sr reports the width that DICOM expects and that of the edges'
has err 'voxels, mean (from DICOM and edges)' 'ct-sr reports that the width is the mean of DICOM and edges'
ct-info sr.nii >info
has info '^  assumed  *profile .*DICOM (Philips, 4 mm, kernel UB)' 'the result records that the profile comes from DICOM'
[ "$(line info dicom.thickness),$(line info dicom.maker)" = 0,0,4,Philips ]
ok $? 'the result records slice thickness and maker of the sidecar'
exits 0 'ct-info -e accepts a scan with a sidecar' ct-info -e -x 1,1,4 s.nii
awk '/^profile-spread/ {s = $4} /^dicom-spread/ {d = $4} /^joint-spread/ {j = $4} /^profile-dev/ {sd = $4} /^joint-dev/ {jd = $4}
	END {exit !(s > 0 && d > .37 && d < .38 && (s - j) * (j - d) >= 0 && jd < sd)}' out; ok $? 'the joint width lies between DICOM and edges and is less uncertain'
exits 0 'ct-info --json -e accepts a scan with a sidecar' ct-info --json -e -x 1,1,4 s.nii
tr -d ' \n' <out >flat
has flat '"dicom-spread-voxels":\[null,null,0.37' 'JSON of -e has the spread that DICOM expects'
gzip -k s.nii
exits 0 'ct-info -e accepts a compressed scan with a sidecar' ct-info -e -x 1,1,4 s.nii.gz
has out '^dicom-spread' 'a compressed NIfTI has the spread that DICOM expects'
exits 0 'ct-upsample --estimate accepts a scan with a sidecar' ct-upsample -q -f -m tv -x 1,1,4 --estimate --iterations 20 s.nii up.nii
ct-info up.nii >info
has info '^  assumed  *profile .*DICOM (Philips' 'the result notes a profile assumed from DICOM'
sr 'ct-sr refines a scan that records its operator' lr.nii
! grep -q assumed: err; ok $? 'an operator in the header is used and nothing is assumed'
exits 0 'ct-sr --slice-thickness accepts a scan with a sidecar' ct-sr -f -Q draft -x 1,1,4 --noise 0 --slice-thickness 4 s.nii sr2.nii
! grep -q assumed: err; ok $? 'with --noise and --slice-thickness nothing is assumed'
echo '{"Modality": "MR", "SliceThickness": 4}' >s.json
sr 'ct-sr refines a scan with a sidecar of MR' s.nii
has err 'measured on edges' 'a sidecar of MR is not used'
echo "$side" | sed 's/"SliceThickness": 4, "Sp.*4/"BodyPart": "HEAD"/' >s.json
sr 'ct-sr refines a scan with a sidecar without thickness' s.nii
has err 'DICOM (Philips, kernel UB) expects 3.5[0-9] mm within 2[0-9] %' 'without a thickness the spacing is expected, with more uncertainty'

# thickness and spacing are two things
echo "$side" | sed 's/"SliceThickness": 4/"SliceThickness": 5/' >s.json
exits 0 'ct-info -e accepts slices that overlap' ct-info -e -x 1,1,4 s.nii
awk '/^dicom-spread/ {d = $4} END {exit !(d > .46 && d < .475)}' out
ok $? 'slices that overlap are expected to be as wide as their thickness'
echo "$side" | sed 's/"SliceThickness": 4/"SliceThickness": 20/' >s.json
sr 'ct-sr refines a scan whose sidecar gives five times the thickness' s.nii
has err 'edges show .*: they contradict each other, and edges count' 'a thickness that contradicts the edges is reported'
has err 'voxels, [a-z]* (measured)' 'with a thickness that contradicts the edges the edges are used'

# not those slices any more
echo "$side" | sed 's/: 4}/: 5}/' >s.json; sr 'ct-sr refines a scan whose sidecar gives another spacing' s.nii
has err 'warning: what DICOM says of slices of 4 mm is not used: they were not 1,1,4 mm apart, as the voxels are' 'a sidecar of another spacing gives a warning'
cmp -s sr.nii alone.nii
[ "$(tail -c 3000000 sr.nii | cksum)" = "$(tail -c 3000000 alone.nii | cksum)" ]
ok $? 'a sidecar of another spacing does not change the result'

# damaged and hostile: a warning that names file and field, and the result is that without
bad() { # bad WORDS TEXT
	printf '%s' "$2" >s.json; sr "ct-sr refines a scan with a bad sidecar: $1" s.nii
	has err "warning: s.json: .*$1.*: nothing of it is used" "a bad sidecar is reported with file and field: $1"
	[ "$(tail -c 3000000 sr.nii | cksum)" = "$(tail -c 3000000 alone.nii | cksum)" ]
	ok $? "a bad sidecar does not change the result: $1"
}
bad 'not JSON' '{"SliceThickness": 4'
bad 'field SliceThickness: not a length' '{"Manufacturer": "GE", "SliceThickness": "four"}'
bad 'field SpacingBetweenSlices: not a length' '{"SliceThickness": 4, "SpacingBetweenSlices": -4}'
bad 'field ConvolutionKernel: not a text' '{"SliceThickness": 4, "ConvolutionKernel": 4}'
rm s.json
mkfifo s.json
sr 'ct-sr refines a scan with a pipe for a sidecar' s.nii
has err 'warning: s.json: not a file' 'a pipe for a sidecar is warned of and not waited for'
rm s.json
mkdir s.json
sr 'ct-sr refines a scan with a folder for a sidecar' s.nii
has err 'warning: s.json: not a file' 'a folder for a sidecar is warned of and ignored'
rmdir s.json
ln -s /dev/zero s.json
sr 'ct-sr refines a scan with a device for a sidecar' s.nii
has err 'warning: s.json: not a file' 'a device for a sidecar is warned of and ignored'
rm s.json
truncate -s 17M s.json
sr 'ct-sr refines a scan with a sidecar of 17 MiB' s.nii
has err 'warning: s.json: more than' 'a sidecar of 17 MiB is warned of and not read'
rm s.json
printf '{"SliceThickness": 4, "Manufacturer": "\\u001b]0;x\\u0007<b>GE"}' >s.json
sr 'ct-sr refines a scan whose sidecar holds a terminal sequence' s.nii
has err 'DICOM (\]0;x<b>GE, 4 mm)' 'the maker is printed without its control characters' && ! grep -q "$(printf '\033')" err
ok $? 'no control character of a sidecar is printed'
rm s.json

# DICOM itself: what ct-convert writes is derived, and becomes what a scanner writes
if python_with pydicom && ct-convert -q --units hu s.nii dcm/ 2>err; then
	sr 'ct-sr refines a derived series' dcm
	has err 'measured on edges' 'a derived series expects no width of a scanner'
	"$PY" -c 'import pydicom, sys
for f in sys.argv[1:]:
    d = pydicom.dcmread(f)
    d.ImageType, d.Manufacturer, d.ConvolutionKernel = ["ORIGINAL", "PRIMARY", "AXIAL"], "Philips", "UB"
    d.save_as(f)' dcm/*
	sr 'ct-sr refines a series of a scanner' dcm
	has err 'DICOM (Philips, 4 mm, kernel UB) expects 3.5[0-9] mm within' 'a series of a scanner expects the width of its thickness'
	cp err err.dcm
	exits 0 'ct-info -e accepts a series of a scanner' ct-info -e -x 1,1,4 dcm
	has out '^dicom-spread' 'a series has the spread that DICOM expects'
	exits 0 'ct-upsample --estimate accepts a series of a scanner' ct-upsample -q -f -m tv -x 1,1,4 --estimate --iterations 20 dcm up.nii
	exits 0 'a series of a scanner is converted to NIfTI' ct-convert -q dcm conv.nii
	ct-info conv.nii >info
	[ "$(line info dicom.thickness),$(line info dicom.spacing)" = 0,0,4,1,1,4 ]
	ok $? 'a converted series records thickness and spacing'
	sr 'ct-sr refines a converted series' conv.nii
	[ "$(grep assumed: err)" = "$(grep assumed: err.dcm)" ]
	ok $? 'a converted series gives the assumptions of the series'
	ct-convert -q --reorient SAR conv.nii turned.nii; ct-info turned.nii >info
	[ "$(line info dicom.thickness),$(line info dicom.spacing)" = 4,0,0,4,1,1 ]
	ok $? 'a converted series with turned axes has the thickness on the turned axis'
	exits 0 'a converted series is resampled to 2 mm' ct-convert -q --iso 2 conv.nii iso.nii
	exits 0 'ct-info -e accepts a resampled series' ct-info -e -x 1,1,2 iso.nii
	has err 'is not used: they were not 2,2,2 mm apart' 'the thickness of a resampled series is not used'
	sr 'ct-sr refines a converted series before a second estimate' conv.nii
	exits 0 'ct-info -e accepts a result of ct-sr' ct-info -e -x 1,1,2 sr.nii
	has err 'is not used: they were not 1,1,1 mm apart' 'the thickness of a refined series is not used'
else
	skip 'a series of a scanner expects the width of its thickness' 'no pydicom or vtk-dicom'
fi
done_testing
