#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The parts of make check-long can pass, and can fail: with few tries of one command, then of one that
# breaks what they look for.
. "$srcdir/tests/tap.sh"
mkdir broken
# breaks TOOL: the lines that follow are run in its place, the true one being $true
breaks() {
	rm -f broken/ct-*
	{ echo "#!/bin/sh"; echo "true=$builddir/$1"; cat; } >broken/"$1"
	chmod +x broken/"$1"
}
passes() { # passes PART ARGS...: all that was tried
	builddir=$builddir sh "$srcdir/tests/long/$1.sh" "$2" "$3" >out 2>&1
	[ $? -eq 0 ] && awk -F'|' '/^row/ {n++; bad += $4 == 0 || $4 != $5} END {exit !(n && !bad)}' out
	ok $? "$1 $3 passes"
	sed 's/^/# /' out
}
fails() { # fails WORDS PART ARGS...: for that reason
	words=$1; shift
	for t in "$builddir"/ct-*; do [ ! -x "$t" ] || [ -e broken/"${t##*/}" ] || ln -s "$t" broken/; done
	builddir=$dir_/broken sh "$srcdir/tests/long/$1.sh" "$2" "$3" >out 2>&1
	[ $? -eq 1 ] && grep -q "$words" out; ok $? "$1 $3 fails: $words"
	grep -q "$words" out || sed 's/^/# /' out
	rm -f broken/ct-*
}
passes full 2 ct-degrade
echo 'for o; do :; done; $true "$@" || { s=$?; : >$o.abcdef; exit $s; }' | breaks ct-degrade
fails 'is left' full 2 ct-degrade
echo '$true "$@"; exit 0' | breaks ct-degrade
fails 'status 0' full 2 ct-degrade
# a sanitizer takes all addresses
if (ulimit -v 4000000 && exec ct-degrade --version) >/dev/null 2>&1; then
	passes memory 3 ct-degrade
	echo '[ "$(ulimit -v)" = unlimited ] || kill -ABRT $$; exec $true "$@"' | breaks ct-degrade
	fails 'status 134' memory 3 ct-degrade
else
	skip 'memory' 'no room for a limit here'
fi
# one at each of its first calls, and at others: FAULT_AT is set for one that is to fail
if command -v "${CC:-cc}" >/dev/null && ! sanitized ct-degrade; then
	passes faults 400 ct-degrade
	passes faults 400 ct-info
	passes faults 300 ct-ddnm
	echo '[ -z "$FAULT_AT" ] || kill -ABRT $$; exec $true "$@"' | breaks ct-degrade
	fails 'status 134' faults 60 ct-degrade
else
	skip 'faults' 'no compiler here, or a sanitizer'
fi
if command -v python3 >/dev/null; then
	passes peak 1 ct-upsample
	echo 'python3 -c "b = b\"x\" * (300 << 20)"; exec $true "$@"' | breaks ct-upsample
	fails 'held 3[0-9][0-9] MiB' peak 1 ct-upsample
else
	skip 'peak' 'no python3'
fi
builddir=$builddir sh "$srcdir/tests/long/kill.sh" 3 ct-fuse >out 2>&1
has out '^row|kill|SIGKILL, ct-fuse|3|3$' 'the part kill passes for ct-fuse'
echo 'case "$*" in *--resume*) exec $true "$@" -n 2 ;; esac; exec $true "$@"' | breaks ct-fuse
fails 'another result\|ended with' kill 6 ct-fuse
passes two 2 ct-fuse
echo 'case "$*" in *other*race/1) until [ -s race/1 ]; do sleep 0.1; done; exec $true --force "$@" ;; esac; exec $true "$@"' | breaks ct-fuse
fails 'both say' two 2 ct-fuse
done_testing
