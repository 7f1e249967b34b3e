#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# io-faults.sh [COUNT [COMMAND]]: the calls on files fail within every command (tests/long/io-fault.c), COUNT (2000) times in
# all: open, read, write, sync, rename, link, mkdir, unlink and close, with EIO, ENOSPC, EINTR, or they are short; once, or from
# there on. Over an older output (--force): status 0 and the right result, or another status with a message and
# the older output whole, or the new one; never a signal; and what stands beside it is as it was.
. "$(dirname "$0")/lib.sh"
count=${1:-2000} only=${2:-}
cc -O1 -shared -fPIC -o "$work/io-fault.so" "$srcdir/tests/long/io-fault.c" -ldl || exit 99
inputs
mkdir older
ct-phantom -q --size 8x8x8 --spacing 4 cube old.nii
faulty() { # faulty ENVIRONMENT... COMMAND...
	timeout 60 env LD_PRELOAD="$work/io-fault.so" "$@" >stdout 2>err
}
beside() { # what a person may have beside it
	for f in out/o.ct-thorax out/.ctsr-tmp-abcdef out/o.nii.ct-abcdef out/o.exr.ct-pelvis; do mkdir $f && echo a >$f/ctsr0001.dcm && echo b >$f/mark; done
	echo c >out/o.nii.ct-locked; echo e >out/o.exr.state.ct-locked; echo d >out/other.nii
}
others() { find out -type f \( -name '*.ct-*' -o -path 'out/.ctsr-tmp-abcdef/*' -o -path '*.ct-*/*' -o -name other.nii \) -exec cksum {} + 2>/dev/null | sort; }
whole() { if [ -d "$1" ]; then cat "$1"/* | cksum; else content "$1"; fi; }
fails() { # fails OUT COMMAND...
	out=$1; shift
	[ -z "$only" ] || [ "$only" = "$1" ] || return
	[ "$out" != stdout ] || return
	row "files fail: $*"
	rm -rf out && mkdir out
	"$@" >/dev/null 2>err || { tally 1 'does not run'; return; }
	rm -rf older && mkdir older && cp -r out/. older/ && want=$(whole "$out") && rm -f older/*.state
	for kind in open read write sync rename link mkdir unlink close; do
		rm -rf out && cp -r older out
		rm -f "$work/calls"; : >"$work/calls"
		faulty IO_CALL=$kind IO_LOG="$work/calls" "$@" --force
		eval "n_$kind=$(wc -l <"$work/calls")"
	done
	k=0
	while [ "$k" -lt $((count / 23)) ]; do
		set_=$k k=$((k + 1))
		case $((set_ % 9)) in 0) kind=open ;; 1) kind=read ;; 2) kind=write ;; 3) kind=sync ;; 4) kind=rename ;; 5) kind=mkdir ;; 6) kind=unlink ;; 7) kind=close ;; 8) kind=write ;; esac
		eval "calls=\$n_$kind"
		[ "$calls" -gt 0 ] || continue
		random 4
		case $R in 0) number=5 ;; 1) number=28 ;; 2) number=4 ;; 3) number=0 ;; esac # EIO ENOSPC EINTR short
		case $kind,$number in read,0 | write,0 | *,[1-9]*) ;; *) number=5 ;; esac
		random "$calls" && at=$((R + 1)) on=
		random 3; [ "$R" -ne 0 ] || [ "$number" -eq 4 ] || on=IO_ON=1 # a call that is always interrupted has no end
		rm -rf out tmp && cp -r older out && mkdir tmp && beside
		old=$(whole "$out") before=$(others)
		# shellcheck disable=SC2086
		faulty IO_CALL=$kind IO_AT=$at IO_ERRNO=$number $on "$@" --force
		got=$? broken=
		now=$( [ -e "$out" ] && whole "$out" )
		case $got in
		0) [ "$now" = "$want" ] || broken='status 0 and another result' ;;
		124) broken='no end' ;;
		1[2-9][0-9]) broken="status $got" ;;
		*)
			[ -s err ] || broken="status $got, no message"
			[ "$now" = "$old" ] || [ "$now" = "$want" ] || broken="status $got, and the older output is gone"
			;;
		esac
		others >"$work/others" # and what this run could not remove
		gone=$(echo "$before" | comm -23 - "$work/others")
		[ -z "$gone" ] || broken="$broken; what stands beside it is changed: $gone"
		[ -z "$broken" ]; tally $? "$broken: $kind $at of $calls, errno $number $on"
	done
}
every fails
fails out/s ct-convert -q -t 2 hr.nii out/s/
fails out/c.nii ct-sr -q -t 2 -x 2 --confidence out/c.nii hr-lr.nii out/o.nii
finish
