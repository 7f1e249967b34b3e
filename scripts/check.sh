#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds in a folder of its own, runs the tests. From a fresh clone:
#   scripts/check.sh [--sanitize]
# Closes with a line "N passed, N failed, N skipped".
set -e
top=$(cd "$(dirname "$0")/.." && pwd)
"$top/scripts/install-deps.sh" tests
cd "$top"
[ -x configure ] || ./bootstrap >/dev/null 2>&1
options='--enable-werror CFLAGS=-O2 CXXFLAGS=-O2' build=$top/build-check # -g takes an eighth of the build
if [ "${1:-}" = --sanitize ]; then options='--enable-werror --enable-sanitize' build=$top/build-sanitize; fi
mkdir -p "$build" && cd "$build"
# shellcheck disable=SC2086
[ -f Makefile ] || "$top/configure" $options
make -j"$(nproc)" >make.log 2>&1 || { tail -n 40 make.log; exit 1; }
status=0
make -j"$(nproc)" check >check.log 2>&1 || status=$?
grep -hE '^(FAIL|ERROR|XPASS):' check.log || true
if [ "$status" -ne 0 ]; then
	for t in tests/*.trs; do
		grep -qE '^:test-result: (FAIL|ERROR)' "$t" && { echo "== ${t%.trs}.log"; tail -n 40 "${t%.trs}.log"; }
	done
fi
awk '/^:test-result:/ {c[$2]++} END {
	printf "%d passed, %d failed, %d skipped\n", c["PASS"] + c["XFAIL"],
		c["FAIL"] + c["ERROR"] + c["XPASS"], c["SKIP"] + 0 }' tests/*.trs
exit "$status"
