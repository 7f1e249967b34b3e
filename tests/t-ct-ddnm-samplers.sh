#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-ddnm: every sampler alike: threads, travel, samples, a start, what it costs, interruption, resuming.
. "$srcdir/tests/tap.sh"
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii && ct-degrade -q -x 4 hr.nii lr.nii &&
	ct-upsample -q lr.nii up.nii && ct-project -q --views 2 up.nii up.exr &&
	ct-project -q --views 2 --coarsen 4 --pixel mean up.nii y.exr &&
	ct-project -q --views 8 --coarsen 4 --pixel mean up.nii many.exr
ok $? 'projections, fine and coarse'

calls() { ct-ddnm --dry-run "$@" y.exr no.exr | sed -n 's/^work *//p' | sed 's/of [0-9.]* s //g'; }
on='of the network of 32x32'
# What a sampler is asked for, of 2 views of y.exr, and what that costs.
: >results
while IFS='|' read -r options cost; do
	set -f; set -- --sampler $options; set +f
	mkdir t1 t4 whole cut # the name of the output is in the history
	(cd t1 && ct-ddnm -q -t 1 "$@" --expert travel=2,2 --samples 2 ../y.exr a.exr); ok $? "$options"
	(cd t4 && ct-ddnm -q -t 4 "$@" --expert travel=2,2 --samples 2 ../y.exr a.exr)
	cmp -s t1/a.exr t4/a.exr; ok $? 'the same bytes on 4 threads, back in time, of two samples'
	ct-info t1/a.exr | sed '/history/d' | cksum >>results
	exits 0 'a sampler begins from a picture' ct-ddnm -q -f "$@" --init up.exr --expert t-start=20 y.exr near.exr
	got=$(calls "$@"); [ "$got" = "$cost" ]; ok $? "$got"
	(cd whole && ct-ddnm -q "$@" ../many.exr o.exr)
	cd cut || exit 99
	signalled 9 15 ct-ddnm -q -t 1 "$@" ../many.exr o.exr; s=$?
	[ $s -eq 75 ] && [ -s o.exr.state ] && [ ! -e o.exr ]; ok $? "SIGTERM stops it (status $s)"
	exits 3 'another sampler cannot resume' ct-ddnm -q --resume ../many.exr o.exr
	exits 0 'a stopped sampler resumes with --resume' ct-ddnm -q "$@" --resume ../many.exr o.exr
	cd .. && cmp -s whole/o.exr cut/o.exr; ok $? 'to the same bytes'
	rm -r t1 t4 whole cut
done <<EOF2
ddim -n 8 --expert eta=0.5|16 calls $on
ddpm -n 8|16 calls $on
dpm-solver++ -n 8|16 calls $on
gdp -n 8 --expert guidance=200|16 calls $on
bird -n 2 --expert iterations=4|16 calls $on, 12 of its derivative
bird -n 2 --expert iterations=4,gradient=chain|16 calls $on
EOF2
[ "$(sort -u results | wc -l)" -eq 6 ]; ok $? 'no two give the same'

# as published, where nothing is said
costs() { got=$(calls --sampler "$1"); [ "$got" = "$2" ]; ok $? "$1: $got"; }
for s in ddnm ddnm+ simple ddim ddpm dpm-solver++; do costs $s "100 calls $on"; done
costs gdp "2000 calls $on"
costs bird "2000 calls $on, 1980 of its derivative"
costs none '0 calls of a network'

# none: what it begins with, which is no matter of a prior or of a seed
exits 0 'the sampler none is taken' ct-ddnm -q --sampler none --init up.exr y.exr a.exr
exits 0 'none, on 4 threads' ct-ddnm -q -t 4 -s 3 --sampler none y.exr b.exr
exits 5 'an init of another geometry is refused' ct-ddnm -q --sampler none --init y.exr y.exr n.exr
if command -v python3 >/dev/null; then
	cp "$srcdir/tests/exr.py" .
	cat >look.py <<-'EOP'
		from exr import read
		y, up, a, b = map(read, ('y.exr', 'up.exr', 'a.exr', 'b.exr'))
		assert a == up
		at = lambda i, j: .125 * y[0][8 * i + j] + .875 * y[0][8 * i + j + 1]
		assert abs(b[0][10 * 32 + 13] - (.875 * at(2, 2) + .125 * at(3, 2))) < 1e-5 * max(y[0])
	EOP
	python3 look.py; ok $? 'is --init, or between the pixels of IN'
fi
done_testing
