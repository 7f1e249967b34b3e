#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-train --kind slices and ct-upsample -m prior: a prior of phantoms makes other phantoms better, agrees with the scan,
# is resumed to the same bytes, and what does not fit is refused.
. "$srcdir/tests/tap.sh"
cmp_() { # the voxels of two volumes: none is apart
	ct-metrics --json "$1.nii" "$2.nii" | grep -q '"max-hu": 0[,.]'
}
psnr() { ct-metrics -q --json "$1" "$2" | sed -n 's/.*"psnr": \([-0-9.]*\).*/\1/p'; }

mkdir scans
for k in 1 2 3; do ct-phantom -q -s $k --size 72x64x56 ellipsoids scans/$k.nii; done
ct-phantom -q -s 9 --size 56x48x40 ellipsoids truth.nii
ct-degrade -q -x 4 truth.nii lo.nii
ct-upsample -q lo.nii up.nii
small='--kind slices -s 2 --expert=cubes=3,cube=48,noise=0,width=48,components=60,batch=512 -n 60'

# training, stopped and resumed, with and without a cache
# shellcheck disable=SC2086
exits 0 'ct-train --kind slices trains on three scans' ct-train $small --expert=log-every=20,validate-every=30 --validate truth.nii p.safetensors scans
awk '/step 20: loss/{a=$5} /step 60: loss/{b=$5} END{exit !(b+0 < a+0 && b+0 > 0)}' err
ok $? 'the training loss of slices falls'
awk '/step 60: held/{a=$6} END{exit !(a+0 > 0 && a+0 < 0.97)}' err
ok $? 'the network predicts some detail of a phantom that was not trained on'
# shellcheck disable=SC2086
{
ct-train -q $small -t 1 --minutes 0.00001 q.safetensors scans
ct-info q.safetensors >info
ct-train -q $small -t 3 --resume q.safetensors scans
}
! grep -q 'step.*60' info && cmp p.safetensors.state q.safetensors.state
ok $? 'a training that was stopped and resumed with other threads gives the same bytes'
# shellcheck disable=SC2086
{
ct-train -q $small --cache kept -f --validate truth.nii c.safetensors scans
ls kept >made
ct-train -q $small --cache kept -f --validate truth.nii d.safetensors scans
cmp p.safetensors.state c.safetensors.state && cmp c.safetensors.state d.safetensors.state
ok $? 'a training gives the same bytes without a cache, with a new one and with a full one'
[ "$(wc -l <made)" -ge 9 ] && [ "$(ls kept)" = "$(cat made)" ]
ok $? 'the cache holds one file for each example and is not written again'
set -- kept/*; head -c 3000 "$1" >t
while [ $# -gt 1 ]; do mv "$2" "$1"; shift; done; mv t "$1"
ct-train -q $small --cache kept -f --validate truth.nii d.safetensors scans
cmp c.safetensors.state d.safetensors.state; ok $? 'damaged and renamed files of the cache are made again'
ct-train -q $small --cache kept -f -n 1 --with c.safetensors -x 2 --validate truth.nii two.safetensors scans
ct-upsample -m prior -q -p p.safetensors lo.nii a.nii && ct-upsample -m prior -q -p two.safetensors lo.nii b.nii
ct-metrics --json a.nii b.nii | grep -q '"max-hu": 0[,.]'; ok $? '--with keeps the network of another factor as it was'
}
# shellcheck disable=SC2086
exits 3 'a volume given to --with is refused with status 3' ct-train $small --with truth.nii x.safetensors scans
# shellcheck disable=SC2086
exits 4 'a cache folder that cannot be made is refused with status 4' ct-train $small --cache /dev/null x.safetensors scans
# shellcheck disable=SC2086
exits 3 'a training cannot be resumed with another depth' ct-train $small --expert=depth=1 --resume p.safetensors scans
has err "depth was '3', not '1'" 'the error of a resume with another depth gives both values'
exits 2 '--kind slices refuses an option of pictures' ct-train --kind slices --arch num_heads=1 x.safetensors scans
exits 2 '--kind pictures refuses an option of slices' ct-train --expert=depth=3 x.safetensors scans
if python_with nibabel; then
	"$PY" - <<'E2'
import nibabel as n, numpy as np
v = n.load('truth.nii')
n.save(n.Nifti1Image(np.clip(np.round(v.get_fdata() / 20 + 60), 0, 255).astype('i2'), v.affine), 'bytes.nii')
E2
	# shellcheck disable=SC2086
	exits 3 'a scan of bytes is refused as it holds no HU' ct-train $small x.safetensors bytes.nii
	has err '--bytes' 'the error of a scan of bytes names the option --bytes'
fi

# refining with the prior
exits 0 'ct-upsample -m prior refines a phantom' ct-upsample -m prior -v -p p.safetensors lo.nii hr.nii
mkdir loud; ONEDNN_VERBOSE=2 ONEDNN_JIT_DUMP=1 sh -c 'cd loud && ct-upsample -m prior -q -p ../p.safetensors ../lo.nii - >o.nii'
ct-upsample -m prior -q -p p.safetensors lo.nii - >quiet.nii; cmp -s loud/o.nii quiet.nii && [ "$(ls loud)" = o.nii ]
ok $? 'what oneDNN is told by the environment is in no output'
a=$(psnr truth.nii up.nii) b=$(psnr truth.nii hr.nii)
awk "BEGIN{exit !($b > $a + 0.1)}"; ok $? "the prior gains 0.1 dB or more on a phantom ($a to $b dB)"
ct-degrade -q -x 4 hr.nii again.nii
r=$(ct-metrics -q --json lo.nii again.nii | sed -n 's/.*"max-hu": \([0-9.e-]*\).*/\1/p')
awk "BEGIN{exit !($r < 0.01)}"; ok $? "a result of the prior agrees with the scan within 0.01 HU ($r HU)"
mkdir one three
CT_THREADS=1 ct-upsample -m prior -q -p p.safetensors --start up.nii lo.nii one/o.nii
CT_THREADS=3 ct-upsample -m prior -q -p p.safetensors --start up.nii lo.nii three/o.nii
cmp one/o.nii three/o.nii; ok $? 'the prior gives the same bytes with one and three threads'
ct-upsample -m prior -Q fast -q --start up.nii --expert=weight=0 -p p.safetensors lo.nii none.nii
r=$(ct-metrics -q --json up.nii none.nii | sed -n 's/.*"max-hu": \([0-9.e-]*\).*/\1/p')
awk "BEGIN{exit !($r < 0.01)}"; ok $? "with weight 0 the result is that of the inversion ($r HU)"
w() { out=$1; shift; ct-upsample -m prior -q -f -p p.safetensors --start up.nii "$@" lo.nii $out.nii; } # w OUT ARGS...
far() { ct-metrics -q --json $1.nii $2.nii | sed -n 's/.*"rmse-hu": \([0-9.e-]*\).*/\1/p'; } # far A B
w auto; cmp_ auto one/o; ok $? 'a second run from the same start gives the same voxels'
w full --expert=weight=1
w none --expert=doubt=0,gate=0,cap=0,steps=0
cmp_ full none
ok $? 'with weight 1 all confidence weights are off'
! cmp_ full auto; ok $? 'with weight 1 the result differs from the default'
w careful --expert=weight=1,doubt=1.2,gate=15,cap=360,steps=0.05
cmp_ careful auto
ok $? 'the default is a careful choice of the confidence weights'
w soft --expert=steps=0
! cmp_ soft auto
ok $? 'without the weight for edges the result differs from the default'
w half --expert=weight=0.5; a=$(far up half) b=$(far up full)
awk "BEGIN{exit !($a > 0.45 * $b && $a < 0.55 * $b)}"; ok $? "with weight 0.5 half of the detail is added ($a of $b HU)"
for x in -0.1 10.1; do
	exits 2 "a weight of $x is refused with status 2" ct-upsample -m prior -p p.safetensors --expert=weight=$x lo.nii x.nii
	has err "^ct-upsample: --expert weight: $x is outside \[0, 10\]" "a weight outside [0, 10] is refused: $x"
done
exits 2 'a weight that is no number is refused with status 2' ct-upsample -m prior -p p.safetensors --expert=weight=much lo.nii x.nii
has err "^ct-upsample: --expert weight: 'much' is not a number" 'the error of a weight that is no number repeats what was given'
ct-upsample -m prior -q -p p.safetensors -Q fast lo.nii z.nii
r=$(ct-metrics -q --json hr.nii z.nii | sed -n 's/.*"max-hu": \([0-9.e-]*\).*/\1/p')
awk "BEGIN{exit !($r > 0.01)}"; ok $? '-Q fast, which uses slices across one axis, gives another result'
ct-degrade -q -x 1,4,4 truth.nii wide.nii
exits 0 '-Q fast accepts an axis that is not refined as much as the others' ct-upsample -m prior -q -p p.safetensors -Q fast wide.nii w-one.nii
ct-upsample -q wide.nii w-no.nii; ! cmp_ w-one w-no; ok $? '-Q fast adds detail where one axis is not refined'

# the predicted error
exits 0 '-m prior --std writes the predicted error' ct-upsample -m prior -q --std e.nii -p p.safetensors --start up.nii lo.nii x.nii
dd if=e.nii bs=1 skip=148 count=80 2>/dev/null | tr '\0' '\n' | grep -q '^expected error, HU; ct-upsample [0-9.]*$'; ok $? 'the header of the predicted error says what it is'
ct-metrics --json x.nii one/o.nii | grep -q '"max-hu": 0[,.]'; ok $? '--std does not change the result'
ct-metrics --uncertainty e.nii truth.nii x.nii >out
awk '/^std-all/{a=$3/$4; b=$5} /^std-1 /{l=$4} /^std-10 /{h=$4} END{exit !(a > 0.5 && a < 2 && b > 0.4 && h > 4 * l)}' out
ok $? "the predicted error is within a factor of two of the measured one ($(grep std-all out))"
rm x.nii
# factors and networks
ct-degrade -q -x 1.4,4,4 truth.nii mixed.nii
ct-degrade -q -x 2 truth.nii two.nii
exits 5 'with a weight, a factor far from that of any network is refused with status 5' ct-upsample -m prior --expert=weight=1 -p p.safetensors mixed.nii x.nii
has err 'mixed.nii: the prior has no network for factors 1.4,4,4$' 'factors that the prior has no network for are named'
exits 0 'without a weight, a factor far from that of any network is only inverted' ct-upsample -m prior -p p.safetensors mixed.nii x.nii
has err 'mixed.nii: the prior has no network for factors 1.4,4,4: the prior adds nothing$' 'ct-upsample reports that the prior has no network for the factors'
ct-upsample -q mixed.nii - | ct-metrics --json - x.nii | grep -q '"max-hu": 0[,.]'
ok $? 'without a network for the factors the result is that of the inversion'
rm x.nii
ct-degrade -q -x 2,4,4 truth.nii mixed2.nii
exits 0 'one network refines axes of different factors' ct-upsample -m prior -q -p p.safetensors mixed2.nii x.nii
ct-upsample -q mixed2.nii up2.nii; is() { ct-metrics -q --json truth.nii "$1" | sed -n 's/.*"psnr": \([0-9.]*\).*/\1/p'; }
awk "BEGIN{exit !($(is x.nii) > $(is up2.nii) + .02)}"
ok $? "different factors on each axis gain by the prior ($(is up2.nii) to $(is x.nii) dB)"
ct-metrics -q --consistency mixed2.nii --max residual-rms-hu=.05 truth.nii x.nii >out 2>&1
ok $? 'a result of different factors agrees with the scan'
rm x.nii
exits 0 'a factor without a network uses the nearest network' ct-upsample -m prior -q -p p.safetensors two.nii x.nii
exits 0 'a factor with a network uses it' ct-upsample -m prior -q -p two.safetensors two.nii y.nii
! cmp_ x y; ok $? 'the nearest network gives another result than that of the factor'
rm x.nii
# files that do not fit
exits 3 'a volume given as prior is refused with status 3' ct-upsample -m prior -p up.nii lo.nii x.nii
exits 3 'a prior of pictures is refused by ct-upsample with status 3' ct-upsample -m prior -p "$builddir/prior.safetensors" lo.nii x.nii
has err 'no prior of slices' 'a file without a prior of slices is named'
exits 5 'a --start on another grid is refused with status 5' \
	ct-upsample -m prior -p p.safetensors --start two.nii lo.nii x.nii
exits 5 'a --start on the grid of the scan is refused with status 5' ct-upsample -m prior -p p.safetensors --start lo.nii lo.nii x.nii
ct-convert -q --type f32 lo.nii - | tail -c 6720 >lo.raw # 14x12x10
ct-convert -q --raw 14x12x10:f32:8 lo.raw plain.nii
exits 2 'a scan that does not record its operator is refused with status 2' ct-upsample -m prior -x 4 -p p.safetensors plain.nii x.nii
ct-phantom -q --size 32x32x32 cube cube.nii && ct-convert -q --type f32 cube.nii - | tail -c 131072 | head -c 4096 >flat.raw
ct-convert -q --raw 16x8x8:f32:8 flat.raw flat.nii
exits 0 'a scan without edges to measure is accepted with --estimate' ct-upsample -m prior --estimate -x 4 -p p.safetensors flat.nii w.nii
has err 'flat.nii: its edges do not show how it was made (pass --sigma): the prior adds nothing' 'a scan without edges to measure is only inverted, with a warning'
exits 3 'the predicted error of a scan without edges is refused with status 3' ct-upsample -m prior --estimate -x 4 --std e.nii -f -p p.safetensors flat.nii x.nii
has err 'flat.nii: its edges do not show how it was made, which the predicted error needs: pass --sigma$' 'the error of --std for a scan without edges names the option that helps'

# a second pass, by networks trained on what the first pass gives
# shellcheck disable=SC2086
{
exits 0 'ct-train trains a network for a second pass' ct-train -q $small -n 30 --expert=again=yes --with p.safetensors --validate truth.nii r.safetensors scans
ct-info -v r.safetensors >out; has out '^  *again-4.shape' 'a prior with a second pass has one more network'
exits 3 'a second pass without a first one is refused with status 3' ct-train $small -x 3 --expert=again=yes --with p.safetensors x.safetensors scans
has err '^ct-train: p.safetensors: has no network for factor 3$' 'a factor without a network is refused by ct-train'
}
look() { out=$1; shift; ct-upsample -m prior -v -f --std $out-e.nii -p "$@" lo.nii $out.nii 2>err; }
look once p.safetensors --start up.nii
cmp_ once one/o
ok $? 'without a network for it there is no second pass'
look some r.safetensors --start up.nii
! cmp_ some once
ok $? 'a second pass changes the result where the first added much'
look few p.safetensors --start up.nii --expert=least=1e6; look none r.safetensors --start up.nii --expert=least=1e6
cmp_ few none; ok $? 'a second pass changes nothing where the first added too little'
look once p.safetensors --start up.nii --expert=least=0; look twice r.safetensors --start up.nii --expert=least=0
! cmp_ twice once && ! cmp_ twice some; ok $? 'with least=0 the second pass changes every place'
if command -v python3 >/dev/null; then
	python3 - <<'END'
import json
b = open('r.safetensors', 'rb').read()
n = int.from_bytes(b[:8], 'little')
h = {k[6:] if k.startswith('again-') else k if k == '__metadata__' else 'was-' + k: v for k, v in json.loads(b[8:8 + n]).items()}
t = json.dumps(h).encode()
open('only.safetensors', 'wb').write(len(t).to_bytes(8, 'little') + t + b[8 + n:])
END
	look hand only.safetensors --start once.nii --expert=cap=80,least=0
	for f in once-e twice-e; do tail -c 430080 $f.nii >$f.f32; done # 56x48x40
	cmp_ hand twice; ok $? 'the second pass starts from the result of the first'
	cmp once-e.f32 twice-e.f32; ok $? 'the predicted error is that of the first pass'
fi
ct-degrade -q -x 4 --noise 15 truth.nii noisy.nii; ct-upsample -q noisy.nii up-noisy.nii
noisy() { out=$1 by=$2; shift 2; ct-upsample -m prior -v -f -p "$by" --start up-noisy.nii "$@" noisy.nii $out.nii 2>err; }
noisy n1 p.safetensors
noisy n2 r.safetensors
! cmp_ n1 n2
ok $? 'a scan with noise of 15 HU has a second pass'
ct-degrade -q -f -x 4 -p P3n truth.nii noisy.nii
noisy n1 p.safetensors; noisy n2 r.safetensors; ! cmp_ n1 n2; ok $? 'a noisy aliased scan has a second pass'
noisy g0 r.safetensors --expert=gate=0
! cmp_ n2 g0
ok $? 'the second pass of a noisy aliased scan uses the weight for noise'
noisy w2 r.safetensors --expert=weight=1
cmp_ g0 w2
ok $? 'with weight 1 the second pass of a noisy aliased scan does not use the weight for noise'
ct-sr --prior r.safetensors lo.nii passes.nii 2>err
has err 'then the prior in two passes' 'ct-sr reports a prior in two passes'
ct-upsample -m prior -q -f --estimate -p r.safetensors lo.nii want.nii
cmp_ passes want; ok $? 'ct-sr with a prior gives the voxels of ct-upsample -m prior'

# thick slices, with the shipped prior
known=$builddir/slices.safetensors
ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean truth.nii thick.nii && ct-upsample -q thick.nii thin.nii
exits 0 'the shipped prior refines slices four times as thick' ct-upsample -m prior -q -p "$known" thick.nii thin-p.nii
awk "BEGIN{exit !($(psnr truth.nii thin-p.nii) > $(psnr truth.nii thin.nii) + 0.5)}"
ok $? "thick slices gain 0.5 dB by the shipped prior ($(psnr truth.nii thin.nii), $(psnr truth.nii thin-p.nii) dB)"
ct-degrade -q -x 1,1,4 truth.nii well.nii && ct-upsample -q well.nii up-well.nii
exits 0 'the shipped prior accepts band-limited slices' ct-upsample -m prior -f -p "$known" well.nii well-p.nii
has err 'well.nii: the slices look band-limited, for which the prior has no network; .*: the prior adds nothing$' 'ct-upsample reports that band-limited slices are only inverted'
ct-metrics --json up-well.nii well-p.nii | grep -q '"max-hu": 0[,.]'
ok $? 'band-limited slices give the result of the inversion'
exits 3 '--start with band-limited slices is refused with status 3' ct-upsample -m prior --start up-well.nii -p "$known" well.nii x.nii
exits 0 'with a weight the prior runs on a band-limited scan' ct-upsample -m prior -q --expert=weight=1 --start up-well.nii -p "$known" well.nii well-w.nii
! ct-metrics --json up-well.nii well-w.nii | grep -q '"max-hu": 0[,.]'
ok $? 'with a weight the prior changes a band-limited scan'
exits 0 '-m prior --dry-run reports the cost' ct-upsample -m prior --dry-run -p p.safetensors lo.nii x.nii
awk '$1 == "time" {s = $2; u = $3} END {exit !(s > 0 && s < 1000 && u == "s")}' out
ok $? 'a dry run estimates the time in seconds'
[ ! -e x.nii ]; ok $? 'runs that failed and dry runs leave no output'
# A test on the scan itself: of shells the prior adds too little at 2x. It is not made where the operator is estimated.
ct-phantom -q -s 3 --size 64x64x64 --spacing 1.5 shells own-sharp.nii && ct-degrade -q -x 1 --sigma .6,.6,.6 own-sharp.nii own.nii &&
	ct-degrade -q -x 2 --sigma 0 --decimate mean own.nii own-lr.nii
exits 0 'the shipped prior refines shells 2 times' ct-upsample -m prior -v -p "$known" own-lr.nii own-hr.nii
has err 'rehearsal: what the prior adds is multiplied by 1.60$' 'a scan to which the prior adds too little scales the detail up'
awk "BEGIN{exit !($(psnr own.nii own-hr.nii) > 39.5)}"
ok $? "a scan whose detail is scaled up comes near to the truth ($(psnr own.nii own-hr.nii) dB)"
tail -c 131072 own-lr.nii >own.raw && ct-convert -q --raw 32x32x32:f32:3 own.raw own-mute.nii
exits 0 'the shipped prior accepts an operator given by options' ct-upsample -m prior -v -f -p "$known" -x 2 --sigma 0 --decimate mean --noise 0 own-mute.nii x.nii
has err 'rehearsal: what the prior adds is multiplied by 1.60$' 'an operator given by options is tested on the scan like one that is recorded'
exits 0 'the shipped prior accepts an operator that is estimated' ct-upsample -m prior -v -f -p "$known" -x 2 --estimate own-mute.nii x.nii
! grep -q 'rehearsal: ' err; ok $? 'an estimated operator is not tested on the scan'; rm -f x.nii
exits 0 'the shipped prior predicts the error of thick slices' ct-upsample -m prior -v -f --std thin-s.nii -p "$known" thick.nii thin-p.nii
has err 'rehearsal: the predicted error is multiplied by [0-9.]* to [0-9.]*$' 'the predicted error of thick slices is scaled by a test on the scan'
exits 0 'the inversion predicts the error of thick slices' ct-upsample -v -f --std thin-s.nii thick.nii thin.nii
! grep -q 'rehearsal: ' err; ok $? 'the predicted error of the inversion is not scaled'
done_testing
