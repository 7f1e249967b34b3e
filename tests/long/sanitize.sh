#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# sanitize.sh [TEST...]: the tests under AddressSanitizer, LeakSanitizer and UBSan, C programs and shell tests, whose
# commands are built likewise; all of them, or TEST as in t-core, fuzz/fuzz-ply or t-sr.sh. Builds in build-sanitize. Any
# report of any process is a failure, also where a test expects its command to fail.
. "$(dirname "$0")/lib.sh"
build=$srcdir/build-sanitize
[ -x "$srcdir/configure" ] || (cd "$srcdir" && ./bootstrap >/dev/null 2>&1)
mkdir -p "$build" && cd "$build" || exit 99
[ -f Makefile ] || "$srcdir/configure" CC="${CC:-gcc}" CXX="${CXX:-g++}" CFLAGS='-g -O1' CXXFLAGS='-g -O1' --enable-sanitize >configure.log 2>&1 ||
	{ tail -n 20 configure.log; exit 1; }
make -j"$(nproc)" >make.log 2>&1 || { tail -n 40 make.log; exit 1; }
say() { make -s --eval="say: ; @echo \$($1)" say; }
tests=${*:-$(for t in $(say TESTS); do echo "${t#tests/}"; done)}
programs=$(for t in $tests; do case $t in (*.sh) ;; (*) echo "tests/$t" ;; esac; done)
called=$(cat "$srcdir"/tests/*.sh | grep -o 'builddir"*/tests/t-[a-z-]*' | sed 's/.*tests/tests/' | sort -u)
# shellcheck disable=SC2086
make -j"$(nproc)" $programs $called >>make.log 2>&1 || { tail -n 40 make.log; exit 1; }
cat >"$work/leaks" <<'END'
END
export ASAN_OPTIONS="log_path=$work/report:allocator_may_return_null=1:detect_leaks=1" \
	LSAN_OPTIONS="suppressions=$work/leaks:print_suppressions=0" \
	UBSAN_OPTIONS="log_path=$work/report:print_stacktrace=1"
CT_TOOLS=$(say bin_PROGRAMS)
PATH=$build:$PATH LC_ALL=C builddir=$build
export CT_TOOLS PATH LC_ALL builddir srcdir
unset CT_THREADS OMP_NUM_THREADS
run_test() { # run_test NAME COMMAND...: 77 and a plan of nothing are skips, no failures
	name=$1; shift
	rm -f "$work"/report.*
	timeout 3600 "$@" >"$work/out" 2>"$work/err"
	got=$?
	# a test that limits its memory leaves none to the sanitizer, and what is refused is an exception elsewhere
	found=$(grep -LE 'AddressSanitizer( failed to allocate|: allocator is out of memory)' "$work"/report.* 2>/dev/null | xargs -r cat)
	[ -z "$found" ] && { [ $got -eq 0 ] || [ $got -eq 77 ]; }
	tally $? "$name: status $got; $(grep '^not ok' "$work/out" | head -n 3 | tr '\n' ' ')
$(echo "$found" | grep -E 'ERROR|runtime error|SUMMARY|    #[0-6] ' | head -n 12)"
}
[ -z "$programs" ] || row 'C tests under ASan and UBSan'
for t in $tests; do case $t in *.sh) ;; *) run_test "$t" "tests/$t" ;; esac; done
case "$tests" in *.sh*) row 'shell tests, their commands under ASan and UBSan' ;; esac
for t in $tests; do case $t in *.sh) run_test "$t" sh "$srcdir/tests/$t" ;; esac; done
finish
