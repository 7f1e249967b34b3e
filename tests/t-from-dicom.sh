#!/bin/sh
# What DICOM says of the scanner, from a series, a converted file or a sidecar: used, joined with edges, or refused.
. "${srcdir:?}/tests/tap.sh"
ct-phantom -q --size 96x96x96 --spacing 1 shepp-logan hi.nii || exit 99
ct-degrade -q -x 1,1,4 --sigma 0,0,1.48 --decimate point hi.nii lr.nii || exit 99
bare() { ct-convert -q --type f32 "$1" - | tail -c $((96 * 96 * 24 * 4)) >raw; ct-convert -q -f --raw "96x96x24:f32:1,1,4" --orient RAS raw "$2"; }
bare lr.nii s.nii
sr() { exits 0 "$1" ct-sr -f -Q draft -x 1,1,4 --noise 0 "$2" sr.nii; grep '^ct-sr: assumed' err | sed 's/^/# /'; } # sr NAME IN
line() { awk -v k="$2" '$1 == k {$1 = ""; sub(/^ /, ""); print}' "$1"; } # line FILE KEY
sr 'no word of a scanner' s.nii
has err 'assumed: profile .*; measured on edges; ' 'is measured'
cp sr.nii alone.nii; ct-info -e -x 1,1,4 s.nii >alone
! grep -q '^dicom-' alone; ok $? 'and nothing is expected'

# a sidecar, as dcm2niix and ct-convert write it
side='{"Modality": "CT", "Manufacturer": "Philips", "ConvolutionKernel": "UB", "SliceThickness": 4, "SpacingBetweenSlices": 4}'
echo "$side" >s.json
sr 'a sidecar' s.nii
has err 'DICOM (Philips, 4 mm, kernel UB) expects 3.5[0-9] mm within [0-9]* %, edges show [0-9.]* within [0-9]* %' 'both estimates are told'
has err 'voxels, mean (from DICOM and edges)' 'with who says them'
ct-info sr.nii >info; has info '^  assumed  *profile .*DICOM (Philips, 4 mm, kernel UB)' 'the result keeps that'
[ "$(line info dicom.thickness),$(line info dicom.maker)" = 0,0,4,Philips ]; ok $? 'and what DICOM says'
exits 0 'ct-info' ct-info -e -x 1,1,4 s.nii
awk '/^profile-spread/ {s = $4} /^dicom-spread/ {d = $4} /^joint-spread/ {j = $4} /^profile-dev/ {sd = $4} /^joint-dev/ {jd = $4}
	END {exit !(s > 0 && d > .37 && d < .38 && (s - j) * (j - d) >= 0 && jd < sd)}' out; ok $? 'between the two, and surer'
exits 0 'as JSON' ct-info --json -e -x 1,1,4 s.nii; tr -d ' \n' <out >flat; has flat '"dicom-spread-voxels":\[null,null,0.37' 'JSON of -e has the spread that DICOM expects'
gzip -k s.nii; exits 0 'of a compressed file' ct-info -e -x 1,1,4 s.nii.gz; has out '^dicom-spread' 'a compressed NIfTI has the spread that DICOM expects'
exits 0 'ct-upsample' ct-upsample -q -f -m tv -x 1,1,4 --estimate --iterations 20 s.nii up.nii
ct-info up.nii >info; has info '^  assumed  *profile .*DICOM (Philips' 'the result notes a profile assumed from DICOM'
sr 'the operator in the header' lr.nii
! grep -q assumed: err; ok $? 'has the last word'
exits 0 'options' ct-sr -f -Q draft -x 1,1,4 --noise 0 --slice-thickness 4 s.nii sr2.nii
! grep -q assumed: err; ok $? 'with --noise and --slice-thickness nothing is assumed'
echo '{"Modality": "MR", "SliceThickness": 4}' >s.json; sr 'of another modality' s.nii; has err 'measured on edges' 'nothing is used'
echo "$side" | sed 's/"SliceThickness": 4, "Sp.*4/"BodyPart": "HEAD"/' >s.json; sr 'no thickness, as dcm2niix' s.nii
has err 'DICOM (Philips, kernel UB) expects 3.5[0-9] mm within 2[0-9] %' 'is the spacing, less surely'

# thickness and spacing are two things
echo "$side" | sed 's/"SliceThickness": 4/"SliceThickness": 5/' >s.json; exits 0 'slices that overlap' ct-info -e -x 1,1,4 s.nii
awk '/^dicom-spread/ {d = $4} END {exit !(d > .46 && d < .475)}' out; ok $? 'are wider by their thickness, over the spacing'
echo "$side" | sed 's/"SliceThickness": 4/"SliceThickness": 20/' >s.json; sr 'much too thick' s.nii
has err 'edges show .*: they contradict each other, and edges count' 'contradicts the edges'
has err 'voxels, [a-z]* (measured)' 'which count'

