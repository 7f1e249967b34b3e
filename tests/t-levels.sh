#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The level of the processor changes no byte of the results, but what goes through the product of
# matrices at v2, which has no fused multiply-add (src/core/simd.h).
unset CTSR_CPU
. "$srcdir/tests/tap.sh"
CTSR_CPU=v5 ct-phantom sphere out.nii 2>err; [ $? -eq 2 ]; ok $? 'a level that there is not is refused'
has err "v5" 'the error of an unknown level names it'
if grep -q 'one level only' err; then
	skip 'levels give the same bytes' 'this processor has one level only'
	done_testing
fi
at() { CTSR_CPU=$1 ct-phantom -f --size 4x4x4 sphere out.nii 2>err; } # at LEVEL
at v2; ok $? 'all commands run at level v2'
at v3 || { skip 'v3 and v4' 'this processor has no v3'; done_testing; }
at v4; has_v4=$?
[ "$has_v4" -eq 0 ] || { [ "$has_v4" -eq 2 ] && grep -q 'at most' err; }
ok $? 'a level that this processor lacks is refused'
highest=v3; [ "$has_v4" -ne 0 ] || highest=v4
export SAME='volumes projections fits'
sh "$srcdir/scripts/outputs.sh" "$builddir" >best 2>err; ok $? 'all commands run at the best level'
[ "$(wc -l <best)" -gt 45 ]; ok $? 'and write their files'
for v in v2 v3 v4; do CTSR_CPU=$v sh "$srcdir/scripts/outputs.sh" "$builddir" >"$v" 2>err; done
if [ "$has_v4" -eq 0 ]; then
	diff v3 v4 >differ; ok $? 'v3 and v4 give the same bytes'
	sed 's/^/# /' differ
else
	skip 'v3 and v4 give the same bytes' 'this processor has no v4'
fi
diff best "$highest" >differ; ok $? 'the highest level is the one that is taken'
diff v2 v3 | sed -n 's/^> [0-9a-f]* *//p' | grep -v -e '-h*tv\.nii$' -e '^blind\.nii$' -e '^map\.nii$' \
	-e '^consistency\.txt$' -e '^fused.*\.nii$' >differ
[ ! -s differ ]; ok $? 'at v2 only volumes of least variation differ'
sed 's/^/# /' differ
done_testing
