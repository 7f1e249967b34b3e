#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Prints how large the project is: options of its own of each command, and lines of C.
#   scripts/count.sh FOLDER-OF-COMMANDS
# Common options (help, threads, seed, units and so on) are not counted; --expert counts once.
set -eu
bin=$(cd "${1:?folder of the commands}" && pwd)
cd "$(dirname "$0")/.."
common=' threads expand force quiet verbose help version seed json dry-run units '
all=0
for t in src/tools/ct-*.c; do
	t=$(basename "$t" .c)
	[ -x "$bin/$t" ] || continue
	n=0
	for o in $("$bin/$t" --help | sed -n 's/^  ....--\([a-z0-9-]*\).*/\1/p; s/^  -[^-], --\([a-z0-9-]*\).*/\1/p' | sort -u); do
		case $common in *" $o "*) ;; *) n=$((n + 1)) ;; esac
	done
	all=$((all + n))
	printf '%-12s %3d options\n' "$t" "$n"
done
printf '%-12s %3d options\n' all "$all"
lines() { git ls-files "$@" | grep -E '\.(c|cc|h)$' | xargs cat | wc -l; }
for d in src/* formats; do [ -d "$d" ] && printf '%-16s %6d lines\n' "$d" "$(lines "$d")"; done
printf '%-16s %6d lines\n' 'src and formats' "$(lines src formats)"
