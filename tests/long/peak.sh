#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# peak.sh [TRIES [COMMAND]]: TRIES (20) random runs of the commands that take --memory, or of COMMAND alone:
# sizes, factors, methods, threads, .nii, .nii.gz or a pipe, and a bound from the least that the command
# says it takes on. No process may hold more than the bound and 64 MiB. SEED=2 is another choice. What each
# run held stands before the table. Then, what --dry-run says that ct-sr takes, beside what it took, TRIES / 5 times.
. "$(dirname "$0")/lib.sh"
tries=${1:-20} only=${2:-}
command -v python3 >/dev/null || { echo "$part: no python3" >&2; exit 99; }
cat >peak.py <<'END_'
import resource, subprocess, sys
rc = subprocess.call(['/bin/sh', '-c', sys.argv[1]])
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024, file=open('peak', 'w'))
sys.exit(rc)
END_
among() { # among WORDS...: sets W to one of them
	random $#
	shift $R
	W=$1
}
# small SIZES...: a volume to be refined $x times, to one of these, $v
small() {
	among "$@"; size=$W
	among 2 3 4; x=$W
	among P1 P2 P3; v=s$size-$x$W
	[ -e $v.nii ] || ct-phantom -q --size $size ellipsoids - | ct-degrade -q -x $x -p $W - $v.nii
}
sizes='128x144x136 168x160x192 192x192x192'
# line TOOL: the words of a run on $in, to $out
line() {
	in=IN out=OUT.nii
	case $1 in
	ct-upsample)
		small $sizes; among tv htv dc bspline prior
		case $W in ?tv|tv|prior) set -- "$1" --iterations 4 --tolerance 0; esac
		line="$* -m $W $in $out" ;;
	ct-sr) small 96x112x104 128x144x136; among draft fast; line="$1 -x $x -Q $W $in $out" ;;
	esac
}
# form: IN and OUT of the line by name, compressed, or through a pipe
form() {
	line=$line\ -q\ -t\ $threads\ --memory\ SIZE
	among "$v.nii" "$v.nii.gz" -
	case $line in ct-sr*) [ "$W" != - ] || W=$v.nii ;; esac
	case $W in *.gz) [ -e "$W" ] || gzip -1 -k "$v.nii" ;; -) line="$line <$v.nii" ;; esac
	line=$(echo "$line" | sed "s| IN | $W |")
	among out.nii out.nii.gz -
	case $line in
	ct-sr*) [ "$W" != - ] || W=out.nii ;;
	esac
	line=$(echo "$line" | sed "s| OUT[.a-z]* | $W |")
	[ "$W" != - ] || line="$line >out.nii"
}
held() { # held MIB: the line with so much memory
	rm -f out.*
	timeout 900 python3 peak.py "$(echo "$line" | sed "s/--memory SIZE/--memory $1M/")" >told 2>err
	got=$?
}
more() { size=$(sed -n 's/.*: takes \([0-9]*\) MiB of memory.*/\1/p' err); } # more: what the line takes, if that was too little
one() { # one TOOL
	line $1
	among 1 2 4; threads=$W
	form
	held 1; more
	random 60; size=$((${size:-0} + R))
	held $size
	while [ $got -eq 7 ] && grep -q ': takes [0-9]* MiB of memory' err; do more; held "$size"; done
	peak=$(cat peak)
	[ $got -eq 0 ] && [ "$peak" -le $((size + 64)) ]
	tally $? "held $peak MiB of $size, status $got: $line"
	echo "# $peak MiB held, --memory ${size}M, $((size + 64 - peak)) to spare: $line" >>held
}
tools=${only:-ct-upsample ct-sr}
row 'random bounds of memory'
k=0
while [ $k -lt "$tries" ]; do
	for tool in $tools; do
		[ $k -lt "$tries" ] || break
		one $tool
		k=$((k + 1))
	done
done
sort -t, -k3.1n held
echo "# least: $(sed 's/.*M, \([-0-9]*\) to spare.*/\1/' held | sort -n | head -n 1) MiB to spare"
if [ -z "$only" ] || [ "$only" = ct-sr ]; then
	row 'seconds told and taken'
	k=0
	while [ $((k * 5)) -lt "$tries" ]; do
		small 72x72x72 96x88x80 112x96x104; among draft fast balanced; q=$W
		line="ct-sr -t 1 -x $x -Q $q $v.nii"
		told=$($line o.nii --dry-run --json | sed -n 's/^  "seconds": \([^,]*\),*$/\1/p')
		/usr/bin/time -o took -f '%U + %S' $line -q -f o.nii 2>err
		awk "BEGIN {took = $(cat took); exit !($told < 1.7 * took && $told > .6 * took)}"
		tally $? "$told s told, $(cat took) s taken: $line"
		k=$((k + 1))
	done
fi
finish
