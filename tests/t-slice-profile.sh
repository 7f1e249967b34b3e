#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Profiles of slices: given by options, expected of what DICOM says, measured by ct-profile.
. "${srcdir:?}/tests/tap.sh"

# --profile and --slice-thickness: what they mean, what they contradict, what carries them on.
part options
ct-phantom -q --size 32x32x60 --spacing 1 ellipsoids hi.nii || exit 99
line() { ct-info "$1" | awk -v k="$2" '$1 == k {$1 = ""; sub(/^ /, ""); print}'; } # line FILE KEY
bare() { ct-convert -q --type f32 "$1" - | tail -c $((32 * 32 * $2 * 4)) >raw; ct-convert -q -f --raw "32x32x$2:f32:1,1,$3" --orient RAS raw "$4"; }
no() { # no STATUS WORDS COMMAND...
	status=$1 words=$2; shift 2
	exits "$status" "refused with status $status: $*" "$@" no.nii
	has err "$words" "the error reads: $words"
	[ ! -e no.nii ] || ok 1 "no output is left by: $*"
}

printf -- '-2 1\n2 1\n' >own; cp own was
for i in 'ct-degrade -x 1,1,5' 'ct-upsample -x 1,1,2' 'ct-sr -x 1,1,2'; do
	exits 4 "${i%% *} does not write over the file of --profile" $i -f --profile own hi.nii own
	has err 'own: would be written over own, an input of the same run' "${i%% *} says that the file of --profile is an input"
done
cmp -s own was; ok $? 'the file of --profile stays as it was'
exits 0 'a shape of --profile is no file' ct-degrade -q -x 1,1,5 --profile box hi.nii box
# profiles that other options can state too
ct-degrade -q -x 1,1,5 --slice-thickness 4 hi.nii a.nii && ct-degrade -q -x 1,1,5 --sigma 0,0,1.484 --decimate point hi.nii b.nii
ct-metrics --ssim none a.nii b.nii >m
has m '^max-hu 0[.]0*$' '--slice-thickness is a Gaussian with a sigma of .371 of it, point-sampled'
ct-degrade -q -x 1,1,5 --profile gaussian --slice-thickness 4 hi.nii c.nii
ct-metrics --ssim none a.nii c.nii >m
has m '^max-hu 0[.]0*$' '--profile gaussian is the same as --slice-thickness alone'
ct-convert -q --reorient PSR hi.nii psr.nii
exits 0 'a thickness beside factors that are alike is taken' ct-upsample --dry-run -m tv -x 2 --sigma .8,.8,0 --decimate point --slice-thickness 4 psr.nii no.nii
[ "$(sed -n 's/^blur  *0[.]8,0[.]8,\([0-9.]*\) .*, point (given)$/\1/p' out)" != '' ]; ok $? 'and is of the third axis of the file, however it is stored'
ct-degrade -q -f -x 1,1,5 --profile box hi.nii a.nii && ct-degrade -q -f -x 1,1,5 --sigma 0 --decimate mean hi.nii b.nii
ct-metrics --ssim none a.nii b.nii >m
has m '^max-hu 0[.]0*$' '--profile box as thick as the spacing is --decimate mean'
ct-degrade -q -x 1,1,4 --profile box --slice-thickness 2 hi.nii gap.nii
[ "$(line gap.nii profile | cut -d' ' -f1)" = 2 ]
ok $? 'a box thinner than the spacing is recorded in the file as samples'