# not those slices any more
echo "$side" | sed 's/: 4}/: 5}/' >s.json; sr 'of another spacing' s.nii
has err 'warning: what DICOM says of slices of 4 mm is not used: they were not 1,1,4 mm apart, as the voxels are' 'a warning'
cmp -s sr.nii alone.nii; [ "$(tail -c 3000000 sr.nii | cksum)" = "$(tail -c 3000000 alone.nii | cksum)" ]; ok $? 'and the result is that without it'

# damaged and hostile: a warning that names file and field, and the result is that without
bad() { # bad WORDS TEXT
	printf '%s' "$2" >s.json; sr "$1" s.nii
	has err "warning: s.json: .*$1.*: nothing of it is used" 'is told'
	[ "$(tail -c 3000000 sr.nii | cksum)" = "$(tail -c 3000000 alone.nii | cksum)" ]; ok $? 'and not used'
}
bad 'not JSON' '{"SliceThickness": 4'
bad 'field SliceThickness: not a length' '{"Manufacturer": "GE", "SliceThickness": "four"}'
bad 'field SpacingBetweenSlices: not a length' '{"SliceThickness": 4, "SpacingBetweenSlices": -4}'
bad 'field ConvolutionKernel: not a text' '{"SliceThickness": 4, "ConvolutionKernel": 4}'
rm s.json; mkfifo s.json; sr 'a pipe' s.nii; has err 'warning: s.json: not a file' 'is not waited for'
rm s.json; mkdir s.json; sr 'a folder' s.nii; has err 'warning: s.json: not a file' 'a folder for a sidecar is warned of and ignored'; rmdir s.json
ln -s /dev/zero s.json; sr 'a device' s.nii; has err 'warning: s.json: not a file' 'a device for a sidecar is warned of and ignored'; rm s.json
truncate -s 17M s.json; sr 'what is too long' s.nii; has err 'warning: s.json: more than' 'is not read'; rm s.json
printf '{"SliceThickness": 4, "Manufacturer": "\\u001b]0;x\\u0007<b>GE"}' >s.json; sr 'what steers a terminal' s.nii
has err 'DICOM (\]0;x<b>GE, 4 mm)' 'is printable' && ! grep -q "$(printf '\033')" err; ok $? 'and nothing else'
rm s.json

# DICOM itself: what ct-convert writes is derived, and becomes what a scanner writes
if python_with pydicom && ct-convert -q --units hu s.nii dcm/ 2>err; then
	sr 'a series that was derived' dcm
	has err 'measured on edges' 'says nothing of a scanner'
	"$PY" -c 'import pydicom, sys
for f in sys.argv[1:]:
    d = pydicom.dcmread(f)
    d.ImageType, d.Manufacturer, d.ConvolutionKernel = ["ORIGINAL", "PRIMARY", "AXIAL"], "Philips", "UB"
    d.save_as(f)' dcm/*
	sr 'a series of a scanner' dcm
	has err 'DICOM (Philips, 4 mm, kernel UB) expects 3.5[0-9] mm within' 'says its thickness'
	cp err err.dcm
	exits 0 'ct-info of a series' ct-info -e -x 1,1,4 dcm; has out '^dicom-spread' 'a series has the spread that DICOM expects'
	exits 0 'ct-upsample of a series' ct-upsample -q -f -m tv -x 1,1,4 --estimate --iterations 20 dcm up.nii
	exits 0 'a converted file' ct-convert -q dcm conv.nii
	ct-info conv.nii >info; [ "$(line info dicom.thickness),$(line info dicom.spacing)" = 0,0,4,1,1,4 ]; ok $? 'carries it'
	sr 'is refined' conv.nii; [ "$(grep assumed: err)" = "$(grep assumed: err.dcm)" ]; ok $? 'as the series is'
	ct-convert -q --reorient SAR conv.nii turned.nii; ct-info turned.nii >info
	[ "$(line info dicom.thickness),$(line info dicom.spacing)" = 4,0,0,4,1,1 ]; ok $? 'goes with its axis'
	exits 0 'on another grid' ct-convert -q --iso 2 conv.nii iso.nii
	exits 0 'nothing' ct-info -e -x 1,1,2 iso.nii; has err 'is not used: they were not 2,2,2 mm apart' 'is used of it'
	sr 'refined' conv.nii; exits 0 'once more' ct-info -e -x 1,1,2 sr.nii; has err 'is not used: they were not 1,1,1 mm apart' 'likewise'
else
	skip 'DICOM' 'no pydicom or vtk-dicom'
fi
done_testing
