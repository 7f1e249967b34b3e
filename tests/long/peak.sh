#!/bin/sh
# peak.sh [TRIES [COMMAND]]: TRIES (20) random runs of the commands that take --memory, or of COMMAND alone:
# sizes, factors, methods, threads, .nii, .nii.gz or a pipe, and a bound from the least that the command
# says it takes on. No process may hold more than the bound and 64 MiB. SEED=2 is another choice. What each
# run held stands before the table.
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
# large: a volume of up to 118 MB, $v, and what is compared with it, in the present folder; once for each size
large() {
	among 224x256x240 288x304x272 320x288x320; v=l$W
	[ -e $v.nii ] || {
		ct-phantom -q --size "$W" ellipsoids $v.nii
		ct-degrade -q -x 4 $v.nii $v-lr.nii
		ct-degrade -q -x 4 -p P3 $v.nii $v-points.nii
		ct-upsample -q -m cubic $v-lr.nii $v-up.nii
		ct-project -q -n 12 --det 64 $v.nii $v.exr
		ct-nabgs -q -n 3 -g 300 --max-gaussians 300 -b $v-up.nii $v.exr $v.ply >/dev/null
	}
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
		small $sizes; among tv htv dc bspline
		case $W in ?tv|tv) set -- "$1" --iterations 4 --tolerance 0; esac
		line="$* -m $W $in $out" ;;
	ct-restore) small $sizes; line="$1 --iterations 4 $in $out" ;;
	ct-sr) small 96x112x104 128x144x136; among draft fast; line="$1 -x $x -Q $W $in $out" ;;
	ct-degrade) large; among '-x 4' '-x 2.5 -p P3' '-x 1,1,3 --decimate mean' '-x 1 --sigma 1,0,0 --noise 4'; line="$1 $W $in $out" ;;
	ct-convert) large; among '' '--reorient SAL' '--reorient ASR' '--crop auto' '--iso 2.2' '--cube 256' '--type i16'; line="$1 $W $in $out" ;;
	ct-compose) large; among "--consistent $v-lr.nii" '--spacing 2.2' ''; line="$1 $W $in $v.ply $out" ;;
	ct-project)
		large; out=OUT.exr; among '' '--photons 1e5 --coarsen 2 --pixel mean' '--rotate 9,5,2 -m joseph' '--beam fan'
		line="$1 -n 4 --det 128 $W $in $out" ;;
	ct-metrics)
		large; out=; among '' '--structures --psnr' '--harm --psnr' "--mask $v.nii --per-slice s.csv" '--edges --ssim all' "--consistency $v-lr.nii"
		line="$1 -f $W $in $v-up.nii" ;;
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
	*OUT.exr*) W=out.exr ;;
	esac
	line=$(echo "$line" | sed "s| OUT[.a-z]* | $W |")
	[ "$W" != - ] || line="$line >out.nii"
}
held() { # held MIB: the line with so much memory
	rm -f out.*
	timeout 900 python3 peak.py "$(echo "$line" | sed "s/--memory SIZE/--memory $1M/")" >told 2>err
	got=$?
}
more() { size=$(sed -n 's/.*: this takes \([0-9]*\)M$/\1/p' err); } # more: what the line takes, if that was too little
one() { # one TOOL
	line $1
	among 1 2 4; threads=$W
	form
	held 1; more
	random 60; size=$((${size:-0} + R))
	held $size
	while [ $got -eq 7 ] && grep -q ': this takes ' err; do more; held "$size"; done # another stage of ct-sr
	peak=$(cat peak)
	[ $got -eq 0 ] && [ "$peak" -le $((size + 64)) ]
	tally $? "held $peak MiB of $size, status $got: $line"
	echo "# $peak MiB held, --memory ${size}M, $((size + 64 - peak)) to spare: $line" >>held
}
tools=${only:-ct-upsample ct-restore ct-sr ct-degrade ct-convert ct-compose ct-project ct-metrics}
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
finish
