#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# faults.sh [COUNT [COMMAND]]: memory fails within every command (tests/long/fault.c), COUNT (2000) times in all: at
# each of the first calls, then at the last and at random ones, once or from there on. The right result, or status 7
# and a message (1, if a library ends the run with words of its own), and nothing left. A library that does not
# look at what it got may end the run by a signal: then the call that failed last is in it (FAULT_SHOW), and
# nothing but temporary files is left.
. "$(dirname "$0")/lib.sh"
count=${1:-2000} only=${2:-}
cc -O1 -shared -fPIC -o "$work/fault.so" "$srcdir/tests/long/fault.c" -ldl || exit 99
inputs
libraries='lib(dnnl|stdc\+\+|OpenImageIO|vtk|gdcm|tbb)'
faulty() { # faulty ENVIRONMENT... COMMAND...
	timeout 20 env LD_PRELOAD="$work/fault.so" "$@" >stdout 2>err
}
fails() { # fails OUT COMMAND...
	out=$1; shift
	[ -z "$only" ] || [ "$only" = "$1" ] || return
	row "memory fails: $*"
	rm -rf out && mkdir out
	faulty FAULT_COUNT="$work/calls" "$@" || { tally 1 'does not run'; return; }
	want=$(content "$out") calls=$(cat "$work/calls") k=0 last=0
	while [ "$k" -lt $((count / 22)) ]; do
		k=$((k + 1))
		if [ "$k" -le $((count / 44)) ] || [ "$k" -ge "$calls" ]; then
			at=$k
		else
			random "$calls" && at=$((R + 1))
			# the output takes its place in the last ones
			[ $((k % 4)) -gt 1 ] || { at=$((last / 2 < calls ? calls - last / 2 : 1)); last=$((last + 1)); }
		fi
		rm -rf out && mkdir out
		on=
		[ $((k % 2)) -eq 0 ] || on=1
		faulty FAULT_AT="$at" ${on:+FAULT_ON=1} "$@"
		got=$? broken=
		case $got in
		0) [ "$(content "$out")" = "$want" ] || broken='another result' ;;
		7) [ -s err ] || broken='no message' ;;
		1) grep -qi 'out of memory\|insufficient memory' err || broken='status 1' ;; # the library's words: of OpenMP, PNG
		134 | 139) # SIGABRT, SIGSEGV
			faulty FAULT_SHOW=1 FAULT_AT="$at" ${on:+FAULT_ON=1} "$@"
			sed -n '/fault\.so/h; /fault\.so/!H; ${x; p}' err | grep -qE "$libraries" || broken="status $got"
			rm -f out/*.ct-locked # its lock is left; the next run removes it
			;;
		127) grep -q 'thread-local' err || broken='status 127' ;; # the loader's own end
		*) broken="status $got" ;;
		esac
		# ct-train writes its prior, then its state
		[ "$got" -eq 0 ] || [ -z "$(find out -mindepth 1 ! -name '*.state' ! -name '*.safetensors' ! -path '*/.ctsr-tmp-*')" ] || broken="$broken $(ls out) is left"
		[ -z "$broken" ]; tally $? "$broken, call $at of $calls, $((k % 2))"
	done
}
every fails
finish
