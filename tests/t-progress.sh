#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What stands on a terminal while a command works: neither how far it is nor the time left runs backwards.
. "$srcdir/tests/tap.sh"
terminal || { skip 'progress on a terminal' 'no python3, or no terminal'; done_testing; }
# runs NAME SLOW COMMAND...: as on a terminal of a machine that is so many times slower, into shown
runs() {
	name=$1; slow=$2; shift 2
	python3 "$srcdir/tests/term.py" --slow "$slow" "$@" >shown; ok $? "$name runs"
	sed 's/^/# /' shown
	# percentage and seconds of each line: the one never falls, the other never rises
	sed -nE 's/^ct-[a-z]*: ([0-9]+) %(, about ([0-9]+):([0-9]+) left)?$/\1 \3 \4/p' shown |
		awk 'BEGIN {left = 1e9} $1 < done || $1 > 99 {bad = 1} {done = $1}
			NF == 3 {s = 60 * $2 + $3; if (s > left) bad = 1; left = s}
			END {exit bad || NR < 2}'
	ok $? "$name: the percentage never falls and the time never rises"
	! grep '^ct-' shown | grep -qvE '^ct-[a-z]*: ([0-9]+ %|assumed: |noise: |[0-9]+x)'; ok $? "$name: no stage is named"
}
ct-phantom -q --size 96x96x96 shepp-logan t.nii
ct-degrade -q -x 4 --sigma .5 --decimate point t.nii alias.nii
ct-degrade -q -x 4 t.nii scan.nii
runs 'a loop that ends where it may' 12 ct-upsample -t 1 -x 4 --tolerance .4 scan.nii one.nii
runs 'one that takes them all' 12 ct-upsample -t 1 -x 4 --iterations 60 --tolerance 0 alias.nii two.nii
runs 'several works' 2 ct-sr -t 1 -x 4 alias.nii three.nii
has shown '^ct-sr: [0-9]* %, about 0:[0-9]* left$' 'several works say how much of the whole is left'
runs 'a run with rehearsals and a page' 2 ct-sr -t 1 --confidence e.nii --report r.html scan.nii six.nii
ct-upsample -x 4 scan.nii four.nii 2>err; [ ! -s err ]; ok $? 'nothing in a pipe'
python3 "$srcdir/tests/term.py" ct-upsample -q -x 4 scan.nii five.nii >shown
[ ! -s shown ]; ok $? 'no progress is shown with -q'
done_testing
