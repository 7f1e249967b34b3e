#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The error to expect of a solver alone: ct-upsample --std, ct-upsample -m prior --std of what the prior does not
# know, ct-sr -Q draft --confidence: about the one there is, in slabs and in little memory too.
. "$srcdir/tests/tap.sh"
hash() { ct-info --json "$1" | sed -n 's/.*"hash": "\(.*\)".*/\1/p'; }
same() { [ -n "$(hash "$1")" ] && [ "$(hash "$1")" = "$(hash "$2")" ]; }
apart() { ct-metrics --range 1 --ssim none --json "$1" "$2" | sed -n 's/.*"rmse-hu": \([0-9.e+-]*\).*/\1/p'; }
# bodies with a texture: of what is flat between its edges the solver lacks nothing
ct-phantom -q -s 5 --size 48x48x48 ellipsoids flat.nii && ct-degrade -q -x 1 --noise 100 flat.nii rough.nii &&
	ct-degrade -q -x 1 --sigma .5,.5,.5 rough.nii truth.nii || exit 99

# calibrated NAME STD RESULT: the error is about the expected one, as a whole and in what expects most, which is
# more than that of what expects least
calibrated() {
	ct-metrics --ssim none --uncertainty "$2" truth.nii "$3" >out
	awk '/^std-all/ {a = $3 / $4; b = $5; c = $6} /^std-[0-9]/ {if (!n++) {l = $4; le = $3} h = $4; he = $3}
		END {exit !(a > .8 && a < 1.8 && b > .5 && b < .8 && c > .75 && he / h < 2.5 && h > 1.4 * l && he > 4 * le)}' out
	ok $? "$1: about the one there is ($(grep std-all out))"
}
for o in '-x 4' '-x 2' '-x 4 -p P3' '-x 4 --noise 15' '-x 1,1,4 --sigma 0 --decimate mean'; do
	# shellcheck disable=SC2086
	ct-degrade -q -f $o truth.nii lo.nii && ct-upsample -q -f lo.nii plain.nii
	exits 0 "$o" ct-upsample -q -f --std s.nii lo.nii hi.nii
	same hi.nii plain.nii; ok $? 'the same voxels as without'
	calibrated "$o" s.nii hi.nii
done
has_history() { ct-info -v "$1" | sed -n '/^history/,$p' | grep -q "$2 xxh3:"; ok $? "knows of $2"; }
has_history s.nii lo.nii
head -c 6912 /dev/zero >zero.raw && ct-convert -q --raw 12x12x12:f32:8 zero.raw zero.nii
for n in 0 30; do
	ct-upsample -q -x 2 --sigma .85 --noise $n --std z$n.nii zero.nii z.nii -f; ct-info -v z$n.nii | sed -n 's/^mean *//p'
done | tr '\n' ' ' >of; awk '{exit !($1 >= 1 && $1 < 2 && $2 > 20)}' of; ok $? "of noise more is expected, where nothing varies, too ($(cat of))"
dd if=s.nii bs=1 skip=148 count=80 2>/dev/null | tr '\0' '\n' | grep -q '^expected error, HU; ct-upsample [0-9.]*$'; ok $? 'says what it is'
ct-upsample -q -t 3 --std s3.nii lo.nii hi3.nii && same s3.nii s.nii; ok $? 'any number of threads'

# where the prior knows nothing: the same as of ct-upsample
p=$builddir/slices.safetensors
for o in '-x 1,1,4' '-x 1,1.25,10'; do
	# shellcheck disable=SC2086
	ct-degrade -q -f $o truth.nii lo.nii && ct-upsample -q -f --std s.nii lo.nii hi.nii
	exits 0 "$o, left to the solver" ct-upsample -m prior -f -p "$p" --std r.nii lo.nii x.nii
	has err 'the prior adds nothing$' 'a prior that adds nothing says so'
	same r.nii s.nii && same x.nii hi.nii; ok $? "where the prior adds nothing --std is that of the inversion ($o)"
done
rm -f r.nii x.nii
exits 5 'with a weight it is an error' ct-upsample -m prior -p "$p" --expert weight=1 --std r.nii lo.nii x.nii
exits 3 'as is a volume that another program made' ct-upsample -m prior -p "$p" --start hi.nii --std r.nii lo.nii x.nii
ct-phantom -q --size 32x32x32 cube cube.nii && ct-convert -q --type f32 cube.nii - | tail -c 131072 | head -c 4096 >cube.raw
ct-convert -q --raw 16x8x8:f32:8 cube.raw even.nii
exits 3 'a scan whose edges do not say how it was made' ct-upsample --estimate -x 4 --std r.nii even.nii x.nii
has err '^ct-upsample: even.nii: its edges do not show how it was made, which the predicted error needs: pass --sigma$' 'has no predicted error'
exits 2 'or that does not say it itself' ct-upsample -x 4 --std r.nii even.nii x.nii
has err '^ct-upsample: even.nii: holds no operator (how it was reduced): pass --sigma' 'the error of a scan without its operator names it'
exits 3 'ct-sr refuses a scan whose operator is not known' ct-sr -Q draft --confidence r.nii even.nii x.nii
[ ! -e r.nii ] && [ ! -e x.nii ]; ok $? 'and nothing is left of what failed'

# ct-sr, whole and in slabs
ct-degrade -q -f -x 4 -p P3 truth.nii lo.nii && ct-upsample -q -f --std s.nii lo.nii hi.nii
exits 0 'ct-sr writes --confidence of a draft' ct-sr -Q draft --confidence c.nii --report r.html lo.nii o.nii
same c.nii s.nii && same o.nii hi.nii; ok $? 'a draft of ct-sr expects the errors of ct-upsample'
grep -q 'id="error"' r.html; ok $? 'the page shows it'
ct-degrade -q -f -x 1,1.25,10 truth.nii lo5.nii && ct-upsample -q -f --std s5.nii lo5.nii hi5.nii
exits 0 'fast, of factors that no prior knows' ct-sr -Q fast -x 1,1.25,10 --prior "$p" --confidence c5.nii lo5.nii o5.nii
same c5.nii s5.nii; ok $? 'expects that of the solver'
ct-phantom -q -s 5 --size 48x48x400 ellipsoids long.nii && ct-degrade -q -f -x 4 -p P3 long.nii lo.nii && ct-upsample -q -f --std s.nii lo.nii hi.nii
exits 0 '--std is written in slabs' ct-upsample -v --memory 84M --std s2.nii lo.nii h2.nii
awk -v d="$(apart s.nii s2.nii)" 'BEGIN {exit !(d != "" && d < .05)}'; ok $? "the same error ($(apart s.nii s2.nii) HU apart)"
done_testing
