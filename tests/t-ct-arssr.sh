#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-train --kind volumes and ct-upsample -m arssr: resumed, threads: the same bytes; refines; what is refused; and
# PyTorch has the same values and gradients.
. "$srcdir/tests/tap.sh"
mkdir scans
for k in 1 2; do ct-phantom -q -s $k --size 44x42x46 ellipsoids scans/$k.nii; done
ct-phantom -q -s 5 --size 40x44x42 ellipsoids truth.nii
ct-degrade -q -x 3 -p P1 truth.nii lo.nii
# shellcheck disable=SC2086
{
small='-k volumes -a features=6,blocks=2,layers=2,growth=5,out=8,width=16 -p 6 --expert=batch=3,lr=2e-3'
# training
exits 0 'ct-train -k volumes runs three steps' ct-train $small -n 3 a.safetensors scans
ct-train -q $small -n 1 -t 3 b.safetensors scans && ct-train -q $small -n 3 -t 2 --resume b.safetensors scans
cmp a.safetensors.state b.safetensors.state
ok $? 'a training stopped after a step and resumed with other threads gives the same bytes'
ct-train -q $small -n 3 -t 1 c.safetensors scans
cmp a.safetensors.state c.safetensors.state
ok $? 'a training with one thread gives the same bytes'
ct-train -q $small -n 3 -t 8 d.safetensors scans
cmp a.safetensors.state d.safetensors.state
ok $? 'a training with more threads than cubes in a step gives the same bytes'
for o in '-p 7' --expert=batch=2 --expert=lr=1e-3 --expert=ema=0.1 --expert=decay=10 --expert=cosine=yes --expert=window=-900:900 '-s 7' '-a blocks=1'; do
	ct-train -q -f $small $o -n 3 o.safetensors scans && ! cmp -s a.safetensors.state o.safetensors.state
	ok $? "$o changes what the training gives"
done
exits 0 'ct-train -k volumes runs with --validate and --patience' ct-train $small -f -n 60 --validate truth.nii --patience 3 \
	--expert=validate-every=10,validate-pieces=4,log-every=20 p.safetensors scans
awk '/step 20: loss/{a=$5} /step 60: loss/{b=$5} END{exit !(b+0 < 0.8*(a+0) && b+0 > 0)}' err
ok $? 'the training loss falls by a fifth in 40 steps'
has err 'the best, held-out loss' 'ct-train reports the best loss on the validation data'
ct-train -q $small -f -n 3 --half half.safetensors scans
exits 0 'arssr refines with a network trained with --half' ct-upsample -q -m arssr -p half.safetensors lo.nii x.nii
exits 0 'ct-train --dry-run of volumes succeeds' ct-train $small --dry-run z.safetensors scans
has out '2 volumes, [0-9]* parameters' 'ct-train --dry-run prints the number of volumes and parameters'
exits 3 'a network of other features cannot resume a training' ct-train $small -a features=7 -n 4 --resume a.safetensors scans
mkdir more; cp scans/*.nii more; ct-phantom -q -s 3 --size 44x42x46 ellipsoids more/3.nii
exits 3 'a training cannot be resumed with other volumes' ct-train $small -n 4 --resume a.safetensors more
has err 'DATA' 'the error of a resume with other volumes names DATA'
ct-phantom -q --size 44x42x20 ellipsoids low.nii
exits 5 'a volume with too few slices is refused with status 5' ct-train $small z.safetensors low.nii
exits 2 'an unknown word of --arch is refused with status 2' ct-train $small -a colour=3 z.safetensors scans
has err '--arch: there is no "colour"$' 'the error of an unknown word of --arch names it'
exits 2 'a network of 0 blocks is refused with status 2' ct-train $small -a blocks=0 z.safetensors scans
has err 'blocks=0: expected a number from 1 to 64$' 'the error of 0 blocks names its range'
exits 5 'volumes smaller than a training cube are refused with status 5' ct-train $small -p 12 z.safetensors scans
has err '^ct-train: scans: no volume has 48 voxels along each axis$' 'the error of volumes smaller than a cube says how many voxels are needed'
cp truth.nii nan.nii; printf '\000\000\300\177' | dd of=nan.nii bs=1 conv=notrunc seek=$(($(wc -c <truth.nii) - 4)) 2>/dev/null
exits 6 'a volume with a NaN is refused for training with status 6' ct-train $small z.safetensors nan.nii
has err '^ct-train: nan.nii: voxel' 'the error of a NaN names file and voxel'
exits 2 'a window beyond float32 is refused with status 2' ct-train $small --expert=window=-1e308:1e308 z.safetensors scans
has err 'window' 'the error of a window beyond float32 names the option'
exits 6 'a training that diverges ends with status 6' ct-train -q $small --expert=lr=1,decay=10 -n 500 z.safetensors scans
[ ! -e z.safetensors ]; ok $? 'a training that failed leaves no output'
exits 2 'ct-train -k volumes refuses -x with status 2' ct-train $small -x 3 z.safetensors scans
}

# refining
exits 0 'ct-upsample -m arssr refines a volume' ct-upsample -v -m arssr -p p.safetensors lo.nii hi.nii
has err 'arssr' 'ct-upsample -v reports the method arssr'
ct-upsample -q -m cubic lo.nii cubic.nii
ct-metrics hi.nii cubic.nii >out 2>err; ok $? 'arssr gives the grid that the other methods give'
CT_THREADS=1 ct-upsample -q -f -m arssr -p p.safetensors lo.nii one.nii
mkdir three; (cd three && CT_THREADS=3 ct-upsample -q -f -m arssr -p ../p.safetensors ../lo.nii one.nii)
ct-metrics --json one.nii three/one.nii | grep -q '"max-hu": 0[,.]'
ok $? 'arssr gives the same voxels with one and three threads'
exits 0 'arssr --dry-run accepts factors that are not whole' ct-upsample -q -m arssr -x 1.7,2.3,3 -p p.safetensors scans/1.nii --dry-run x.nii
has out 'arssr of' 'arssr --dry-run prints the method'
exits 2 'arssr without --prior is refused with status 2' ct-upsample -m arssr lo.nii z.nii
has err '-m arssr: needs --prior' 'the error of arssr without --prior names the missing option'
exits 2 'arssr with --start is refused with status 2' ct-upsample -m arssr -p p.safetensors --start cubic.nii lo.nii z.nii
printf x >text
exits 3 'a text file as prior of arssr is refused with status 3' ct-upsample -m arssr -p text lo.nii z.nii
if [ -r "$srcdir/src/prior/slices.safetensors" ]; then
	exits 3 'a prior of slices is refused by arssr with status 3' ct-upsample -m arssr -p "$srcdir/src/prior/slices.safetensors" lo.nii z.nii
	has err 'slices.safetensors: is no prior of volumes' 'the error of a prior that arssr cannot use names the file'
fi
exits 3 'a prior of volumes is refused by -m prior with status 3' ct-upsample -m prior -p p.safetensors lo.nii z.nii
exits 7 'arssr with too little memory stops with status 7' ct-upsample -m arssr -p p.safetensors --memory 24M lo.nii z.nii

if python_with torch; then
	"$builddir/tests/t-arssr" small.safetensors published.safetensors
	for f in small published; do
		"$PY" "$srcdir/tests/arssr-torch.py" $f.safetensors 1e-5 1e-4 >out
		ok $? "the $f network has the values and gradients of PyTorch"
		sed 's/^/# /' out
	done
else
	skip 'the small network has the values and gradients of PyTorch' 'no PyTorch'
fi
done_testing
