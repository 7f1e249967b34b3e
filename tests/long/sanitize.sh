#!/bin/sh
# sanitize.sh: the whole suite under AddressSanitizer and UBSan (scripts/check.sh --sanitize).
. "$(dirname "$0")/lib.sh"
row 'the suite under ASan and UBSan'
"$srcdir/scripts/check.sh" --sanitize >out 2>&1
got=$?
counts=$(sed -n 's/^\([0-9]*\) passed, \([0-9]*\) failed, \([0-9]*\) skipped$/\1 \2 \3/p' out)
# shellcheck disable=SC2086
set -- $counts
if [ $# -eq 3 ]; then
	tally 0 '' "$1"
	[ "$2" -eq 0 ] || tally 1 "$(grep -E '^(FAIL|ERROR):' out | sort -u | tr '\n' ' ')" "$2"
else
	tail -n 20 out
	tally 1 "the suite did not end: status $got"
fi
finish
