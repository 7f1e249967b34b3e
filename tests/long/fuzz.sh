#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# fuzz.sh [SECONDS]: libFuzzer on every target for SECONDS (60) each: scripts/fuzz.sh.
. "$(dirname "$0")/lib.sh"
"$srcdir/scripts/fuzz.sh" --seconds "${1:-60}" >out 2>err || [ $? -ne 77 ] || { cat err; exit 77; }
cat err
row 'libFuzzer: executions without a crash, leak or hang'
while read -r target n _ _ result; do
	case $target in target | [0-9]*) continue ;; esac
	: >err
	case $result in
	sound) tally 0 '' "$n" ;;
	*) tally 0 '' $((n > 0 ? n - 1 : 0)); tally 1 "$target: $result" ;;
	esac
done <out
[ "$tried_" -gt 0 ] || tally 1 "$(tail -n 5 out)"
finish
