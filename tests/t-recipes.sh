#!/bin/sh
# The recipe of the shipped prior of projections, on a phantom and one step; the options that README says.
. "$srcdir/tests/tap.sh"
mkdir ct xray
ct-phantom -q --size 24x24x24 ellipsoids ct/a.nii.gz
ct-view -q -p axial -o xray/a.png ct/a.nii.gz 2>err || { skip 'make-prior.sh' 'no ct-view'; done_testing; exit 0; }
readme=$srcdir/src/prior/README.md
# options FILE: what stands behind its name in README's command, on one line
options() { sed -n "/make-$1.sh .* $1.safetensors/,/^$/p" "$readme" | tr -d '\\\n' | sed "s/.*$1.safetensors//"; }
said=$(options prior | sed 's/--validate HELD_OUT//; s/,validate-every=250//; s/3200/1/; s/--patch 96/--patch 32/; s/batch=8/batch=1/')
echo "$said" | grep -q 'steps 1 '; ok $? "README has options:$said"
# shellcheck disable=SC2086
exits 0 'they make a prior' sh "$srcdir/src/prior/make-prior.sh" ct xray work prior.safetensors $said --arch model_channels=32,channel_mult=1
exits 0 'which can be read' ct-info prior.safetensors; has out 'scales=1,2' 'as it was made'
[ "$(ls work | wc -l)" -eq 6 ]; ok $? 'the recipe of poses makes six files'
done_testing
