#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The pipeline of README.md and of ct-pipeline(7) is what ct-sr --paper runs, and is run here as it stands
# there, on a small phantom with fewer views, Gaussians and iterations.
. "$srcdir/tests/tap.sh"
# The lines from ct-convert to ct-compose of a text, one command a line, nothing else.
commands() {
	sed -n '/^ *ct-convert scan/,/^ *ct-compose/p' "$1" | sed 's/ *#.*//; s/\\e$/\\/' |
		sed -e ':a' -e '/\\$/N; s/ *\\\n */ /; ta' | sed 's/^ *//; /^$/d'
}
commands "$srcdir/README.md" >readme
commands "$srcdir/man/ct-pipeline.7" >page
[ "$(wc -l <readme)" -eq 7 ]; ok $? 'README has a pipeline'
cmp -s readme page; ok $? 'and ct-pipeline(7) the same'
mkdir scan
ct-sr --dry-run --paper --keep . scan/ hr.nii | sed 's,\./,,g; s, --prior=[^ ]*,,' >runs
cmp -s readme runs; ok $? 'which is what ct-sr runs'
diff readme runs | sed 's/^/# /'

ct-phantom -q -w -512:3071 ellipsoids --size 32x32x32 --spacing 4 truth.nii && ct-degrade -q --clip -512:3071 -x 4 truth.nii scan.nii
ok $? 'a scan to refine is made'
few='s/--views=[0-9]*/--views=16/; s/--iterations=[0-9]*/--iterations=200/; s/--gaussians=[0-9]*/--gaussians=4000/'
sed "s,scan/,scan.nii,; $few" readme >script
sh -e script >/dev/null 2>err; ok $? 'the script of ct-pipeline(7) runs as it stands'
sed 's/^/# /' err
ct-sr -q --paper --expert views=16,iterations=200,gaussians=4000 scan.nii sr.nii; ok $? 'ct-sr --paper runs on the same scan'
voxels() { ct-convert -q --type f32 "$1" - | tail -c 131072; }
voxels hr.nii >a; voxels sr.nii >b
[ "$(wc -c <a)" -eq 131072 ] && cmp -s a b; ok $? 'to the same voxels'
ct-upsample -q -m cubic scan.nii cubic.nii
db() { ct-metrics "$@" | awk '/^psnr/ {print $2}'; }
awk "BEGIN {exit !($(db truth.nii hr.nii) > $(db truth.nii cubic.nii) - 1.5)}"
ok $? "at most 1.5 dB below cubic, of few views: $(db truth.nii hr.nii), $(db truth.nii cubic.nii)"
done_testing