# a profile from a file, and the header of the result
printf '# mm weight\n-1 .25\n0 .5\n1 .25\n' >p.txt
ct-degrade -q -f -x 1,1,5 --profile p.txt hi.nii a.nii
[ "$(line a.nii decimate),$(line a.nii sigma)" = point,0,0,0.763762616 ]
ok $? 'beside the samples of a profile a Gaussian of the same spread is recorded'
bare a.nii 12 5 bare.nii
exits 0 'ct-upsample uses a profile recorded in the header' ct-upsample -m dc -x 1,1,5 a.nii up.nii
exits 0 'ct-upsample uses a profile given by --profile' ct-upsample -m dc -x 1,1,5 --profile p.txt bare.nii up2.nii
ct-metrics --ssim none up.nii up2.nii | awk '$1 == "max-hu" {exit !($2 < .01)}'
ok $? 'a profile in the header and by --profile give the same volume'
exits 0 'ct-upsample uses a thickness instead of a profile' ct-upsample -f -m dc -x 1,1,5 --slice-thickness 5 bare.nii up3.nii
ct-metrics --ssim none up.nii up3.nii | awk '$1 == "max-hu" {exit !($2 > 1)}'
ok $? 'another profile gives another volume'
exits 0 'ct-sr accepts a profile by --profile' ct-sr -Q draft -x 1,1,5 --profile p.txt --noise 0 bare.nii sr.nii
has err 'with a slice profile (given)' 'ct-sr reports that the profile was given'
! grep -q 'assumed:' err; ok $? 'with a given profile ct-sr assumes nothing'
[ "$(line sr.nii profile | wc -w)" -eq 4 ]; ok $? 'the result of ct-sr records the profile'
ct-metrics --consistency bare.nii sr.nii | awk '$1 == "residual-rms-hu" {exit !($2 < .01)}'
ok $? 'the result with a given profile agrees with the scan'
ct-convert -q --reorient SAR a.nii turned.nii
[ "$(line turned.nii profile | cut -d' ' -f1)" = 0 ]
ok $? 'a recorded profile turns with its axis'
exits 0 'ct-upsample uses a profile along another axis' ct-upsample -m dc turned.nii up4.nii
ct-convert -q --reorient RAS up4.nii back.nii && ct-metrics --ssim none up.nii back.nii | awk '$1 == "max-hu" {exit !($2 < .01)}'
ok $? 'a profile along another axis gives the same volume'
ct-convert -q --iso 2 a.nii coarse.nii
[ -z "$(line coarse.nii profile)" ]; ok $? 'a recorded profile is dropped on another grid'
exits 0 'ct-sr accepts a blur in plane with a profile of slices' ct-sr -Q draft -x 2,2,5 --sigma .7,.7,0 --decimate mean --profile p.txt --noise 0 bare.nii sr2.nii
exits 0 'ct-sr measures the blur in plane beside a profile of slices' ct-sr -Q draft -x 2,2,5 --profile p.txt --noise 0 bare.nii sr3.nii
! grep -q 'along x,y,z' err; ok $? 'with a profile of slices the blur along z is not measured'

# contradictions
no 2 '--sigma contradicts --profile, which says the blur along axis 2' ct-upsample -x 1,1,5 --sigma 1 --profile box bare.nii
no 2 '--decimate contradicts --slice-thickness, which says how axis 2 was sampled' ct-sr -x 1,1,5 --decimate mean --slice-thickness 5 bare.nii
no 2 '--sigma contradicts --slice-thickness' ct-degrade -x 1,1,5 --sigma 1 --slice-thickness 5 hi.nii
no 2 '--decimate contradicts --profile' ct-degrade -x 1,1,5 --decimate mean --profile triangle hi.nii
no 2 'a slice profile leaves nothing of it' ct-degrade -x 1,1,5 -p P1 --profile triangle hi.nii
no 2 'a.nii: --profile and --slice-thickness contradict the file, which says its operator' ct-upsample -x 1,1,5 --profile triangle a.nii
no 2 'slice-thickness: the file of --profile says it' ct-upsample -x 1,1,5 --profile p.txt --slice-thickness 5 bare.nii
no 2 'bare.nii: a slice thickness of 90 mm at a spacing of 5 mm is not above 0 and up to 16 times that' ct-upsample -x 1,1,5 --slice-thickness 90 bare.nii
# files
no 3 'none.txt: no file, and no shape of --profile: gaussian' ct-upsample -x 1,1,5 --profile none.txt bare.nii
printf -- '-1 1\n0 x\n1 1\n' >bad.txt
no 3 'bad.txt: line 2: field 2, weight, is no number' ct-upsample -x 1,1,5 --profile bad.txt bare.nii
printf -- '-1 1\n0 1\n\0001 1\n' >bad.txt
no 3 'bad.txt: a slice profile is text, and this is none' ct-sr -x 1,1,5 --profile bad.txt bare.nii
awk 'BEGIN {for (i = -70; i < 71; i++) print i / 100, 1}' >long.txt
no 3 'long.txt: line 129: more than 128 samples' ct-degrade -x 1,1,5 --profile long.txt hi.nii

# What DICOM says of the scanner, from a series, a converted file or a sidecar: used, joined with edges, or refused.
part scanner
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
has err 'warning: what DICOM says of slices of 4 mm is not used: it does not say that they were 1,1,4 mm apart, as the voxels are' 'a sidecar of another spacing gives a warning'
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
	has err 'is not used: it does not say that they were 2,2,2 mm apart' 'the thickness of a resampled series is not used'
	sr 'ct-sr refines a converted series before a second estimate' conv.nii
	exits 0 'ct-info -e accepts a result of ct-sr' ct-info -e -x 1,1,2 sr.nii
	has err 'is not used: it does not say that they were 1,1,1 mm apart' 'the thickness of a refined series is not used'
else
	skip 'a series of a scanner expects the width of its thickness' 'no pydicom or vtk-dicom'
fi

