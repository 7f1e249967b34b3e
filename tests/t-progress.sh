#!/bin/sh
# What stands on a terminal while a command works: neither how far it is nor the time left runs backwards.
. "$srcdir/tests/tap.sh"
terminal || { skip 'progress on a terminal' 'no python3, or no terminal'; done_testing; }
# runs NAME SLOW COMMAND...: as on a terminal of a machine that is so many times slower, into shown
runs() {
	name=$1; slow=$2; shift 2
	python3 "$srcdir/tests/term.py" --slow "$slow" "$@" >shown; ok $? "$name runs"
	sed 's/^/# /' shown
	# work, done and seconds of each line: within a work the one never falls, the other never rises
	sed -E 's/^(ct-[a-z]*: [a-z]+) ([0-9]+) of [0-9]+, /\1\2/' shown | sed -nE 's/^ct-[a-z]*: ([a-z0-9]+) ([0-9]+)( of at most |\/)([0-9]+)(.* ([0-9]+):([0-9]+) left)?$/\1 \2 \4 \6 \7/p' |
		awk '$1 != work {work = $1; done = -1; left = 1e9; of = $3}
			{if ($2 < done || $3 != of || $2 >= $3) bad = 1; done = $2}
			NF == 5 {s = 60 * $4 + $5; if (s > left) bad = 1; left = s}
			END {exit bad || NR < 2}'
	ok $? "$name: it goes one way"
}
ct-phantom -q --size 96x96x96 shepp-logan t.nii
ct-degrade -q -x 4 --sigma .5 --decimate point t.nii alias.nii
ct-degrade -q -x 4 t.nii scan.nii
runs 'a loop that ends where it may' 12 ct-upsample -t 1 -x 4 --tolerance .4 scan.nii one.nii
grep -q 'iterations 0 of at most 300$' shown && ! grep -q '/300' shown; ok $? 'at most so many iterations'
[ "$(grep -c '300 of' shown)" -eq 0 ]; ok $? 'never the last one that it did not come to'
runs 'one that takes them all' 12 ct-upsample -t 1 -x 4 --iterations 60 --tolerance 0 alias.nii two.nii
has shown '^ct-upsample: iterations 0/60$' 'no other end, so many iterations'
runs 'several works' 2 ct-sr -t 1 -x 4 alias.nii three.nii
has shown '^ct-sr: pass 1 of 2, slices [0-9]*/288, 0:[0-9]* left$' 'others say how much is left'
ct-upsample -x 4 scan.nii four.nii 2>err; [ ! -s err ]; ok $? 'nothing in a pipe'
python3 "$srcdir/tests/term.py" ct-upsample -q -x 4 scan.nii five.nii >shown
[ ! -s shown ]; ok $? 'no progress is shown with -q'
done_testing
