#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# two.sh [COUNT [COMMAND]]: two processes with the inputs of two patients on one output, and two ct-sr on one
# --keep folder, COUNT (100) times in all, the second begun up to half a run later. Each that ends with
# status 0 has its own patient's result, what is left is whole, and at least one of the two succeeds.
. "$(dirname "$0")/lib.sh"
count=${1:-100} tools=${2:-$lasting}
inputs
race() { # race COMMAND TIMES
	tool=$1 left=$2
	for who in hr other; do
		command_ "$tool" $who "$work/ref-$tool-$who"
		from=$(now)
		# shellcheck disable=SC2086
		$line >/dev/null 2>err || { tally 1 'does not run'; return; }
		length=$(($(now) - from))
	done
	one=$(said "ref-$tool-hr") two=$(said "ref-$tool-other")
	while [ "$left" -gt 0 ]; do
		rm -rf race && mkdir race
		if [ "$tool" = ct-sr ]; then # one folder, two outputs
			command_ "$tool" hr race/1; line1=$(echo "$line" | sed 's|--keep [^ ]*|--keep race/keep|')
			command_ "$tool" other race/2; line2=$(echo "$line" | sed 's|--keep [^ ]*|--keep race/keep|')
			f1=race/1 f2=race/2
		else
			command_ "$tool" hr race/1; line1=$line
			command_ "$tool" other race/1; line2=$line
			f1=race/1 f2=race/1
		fi
		# shellcheck disable=SC2086
		timeout 300 $line1 >/dev/null 2>err1 & pid1=$!
		# every other time nearly at once
		random $((left % 2 ? 30 : length / 2)) && sleep_ms "$R"
		# shellcheck disable=SC2086
		timeout 300 $line2 >/dev/null 2>err2 & pid2=$!
		wait $pid1; got1=$?
		wait $pid2; got2=$?
		cat err1 err2 >err
		broken=
		[ $got1 -eq 0 ] || [ $got2 -eq 0 ] || broken="both failed, $got1 and $got2"
		if [ $f1 != $f2 ]; then
			[ $got1 -ne 0 ] || [ "$(said $f1)" = "$one" ] || broken='the first has another result'
			[ $got2 -ne 0 ] || [ "$(said $f2)" = "$two" ] || broken='the second has another result'
		else
			case $got1,$got2,$(said $f1) in
			0,0,*) broken='both say that the output is theirs' ;;
			0,*,"$one" | *,0,"$two") ;;
			*) broken="statuses $got1 and $got2, and the output is neither's who succeeded" ;;
			esac
		fi
		for got in $got1 $got2; do
			case $got in 0 | 3 | 4) ;; *) broken="status $got" ;; esac
		done
		[ -z "$broken" ]; tally $? "$broken"
		left=$((left - 1))
	done
}
# shellcheck disable=SC2086
set -- $tools
each=$(((count + $# - 1) / $#))
for tool; do
	row "two at once, $tool"
	race "$tool" "$each"
done
finish
