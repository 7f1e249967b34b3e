#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# RDN and Omni-SR: the numbers of PyTorch; ct-train --kind superres, and ct-ddnm, which asks such a network once.
. "$srcdir/tests/tap.sh"
net=$builddir/tests/t-super-net twin=$srcdir/tests/supervised-torch.py
if python_with torch; then
	"$PY" "$twin" make && for n in rdn-small rdn-published omni-small omni-published; do
		"$net" answer $n.pt $n.safetensors || break
	done && "$PY" "$twin" compare >same
	[ "$(grep -c ^good same)" = 4 ]; ok $? 'RDN and Omni-SR have the values and gradients of PyTorch'
	sed 's/^/# /' same
else
	skip 'RDN and Omni-SR have the values and gradients of PyTorch' 'no PyTorch'
fi

# training and refining, for each network
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii && ct-project -q --views 6 --det 48 hr.nii hr.exr &&
	ct-project -q --views 6 --det 48 --coarsen 3 --pixel mean hr.nii lr.exr
ok $? 'projections for this test are made'
rdn=net=rdn,blocks=1,layers=2,features=8,growth=6
omni=net=omni,blocks=1,features=8,num_heads=2,window=4
opts='--kind superres -x 3 -p 48 --expert batch=5,lr=1e-3'
for n in rdn omni; do
	eval "arch=\$$n"
	# shellcheck disable=SC2154
	exits 0 "$n: ct-train --kind superres runs four steps" ct-train -q $opts --arch "$arch" -n 4 $n.safetensors hr.exr
	ct-train -q $opts --arch "$arch" -n 2 -t 1 b.safetensors hr.exr &&
		ct-train -q $opts --arch "$arch" -n 4 -t 3 --resume -f b.safetensors hr.exr &&
		cmp $n.safetensors.state b.safetensors.state
	ok $? "$n: a training stopped and resumed with other threads gives the same bytes"
	rm -f b.safetensors b.safetensors.state
	exits 0 "$n: ct-ddnm refines projections with the network" ct-ddnm -q -t 1 --prior $n.safetensors lr.exr $n.exr
	for k in 1 3; do
		CT_THREADS=$k ct-ddnm -q --prior $n.safetensors lr.exr - >$k.exr
	done
	cmp 1.exr 3.exr; ok $? "$n: ct-ddnm gives the same bytes with one and three threads"
done
exits 0 'ct-train --kind superres accepts --validate' ct-train $opts --arch $rdn -n 60 --expert log-every=20,ema=0.9 --validate hr.exr \
	l.safetensors hr.exr
awk '/step 20: loss/{a=$5} /step 60: loss/{b=$5} /step 60: held/{c=$6} END{exit !(b+0 < 0.8*(a+0) && c+0 > 0 && c+0 < a+0)}' err
ok $? 'the loss of a training of super-resolution falls by a fifth'
# networks that PyTorch wrote
if python_with torch; then
	exits 0 'ct-ddnm accepts a checkpoint of PyTorch with its factor' ct-ddnm -q --prior rdn-small.pt --arch net=rdn,factor=6 hr.exr pt.exr
	exits 3 'a checkpoint of PyTorch with a wrong factor is refused with status 3' ct-ddnm -q --prior rdn-small.pt --arch net=rdn,factor=3 hr.exr pt3.exr
	has err 'factor is 3, the tensors are of another' 'the error of tensors of another factor names it'
	cp "$srcdir/tests/exr.py" .
	PYTHONPATH=. "$PY" "$twin" stack rdn 1 2 6 8 3 >same && PYTHONPATH=. "$PY" "$twin" stack omni 1 1 8 2 4 3 >>same
	[ "$(grep -c ^good same)" = 2 ]; ok $? 'PyTorch refines a stack to the same values'
	sed 's/^/# /' same
fi
ct-info omni.safetensors >info && has info 'net.*omni' 'the file of a network records its kind'

# refusals and cost
exits 2 '-x with another factor than that of the network is refused' ct-ddnm -q -x 2 --prior rdn.safetensors hr.exr x.exr
has err 'rdn.safetensors makes 3 times finer' 'the error of another factor names that of the network'
ct-project -q --views 2 --det 16 --coarsen 2 --pixel mean hr.nii two.exr
exits 2 'projections coarser by another factor are refused with status 2' ct-ddnm -q --prior rdn.safetensors two.exr x.exr
exits 0 'the factor of the network is used without -x' ct-ddnm -q --sampler once --prior rdn.safetensors hr.exr x.exr
ct-info x.exr >info && has info '^size  *144 144' 'a network of factor 3 makes the detector three times finer'
exits 2 'a diffusion sampler with a network of super-resolution is refused' ct-ddnm -q --sampler ddim --prior rdn.safetensors lr.exr y.exr
has err 'not a diffusion prior: give --sampler once' 'the error of a diffusion sampler names --sampler once'
exits 2 'a diffusion prior with --sampler once is refused with status 2' ct-ddnm -q --sampler once lr.exr y.exr
has err 'ct-train --kind superres' 'the error of a diffusion prior once names --kind superres'
exits 2 '--steps with a network of super-resolution is refused with status 2' ct-ddnm -q --steps 5 --prior rdn.safetensors lr.exr y.exr
has err 'steps' 'the error of --steps with a network of super-resolution names it'
exits 2 '--init with a network of super-resolution is refused with status 2' ct-ddnm -q --init hr.exr --prior rdn.safetensors lr.exr y.exr
exits 2 '--kind superres with net=unet is refused with status 2' ct-train -q $opts --arch net=unet y.safetensors hr.exr
exits 2 'net=rdn without --kind superres is refused with status 2' ct-train -q --arch net=rdn y.safetensors hr.exr
has err 'not with --kind pictures' 'the error of net=rdn without its kind names --kind pictures'
exits 2 'a piece that the factor does not divide is refused with status 2' ct-train -q $opts -p 50 --arch $rdn y.safetensors hr.exr
exits 5 'a piece smaller than the network accepts is refused with status 5' ct-train -q $opts -p 36 --arch $omni y.safetensors hr.exr
has err 'multiples of 4 from 16' 'the error of a wrong side names its multiples'
exits 0 'ct-ddnm --dry-run accepts a network of super-resolution' ct-ddnm --dry-run --prior omni.safetensors lr.exr y.exr
has out '6 calls' 'the dry run counts one call for each view'
done_testing
