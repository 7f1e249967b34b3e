#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What a command tells while it works.
. "$srcdir/tests/tap.sh"

# What -v tells is so: sizes, ranges, blur, iterations and how far they came.
ct-phantom -q --size 20x24x28 --spacing 4,3,2 ellipsoids a.nii || exit 99
tells() { # tells LINE COMMAND...: it is among what is told
	line=$1; shift
	"$@" -f -v >out 2>err; status=$?
	sed -i 's/, [0-9.]* s$/, TIME/' err
	[ $status -eq 0 ] && grep -qxF -- "$1: $line" err; ok $? "$*: $line"
	grep -qxF -- "$1: $line" err || sed 's/^/# /' err
}
quiet() { "$@" -f 2>err && [ ! -s err ]; ok $? "without -v nothing: $*"; }
most=$(ct-info a.nii | sed -n 's/^max *//p' | awk '{printf "%g", $1}')
tells "20x24x28 voxels of 4x3x2 mm, -1024 to $most HU" ct-convert a.nii b.nii
quiet ct-convert a.nii b.nii
tells '20x24x28 to 10x8x28, sigma 0.849329,1.27399,0' ct-degrade -x 2,3,1 a.nii c.nii
tells '5 views of 16x12, cone beam' ct-project -n 5 --det 16x12 a.nii p.exr
tells '5 views of 4x3, parallel beam' ct-project -n 5 --det 16x12 --beam parallel --coarsen 4 a.nii q.exr
ct-project -q -f -n 30 --arc 360 --det 16x12 a.nii p.exr
tells 'filter to 1 of the Nyquist frequency' ct-fdk p.exr f.nii
! grep -q 'do not see' err; ok $? 'all views see it'
tells 'filter to 0.25 of the Nyquist frequency' ct-fdk --expert cutoff=0.25 p.exr f.nii
quiet ct-fdk p.exr f.nii
ct-project -q -f -n 30 --arc 360 --det 8 --expert pitch=4 a.nii near.exr
tells '30 of 30 views do not see the whole grid' ct-fdk near.exr f.nii
ct-project -q -f -n 30 --arc 190 --det 16x12 a.nii short.exr
tells 'warning: a short scan of 190 degrees: rays seen twice count twice (--parker weighs them)' ct-fdk short.exr f.nii
ct-project -q -f -n 30 --arc 220 --det 16x12 a.nii short.exr
ct-fdk -f -v --parker short.exr f.nii 2>err; ! grep -q 'short scan' err; ok $? 'a short scan with --parker is not warned of'

# iterations: so many by default, and the residual is that of what is written
for m in cgls=30 sirt=100 tv=100; do
	ct-fdk -f -v -m ${m%=*} --grid 6 p.exr f.nii 2>err
	grep -q "^ct-fdk: ${m#*=} iterations, residual " err; ok $? "$m iterations of its own"
done
if command -v python3 >/dev/null; then
	cp "$srcdir/tests/exr.py" .
	for m in 'cgls -n 3' 'cgls -n 3 --expert projector=joseph' 'sirt --expert tolerance=0.2'; do
		# shellcheck disable=SC2086
		ct-fdk -f -v -m $m --quantity density p.exr d.nii 2>err
		by=siddon; case $m in *joseph) by=joseph ;; esac
		ct-project -q -f -m $by --like p.exr d.nii again.exr
		python3 - "$m" >log 2>&1 <<-'EOP'
			import math, re, sys
			from exr import read
			a, b = sum(read('again.exr'), []), sum(read('p.exr'), [])
			n, said = re.search(r': (\d+) iterations, residual ([0-9.]+)\n$', open('err').read()).groups()
			is_ = math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)) / sum(y * y for y in b))
			print(n, said, is_)
			assert abs(is_ - float(said)) < 2e-5
			words = sys.argv[1].split()
			assert n == words[2] if '-n' in words else is_ < 0.2 and 1 < int(n) < 100
		EOP
		ok $? "ct-fdk -m $m: the residual ($(cat log))"
	done
else
	skip 'residuals' 'no python3'
fi
ct-degrade -q -f -x 4,3,2 a.nii lr.nii
tells '5x8x14 to 20x24x28, linear, TIME' ct-upsample -m linear lr.nii up.nii

# What stands on a terminal while a command works: neither how far it is nor the time left runs backwards.
part terminal
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
