#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Manners that every command has.
. "$srcdir/tests/tap.sh"
for t in $CT_TOOLS; do
	exits 0 "$t --help" "$t" --help
	grep -q 'Usage: ' out && grep -q -- '--threads' out; ok $? "$t --help says how to use it"
	exits 0 "$t --version" "$t" --version
	grep -q "^$t (ctsr) [0-9]" out; ok $? "$t --version names it"
	exits 2 "$t rejects an unknown option" "$t" --no-such-option
	[ ! -s out ] && grep -q "^$t: " err; ok $? "$t prints errors on standard error only"
	exits 2 "$t needs its operands" "$t"
	"$t" --help | tail -n 1 | grep -q '^Cite: man ct-references$'; ok $? "$t --help says how to cite"
	if [ -w /dev/full ]; then
		"$t" --help >/dev/full 2>err; [ $? -eq 4 ]; ok $? "$t notices a full disk"
	fi
	( "$t" --help; echo $? >code ) 2>err | head -c 1 >out # a closed pipe is no noise
	[ ! -s err ]; ok $? "$t is quiet when the pipe closes"
	[ -f "$srcdir/man/$t.1.in" ]; ok $? "$t has a man page"
	sed -n '/^.Sh EXIT STATUS/,/^.Sh SEE/p' "$srcdir/man/$t.1.in" >page
	left=$(for s in 0 1 2 3 4 5 7 75; do grep -qw -- $s page || echo $s; done)
	[ -z "$left" ]; ok $? "$t: its page lists the exit statuses $left"
	exits 2 "$t: an option with an empty file" "$t" ''
	if command -v mandoc >/dev/null 2>&1; then
		page=$srcdir/man/$t.1; [ -f "$page" ] || page=$builddir/man/$t.1
		mandoc -Tlint -W warning "$page" >lint 2>&1 || { grep -v "sections out of conventional order: Sh DESCRIPTION" lint >left; mv left lint; [ ! -s lint ]; }; ok $? "$t: mandoc finds nothing"
		sed 's/^/# /' lint
	else
		skip "$t: mandoc finds nothing" 'no mandoc'
	fi
done
# a library that is not linked need not be there: who asks for volumes reads no other format
for t in ct-degrade; do
	if command -v ldd >/dev/null; then
		! ldd "$(command -v $t)" | grep -qE 'OpenEXR|deflate'; ok $? "$t links no library of EXR"
	else
		skip "$t links no library of EXR" 'no ldd'
	fi
done
# keys of --expert are no options, and nothing calls them so: of a command its page and its file, of all the rest
options() { "$1" --help | sed -n '/^Keys of --expert/q; s/^  .* --\([a-z0-9-]*\).*/\1/p'; }
keys() { "$1" --help | sed -n '1,/^Keys of --expert/d; s/^      \([a-z0-9-]*\)=.*/\1/p'; }
called() { grep -InE -- "(--|\\\\-)($1)([^a-z0-9-]|\$)" $2 /dev/null; } # called KEY|... FILES: as options
for t in $CT_TOOLS; do
	options "$t" | sort >options; keys "$t" | sort >keys
	cat options >>all-options; cat keys >>all-keys
	left=$(comm -13 options keys | paste -sd '|' -)
	[ -z "$left" ] || ! called "$left" "$srcdir/man/$t.1.in $srcdir/src/tools/$t.c"; ok $? "$t: no key of --expert is called an option"
done
sort -u all-options >options; sort -u all-keys >keys
left=$(comm -13 options keys | paste -sd '|' -)
[ -n "$left" ] && ! called "$left" "$(find "$srcdir/src/tools" "$srcdir/man" "$srcdir/doc" "$srcdir/examples" "$srcdir/README.md" -type f | tr '\n' ' ')"; ok $? "nor is $left in any text"
# a file that is not there: status 3 and its name, nothing made
missing() { # missing TOOL ARGS...
	exits 3 "$1 names a missing file" "$@"
	has err 'none\.' "$1 says which"
	[ ! -e new.nii ] && [ ! -e new.exr ] && [ ! -e new.ply ] && [ ! -e new.txt ]; ok $? "$1 leaves nothing"
}
missing ct-convert none.nii new.nii
missing ct-degrade -x 2 none.nii new.nii
missing ct-upsample -x 2 none.nii new.nii
missing ct-project none.nii new.exr
missing ct-fdk none.exr new.nii
missing ct-ddnm -x 2 none.exr new.exr
missing ct-nabgs --base none.nii none.exr new.ply
missing ct-fuse none.nii none.nii none.exr new.nii
missing ct-compose none.nii none.ply new.nii
missing ct-metrics none.nii none.nii
missing ct-report none.nii none.nii new.html
missing ct-info none.nii
missing ct-profile none.nii none.nii new.txt
exits 3 'a phantom too large for any memory is refused' ct-phantom --size 100000x100000x100000 sphere huge.nii
has err '^ct-phantom: --size: array of' 'the error of a phantom that is too large names its option'

# The level of the processor changes no byte of the results, but what goes through the product of
# matrices at v2, which has no fused multiply-add (src/core/simd.h).
part levels
unset CTSR_CPU
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

# ct-sr of scans that no hospital makes: the rows of extremes.py. With a sanitizer ct-sr takes more memory.
part extremes
if ! sanitized ct-sr && command -v python3 >/dev/null; then
	python3 "$srcdir/tests/extremes.py" >rows 2>err; rc=$?
	if [ $rc -eq 77 ]; then skip 'the rows of extremes.py' "$(cat err)"; fi
	with_dicom || skip 'the rows of extremes.py that are DICOM' 'no VTK'
	while IFS='|' read -r _ name _ _ _ _ verdict _; do
		case $name in ' scan '|---|'') continue ;; esac
		[ "$verdict" = ' ok ' ]; ok $? "$name:$verdict"
	done <rows
	[ $rc -eq 77 ] || { grep -q '^[0-9]* rows, 0 wrong,' rows; ok $? "all rows: $(tail -n 1 rows) $(tail -n 1 err)"; }
fi
done_testing
