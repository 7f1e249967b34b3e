#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Which folder may include which: the table of CONTRIBUTING, "Where things are".
. "$srcdir/tests/tap.sh"
# layers TREE: each include of a room of TREE that its row does not allow, each room without a row, each circle
layers() { (
	cd "$1" || exit 99
	rooms=$(find src/* formats -name '*.[ch]' -o -name '*.cc' | sed 's|^src/||; s|/.*||' | sort -u)
	for r in $rooms; do
		grep -nE '^[[:space:]]*#[[:space:]]*include "[a-z0-9]+/' /dev/null $(find "src/$r" "$r" -name '*.[ch]' -o -name '*.cc' 2>/dev/null) |
			sed 's|^\([^:]*:[0-9]*\):.*include "\([a-z0-9]*\)/.*|'"$r"' \2 \1|'
	done >"$dir_/includes"
	awk -F'|' -v rooms="$rooms" '
		FNR == NR {
			if ($2 !~ /^ `(src\/)?[a-z]+` $/ || NF != 5) next
			room = $2; gsub(/[ `]|src\//, "", room)
			rest = $4; gsub(/^ +| +$/, "", rest)
			all[room] = sub(/^everything( but )?/, "", rest)
			n = split(rest, word, /, /)
			for (i = 1; i <= n; i++) listed[room, word[i]] = 1
			row[room] = 1
			next
		}
		{
			split($0, at, " ")
			if (at[1] in row && (all[at[1]] ? 1 : 0) == (((at[1], at[2]) in listed) ? 1 : 0))
				print at[3] ": " at[1] " may not include " at[2]
		}
		END {
			n = split(rooms, name, /[ \n]/)
			for (i = 1; i <= n; i++) if (!(name[i] in row)) print name[i] ": has no row in CONTRIBUTING.md"
		}' CONTRIBUTING.md "$dir_/includes"
	# a circle is what cannot be put in an order
	cut -d' ' -f1,2 "$dir_/includes" | sort -u | tsort 2>&1 >/dev/null | sed 's/^tsort: //'
) 2>&1; }
clean() { [ -z "$2" ]; ok $? "$1"; [ -z "$2" ] || echo "$2" | sed 's/^/# /'; }
clean 'every room has a row, includes what its row allows, and no circle' "$(layers "$srcdir")"
made() { # made: a small tree of two rooms, which is in order
	rm -rf made; mkdir -p made/src/core made/src/dicom made/formats
	printf '| `src/core` | a | core |\n| `src/dicom` | b | core, dicom |\n| `formats` | c | everything but dicom |\n' >made/CONTRIBUTING.md
	echo '#include "core/a.h"' | tee made/src/core/a.c made/src/dicom/a.c >made/formats/a.c
}
made; clean 'a made-up tree in order has no faults' "$(layers made)"
made; mkdir made/src/attic; echo >made/src/attic/a.c; layers made >out
has out '^attic: has no row in CONTRIBUTING.md$' 'a room that CONTRIBUTING does not know is a fault'
made; echo '#include "dicom/a.h"' >made/formats/a.c; layers made >out
has out '^formats/a.c:1: formats may not include dicom$' 'an include that is excepted from everything is a fault'
made; mkdir made/src/dicom/deep; echo '#  include "formats/a.h"' >made/src/dicom/deep/a.cc; layers made >out
has out '^src/dicom/deep/a.cc:1: dicom may not include formats$' 'an include that no row lists is a fault, also in a folder of a room'
made; sed -i 's/| core |/| core, dicom |/' made/CONTRIBUTING.md; echo '#include "dicom/a.h"' >made/src/core/a.c; layers made >out
has out 'loop' 'two rooms that include each other are a fault, whatever their rows say'
# What is below the command line: every room but cli, dicom and tools, which may exit and read the environment.
bad=$(cd "$srcdir" && find src formats -name '*.c' -o -name '*.cc' | grep -vE '^src/(cli|dicom|tools)/' |
	xargs grep -nE '\b(printf|fprintf|puts|perror|exit|abort|getenv) *\(' /dev/null | grep -v 'fprintf(f,')
clean 'nothing prints, exits or reads the environment below the command line' "$bad"
done_testing
