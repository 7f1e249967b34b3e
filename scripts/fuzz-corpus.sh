#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The corpus of a fuzz target is one archive, tests/fuzz/corpus/TARGET.tar:
#   scripts/fuzz-corpus.sh list [TARGET...]           how many inputs each holds
#   scripts/fuzz-corpus.sh unpack TARGET FOLDER       its inputs into FOLDER
#   scripts/fuzz-corpus.sh add TARGET FILE...         adds inputs, as found-NAME: scripts/fuzz.sh --keep keeps those
#   scripts/fuzz-corpus.sh replace TARGET FOLDER      the archive holds what FOLDER holds, and nothing else
#   scripts/fuzz-corpus.sh pack                       moves the files of folders tests/fuzz/corpus/TARGET into archives
# The same inputs make the same bytes: sorted by name, without times, owners and modes.
set -e
corpus=$(cd "$(dirname "$0")/.." && pwd)/tests/fuzz/corpus
usage() { sed -n '2,7s/^# \{0,1\}//p' "$0" >&2; exit 2; }
replace() { # replace TARGET FOLDER
	(cd "$2" && find . -type f -printf '%P\n' | LC_ALL=C sort) |
		tar -C "$2" -b 1 --format=ustar --mtime=@0 --owner=0 --group=0 --numeric-owner --mode=644 \
			--no-recursion -T - -cf "$corpus/$1.tar.new"
	mv "$corpus/$1.tar.new" "$corpus/$1.tar"
}
unpack() { # unpack TARGET FOLDER; a target without inputs has no archive
	mkdir -p "$2"
	[ ! -f "$corpus/$1.tar" ] || tar -xf "$corpus/$1.tar" -C "$2"
}
new=
trap '[ -z "$new" ] || rm -rf "$new"' EXIT
what=${1:-}
[ $# -eq 0 ] || shift
case $what in
list)
	[ $# -gt 0 ] || for f in "$corpus"/*.tar; do set -- "$@" "$(basename "$f" .tar)"; done
	for x; do printf '%-14s %s\n' "$x" "$(tar -tf "$corpus/$x.tar" | wc -l)"; done ;;
unpack)
	[ $# -eq 2 ] || usage
	unpack "$1" "$2" ;;
replace)
	[ $# -eq 2 ] && [ -d "$2" ] || usage
	replace "$1" "$2" ;;
add)
	[ $# -ge 2 ] || usage
	x=$1 new=$(mktemp -d)
	shift
	unpack "$x" "$new"
	for f; do
		name=$(basename "$f")
		cp "$f" "$new/found-${name#found-}"
	done
	replace "$x" "$new" ;;
pack)
	[ $# -eq 0 ] || usage
	for d in "$corpus"/*/; do
		[ -d "$d" ] || continue
		x=$(basename "$d") new=$(mktemp -d)
		unpack "$x" "$new"
		find "$d" -type f -exec cp {} "$new/" \;
		replace "$x" "$new"
		rm -rf "$d" "$new"
	done ;;
*) usage ;;
esac
