#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The window from HU to density and back: what is composed is what was fitted, beyond its ends too.
. "$srcdir/tests/tap.sh"
inside() { ct-metrics -w -512:1000 t.nii "$1" | sed -n 's/^psnr //p'; }
above() { awk "BEGIN {exit !($1 > $2)}"; } # above A B
ball() { # ball FILE OUTSIDE:ONE DENSITY: no metadata, so that it is projected in any window
	ct-phantom -f --size=24x24x24 --spacing=2 --window=$2 --expert density=$3 sphere with.nii &&
		tail -c $((24 * 24 * 24 * 4)) with.nii >bare.raw &&
		ct-convert -f --units hu --raw 24x24x24:f32:2 --orient=RAS bare.raw "$1"
}
project() { ct-project -f -q -w -512:1000 --views 20 "$@"; }
beyond() { # beyond NAME: the truth t.nii, the base b.nii
	project t.nii t.exr && project b.nii b.exr
	exits 0 "$1: fits" ct-nabgs -f -b b.nii -n 300 -g 2000 t.exr r.ply
	exits 0 'ct-compose writes --residual-out of a window' ct-compose -f --residual-out=r.nii b.nii r.ply c.nii
	above "$(inside c.nii)" "$(inside b.nii) + 6"; ok $? 'to what was fitted'
	cp err warn; rm r.nii
}

# A nodule in a lung that the window cuts off.
ball t.nii -850:150 0.55 && ball b.nii -850:150 0.0001
beyond 'below'
has warn 'b.nii: [0-9]* voxels are below -512 HU, down to -850, and become -512' 'a cut below, as of air, is told'
ct-compose -f --floor=-2000 -g 0 b.nii r.ply low.nii
ct-info low.nii >info; grep -q '^min *-850' info; ok $? 'a floor below the window keeps what is there'
ct-compose -f -g 0 b.nii r.ply low.nii
ct-info low.nii >info; grep -q '^max *-512' info; ok $? 'else it ends at the window'

# Metal that is none.
ball t.nii 0:1000 0.7 && ball b.nii 0:2000 0.8
beyond 'above'
has warn 'b.nii: [0-9]* voxels are above 1000 HU, up to 1600' 'a warning says what was cut'
ct-project -f -w -512:1000 -n 2 b.nii p.exr 2>warn
has warn 'b.nii: [0-9]* voxels are above 1000 HU' 'as it does where they are projected'
ct-project -f -w -512:1600 -n 2 b.nii p.exr 2>warn && [ ! -s warn ]; ok $? 'in a wider window none'

# ct-fuse composes likewise.
ct-degrade -f -x 2 t.nii lr.nii
exits 0 'ct-fuse writes --residual-out of a window' ct-fuse -f --residual-out=r.nii b.nii lr.nii t.exr f.nii
has err 'above 1000 HU, up to 1600' 'ct-fuse warns of values above the window'
ct-compose -f -q b.nii r.nii same.nii && [ "$(ct-metrics f.nii same.nii | sed -n 's/^psnr //p')" = inf ]
ok $? 'to what ct-compose makes of its residual'
exits 3 'a residual is no base' ct-compose r.nii r.ply no.nii
has err 'r.nii: quantity is residual, not hu' 'and that is said'
done_testing
