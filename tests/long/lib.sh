# SPDX-License-Identifier: Apache-2.0
# lib.sh: what the parts of make check-long share; source it first. Each part is a script of its own:
#   builddir=BUILD sh tests/long/PART.sh [COUNT [COMMAND]]
# of the commands in BUILD, or else of those that are installed.
# It prints what failed, and last a line "row|PART|WHAT|TRIED|PASSED" a row of the table.
# shellcheck shell=sh disable=SC2034
unset MAKELEVEL # a command that make runs overwrites
part=$(basename "$0" .sh)
: "${srcdir:=$(cd "$(dirname "$0")/../.." && pwd)}"
srcdir=$(cd "$srcdir" && pwd)
[ -z "${builddir:-}" ] || PATH=$(cd "$builddir" && pwd):$PATH
command -v ct-sr >/dev/null || { echo "$0: no ct-sr; say builddir=FOLDER" >&2; exit 99; }
work=$(mktemp -d) && cd "$work" || exit 99
trap 'rm -rf "$work"' EXIT
trap 'exit 75' INT TERM HUP
bad_=0
# random N: sets R to a number from 0 to N - 1, the same sequence in every run
seed_=${SEED:-1}
random() {
	seed_=$(((seed_ * 1103515245 + 12345) & 2147483647))
	R=$((seed_ / 8 % $1))
}
row() { # row WHAT: begin one
	end_row
	what_=$1 tried_=0 passed_=0
}
tally() { # tally STATUS WORDS [N]: N tries, one if not said, that passed if STATUS is 0
	tried_=$((tried_ + ${3:-1}))
	if [ "$1" -eq 0 ]; then
		passed_=$((passed_ + ${3:-1}))
	else
		bad_=1
		echo "# $part: $what_: $2"
		[ ! -s err ] || sed 's/^/#   /' err | tail -n 4
	fi
}
end_row() {
	[ -n "${what_:-}" ] && echo "row|$part|$what_|$tried_|$passed_" >>"$work/rows"
	what_=
}
finish() {
	end_row
	cat "$work/rows"
	exit $bad_
}
now() { echo $(($(date +%s%N) / 1000000)); }
sleep_ms() { sleep "$(($1 / 1000)).$(printf %03d $(($1 % 1000)))"; }
# The hash of what a file says, not of its bytes: a history holds the names of files.
said() { ct-info "$1" 2>/dev/null | sed -n 's/^hash *//p' | grep .; }
content() { said "$1" || cksum <"$1"; }
# Small inputs of every command, in the present folder.
inputs() {
	# what cannot be saved in its place is kept there
	mkdir tmp && TMPDIR=$work/tmp && export TMPDIR
	ct-phantom -q -w -512:3071 --size 24x24x24 --spacing 4 marks hr.nii
	ct-phantom -q -w -512:3071 --size 24x24x24 --spacing 4 cube other.nii
	for v in hr other; do
		ct-degrade -q -x 2 $v.nii $v-lr.nii
		ct-degrade -q -x 4 $v.nii $v-lr4.nii
		ct-degrade -q -x 1,1,4 --decimate mean $v.nii $v-thick.nii
		ct-upsample -q -x 2 -m linear $v-lr.nii $v-up.nii
		ct-project -q -n 20 $v.nii $v.exr
		ct-project -q -n 12 --coarsen 4 $v.nii $v-low.exr
	done
	ct-nabgs -q -n 40 -g 200 --expert max-gaussians=200 -b hr-up.nii hr.exr residual.ply >/dev/null
	[ -s residual.ply ] || { echo "$part: the inputs could not be made" >&2; exit 99; }
}
# command NAME INPUT OUT: the words of a run, on the inputs hr or other, in $line
command_() {
	case $1 in
	ct-ddnm) line="ct-ddnm -q -t 2 -x 4 -n 4 $2-low.exr $3" ;;
	ct-nabgs) line="ct-nabgs -q -t 2 -b $2-up.nii -n 300 -g 300 --expert max-gaussians=300 --checkpoint-every 20 $2.exr $3" ;;
	ct-fuse) line="ct-fuse -q -t 2 -n 15 --checkpoint-every 1 $2-up.nii $2-lr.nii $2.exr $3" ;;
	ct-field) line="ct-field -q -t 2 -x 2 -b 400 --expert every=40 $2-lr.nii $3" ;;
	ct-train) line="ct-train -q -t 2 --arch model_channels=32,channel_mult=1 -p 8 --expert batch=2 -n 60 --checkpoint-every 10 $3 $2.exr" ;;
	ct-upsample) line="ct-upsample -m prior -q -t 2 -x 2 $2-lr.nii $3" ;;
	ct-sr) line="ct-sr -q -t 2 -x 4 --paper --expert views=8,iterations=50,gaussians=300 --keep $3.keep $2-lr4.nii $3" ;;
	esac
}
# Those that take longest; ct-upsample keeps no state, so it begins again; ct-sr knows by --keep.
lasting='ct-ddnm ct-nabgs ct-fuse ct-field ct-train ct-upsample ct-sr'
again_of() { case $1 in ct-upsample) echo --force ;; ct-sr) ;; *) echo --resume ;; esac; }
# every DO: "DO OUT COMMAND..." of every command, on the inputs, to the folder out or to "stdout"
every() {
	mkdir out
	"$1" out/o.nii ct-phantom -q -t 2 --size 24x24x24 cube out/o.nii
	"$1" out/o.nii ct-convert -q -t 2 --type f32 hr.nii out/o.nii
	"$1" out/o.dcm ct-convert -q -t 2 hr.nii out/o.dcm
	"$1" out/o.nii ct-degrade -q -t 2 -x 2 hr.nii out/o.nii
	"$1" out/o.nii ct-upsample -q -t 2 -x 2 hr-lr.nii out/o.nii
	"$1" out/o.exr ct-project -q -t 2 -n 6 hr.nii out/o.exr
	"$1" out/o.nii ct-fdk -q -t 2 hr.exr out/o.nii
	"$1" out/o.nii ct-compose -q -t 2 hr-up.nii residual.ply out/o.nii
	"$1" out/o.nii ct-metrics -q -t 2 --consistency hr-lr.nii --map out/o.nii hr.nii
	"$1" out/o.exr ct-ddnm -q -t 2 -x 4 -n 2 hr-low.exr out/o.exr
	"$1" out/o.ply ct-nabgs -q -t 2 -b hr-up.nii -n 40 -g 200 --expert max-gaussians=200 hr.exr out/o.ply
	"$1" out/o.nii ct-fuse -q -t 2 -n 4 hr-up.nii hr-lr.nii hr.exr out/o.nii
	"$1" out/o.nii ct-field -q -t 2 -x 2 -b 20 hr-lr.nii out/o.nii
	"$1" out/o.txt ct-profile -q -t 2 hr-thick.nii hr.nii out/o.txt
	"$1" out/o.safetensors ct-train -q -t 2 --arch model_channels=32,channel_mult=1 -p 8 --expert batch=2 -n 3 out/o.safetensors hr.exr
	"$1" out/o.nii ct-upsample -m prior -q -t 2 -x 2 hr-lr.nii out/o.nii
	"$1" out/s.nii ct-upsample -m prior -q -t 2 -x 2 --std out/s.nii hr-lr.nii out/o.nii
	"$1" out/o.nii ct-sr -q -t 2 -x 2 hr-lr.nii out/o.nii
	"$1" out/o.nii ct-sr -q -t 2 -x 4 --paper --expert views=2,iterations=2,gaussians=20 hr-lr4.nii out/o.nii
	"$1" out/o.html ct-report -q -t 2 hr-lr.nii hr-up.nii out/o.html
	"$1" stdout ct-info --json hr.nii
	if command -v ct-view >/dev/null; then "$1" out/o.png ct-view -q -t 2 hr.nii out/o.png; fi
}
