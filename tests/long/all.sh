#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# all.sh [PART[=COUNT[,COMMAND]]...]: the parts of make check-long, all of them if none is named, and a table
# of what was tried and what passed, in check-long.md of the present folder too.
here=$(cd "$(dirname "$0")" && pwd)
parts=${*:-kill full memory faults io-faults peak two threads sanitize fuzz network train cluster conda}
table=$PWD/check-long.md rows=$(mktemp)
trap 'rm -f "$rows" "$rows.part"' EXIT
status=0 counts=
for p in $parts; do
	name=${p%%=*} count=
	[ "$name" = "$p" ] || count=${p#*=}
	[ -f "$here/$name.sh" ] || { echo "$0: no part $name" >&2; exit 2; }
	from=$(date +%s)
	# shellcheck disable=SC2086
	sh "$here/$name.sh" ${count:+$(echo "$count" | tr , ' ')} >"$rows.part" 2>&1
	got=$?
	grep -v '^row|' "$rows.part"
	grep '^row|' "$rows.part" >>"$rows" || echo "row|$name|did not run, status $got|1|0" >>"$rows"
	[ $got -eq 0 ] || status=1
	counts="$counts $name${count:+=$count} ($(($(date +%s) - from)) s)"
done
{
	echo "Parts:$counts."
	echo
	echo '| part | what | tried | passed |'
	echo '|---|---|---:|---:|'
	sed 's/^row|\([^|]*\)|\([^|]*\)|\([^|]*\)|\(.*\)$/| \1 | \2 | \3 | \4 |/' "$rows"
	echo
	echo "Made on $(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1), $(nproc) processors," \
		"$(awk '/^MemTotal/ {printf "%d", $2 / 1048576 + 0.5}' /proc/meminfo) GiB, $(sed -n 's/^PRETTY_NAME="\(.*\)"/\1/p' /etc/os-release)."
} >"$table"
cat "$table"
exit $status
