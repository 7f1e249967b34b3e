#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# memory.sh [LIMITS [COMMAND]]: every command with LIMITS (24) limits of its memory (ulimit -v) from 64 MB up to where
# all have room: the right result, or status 7 and a message, and nothing left; never a crash. The
# loader's own "error while loading shared libraries" counts as a message, and "terminate called" of a library that
# throws while it is initialised, before the command is.
. "$(dirname "$0")/lib.sh"
limits=${1:-24} only=${2:-}
inputs
limited() { # limited OUT COMMAND...: with every limit
	out=$1; shift
	[ -z "$only" ] || [ "$only" = "$1" ] || return
	row "little memory: $1 to ${out#out/}"
	rm -rf out && mkdir out
	"$@" >stdout 2>err || { tally 1 'does not run'; return; }
	want=$(content "$out") k=0 enough=0
	while [ "$k" -lt "$limits" ]; do
		rm -rf out && mkdir out
		mb=$(awk "BEGIN {printf \"%d\", 64 * 64 ^ ($k / ($limits - 0.999))}")
		(ulimit -v $((mb * 1024)) && exec timeout 100 "$@") >stdout 2>err
		got=$? broken=
		case $got in
		0) enough=1; [ "$(content "$out")" = "$want" ] || broken='another result' ;;
		7) [ -s err ] || broken='no message' ;;
		134) grep -q 'terminate called' err || broken='status 134' ;; # a library throws while it is initialised
		127) grep -q 'shared librar' err || broken="status 127" ;;
		*) broken="status $got" ;;
		esac
		[ "$got" -eq 0 ] || [ -z "$(find out -mindepth 1 ! -name '*.state')" ] || broken="$(ls out) is left"
		[ -z "$broken" ]; tally $? "$broken with $mb MB: $*"
		k=$((k + 1))
	done
	[ $enough -eq 1 ]; tally $? 'never had enough'
}
every limited
finish
