#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Looks for inputs that break a reader, with libFuzzer (Debian: clang, libclang-rt-dev):
#   scripts/fuzz.sh [--seconds N | --runs N] [--keep] [TARGET...]
# TARGET is the x of tests/fuzz/fuzz-x.c; default: all of them, 60 seconds each. Builds in build-fuzz with
# AddressSanitizer and UBSan. Each begins from its seeds and tests/fuzz/corpus/TARGET.tar. --keep writes back to
# this archive at most 40 small inputs a target that reach most of what was reached, beside those that
# are named found-*. A finding is left in build-fuzz/found, to be replayed: tests/fuzz/fuzz-x FILE,
# and kept: scripts/fuzz-corpus.sh add TARGET FILE. Closes with a table.
set -e
top=$(cd "$(dirname "$0")/.." && pwd)
limit=-max_total_time=60 keep=
while :; do
	case ${1:-} in
	--seconds) limit=-max_total_time=$2; shift 2 ;;
	--runs) limit=-runs=$2; shift 2 ;;
	--keep) keep=1; shift ;;
	-*) sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
	*) break ;;
	esac
done
command -v clang >/dev/null || { echo "$0: clang is not here (Debian: clang, libclang-rt-dev)" >&2; exit 77; }
cd "$top"
[ -x configure ] || ./bootstrap >/dev/null 2>&1
build=$top/build-fuzz
mkdir -p "$build/found" && cd "$build"
# Readers may ask for little memory here: what is larger is refused as absurd.
[ -f Makefile ] || "$top/configure" CC="${CC:-clang}" CXX="${CXX:-clang++}" CFLAGS='-g -O1' CXXFLAGS='-g -O1' \
	CPPFLAGS='-DCT_FUZZER -DCT_MAX_BYTES=67108864ul' --disable-openmp \
	--enable-sanitize=fuzzer-no-link,address,undefined >configure.log 2>&1 ||
	{ tail -n 20 configure.log; exit 1; }
make -s Makefile >make.log 2>&1
all=$(make -s --eval='print-targets: ; @echo $(FUZZ_TARGETS)' print-targets)
names=${*:-$(for t in $all; do echo "${t##*/fuzz-}"; done)}
programs=
for x in $names; do
	case " $all " in
	*" tests/fuzz/fuzz-$x "*) programs="$programs tests/fuzz/fuzz-$x" ;;
	*) echo "$0: no target $x among:$(for t in $all; do printf ' %s' "${t##*/fuzz-}"; done)" >&2; exit 2 ;;
	esac
done
# shellcheck disable=SC2046
make $(make -s --eval='print-built: ; @echo $(BUILT_SOURCES)' print-built) >make.log 2>&1
make -j"$(nproc)" libct.a libctshim.a >make.log 2>&1 || { tail -n 40 make.log; exit 1; }
# shellcheck disable=SC2086
make -j"$(nproc)" LDFLAGS=-fsanitize=fuzzer LIBS="-lm -l:libgomp.so.1" $programs >>make.log 2>&1 ||
	{ tail -n 40 make.log; exit 1; }
export UBSAN_OPTIONS=print_stacktrace=1
tried=0 broken=0
printf '%-14s %12s %8s %8s  %s\n' target executed covered corpus result >table
for x in $names; do
	new=$build/corpus/$x
	rm -rf "$build/seeds/$x" && mkdir -p "$new" "$build/seeds/$x"
	"tests/fuzz/fuzz-$x" --seeds "$build/seeds/$x"
	"$top/scripts/fuzz-corpus.sh" unpack "$x" "$build/seeds/$x"
	result=sound leaks=1
	# where another library decodes, what it leaks is its own
	! grep -q 'fuzz_rounds = 0' "$top/tests/fuzz/fuzz-$x.c" || leaks=0
	ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=$leaks "tests/fuzz/fuzz-$x" "$limit" -max_len=16384 -timeout=20 -rss_limit_mb=4096 -print_final_stats=1 \
		-artifact_prefix="$build/found/$x-" "$new" "$build/seeds/$x" >"$x.log" 2>&1 || result=broken
	n=$(sed -n 's/^stat::number_of_executed_units: *//p' "$x.log" | tail -n 1)
	cov=$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$x.log" | tail -n 1)
	tried=$((tried + ${n:-0}))
	if [ "$result" = broken ]; then
		broken=$((broken + 1))
		result="BROKEN: $(grep -a -m 1 -E '^SUMMARY|runtime error|ERROR:' "$x.log")"
	fi
	if [ "$keep" ] && [ "${result#BROKEN}" = "$result" ]; then
		rm -rf "$build/least" && mkdir "$build/least"
		ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=0 "tests/fuzz/fuzz-$x" -set_cover_merge=1 -max_len=4096 "$build/least" "$build/seeds/$x" "$new" >>"$x.log" 2>&1
		rm -rf "$build/kept" && mkdir "$build/kept"
		find "$build/least" -type f -printf '%s %p\n' | sort -n | head -n 40 | while read -r _ f; do cp "$f" "$build/kept/"; done
		find "$build/seeds/$x" -type f -name 'found-*' -exec cp {} "$build/kept/" \;
		"$top/scripts/fuzz-corpus.sh" replace "$x" "$build/kept"
	fi
	printf '%-14s %12s %8s %8s  %s\n' "$x" "${n:-0}" "${cov:-0}" "$(find "$new" -type f | wc -l)" "$result" >>table
done
cat table
echo "$tried executed, $broken targets broken"
[ "$broken" -eq 0 ]