# ct-profile: what it finds of a profile that is known, what it writes, what it refuses.
part measured
command -v python3 >/dev/null || { skip 'ct-profile' 'python3 is not here'; done_testing; }
no() { # no STATUS WORDS ARGUMENTS...
	status=$1 words=$2; shift 2
	exits "$status" "refused with status $status: ct-profile $*" ct-profile "$@" no.txt
	has err "$words" "the error of ct-profile reads: $words"
	[ ! -e no.txt ] || ok 1 "no output is left by: ct-profile $*"
}
weights() { awk '/^[^#]/ {printf "%s %.2f ", $1, $2}' "$1"; }

# 20x18x100 voxels of noise; slices of it
python3 -c '
import array, random
r = random.Random(1)
array.array("f", (r.gauss(100, 200) for i in range(20 * 18 * 100))).tofile(open("raw", "wb"))' || exit 99
thin() { ct-convert -q -f --raw "20x18x100:f32:${2:-0.8,0.8,1}" --orient RAS raw "$1"; }
thin thin.nii || exit 99
printf -- '-3 .04\n-2 .12\n-1 .2\n0 .28\n1 .2\n2 .12\n3 .04\n' >known.txt
ct-degrade -q -x 1,1,5 --profile known.txt thin.nii thick.nii || exit 99
# a profile that is known
exits 0 'ct-profile measures a profile of seven samples' ct-profile thick.nii thin.nii p.txt
[ "$(weights p.txt)" = '-3 0.04 -2 0.12 -1 0.20 0 0.28 1 0.20 2 0.12 3 0.04 ' ]
ok $? 'the seven weights are those that made the slices'
[ "$(grep -c '^#' p.txt)" -eq 6 ] && [ ! -s err ]; ok $? 'the file has six lines of comments, and nothing is printed'
has p.txt '^# slice profile of thick.nii relative to thin.nii, measured by ctsr' 'the file names both scans'
has p.txt '^# spacing 5 mm and 1 mm along axis k; 16 slices, 5760 textured lines$' 'the file names both spacings and the number of lines used'
has p.txt '^# sigma 1.499 mm +- 0.000, 0.300 of the thick spacing; sum 1.0000; centre 0.000 mm$' 'the file gives sigma, sum and centre of the profile'
has p.txt '^# residual 0.0[0-9] HU RMS, 0.0000 % of the variance; condition [12]' 'the file gives residual and condition of the fit'
has p.txt '^# other shapes: Gaussian of sigma 1.[0-9]* mm [1-9].* HU; box of 5 mm [1-9]' 'the file gives the residual of a Gaussian and a box'
awk '/^[^#]/ && !($3 == "#" && $4 < .001) {bad = 1} END {exit bad}' p.txt; ok $? 'each weight has its standard error'
exits 0 'ct-profile writes to standard output' ct-profile thick.nii thin.nii -
cmp -s out p.txt; ok $? 'standard output gets the bytes of the file'
mv out one.txt
exits 4 'ct-profile does not overwrite its output' ct-profile thick.nii thin.nii p.txt
exits 0 'ct-profile -f overwrites its output' ct-profile -f -t 3 thick.nii thin.nii p.txt
cmp -s one.txt p.txt; ok $? 'ct-profile writes the same bytes with three threads'
ct-convert -q --crop 0:20,0:18,30:80 thin.nii part.nii && ct-convert -q --crop 0:20,0:18,40:60 thin.nii covers.nii || exit 99
exits 0 'ct-profile accepts thin slices that cover a part of the thick ones' ct-profile thick.nii part.nii part.txt
[ "$(weights part.txt)" = "$(weights p.txt)" ]; ok $? 'a part of the thin scan gives the same weights'

# the file is one for --profile
python3 - <<'PY' || exit 99
# the slices without a word of how they were made
d = bytearray(open('thick.nii', 'rb').read())
start = int(__import__('struct').unpack_from('<f', d, 108)[0])
open('bare.raw', 'wb').write(d[start:])
PY
ct-convert -q --raw 20x18x20:f32:0.8,0.8,5 --orient RAS bare.raw bare.nii || exit 99
exits 0 'ct-sr --profile accepts the file of ct-profile' ct-sr -q -Q draft --noise 0 -x 1,1,5 --profile p.txt bare.nii sr.nii
ct-metrics --consistency thick.nii sr.nii | awk '$1 == "residual-rms-hu" {exit !($2 < .5)}'
ok $? 'a result of ct-sr with the measured profile agrees with the thick scan'
exits 0 'ct-degrade --profile accepts the file of ct-profile' ct-degrade -q -x 1,1,5 --profile p.txt thin.nii again.nii
ct-metrics --ssim none thick.nii again.nii | awk '$1 == "rmse-hu" {exit !($2 < .1)}'
ok $? 'ct-degrade with the measured profile makes the same thick slices'

