#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# One plane as a stack of one view, of grey values or of line integrals.
. "$srcdir/tests/tap.sh"
awk 'BEGIN {for (i = 0; i < 192; i++) printf "%c", 1 + i % 100}' >g.raw
raw() { ct-convert -f --raw 16x12x1:u8:0.2,0.3,1 "$@"; }
exits 0 'ct-convert makes line integrals of a plane' raw --rescale 0.5,1 --radiograph integral g.raw i.exr
exits 0 'ct-info reads a radiograph of line integrals' ct-info i.exr
has out '16x12' 'a radiograph has the columns and rows of its plane'
has out 'lineIntegral' 'a radiograph of integrals records the quantity lineIntegral'
exits 0 'ct-convert makes grey values of a plane' raw --rescale 0.01 --radiograph intensity --orient RIP g.raw g.exr
ct-info g.exr >out; has out 'intensity' 'a radiograph of grey values records the quantity intensity'
exits 3 'grey values above 1 are refused with status 3' raw --rescale 0.02 --radiograph intensity g.raw o.exr
has err 'g.raw: --radiograph: pixel 2,3 is 1.02, no grey value from 0 to 1' 'the error of a grey value above 1 gives pixel and value'
exits 5 'a volume of two planes is refused with status 5' ct-convert --raw 16x6x2:u8:1 --radiograph integral g.raw o.exr
has err 'g.raw: --radiograph: has 2 planes, not one' 'the error of a volume of two planes gives their number'
exits 2 '--radiograph with a volume as output is refused with status 2' raw --radiograph integral g.raw o.nii
[ ! -e o.exr ]; ok $? 'refused radiographs leave no output'
raw --rescale 0.01 g.raw g.mha
exits 0 '--radiograph accepts a plane of MetaImage' ct-convert --radiograph intensity g.mha m.exr
exits 0 'ct-ddnm refines a radiograph of grey values' ct-ddnm -q -x 2 -n 1 g.exr d.exr
exits 0 'ct-ddnm refines a radiograph into a PNG picture' ct-ddnm -q -x 2 -n 1 g.exr d.png
if pictures; then
	exits 0 '--radiograph accepts a PNG picture' ct-convert --radiograph intensity d.png o.exr
	exits 0 'ct-ddnm refines its own PNG picture' ct-ddnm -q -x 2 -n 1 d.png dd.png
fi
if command -v python3 >/dev/null; then
	cat >check.py <<-'END'
		import sys
		sys.path.insert(0, sys.argv[1])
		import exr
		assert exr.read('i.exr') == [[1 + .5 * (1 + i % 100) for i in range(192)]]
		for name, u, v, source in (('i.exr', (-.2, 0, 0), (0, -.3, 0), (0, 0, -1000)),
		                           ('g.exr', (.2, 0, 0), (0, 0, -.3), (0, -1000, 0)),
		                           ('m.exr', (-.2, 0, 0), (0, -.3, 0), (0, 0, -1000))):
		    had = exr.header(open(name, 'rb').read(), 8)[0]
		    for key, want in (('U', u), ('V', v), ('Centre', (0, 0, 0))):
		        assert [float(x) for x in had['ct:det' + key].split(b',')] == list(want), (name, key)
		    assert [float(x) for x in had['ct:source'].split(b',')] == list(source), name
		    assert had['ct:beam'] == b'parallel'
	END
	exits 0 'pixels lie row after row where the plane lies' python3 check.py "$srcdir/tests"
else
	skip 'pixels lie row after row where the plane lies' 'no python3'
fi
done_testing
