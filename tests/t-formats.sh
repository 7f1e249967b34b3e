#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Files beside other programs, and headers that contradict themselves.
. "$srcdir/tests/tap.sh"

# A PLY of Gaussians read by a few lines of Python that know PLY and nothing of ours.
"$builddir/tests/t-ply" g.ply; ok $? 'a file to look at'
head -n 2 g.ply | tail -n 1 | grep -q '^format binary_little_endian 1.0$'; ok $? 'PLY is written binary and little-endian'
if command -v python3 >/dev/null; then
	cat >look.py <<'END'
import math, struct
head, body = open("g.ply", "rb").read().split(b"end_header\n", 1)
lines = head.decode().split("\n")
n = next(int(l.split()[2]) for l in lines if l.startswith("element vertex "))
names = [l.split()[2] for l in lines if l.startswith("property float ")]
want = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"] + \
	["scale_%d" % i for i in range(3)] + ["rot_%d" % i for i in range(4)] + ["density"]
assert names == want, names
assert len(body) == n * 4 * len(names), (len(body), n)
rows = [dict(zip(names, r)) for r in struct.iter_unpack("<%df" % len(names), body)]
gamma = next(float(l.split("=")[1]) for l in lines if l.startswith("comment ct:gamma="))
assert "comment ct:units=mm" in lines and "comment ct:activation=prelu" in lines
rho = [r["density"] if r["density"] > 0 else gamma * r["density"] for r in rows]
most = max(map(abs, rho))
for r, v in zip(rows, rho):
	p = min(max(abs(v) / most, 0.001), 0.999)
	assert abs(r["opacity"] - math.log(p / (1 - p))) < 1e-3, (r, v)
	shown = [0.5 + r["f_dc_%d" % k] / (2 * math.sqrt(math.pi)) for k in range(3)]
	colour = (0.98, 0.62, 0.25) if v >= 0 else (0.25, 0.55, 0.98)
	assert max(abs(a - b) for a, b in zip(shown, colour)) < 1e-5, (shown, v)
	red, blue = (0.5 + 0.28209479 * r[k] for k in ("f_dc_0", "f_dc_2"))
	assert 0 <= min(red, blue) and max(red, blue) <= 1 and (red > blue) == (v >= 0), r
	assert r["nx"] == r["ny"] == r["nz"] == 0
END
	python3 look.py 2>err; ok $? 'a 3DGS viewer finds its properties, colours and opacities'
	sed 's/^/# /' err
else
	skip 'a 3DGS viewer finds its properties' 'no python3'
fi

# EXR stacks seen by other programs: OpenEXR's exrheader, OpenImageIO's oiiotool.
part exr-tools
make_stack() { # a stack of 4 views of 48x40 through the library: t-exr leaves its own on request
	"$builddir/tests/t-exr" keep s.exr >/dev/null
}
make_stack; [ -s s.exr ]; ok $? 'the library writes a stack for this test'
# exrheader of OpenEXR
if command -v exrheader >/dev/null; then
	exrheader s.exr >header
	[ "$(grep -c '^ *part ' header)" -eq 4 ]; ok $? 'exrheader shows one part for each view'
	has header 'name (type string): "view.0003"' 'exrheader shows the name of a view'
	has header 'ct:beam (type string): "cone"' 'exrheader shows the beam as ct:beam'
	has header 'compression (type compression): zip, multi-scanline' 'exrheader shows that a part is compressed with ZIP'
	has header 'Y, 32-bit floating-point' 'exrheader shows the channel Y as float'
	has header 'ct:quantity (type string): "lineIntegral"' 'exrheader shows the quantity as ct:quantity'
else
	skip 'exrheader shows the attributes of a stack' 'no exrheader'
fi
# oiiotool of OpenImageIO
if command -v oiiotool >/dev/null; then
	oiiotool -a --stats s.exr >stats 2>err; ok $? 'oiiotool decodes a stack of views'
	[ "$(grep -c 'Stats Avg' stats)" -eq 4 ]; ok $? 'oiiotool finds all four views'
	"$builddir/tests/t-exr" means s.exr >means
	sed -n 's/.*Stats Avg: \([-0-9.]*\).*/\1/p' stats | paste - means |
		awk '{d = $1 - $2; if (d < -2e-6 || d > 2e-6) bad = 1} END {exit bad || NR != 4}'
	ok $? 'oiiotool computes the means of the views that the library computes'
	oiiotool -a s.exr --compression zips -o t.exr; ok $? 'oiiotool rewrites a stack with ZIPS'
	"$builddir/tests/t-exr" same s.exr t.exr; ok $? 'geometry, metadata and pixels survive a rewrite by oiiotool'
	oiiotool -a s.exr -d half -o h.exr 2>/dev/null
	"$builddir/tests/t-exr" means h.exr >/dev/null; ok $? 'the library reads a stack of HALF pixels'
	oiiotool --pattern constant:color=1 8x8 1 -d float -o plain.exr 2>/dev/null
	"$builddir/tests/t-exr" means plain.exr 2>err
	[ $? -eq 3 ] && grep -q 'no attribute ct:' err; ok $? 'a picture without geometry is refused with status 3'
else
	skip 'oiiotool decodes a stack of views' 'no oiiotool'
fi

# A NIfTI header that contradicts itself: the sform is used and the rest is told; a mirrored one is refused.
part nifti-doubt
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