# DICOM
mkdir dicom
if ct-convert -q thick.nii dicom/thick/ 2>dicom.err && ct-convert -q thin.nii dicom/thin/; then
	exits 0 'ct-profile accepts two DICOM folders' ct-profile dicom/thick dicom/thin -
	[ "$(weights out)" = "$(weights p.txt)" ]; ok $? 'DICOM folders give the weights of the NIfTI scans'
	mkdir both && for f in dicom/*/*.dcm; do cp "$f" "both/$(echo "$f" | tr / -)"; done
	set -- both/dicom-thick-*; thick=$1; set -- both/dicom-thin-*
	exits 0 'one file of each series stands for the series, in one folder' ct-profile "$thick" "$1" -
	[ "$(weights out)" = "$(weights p.txt)" ]; ok $? 'a file of each series gives the same weights'
else
	skip 'DICOM' "$(head -n 1 dicom.err)"
fi

# a name that would end its line
cp thick.nii "$(printf 'a\nb')" && exits 0 'a file name with a line break is accepted' ct-profile "$(printf 'a\nb')" thin.nii -
has out '^# slice profile of a?b relative' 'a file name with a line break stays on one line of the output'

# warnings
ct-convert -q --raw 20x18x20:f32:0.8,0.8,5 --orient RAS bare.raw - >far.nii
python3 - <<'PY' || exit 99
import struct
d = bytearray(open('far.nii', 'rb').read())
for at in (276, 324):  # z of the first voxel: qform, sform
    struct.pack_into('<f', d, at, struct.unpack_from('<f', d, at)[0] + 2)
open('far.nii', 'wb').write(d)
PY
exits 0 'ct-profile measures slices that lie elsewhere than the header says' ct-profile far.nii thin.nii -
has err 'far.nii: the slices lie -2 mm from where the header says' 'slices that lie elsewhere than the header says are reported'
has out '^# the slices lie -2 mm from where their header says; removed below' 'the output file reports slices that lie elsewhere than the header says'
[ "$(weights out)" = "$(weights p.txt)" ]; ok $? 'an offset of the slices does not change the weights'
ct-degrade -q -x 1 --noise 60 thick.nii noisy.nii || exit 99
exits 0 'ct-profile measures thick slices with other noise' ct-profile noisy.nii thin.nii -
has err 'noisy.nii: thin.nii explains only [0-9.]* % of its variance: are they one acquisition?' 'a thin scan that explains little is reported'

ct-degrade -q -x 1,1,2.5 --sigma 0 --decimate mean thin.nii half.nii || exit 99
exits 0 'ct-profile measures a spacing that is no whole number of thin slices' ct-profile half.nii thin.nii -
has err 'half.nii: its slices lie between those of thin.nii, and interpolation blurs these by 0.4[0-9]* mm: the profile is narrower' 'a profile that interpolation made narrower is reported'
# the mean of two slices is a profile that ct-sr reads
ct-degrade -q -x 1,1,2 --sigma 0 --decimate mean thin.nii two.nii || exit 99
exits 0 'ct-profile measures the mean of two slices' ct-profile two.nii thin.nii two.txt
exits 0 'ct-degrade --profile accepts a profile of two slices' ct-degrade -q -x 1,1,2 --profile two.txt thin.nii two-again.nii
ct-metrics --ssim none two.nii two-again.nii | awk '$1 == "rmse-hu" {exit !($2 < .1)}'; ok $? 'and makes the same slices'

# refusals
no 3 'expected HU' --units other thick.nii covers.nii
no 5 'along axis k the thin slices reach 2 mm from 4 thick ones, and the profile goes on beyond: more are needed' thick.nii covers.nii
no 5 'give the thick ones first' thin.nii thick.nii
thin other.nii 0.8,0.9,1 && no 5 'thick.nii: along axis j the thick slices have voxels of 0.8 mm, the thin ones of 0.9 mm' thick.nii other.nii
ct-convert -q --crop 2:20,0:18,0:100 thin.nii shift.nii && no 5 'along axis i the thick slices begin -1.6 mm' thick.nii shift.nii
ct-convert -q --crop 0:20,0:18,40:55 thin.nii few.nii && no 5 'along axis k the thin slices cover' thick.nii few.nii
head -c 144000 /dev/zero >zero && ct-convert -q --raw 20x18x100:f32:0.8,0.8,1 --orient RAS zero water.nii && no 3 '0 slices have 50 lines or more' --units hu thick.nii water.nii
python3 -c '
import struct
d = bytearray(open("thick.nii", "rb").read())
struct.pack_into("<f", d, len(d) - 4, float("nan"))
open("nan.nii", "wb").write(d)'
no 6 'nan.nii: ' nan.nii thin.nii
done_testing
