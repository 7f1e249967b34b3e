#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What PyTorch writes and computes: checkpoints, neural fields.
. "$srcdir/tests/tap.sh"
python_with torch || { echo '1..0 # SKIP no PyTorch'; exit 0; }

# Checkpoints that PyTorch wrote: the numbers and the networks in them; ct-info and ct-ddnm take them.
part checkpoints
pt=$builddir/tests/t-pt
first=in_channels=3,out_channels=6,num_res_blocks=2,channel_mult=1:2,attention_resolutions=2,num_classes=5,num_head_channels=16
second=num_res_blocks=2,channel_mult=1:1:2,attention_resolutions=4,resblock_updown=False,use_scale_shift_norm=False,num_head_channels=32,use_new_attention_order=True
"$pt" shapes $first >first && "$pt" shapes $second >second && "$PY" "$srcdir/tests/t-pt.py" save . first second 2>err
ok $? 'PyTorch writes the checkpoints of this test'
sed 's/^/# /' err
same() { # same KEY NAME COMMAND...: what it prints are the numbers of KEY
	key_=$1 name_=$2; shift 2
	"$@" >out 2>err && "$PY" "$srcdir/tests/t-pt.py" compare want.json "$key_" <out; ok $? "$name_"
	sed 's/^/# /' err
}
# the reader, against PyTorch
for p in 2 4; do
	same plain "tensors of every type and stride are read, protocol $p" "$pt" read plain-$p.pt
	same state "the state of a network is read, protocol $p" "$pt" read state-$p.pt
	same nested "a state within a checkpoint is read, protocol $p" "$pt" read nested-$p.pt
done
for label in 0 3; do
	same net0-$label "a network with classes answers as in PyTorch for class $label" "$pt" answer net0.pt num_head_channels=16 $label 16
done
same net1-0 'a network without classes answers as in PyTorch' "$pt" answer net1.pt num_head_channels=32,use_new_attention_order=True 0 16
same net1-0 'a network with its whole architecture given answers as in PyTorch' "$pt" answer net1.pt model_channels=32,in_channels=1,out_channels=1,conv_resample=True,$second 0 16
! "$pt" answer net1.pt num_head_channels=32 0 16 | "$PY" "$srcdir/tests/t-pt.py" compare want.json net1-0 >/dev/null
ok $? 'another order of attention gives another answer'

# ct-info
exits 0 'ct-info -v lists the tensors of a checkpoint' ct-info -v nested-2.pt
has out '^  1.running_var  shape 3  min 1' 'ct-info -v prints shape and range of a tensor'
exits 0 'ct-info reads a checkpoint from a pipe' sh -c 'cat plain-2.pt | ct-info -'
has out '^tensors *16' 'ct-info counts the tensors of a checkpoint from a pipe'
exits 3 'a checkpoint of PyTorch before 1.6 is refused with status 3' ct-info old.pt
has err 'old.pt: a checkpoint of PyTorch before 1.6' 'the error of a checkpoint before 1.6 names file and version'
exits 3 'a checkpoint that would run a command is refused with status 3' ct-info evil.pt
has err 'evil.pt: .*data.pkl: GLOBAL at byte .*: posix.system' 'the error of a checkpoint that would run a command names the function'
[ ! -e executed ]; ok $? 'a command in a checkpoint is not run'

# ct-ddnm with a checkpoint as prior
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 v.nii &&
	ct-project -q --views 2 --coarsen 4 --pixel mean v.nii y.exr || exit 99
draw() { ct-ddnm -f -q --steps 2 "$@" y.exr o.exr; }
exits 3 'a checkpoint without its number of heads is refused with status 3' draw --prior net1.pt
has err 'net1.pt: architecture: tensors do not give num_head_channels' 'the error of a missing number of heads names num_head_channels'
exits 0 'ct-ddnm accepts a checkpoint with its architecture in --arch' draw --prior net1.pt --arch num_head_channels=32,use_new_attention_order=True
mv o.exr new.exr
exits 0 'ct-ddnm accepts the other order of attention' draw --prior net1.pt --arch num_head_channels=32,beta_schedule=linear,diffusion_steps=1000
! cmp -s o.exr new.exr; ok $? 'the other order of attention gives another result'
exits 3 '--arch with another number of channels is refused with status 3' draw --prior net1.pt --arch num_head_channels=32,in_channels=3
has err 'net1.pt: .*in 3.* 1 out\|net1.pt: 3 channels in and 1 out' 'the error of wrong channels names the checkpoint'
exits 3 '--arch with a level more than the checkpoint is refused with status 3' draw --prior net1.pt --arch num_head_channels=32,channel_mult=1:1:2:2
has err 'net1.pt: no tensor' 'the error of a missing tensor names the checkpoint'
exits 3 '--arch with a schedule of cosine is refused with status 3' draw --prior net1.pt --arch num_head_channels=32,beta_schedule=cosine
has err 'beta_schedule is "cosine"' 'a schedule of cosine is named in the error'
exits 2 'an unknown word of --arch is refused with status 2' draw --prior net1.pt --arch colour=3
has err 'there is no "colour"' 'an unknown word of the architecture is named'
exits 2 '--arch without an equals sign is refused with status 2' draw --prior net1.pt --arch 32
exits 2 '--class for a checkpoint without classes is refused with status 2' draw --prior net1.pt --arch num_head_channels=32 --class 0
has err 'net1.pt: the prior is not conditioned on classes' 'a class for a prior without classes is named'
exits 2 'a checkpoint with classes is refused without --class' draw --prior net0.pt --arch num_head_channels=16
has err 'net0.pt: is conditioned on 5 classes' 'the error of a missing --class gives the number of classes'
exits 2 '--class above the last class is refused with status 2' draw --prior net0.pt --arch num_head_channels=16 --class 5
has err 'net0.pt: the prior has classes 0 to 4' 'a class that the prior has not is named'
exits 0 'ct-ddnm accepts a checkpoint with classes, colours and variances' draw --prior net0.pt --arch num_head_channels=16 --class 3
mv o.exr class3.exr
exits 0 'ct-ddnm accepts another class of a checkpoint' draw --prior net0.pt --arch num_head_channels=16 --class 4
! cmp -s o.exr class3.exr; ok $? 'another class of a checkpoint gives another result'
# safetensors, which record their architecture
exits 2 '--arch that contradicts a file of safetensors is refused with status 2' ct-ddnm -f -q --steps 2 --prior "$builddir/prior.safetensors" --arch model_channels=64 y.exr o.exr
has err 'arch model_channels=64 contradicts the file: 32' 'an architecture that contradicts the file is named'

# Neural fields against PyTorch's: values and gradients of the same weights.
part fields
"$builddir/tests/t-field-network" dump . && "$builddir/tests/t-field-fit" dump . && "$PY" "$srcdir/tests/field-torch.py" . >said
ok $? 'values and gradients of fields are written and read'
judged() { # judged FILE: its lines "good NAME" and "bad NAME" as tests
	while read -r how name; do [ "$how" = good ]; ok $? "$name"; done <"$1"
}
judged said
done_testing
