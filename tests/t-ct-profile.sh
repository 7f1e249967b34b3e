#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-profile: what it finds of a profile that is known, what it writes, what it refuses.
. "${srcdir:?}/tests/tap.sh"
command -v python3 >/dev/null || { skip 'ct-profile' 'python3 is not here'; done_testing; }
no() { # no STATUS WORDS ARGUMENTS...
	status=$1 words=$2; shift 2
	exits "$status" "refused with status $status: ct-profile $*" ct-profile "$@" no.txt
	has err "$words" "the error reads: $words"
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
ct-convert -q --crop 0:20,0:18,30:80 thin.nii part.nii || exit 99
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

# refusals
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
