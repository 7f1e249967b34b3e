#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What documents tell to run, on phantoms and with few steps: the recipe of the shipped prior, and the tutorials.
. "$srcdir/tests/tap.sh"
mkdir ct xray
ct-phantom -q --size 24x24x24 ellipsoids ct/a.nii.gz
ct-view -q -p axial -o xray/a.png ct/a.nii.gz || exit 99
readme=$srcdir/src/prior/README.md
# options FILE: what stands behind its name in README's command, on one line
options() { sed -n "/make-$1.sh .* $1.safetensors/,/^$/p" "$readme" | tr -d '\\\n' | sed "s/.*$1.safetensors//"; }
said=$(options prior | sed 's/--validate HELD_OUT//; s/,validate-every=250//; s/3200/1/; s/--patch 96/--patch 32/; s/batch=8/batch=1/')
echo "$said" | grep -q 'steps 1 '; ok $? "README has options:$said"
if pictures; then
	# shellcheck disable=SC2086
	exits 0 'they make a prior' sh "$srcdir/src/prior/make-prior.sh" ct xray work prior.safetensors $said --arch model_channels=32,channel_mult=1
	exits 0 'which can be read' ct-info prior.safetensors; has out 'scales=1,2' 'as it was made'
	[ "$(ls work | wc -l)" -eq 6 ]; ok $? 'the recipe of poses makes six files'
else
	skip 'the recipe of the shipped prior' 'no OpenImageIO'
fi
[ -e "$builddir/ctsr-dicom.so" ] || { skip 'the tutorials' 'built without vtk-dicom'; done_testing; }
# every command of the tutorials, and every picture in them is made by one
ln -s "$srcdir/examples" examples && mkdir truths
for n in a b; do ct-phantom -q -f --size 24x24x32 --spacing 2 ellipsoids truths/$n.nii.gz || exit 99; done
ct-degrade -q -x 1,1,5 truths/a.nii.gz thick.nii && ct-convert -q thick.nii scan/ && ct-phantom -q -w -512:3071 --size 32x32x32 --spacing 2 ellipsoids hr0.nii &&
	ct-degrade -q -x 4 hr0.nii lr.nii || exit 99
[ -x /usr/bin/time ] || { printf '#!/bin/sh\nout=$2; shift 4; "$@" && echo 1 1 >$out\n' >time; chmod +x time; export MAKEFLAGS=TIME=./time; }
for page in patient evaluate paper; do
	sed -n 's/^    //p' "$srcdir/doc/tutorial-$page.md" >commands
	while IFS= read -r line; do
		fast=$(echo "$line" | sed 's/--views=[0-9]*/--views=4/; s/--steps=50/--steps=2/; s/--iterations=5000/--iterations=20/; s/--gaussians=50000/--gaussians=50/')
		sh -c "$fast" >out 2>err </dev/null; rc=$?
		[ $rc -eq 0 ]; ok $? "tutorial-$page.md: $(echo "$line" | cut -c1-100)"
		[ $rc -eq 0 ] || sed 's/^/# /' err
	done <commands
	grep -o '](tutorial-[a-z]*\.svg)' "$srcdir/doc/tutorial-$page.md" | sed 's/.*tutorial-//; s/.svg.*//' | while read -r name; do
		[ -s "$srcdir/doc/tutorial-$name.svg" ] && [ -n "$(find . -name "$name.svg")" ] || echo "$name"
	done >lost
	[ ! -s lost ]; ok $? "tutorial-$page.md: each picture is made by a command in it"
done
done_testing
