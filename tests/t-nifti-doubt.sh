#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A NIfTI header that contradicts itself: the sform is used and the rest is told; a mirrored one is refused.
. "$srcdir/tests/tap.sh"
ct-phantom -q --size 8x9x10 --spacing 2,3,5 marks v.nii
edit() { # edit NAME OFFSET BYTES: v.nii with other bytes there
	cp v.nii "$1.nii"
	# shellcheck disable=SC2059
	printf "$3" | dd of="$1.nii" bs=1 seek="$2" conv=notrunc 2>/dev/null
}
zero='\000\000\000\000' two='\000\000\000\100' hundred='\000\000\310\102' nan='\000\000\300\177' inf='\000\000\200\177' minus='\000\000\200\277'
edit shifted 268 "$hundred"; edit long 84 "$hundred"; edit none 80 "$zero"; edit nan 80 "$nan"; edit turned 256 "$two"; edit minus 80 "$minus"
ct-upsample -q -m linear -x 2 v.nii want.nii
told() { # told NAME WORDS: the sform is used, and the words are a warning
	for tool in 'ct-convert' 'ct-upsample -m linear -x 2'; do
		exits 0 "$1: ${tool%% *} accepts a header that contradicts itself" $tool -f "$1.nii" o.nii
		has err "^${tool%% *}: warning: $1.nii: \\($2\\)" "$1: ${tool%% *} warns of what contradicts"
		case $tool in ct-convert) want=v.nii ;; *) want=want.nii ;; esac
		for k in o.nii $want; do ct-info $k | grep -v '^file\|hash\|history\|^  '; done | sort | uniq -u >differs
		[ ! -s differs ]; ok $? "$1: ${tool%% *} uses the sform"; sed 's/^/# /' differs
	done
	ct-info "$1.nii" >info; has info 'nifti.doubt' "$1: ct-info shows nifti.doubt"
	exits 0 "$1: the output of ct-convert is converted again" ct-convert o.nii again.nii
	[ ! -s err ]
	ok $? "$1: the output of ct-convert does not contradict itself"
	rm -f again.nii
}
told shifted 'qform and sform are up to 9[0-9.]* mm apart; the sform is used$\|qform and sform are up to 1[0-9.]* mm apart; the sform is used$'
told long 'pixdim\[2\] is 100, but voxels are 3 long in the sform, which is used$'
told none 'pixdim\[1\] is 0, but'; told nan 'pixdim\[1\] is -\{0,1\}nan, but'; told minus 'pixdim\[1\] is -1, but'
told turned 'qform and sform are up to'
cat v.nii v.nii >more.nii; told more '[0-9]* more bytes follow 8x9x10 voxels$'
edit mirrored 76 "$minus"
for tool in 'ct-convert' 'ct-upsample -m linear -x 2' 'ct-sr -x 2 -Q draft'; do
	exits 5 "${tool%% *} refuses a qform that mirrors the sform" $tool mirrored.nii no.nii
	has err 'mirrored.nii: qform and sform are mirror images' 'the error of mirror images names qform and sform'
done
edit other 252 '\002'
exits 0 'a qform of another space is accepted' ct-convert -f other.nii o.nii
[ ! -s err ]
ok $? 'a qform of another space gives no warning'
cp other.nii v2.nii; printf "$hundred" | dd of=v2.nii bs=1 seek=268 conv=notrunc 2>/dev/null
exits 0 'a qform of another space that lies elsewhere is accepted' ct-convert -f v2.nii o.nii
[ ! -s err ]
ok $? 'a qform of another space that lies elsewhere gives no warning'
edit slope 112 "$inf"
exits 3 'a slope of infinity is refused with status 3' ct-convert slope.nii no.nii
has err 'slope.nii: scl_slope is inf' 'the error of a slope of infinity names scl_slope'
edit inter 116 "$inf"; exits 3 'an intercept of infinity is refused with status 3' ct-convert inter.nii no.nii
edit unset 112 "$nan"; exits 0 'a slope of NaN is read as no slope' ct-convert -f unset.nii o.nii
[ ! -e no.nii ]; ok $? 'refused NIfTI headers leave no output'
done_testing
