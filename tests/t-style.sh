#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Rules that grep can check.
. "$srcdir/tests/tap.sh"
cd "$srcdir" || exit 99
src=$(find src formats tests -name '*.c' -o -name '*.h' -o -name '*.cc' | sort)
none() { # none NAME PATTERN: no source line matches
	# shellcheck disable=SC2086
	bad=$(grep -nE -- "$2" $src)
	[ -z "$bad" ]; ok $? "$1"
	[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
}
only() { # only FILE NAME PATTERN: no source line but those of FILE matches
	# shellcheck disable=SC2086
	bad=$(grep -nE -- "$3" $src | grep -v "^$1:")
	[ -z "$bad" ]; ok $? "$2"
	[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
}
none 'no unbounded string functions' '\b(strcpy|strcat|sprintf|gets|atoi|atof|strtok)[[:space:]]*\('
none 'no marks of unfinished work' '\b(TODO|FIXME|XXX|HACK)\b'
none 'no trailing blanks' '[[:space:]]$'
bad=$(grep -nE 'target_clones|GCC (optimize|target)|__attribute__.*target *\(|immintrin|arm_neon' $src |
	grep -vE '^src/core/vec.h:')
[ -z "$bad" ]; ok $? 'vectors have one layer, core/vec.h'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
none 'threads start in one file only' '^[^/*]*#[[:space:]]*pragma[[:space:]]+omp'
bad=$(grep -rnE '^#include "[^/"]+"' src formats | grep -v '"config.h"')
[ -z "$bad" ]; ok $? 'our headers are included with their folder'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
# a key that is misspelt does not compile; values may be words
bad=$(for f in $(find src formats -name '*.[ch]' -o -name '*.cc'); do
	tr '\n\t' '  ' <"$f" | grep -oE 'ct_meta_((get|set|drop|numbers)\([^;,"]*|setf\([^;,"]*,[^;,"]*), *"[^"]*"' |
		sed "s|^|$f: |"
done)
[ -z "$bad" ]; ok $? 'keys of the metadata are the constants of core/meta.h'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
bad=$(sed -n 's/^#define \(CT_META_[A-Z_]*\) .*/\1/p' src/core/meta.h | while read -r k; do
	[ "$(grep -rlw "$k" src formats | wc -l)" -gt 1 ] || echo "$k"; done)
[ -z "$bad" ]; ok $? 'and each of them is in use'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
bad=$(sed -n 's/^#define CT_META_[A-Z_]* "\(.*\)".*/\1/p' src/core/meta.h | while read -r k; do
	grep -qw -- "${k%.}" man/ct-formats.5 || echo "$k"; done)
[ -z "$bad" ]; ok $? 'and is explained in ct-formats(5)'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
only tests/t-core.c 'words of a choice stand in a list beside their enum' \
	'^[^*#]*"[a-z0-9+-]+(\|[a-z0-9+-]+)+"'
only src/core/clock.c 'one file asks for the time' \
	'\b(clock_gettime|gettimeofday|nanosleep|usleep|sleep|clock|time)\('
bad=$(for t in src/tools/ct-*.c; do n=$(basename "$t" .c); [ -f "man/$n.1.in" ] || echo "$n"; done)
[ -z "$bad" ]; ok $? 'every command has a man page'
bad=$(for m in man/ct-*.1.in; do n=$(basename "$m" .1.in); [ -f "src/tools/$n.c" ] || echo "$n"; done)
[ -z "$bad" ]; ok $? 'every man page has a command'
bad=$(for f in $src; do
	case $f in *.h|*.c|*.cc) head -n 1 "$f" | grep -q '^/\*' || echo "$f" ;; esac; done)
[ -z "$bad" ]; ok $? 'every source begins by saying what it is'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
bad=$(find src formats tests bench examples -name '*.[ch]' -o -name '*.cc' | sed 's|.*/||' | sort | uniq -d)
[ -z "$bad" ]; ok $? 'no two sources have one name'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
# shellcheck disable=SC2086
bad=$(wc -l $src | awk '$2 != "total" && $1 > ($2 ~ /^tests/ ? 700 : 500) {print}')
[ -z "$bad" ]; ok $? 'no source is longer than 500 lines, no test than 700'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
bad=$(find tests/fuzz/corpus -mindepth 1 | grep -v '^tests/fuzz/corpus/[a-z-]*\.tar$'
	for f in tests/fuzz/fuzz-*.c; do
		x=${f#tests/fuzz/fuzz-}; [ -f "tests/fuzz/corpus/${x%.c}.tar" ] || echo "$f has no corpus"; done)
[ -z "$bad" ]; ok $? 'the corpus of each fuzz target is one archive (scripts/fuzz-corpus.sh pack)'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
# A name of a test says one property and stands alone. tests/test-names-left lists the files that are not so yet:
# a file leaves it, none comes.
left() { sed -n "s/^$1 //p" tests/test-names-left | sort; }
faulty() { # faulty WHAT NAME: the "FILE:LINE: FAULT" of $dir_/faults, against the list
	cut -d: -f1 "$dir_/faults" | sort -u >"$dir_/at"
	bad=$(left "$1" | comm -23 "$dir_/at" - | while read -r f; do grep "^$f:" "$dir_/faults"; done
		left "$1" | comm -13 "$dir_/at" - | sed "s|.*|&: has none left; take '$1 &' off tests/test-names-left|")
	[ -z "$bad" ]; ok $? "$2"
	[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
}
awk -f tests/test-names.awk tests/*.sh >"$dir_/names"
[ "$(wc -l <"$dir_/names")" -gt 2000 ]; ok $? 'the names of shell tests are found'
awk -F'\t' '($1, $3) in at {print $1 ":" $2 ": named as line " at[$1, $3] ": " $3; next} {at[$1, $3] = $2}' "$dir_/names" >"$dir_/faults"
faulty twice 'no two tests of a file have one name'
awk -F'\t' '$3 !~ /\$/ && split($3, word, " ") < 4 {print $1 ":" $2 ": " $3}' "$dir_/names" >"$dir_/faults"
faulty short 'a name of a test has four words or more'
if clang-format --version 2>/dev/null | grep -q 'version 14\.'; then
	# shellcheck disable=SC2046
	bad=$(clang-format --dry-run $src $(find bench -name '*.[ch]') 2>&1 | grep warning: | cut -d: -f1 | uniq -c)
	[ -z "$bad" ]; ok $? 'every source is as clang-format writes it'
	[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
else
	skip 'every source is as clang-format writes it' 'clang-format 14 is not here'
fi
done_testing
