#!/bin/sh
# EXR stacks seen by other programs: OpenEXR's exrheader, OpenImageIO's oiiotool.
. "$srcdir/tests/tap.sh"
make_stack() { # a stack of 4 views of 48x40 through the library: t-exr leaves its own on request
	"$builddir/tests/t-exr" keep s.exr >/dev/null
}
make_stack; [ -s s.exr ]; ok $? 'a stack to look at'
if command -v exrheader >/dev/null; then
	exrheader s.exr >header
	[ "$(grep -c '^ *part ' header)" -eq 4 ]; ok $? 'exrheader sees a part a view'
	has header 'name (type string): "view.0003"' 'with its name'
	has header 'ct:beam (type string): "cone"' 'with its beam'
	has header 'compression (type compression): zip, multi-scanline' 'in ZIP'
	has header 'Y, 32-bit floating-point' 'channel Y'
	has header 'ct:quantity (type string): "lineIntegral"' 'and the quantity'
else
	skip 'exrheader' 'no exrheader'
fi
if command -v oiiotool >/dev/null; then
	oiiotool -a --stats s.exr >stats 2>err; ok $? 'oiiotool decodes it'
	[ "$(grep -c 'Stats Avg' stats)" -eq 4 ]; ok $? 'all views'
	"$builddir/tests/t-exr" means s.exr >means
	sed -n 's/.*Stats Avg: \([-0-9.]*\).*/\1/p' stats | paste - means |
		awk '{d = $1 - $2; if (d < -2e-6 || d > 2e-6) bad = 1} END {exit bad || NR != 4}'
	ok $? 'with our means'
	oiiotool -a s.exr --compression zips -o t.exr; ok $? 'oiiotool rewrites it'
	"$builddir/tests/t-exr" same s.exr t.exr; ok $? 'and geometry, metadata and pixels stay'
	oiiotool -a s.exr -d half -o h.exr 2>/dev/null
	"$builddir/tests/t-exr" means h.exr >/dev/null; ok $? 'a HALF file is read'
	oiiotool --pattern constant:color=1 8x8 1 -d float -o plain.exr 2>/dev/null
	"$builddir/tests/t-exr" means plain.exr 2>err
	[ $? -eq 3 ] && grep -q 'no attribute ct:' err; ok $? 'a picture without geometry is refused'
else
	skip 'oiiotool' 'no oiiotool'
fi
done_testing
