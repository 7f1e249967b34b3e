#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Outputs that exist: refused by every command, forced with -f, and overwritten in a rule of make.
. "$srcdir/tests/tap.sh"
ct-phantom -q -w -512:3071 --size 16x16x16 --spacing 4 marks hr.nii
ct-degrade -q -x 2 hr.nii lr.nii
ct-upsample -q -x 2 -m linear lr.nii up.nii
ct-project -q -n 6 hr.nii p.exr; ct-project -q -n 6 --coarsen 2 hr.nii pl.exr
ct-nabgs -q -b up.nii -n 2 -g 20 p.exr g.ply
twice() { # twice OUT COMMAND...
	out=$1; shift
	echo old >"$out"
	exits 4 "$1 does not overwrite" "$@"
	[ "$(cat "$out")" = old ]; ok $? 'the output that is not overwritten stays as it was'
	has err "$out: exists; --force overwrites it" 'and says what does'
	MAKELEVEL=1 "$@" >out 2>err; [ $? -eq 0 ] && ! grep -qx old "$out"; ok $? "$1 in a rule does"
	sed 's/^/# /' err
	echo old >"$out"
	exits 0 "$1 --force does" "$@" --force
	! grep -qx old "$out"; ok $? '--force replaces the old output'
}
twice o.nii ct-phantom -q --size 8x8x8 marks o.nii
twice o.nii ct-convert -q hr.nii o.nii
twice o.nii ct-degrade -q -x 2 hr.nii o.nii
twice o.nii ct-upsample -q -x 2 lr.nii o.nii
twice o.exr ct-project -q -n 2 hr.nii o.exr
twice o.nii ct-fdk -q p.exr o.nii
twice o.exr ct-ddnm -q -x 2 -n 1 pl.exr o.exr
twice o.ply ct-nabgs -q -b up.nii -n 2 -g 20 p.exr o.ply
twice f.nii ct-fuse -q -n 1 up.nii lr.nii p.exr f.nii
twice o.nii ct-compose -q up.nii g.ply o.nii
twice o.nii ct-sr -q -x 2 -Q draft lr.nii o.nii
twice o.csv ct-metrics -q --per-slice o.csv hr.nii up.nii
case " $CT_TOOLS " in *' ct-view '*) twice o.png ct-view -q hr.nii o.png ;; esac
twice o.safetensors ct-train -q --arch model_channels=32,channel_mult=1 -p 8 --expert batch=1 -n 1 o.safetensors p.exr

if command -v make >/dev/null 2>&1; then
	printf '%%.hr.nii: %%.nii\n\tct-sr -q -x 2 -Q draft $< $@\n%%.kept.nii: %%.nii\n\tct-sr -v -x 2 --paper --expert views=2,iterations=2,gaussians=20 --keep $*.work $< $@\n' >Makefile
	cp lr.nii a.nii
	exits 0 'make runs a rule of ct-sr' make a.hr.nii a.kept.nii
	exits 0 'when all is there' make -q a.hr.nii a.kept.nii
	touch -d '+1 minute' a.nii
	exits 0 'when the input is newer' make a.hr.nii a.kept.nii
	has err '7 of 7 steps were done' 'though it holds the same'
	[ a.hr.nii -nt lr.nii ]; ok $? 'it is made again'
else
	skip 'a rule' 'no make'
fi
done_testing
