#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The documents are short and plain: README has at most 900 words, no man page more than 250 lines, its tables fit, and the
# mean sentence of each has at most 18 words, as style (Debian's diction) counts them.
. "$srcdir/tests/tap.sh"
[ "$(wc -w <"$srcdir/README.md")" -le 900 ]; ok $? "README has $(wc -w <"$srcdir/README.md") words"
n=$(grep -v '^|' "$srcdir/doc/results.md" | wc -w)
[ "$n" -le 5000 ]; ok $? "results.md has $n words beside its tables"
pages=$(for t in $CT_TOOLS; do
	p=$srcdir/man/$t.1; [ -f "$p" ] || p=$builddir/man/$t.1
	echo "$p"
done; ls "$srcdir"/man/*.[57])
# prose FILE: without tables, code and links
prose() {
	case $1 in
	*.md) sed -e '/^    /d; /^|/d; /^```/,/^```/d; /^#/d; /^!\[/d' -e 's/`[^`]*`/word/g; s/](\([^)]*\))/]/g' "$1" ;;
	*) sed -e '/^\.Bd/,/^\.Ed/d; /^\.Dl/d; /^\.Sh OPTIONS/,/^\.Sh EXIT/d' "$1" | mandoc -Tascii 2>/dev/null | col -b ;;
	esac
}
mean() { prose "$1" | style 2>/dev/null | sed -n 's/.*sentences, average length \([0-9.]*\) words.*/\1/p'; }
command -v mandoc >/dev/null || { skip 'man pages' 'no mandoc'; done_testing; }
for p in $pages; do
	n=$(mandoc -Tascii "$p" | wc -l)
	[ "$n" -le 250 ]; ok $? "$(basename "$p") has $n lines"
done
if command -v nroff >/dev/null; then
	for p in $pages; do # what does not fit into the last column of a table ends far to the right
		! nroff -mdoc "$p" 2>/dev/null | col -bx | grep '^ \{48,\}[^ ]'; ok $? "the tables of $(basename "$p") fit"
	done
else
	skip 'tables' 'no nroff'
fi
sed -n '/^\.Ss Metadata/,/^\.Ss States/s/^\.It //p' "$srcdir/man/ct-formats.5" | sed 's/ , /\n/g' >keys
! sed 's/.*/"&"/' keys | while read -r k; do grep -qF "$k" "$srcdir/src/core/meta.h" || echo "$k"; done | grep .; ok $? 'the keys of ct-formats(5) are those of meta.h'
command -v style >/dev/null || { skip 'sentences' 'no style'; done_testing; }
for p in "$srcdir/README.md" "$srcdir/doc/guide.md" "$srcdir"/doc/tutorial-*.md $pages; do
	m=$(mean "$p")
	awk -v m="$m" 'BEGIN {exit !(m > 0 && m <= 18)}'; ok $? "$(basename "$p"): $m words a sentence"
done
done_testing
