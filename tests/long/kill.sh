#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# kill.sh [COUNT [COMMAND]]: every command with a state, ct-upsample, and ct-sr with a folder that keeps, is
# stopped by the signal $SIGNAL (KILL) at random times, COUNT (1000) in all, then resumed (ct-upsample: run
# again): the same result as a run in one go, nothing else left, and no file that cannot be read meanwhile.
. "$(dirname "$0")/lib.sh"
count=${1:-1000} signal=${SIGNAL:-KILL} tools=${2:-$lasting}
inputs
# strays: what is in the folder, but for the inputs, the output and what it may have beside it: also its lock,
# of a run that was killed behind its result; the next removes it (t-io.c)
strays() { find . -mindepth 1 -maxdepth 1 ! -name out ! -name out.state ! -name out.state.ct-locked ! -name out.keep ! -name err; }
lives() { # lives COMMAND KILLS
	tool=$1 left=$2
	command_ "$tool" hr "$work/ref-$tool"
	from=$(now)
	# shellcheck disable=SC2086
	$line >/dev/null 2>err || { tally 1 "does not run"; return; }
	length=$(($(now) - from))
	want=$(said "$work/ref-$tool")
	while [ "$left" -gt 0 ]; do
		rm -rf "$work/life" && mkdir "$work/life" && cp "$work"/hr* "$work/life/" && cd "$work/life" || exit 99
		command_ "$tool" hr out
		random 5 && kills=$((R + 1)) done_=0 again='' broken=
		[ "$kills" -le "$left" ] || kills=$left
		while [ "$done_" -lt "$kills" ]; do
			# shellcheck disable=SC2086
			setsid $line $again >/dev/null 2>err &
			pid=$!
			random "$length" && sleep_ms "$R"
			kill -s "$signal" -- -"$pid" 2>/dev/null || kill -s "$signal" "$pid" 2>/dev/null
			wait "$pid" 2>/dev/null
			got=$?
			done_=$((done_ + 1))
			case $signal,$got in
			KILL,137 | *,0 | TERM,143 | INT,130) ;; # the last two: before it listens
			KILL,* | *,75) [ "$signal,$got" != KILL,75 ] || broken="ended with $got" ;;
			*) broken="ended with $got" ;;
			esac
			for f in out out.state; do
				[ ! -e $f ] || said $f >/dev/null || broken="$f cannot be read"
			done
			[ "$got" -ne 0 ] || break
			again=$(again_of "$tool")
			# done but for the removal of its state: nothing is left to resume
			[ "$tool" != ct-train ] && [ -e out ] && [ "$(said out)" = "$want" ] && break
		done
		if [ -z "$broken" ] && { [ ! -e out ] || [ "$tool" = ct-train ]; }; then
			# shellcheck disable=SC2086
			timeout 300 $line $(again_of "$tool") >/dev/null 2>err || broken="$(again_of "$tool") ended with $?"
		fi
		[ -n "$broken" ] || [ "$(said out)" = "$want" ] || broken='another result'
		[ -n "$broken" ]; tally $((1 - $?)) "$broken after $done_ of $kills" "$done_"
		left=$((left - done_))
		for f in $(strays | grep -v '^\./hr'); do echo "$tool $f" >>"$work/strays"; done
		echo "$tool" >>"$work/lives"
		cd "$work" || exit 99
	done
}
# shellcheck disable=SC2086
set -- $tools
each=$(((count + $# - 1) / $#))
for tool; do
	row "SIG$signal, $tool"
	lives "$tool" "$each"
done
row "SIG$signal, nothing left beside the result"
n=$(wc -l <"$work/lives")
m=$(cut -d' ' -f1,2 "$work/strays" 2>/dev/null | wc -l)
[ "$m" -gt "$n" ] && m=$n
tally 0 '' $((n - m))
[ "$m" -eq 0 ] || tally 1 "$(sed 's/\.[A-Za-z0-9]\{6\}$/.XXXXXX/' strays | sort | uniq -c | tr '\n' ';')" "$m"
finish
