#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The sources themselves: style, who may include whom, plain documents, credits, names of functions.
. "$srcdir/tests/tap.sh"

# Rules that grep can check.
part style
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
bad=$(sed -n 's/^[a-z].*\b\(ct_product_[a-z]*\)(.*/\1/p' src/nn/product.h | while read -r k; do
	grep -q "^[a-z].*\b$k(" bench/train/dnn-plain.c || echo "$k"; done)
[ -z "$bad" ]; ok $? 'bench/train/dnn-plain.c stands for all of nn/product.h'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
# A name of a test says one property and stands alone: no other test of its file has it, and it has four words or more.
faulty() { # faulty NAME: no "FILE:LINE: FAULT" stands in $dir_/faults; each that does is told
	[ ! -s "$dir_/faults" ]; ok $? "$1"
	sed 's/^/# /' "$dir_/faults"
}
cat >"$dir_/names.awk" <<'END'
# The names of shell tests, as FILE, LINE, NAME between tabs: of ok, exits and has of tests/tap.sh. Left out
# is what a function is given ("$3") or what is computed ("$(...)").
function name(s) {
	s = substr(s, 2, length(s) - 2)
	if (s !~ /^\$[{a-z0-9_}]*$/ && s !~ /\$\(/) print FILENAME "\t" FNR "\t" s
}
{
	line = $0
	while (match(line, /(^|[^A-Za-z0-9_-])(ok \$[?a-z_]+|exits [0-9]+) +('[^']*'|"([^"\\]|\\.)*")/)) {
		s = substr(line, RSTART, RLENGTH)
		line = substr(line, RSTART + RLENGTH)
		sub(/^[^A-Za-z0-9_-]?(ok [^ ]+|exits [^ ]+) +/, "", s)
		name(s)
	}
	line = $0
	while (match(line, /(^|[^A-Za-z0-9_-])has [^ ]+ +('[^']*'|"([^"\\]|\\.)*") +('[^']*'|"([^"\\]|\\.)*")/)) {
		s = substr(line, RSTART, RLENGTH)
		line = substr(line, RSTART + RLENGTH)
		sub(/^[^A-Za-z0-9_-]?has [^ ]+ +('[^']*'|"([^"\\]|\\.)*") +/, "", s)
		name(s)
	}
}
END
awk -f "$dir_/names.awk" tests/*.sh >"$dir_/names"
[ "$(wc -l <"$dir_/names")" -gt 2000 ]; ok $? 'the names of shell tests are found'
awk -F'\t' '($1, $3) in at {print $1 ":" $2 ": named as line " at[$1, $3] ": " $3; next} {at[$1, $3] = $2}' "$dir_/names" >"$dir_/faults"
faulty 'no two tests of a file have one name'
awk -F'\t' '$3 !~ /\$/ && split($3, word, " ") < 4 {print $1 ":" $2 ": " $3}' "$dir_/names" >"$dir_/faults"
faulty 'a name of a test has four words or more'
if clang-format --version 2>/dev/null | grep -q 'version 14\.'; then
	# shellcheck disable=SC2046
	bad=$(clang-format --dry-run $src $(find bench -name '*.[ch]') 2>&1 | grep warning: | cut -d: -f1 | uniq -c)
	[ -z "$bad" ]; ok $? 'every source is as clang-format writes it'
	[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
else
	skip 'every source is as clang-format writes it' 'clang-format 14 is not here'
fi

# Which folder may include which: the table of CONTRIBUTING, "Where things are".
part layers
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
for script in scripts/check-aarch64.sh tests/long/threads.sh; do
	named=$(sed -n "s/^default='\(.*\)'$/\1/p" "$srcdir/$script")
	[ -n "$named" ]; ok $? "$script names tests to run"
	clean "each test that $script names is there" "$(for t in $named; do [ -f "$srcdir/tests/t-${t%-v1}.c" ] || echo "$t"; done)"
done

# The documents are short and plain: README has at most 900 words, no man page more than 250 lines, its tables fit, and the
# mean sentence of each has at most 18 words, as style (Debian's diction) counts them.
part plain
[ "$(wc -w <"$srcdir/README.md")" -le 900 ]; ok $? "README has $(wc -w <"$srcdir/README.md") words"
n=$(wc -w <"$srcdir/doc/results.md")
[ "$n" -le 5000 ]; ok $? "results.md has $n words with its tables"
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
if command -v mandoc >/dev/null; then
	for p in $pages; do
		n=$(mandoc -Tascii "$p" | wc -l)
		[ "$n" -le 250 ]; ok $? "$(basename "$p") has $n lines"
	done
else
	skip 'man pages' 'no mandoc'
fi
if command -v nroff >/dev/null; then
	for p in $pages; do # what does not fit into the last column of a table ends far to the right
		! nroff -mdoc "$p" 2>/dev/null | col -bx | grep '^ \{48,\}[^ ]'; ok $? "the tables of $(basename "$p") fit"
	done
else
	skip 'tables' 'no nroff'
fi
sed -n '/^\.Ss Metadata/,/^\.Ss States/s/^\.It //p' "$srcdir/man/ct-formats.5" | sed 's/ , /\n/g' >keys
! sed 's/.*/"&"/' keys | while read -r k; do grep -qF "$k" "$srcdir/src/core/meta.h" || echo "$k"; done | grep .; ok $? 'the keys of ct-formats(5) are those of meta.h'
if command -v style >/dev/null && command -v mandoc >/dev/null; then
	for p in "$srcdir/README.md" "$srcdir"/doc/*.md $pages; do
		m=$(mean "$p")
		awk -v m="$m" 'BEGIN {exit !(m > 0 && m <= 18)}'; ok $? "$(basename "$p"): $m words a sentence"
	done
else
	skip 'sentences' 'no style or no mandoc'
fi

# Credits: CITATION.cff is the form of version 1.2.0, says the version of configure.ac, and names the paper as the documents do.
part citation
cff=$srcdir/CITATION.cff
version=$(sed -n 's/^AC_INIT(\[ctsr\], \[\([^]]*\)\].*/\1/p' "$srcdir/configure.ac")
[ -n "$version" ] && grep -qx "version: $version" "$cff"; ok $? "CITATION.cff has the version of configure.ac, $version"
if python_with yaml; then
	"$PY" - "$cff" >title 2>err <<'END'
import sys
import yaml
c = yaml.safe_load(open(sys.argv[1], encoding="utf-8"))
paper = c["preferred-citation"]
assert c["cff-version"] == "1.2.0" and c["type"] == "software", "not cff 1.2.0 of software"
for it in (c, paper):
    assert it["title"] and it["authors"], "no title or authors"
    assert all("name" in a or {"family-names", "given-names"} <= a.keys() for a in it["authors"]), "an author without name"
assert c["message"] and isinstance(c["version"], str) and c["license"] == "Apache-2.0", "message, version or license"
assert paper["type"] == "conference-paper" and paper["year"] == 2026 and "2508.15151" in paper["url"], "not the paper"
print(paper["title"])
END
	ok $? 'CITATION.cff parses and has what its form asks for'
	sed 's/^/# /' err
	for p in README.md doc/guide.md man/ct-references.7 man/ct-sr.1.in man/ct-ddnm.1.in man/ct-nabgs.1.in man/ct-project.1.in man/ct-compose.1.in; do
		tr '\n' ' ' <"$srcdir/$p" | grep -qF "$(cat title)" && grep -q 'arXiv.*2508\.15151' "$srcdir/$p"; ok $? "$p names the paper that CITATION.cff cites"
	done
else
	skip 'CITATION.cff parses and has what its form asks for' 'no yaml of Python'
fi
# the data behind the networks: debian/copyright and the cards name the same, and the cards are installed
sed -n 's/^ - \([^,(:]*\).*/\1/p' "$srcdir/debian/copyright" | sed 's/ of the VTK.*//; s/ *$//' >data
[ "$(wc -l <data)" -ge 10 ] && while read -r d; do grep -qF "$d" "$srcdir/src/prior/README.md" || echo "$d"; done <data >lost
[ ! -s lost ]; ok $? 'every data set of debian/copyright stands in the cards of the networks'
sed 's/^/# /' lost
sed -n '/^Sources:/,/^$/p' "$srcdir/src/prior/README.md" | grep -oE 'LIDC-IDRI|LungFCP|RIDER Pilot|[A-Z]+-(OV|THCA|PDA|LSCC)|Soft-tissue-Sarcoma|[A-Za-z-]*CBCT-SEG|TotalSegmentator|dcm_qa_ct|COVID-CT-MD|mouse_CT_atlas|FullHead|ChestX-ray8/14' |
	sort -u | while read -r d; do grep -qxF "$d" data || echo "$d"; done >lost
[ ! -s lost ]; ok $? 'every source of a network stands in debian/copyright'
sed 's/^/# /' lost
grep '^Files: doc/' "$srcdir/debian/copyright" | tr ' ' '\n' | grep / | while read -r f; do [ -e "$srcdir/$f" ] || echo "$f"; done >lost
[ ! -s lost ]; ok $? 'every picture that debian/copyright names is there'
sed 's/^/# /' lost
grep '^pkgdata_DATA' "$srcdir/src/local.mk" | grep -q 'src/prior/README.md'; ok $? 'the cards of the networks are installed beside them'
# what is installed to be run says what runs it
sed -n '/^nobase_dist_example_SCRIPTS/,/[^\\]$/p' "$srcdir/Makefile.am" | grep -oE 'examples/[^ ]*' >scripts
[ -s scripts ] && while read -r f; do head -c 2 "$srcdir/$f" | grep -qx '#!' || echo "$f"; done <scripts >lost
[ ! -s lost ]; ok $? 'every script among the examples names its interpreter'
sed 's/^/# /' lost
# every Xr of a page of ctsr is a page
for p in "$srcdir"/man/*.in "$srcdir"/man/*.[357]; do
	grep -ho '\(^\.Xr\|Xr\) ct[a-z-]* [1-8]' "$p" | sed 's/.*Xr //'
done | sort -u | while read -r name section; do
	[ -f "$srcdir/man/$name.$section" ] || [ -f "$srcdir/man/$name.$section.in" ] || echo "$name($section)"
done >lost
[ ! -s lost ]; ok $? 'every page that a page refers to is there'
sed 's/^/# /' lost
# the licence in each source
(cd "$srcdir" && find src formats tests bench examples man python scripts -name '*.c' -o -name '*.h' -o -name '*.cc' -o -name '*.sh' -o -name '*.py' -o -name '*.mk' \
	-o -name '*.[1357]' -o -name '*.in' | xargs grep -L 'SPDX-License-Identifier: Apache-2.0') | grep -v '\.pc\.in$' >lost
[ ! -s lost ]; ok $? 'every source has an SPDX line'
sed 's/^/# /' lost

# A public function is ct_NOUN_verb (CONTRIBUTING, "Names"): NOUN is the file that declares it, or a
# struct or enum of that header or of src/core that it is about; or it is one of the few words that every file uses.
part names
words=' ct_fail ct_fail_errno ct_blame ct_alloc ct_alloc0 ct_grow ct_size_mul ct_log ct_progress ct_progress_until ct_stopping
	ct_check_stop ct_philox ct_slurp ct_put '
words=" $(echo $words) "
command -v nm >/dev/null || { skip 'public functions are ct_NOUN_verb' 'nm is not here'; done_testing; }
nm -g --defined-only "$builddir/libct.a" 2>/dev/null |
	sed -n 's/^[0-9a-f]* [TW] \(ct_[a-z0-9_]*\)$/\1/p' | sed 's/_v[1-4]$//' | sort -u >symbols
[ "$(wc -l <symbols)" -gt 300 ]; ok $? 'there are public functions'
here=$PWD; cd "$srcdir" || exit 99
# shellcheck disable=SC2046
awk -v words="$words" '
	FNR == 1 { # ct_NOUN of the file, and in the singular
		file = FILENAME
		sub(/.*\//, "", file); sub(/\.h$/, "", file); gsub(/-/, "_", file)
	}
	/^(struct|enum) ct_[a-z0-9_]+ \{/ { noun[FILENAME " " $2] = 1 }
	/^[a-z]/ || /CT_SIMD_DECLARE/ || opened {
		line = $0
		while (match(line, /ct_[a-z0-9_]+(\(|,$|, \()/)) {
			name = substr(line, RSTART, RLENGTH)
			sub(/[,(].*$/, "", name)
			if (!(name in where)) { where[name] = FILENAME; base[name] = file }
			line = substr(line, RSTART + RLENGTH)
		}
	}
	{ opened = /CT_SIMD_DECLARE\($/ } # the name is on the next line
	function begins(name, with) { return name == with || index(name, with "_") == 1 }
	END {
		while ((getline name <symbols) > 0) {
			if (index(words, " " name " ")) continue
			if (!(name in where)) { print name ": in no header"; continue }
			good = begins(name, "ct_" base[name])
			single = base[name]; sub(/s$/, "", single)
			good = good || begins(name, "ct_" single)
			for (k in noun) {
				split(k, part, " ")
				if ((part[1] == where[name] || index(part[1], "src/core/") == 1) && begins(name, part[2])) good = 1
			}
			if (!good) print where[name] ": " name
		}
	}' symbols="$here/symbols" $(git ls-files 'src/*.h' 'formats/*.h' 2>/dev/null | grep . || find src formats -name '*.h') >"$here/bad"
[ ! -s "$here/bad" ]; ok $? 'public functions are ct_NOUN_verb'
sort "$here/bad" | sed 's/^/# /'
# shellcheck disable=SC2046
twice=$(sed -n 's/^\(struct\|enum\) \([a-z0-9_]*\) {.*/\2/p' $(find src formats -name '*.h') | sort | uniq -d)
[ -z "$twice" ]; ok $? 'no two structs share a name'
[ -z "$twice" ] || echo "$twice" | sed 's/^/# /'
done_testing
