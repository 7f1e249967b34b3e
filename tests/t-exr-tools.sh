#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# EXR stacks seen by other programs: OpenEXR's exrheader, OpenImageIO's oiiotool.
. "$srcdir/tests/tap.sh"
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
done_testing
