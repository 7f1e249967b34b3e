#!/bin/sh
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

# shellcheck disable=SC2086
exits 0 'trains' ct-train $small --expert=log-every=20,validate-every=30 --validate truth.nii p.safetensors scans
awk '/step 20: loss/{a=$5} /step 60: loss/{b=$5} END{exit !(b+0 < a+0 && b+0 > 0)}' err
ok $? 'the loss falls'
awk '/step 60: held/{a=$6} END{exit !(a+0 > 0 && a+0 < 0.97)}' err
ok $? 'something is known of a phantom that was not trained on'
# shellcheck disable=SC2086
{
ct-train -q $small -t 1 --minutes 0.00001 q.safetensors scans
ct-info q.safetensors >info
ct-train -q $small -t 3 --resume q.safetensors scans
}
! grep -q 'step.*60' info && cmp p.safetensors.state q.safetensors.state
ok $? 'interrupted, resumed, other threads: same bytes'
# shellcheck disable=SC2086
{
ct-train -q $small --cache kept -f --validate truth.nii c.safetensors scans
ls kept >made
ct-train -q $small --cache kept -f --validate truth.nii d.safetensors scans
cmp p.safetensors.state c.safetensors.state && cmp c.safetensors.state d.safetensors.state; ok $? 'with a cache: the same bytes, made and found'
[ "$(wc -l <made)" -ge 9 ] && [ "$(ls kept)" = "$(cat made)" ]; ok $? 'which holds an example a file'
set -- kept/*; head -c 3000 "$1" >t
while [ $# -gt 1 ]; do mv "$2" "$1"; shift; done; mv t "$1"
ct-train -q $small --cache kept -f --validate truth.nii d.safetensors scans
cmp c.safetensors.state d.safetensors.state; ok $? 'damaged ones, and ones of another name, are made anew'
ct-train -q $small --cache kept -f -n 1 --with c.safetensors -x 2 --validate truth.nii two.safetensors scans
ct-upsample -m prior -q -p p.safetensors lo.nii a.nii && ct-upsample -m prior -q -p two.safetensors lo.nii b.nii
ct-metrics --json a.nii b.nii | grep -q '"max-hu": 0[,.]'; ok $? 'with another prior: the same of its factor'
}
# shellcheck disable=SC2086
exits 3 'what is to stay is a prior, too' ct-train $small --with truth.nii x.safetensors scans
# shellcheck disable=SC2086
exits 4 'a cache that cannot be' ct-train $small --cache /dev/null x.safetensors scans
# shellcheck disable=SC2086
exits 3 'another rule cannot resume' ct-train $small --expert=depth=1 --resume p.safetensors scans
has err "depth was '3', not '1'" 'and says why'
exits 2 'an option of pictures is refused' ct-train --kind slices --arch num_heads=1 x.safetensors scans
exits 2 'one of slices without them' ct-train --expert=depth=3 x.safetensors scans
if python_with nibabel; then
	"$PY" - <<'E2'
import nibabel as n, numpy as np
v = n.load('truth.nii')
n.save(n.Nifti1Image(np.clip(np.round(v.get_fdata() / 20 + 60), 0, 255).astype('i2'), v.affine), 'bytes.nii')
E2
	# shellcheck disable=SC2086
	exits 3 'bytes are no HU' ct-train $small x.safetensors bytes.nii
	has err -- '--bytes' 'unless it is said what they are'
fi

exits 0 'restores' ct-upsample -m prior -v -p p.safetensors lo.nii hr.nii
a=$(psnr truth.nii up.nii) b=$(psnr truth.nii hr.nii)
awk "BEGIN{exit !($b > $a + 0.1)}"; ok $? "a phantom is better for it ($a, $b dB)"
ct-degrade -q -x 4 hr.nii again.nii
r=$(ct-metrics -q --json lo.nii again.nii | sed -n 's/.*"max-hu": \([0-9.e-]*\).*/\1/p')
awk "BEGIN{exit !($r < 0.01)}"; ok $? "and agrees with the scan ($r HU)"
mkdir one three
CT_THREADS=1 ct-upsample -m prior -q -p p.safetensors --start up.nii lo.nii one/o.nii
CT_THREADS=3 ct-upsample -m prior -q -p p.safetensors --start up.nii lo.nii three/o.nii
cmp one/o.nii three/o.nii; ok $? 'any number of threads: same bytes'
ct-upsample -m prior -Q fast -q --start up.nii --expert=weight=0 -p p.safetensors lo.nii none.nii
r=$(ct-metrics -q --json up.nii none.nii | sed -n 's/.*"max-hu": \([0-9.e-]*\).*/\1/p')
awk "BEGIN{exit !($r < 0.01)}"; ok $? "with weight 0 it is what the solver makes ($r HU)"
w() { out=$1; shift; ct-upsample -m prior -q -f -p p.safetensors --start up.nii "$@" lo.nii $out.nii; } # w OUT ARGS...
far() { ct-metrics -q --json $1.nii $2.nii | sed -n 's/.*"rmse-hu": \([0-9.e-]*\).*/\1/p'; } # far A B
w auto; cmp_ auto one/o; ok $? 'the same again'
w full --expert=weight=1; w none --expert=doubt=0,gate=0,cap=0,steps=0; cmp_ full none; ok $? 'a weight takes all with the same confidence'
! cmp_ full auto; ok $? 'which is not the default'
w careful --expert=weight=1,doubt=1.2,gate=15,cap=360,steps=0.05; cmp_ careful auto; ok $? 'the default is the careful confidence weights'
w soft --expert=steps=0; ! cmp_ soft auto; ok $? 'which leaves plain steps as sharp as they are'
w half --expert=weight=0.5; a=$(far up half) b=$(far up full)
awk "BEGIN{exit !($a > 0.45 * $b && $a < 0.55 * $b)}"; ok $? "half of it is half as much ($a, $b HU)"
for x in -0.1 10.1; do
	exits 2 "a weight of $x" ct-upsample -m prior -p p.safetensors --expert=weight=$x lo.nii x.nii
	has err "^ct-upsample: --expert weight: $x is outside \[0, 10\]" "a weight outside [0, 10] is refused: $x"
done
exits 2 'no weight' ct-upsample -m prior -p p.safetensors --expert=weight=much lo.nii x.nii
has err "^ct-upsample: --expert weight: 'much' is not a number" 'a weight that is no number is refused'
ct-upsample -m prior -q -p p.safetensors -Q fast lo.nii z.nii
r=$(ct-metrics -q --json hr.nii z.nii | sed -n 's/.*"max-hu": \([0-9.e-]*\).*/\1/p')
awk "BEGIN{exit !($r > 0.01)}"; ok $? 'slices across one axis give something else'
ct-degrade -q -x 1,4,4 truth.nii wide.nii
exits 0 'one axis refined less: slices across the one that the prior knows' ct-upsample -m prior -q -p p.safetensors -Q fast wide.nii w-one.nii
ct-upsample -q wide.nii w-no.nii; ! cmp_ w-one w-no; ok $? 'add something'

exits 0 'tells the error it expects' ct-upsample -m prior -q --std e.nii -p p.safetensors --start up.nii lo.nii x.nii
dd if=e.nii bs=1 skip=148 count=80 2>/dev/null | tr '\0' '\n' | grep -q '^expected error, HU; ct-upsample [0-9.]*$'; ok $? 'and what it is'
ct-metrics --json x.nii one/o.nii | grep -q '"max-hu": 0[,.]'; ok $? 'and gives the same'
ct-metrics --uncertainty e.nii truth.nii x.nii >out
awk '/^std-all/{a=$3/$4; b=$5} /^std-1 /{l=$4} /^std-10 /{h=$4} END{exit !(a > 0.5 && a < 2 && b > 0.4 && h > 4 * l)}' out
ok $? "which is about the one there is ($(grep std-all out))"
rm x.nii
ct-degrade -q -x 1.4,4,4 truth.nii mixed.nii
ct-degrade -q -x 2 truth.nii two.nii
exits 5 'a factor far from that of any network is refused' ct-upsample -m prior --expert=weight=1 -p p.safetensors mixed.nii x.nii
has err 'mixed.nii: the prior has no network for factors 1.4,4,4$' 'factors that the prior has no network for are named'
exits 0 'or left to the solver' ct-upsample -m prior -p p.safetensors mixed.nii x.nii
has err 'mixed.nii: the prior has no network for factors 1.4,4,4: the prior adds nothing$' 'which is said'
ct-upsample -q mixed.nii - | ct-metrics --json - x.nii | grep -q '"max-hu": 0[,.]'; ok $? 'and gives what it makes'
rm x.nii
ct-degrade -q -x 2,4,4 truth.nii mixed2.nii
exits 0 'several factors are seen by one network' ct-upsample -m prior -q -p p.safetensors mixed2.nii x.nii
ct-upsample -q mixed2.nii up2.nii; is() { ct-metrics -q --json truth.nii "$1" | sed -n 's/.*"psnr": \([0-9.]*\).*/\1/p'; }
awk "BEGIN{exit !($(is x.nii) > $(is up2.nii) + .02)}"; ok $? "which gains ($(is up2.nii) to $(is x.nii) dB)"
ct-metrics -q --consistency mixed2.nii --max residual-rms-hu=.05 truth.nii x.nii >out 2>&1; ok $? 'and agrees with the scan'
rm x.nii
exits 0 'another factor is seen by the nearest network' ct-upsample -m prior -q -p p.safetensors two.nii x.nii
exits 0 'or by its own' ct-upsample -m prior -q -p two.safetensors two.nii y.nii
! cmp_ x y; ok $? 'which is not the same'
rm x.nii
exits 3 'a volume is no prior' ct-upsample -m prior -p up.nii lo.nii x.nii
exits 3 'nor is a prior of pictures' ct-upsample -m prior -p "$builddir/prior.safetensors" lo.nii x.nii
has err 'no prior of slices' 'a file without a prior of slices is named'
exits 5 'nor is a volume on another grid one to start from' \
	ct-upsample -m prior -p p.safetensors --start two.nii lo.nii x.nii
exits 5 'or that of the coarse one' ct-upsample -m prior -p p.safetensors --start lo.nii lo.nii x.nii
ct-convert -q --type f32 lo.nii - | tail -c 6720 >lo.raw # 14x12x10
ct-convert -q --raw 14x12x10:f32:8 lo.raw plain.nii
exits 2 'a scan that does not say how it was made' ct-upsample -m prior -x 4 -p p.safetensors plain.nii x.nii
ct-phantom -q --size 32x32x32 cube cube.nii && ct-convert -q --type f32 cube.nii - | tail -c 131072 | head -c 4096 >flat.raw
ct-convert -q --raw 16x8x8:f32:8 flat.raw flat.nii
exits 0 'or whose edges do not say it' ct-upsample -m prior --estimate -x 4 -p p.safetensors flat.nii w.nii
has err 'flat.nii: its edges do not show how it was made (--sigma says it): the prior adds nothing' 'is refined alone'
exits 3 'and tells no error' ct-upsample -m prior --estimate -x 4 --std e.nii -f -p p.safetensors flat.nii x.nii
has err 'flat.nii: its edges do not show how it was made, which the predicted error needs: --sigma says it$' 'says so'

# another look, by nets for what the first have added to
# shellcheck disable=SC2086
{
exits 0 'a net to look again' ct-train -q $small -n 30 --expert=again=yes --with p.safetensors --validate truth.nii r.safetensors scans
ct-info -v r.safetensors >out; has out '^  *again-4.shape' 'is one more'
exits 3 'one that nothing comes before' ct-train $small -x 3 --expert=again=yes --with p.safetensors x.safetensors scans
has err '^ct-train: p.safetensors: has no network for factor 3$' 'a factor without a network is refused by ct-train'
}
look() { out=$1; shift; ct-upsample -m prior -v -f --std $out-e.nii -p "$@" lo.nii $out.nii 2>err; }
look once p.safetensors --start up.nii; cmp_ once one/o; ok $? 'once: the first alone look'
look some r.safetensors --start up.nii; ! cmp_ some once; ok $? 'twice: the others, too, where the first added much'
look few p.safetensors --start up.nii --expert=least=1e6; look none r.safetensors --start up.nii --expert=least=1e6
cmp_ few none; ok $? 'nowhere if that is not enough'
look once p.safetensors --start up.nii --expert=least=0; look twice r.safetensors --start up.nii --expert=least=0
! cmp_ twice once && ! cmp_ twice some; ok $? 'or everywhere'
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
	cmp_ hand twice; ok $? 'they look at what the first made'
	cmp once-e.f32 twice-e.f32; ok $? 'the error is told after the first'
fi
ct-degrade -q -x 4 --noise 15 truth.nii noisy.nii; ct-upsample -q noisy.nii up-noisy.nii
noisy() { out=$1 by=$2; shift 2; ct-upsample -m prior -v -f -p "$by" --start up-noisy.nii "$@" noisy.nii $out.nii 2>err; }
noisy n1 p.safetensors; noisy n2 r.safetensors; ! cmp_ n1 n2; ok $? 'of noise, too'
ct-degrade -q -f -x 4 -p P3n truth.nii noisy.nii
noisy n1 p.safetensors; noisy n2 r.safetensors; ! cmp_ n1 n2; ok $? 'as where what is sampled by points aliases'
noisy g0 r.safetensors --expert=gate=0; ! cmp_ n2 g0; ok $? 'with a gate then'
noisy w2 r.safetensors --expert=weight=1; cmp_ g0 w2; ok $? 'but for a weight'
ct-sr --prior r.safetensors lo.nii passes.nii 2>err; has err 'then the prior in two passes' 'ct-sr says so'
ct-upsample -m prior -q -f --estimate -p r.safetensors lo.nii want.nii
cmp_ passes want; ok $? 'ct-sr is that'

# thick slices, by the prior that is shipped
known=$builddir/slices.safetensors
ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean truth.nii thick.nii && ct-upsample -q thick.nii thin.nii
exits 0 'slices four times as thick' ct-upsample -m prior -q -p "$known" thick.nii thin-p.nii
awk "BEGIN{exit !($(psnr truth.nii thin-p.nii) > $(psnr truth.nii thin.nii) + 0.5)}"
ok $? "gain ($(psnr truth.nii thin.nii), $(psnr truth.nii thin-p.nii) dB)"
ct-degrade -q -x 1,1,4 truth.nii well.nii && ct-upsample -q well.nii up-well.nii
exits 0 'those that are well sampled' ct-upsample -m prior -f -p "$known" well.nii well-p.nii
has err 'well.nii: the slices look band-limited, for which the prior has no network; .*: the prior adds nothing$' 'are refined alone'
ct-metrics --json up-well.nii well-p.nii | grep -q '"max-hu": 0[,.]'; ok $? 'to what the solver makes'
exits 3 'are not added to' ct-upsample -m prior --start up-well.nii -p "$known" well.nii x.nii
exits 0 'the prior runs on a band-limited scan where asked for' ct-upsample -m prior -q --expert=weight=1 --start up-well.nii -p "$known" well.nii well-w.nii
! ct-metrics --json up-well.nii well-w.nii | grep -q '"max-hu": 0[,.]'; ok $? 'which is something else'
exits 0 'it tells what it will take' ct-upsample -m prior --dry-run -p p.safetensors lo.nii x.nii
awk '$1 == "time" {s = $2; u = $3} END {exit !(s > 0 && s < 1000 && u == "s")}' out; ok $? 'which is no more than the scan, all of which was tried'
[ ! -e x.nii ]; ok $? 'and nothing is left of what failed'
# What the scan itself tells. Of shells the prior adds too little, twice; where the operator is estimated, that is not asked.
ct-phantom -q -s 3 --size 64x64x64 --spacing 1.5 shells own-sharp.nii && ct-degrade -q -x 1 --sigma .6,.6,.6 own-sharp.nii own.nii &&
	ct-degrade -q -x 2 --sigma 0 --decimate mean own.nii own-lr.nii
exits 0 'twice finer' ct-upsample -m prior -v -p "$known" own-lr.nii own-hr.nii
has err 'rehearsal: what the prior adds is multiplied by 1.60$' 'what it expects is too little'
awk "BEGIN{exit !($(psnr own.nii own-hr.nii) > 39.5)}"; ok $? "so more is added ($(psnr own.nii own-hr.nii) dB)"
tail -c 131072 own-lr.nii >own.raw && ct-convert -q --raw 32x32x32:f32:3 own.raw own-mute.nii
exits 0 'an operator that is given' ct-upsample -m prior -v -f -p "$known" -x 2 --sigma 0 --decimate mean --noise 0 own-mute.nii x.nii
has err 'rehearsal: what the prior adds is multiplied by 1.60$' 'is as good'
exits 0 'an operator that is estimated' ct-upsample -m prior -v -f -p "$known" -x 2 --estimate own-mute.nii x.nii
! grep -q 'rehearsal: ' err; ok $? 'is not asked'; rm -f x.nii
exits 0 'the error of slices' ct-upsample -m prior -v -f --std thin-s.nii -p "$known" thick.nii thin-p.nii
has err 'rehearsal: the predicted error is multiplied by [0-9.]*$' 'is scaled'
exits 0 'a draft' ct-upsample -v -f --std thin-s.nii thick.nii thin.nii
! grep -q 'rehearsal: ' err; ok $? 'is not'
done_testing
