#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Credits: CITATION.cff is the form of version 1.2.0, says the version of configure.ac, and names the paper as the documents do.
. "$srcdir/tests/tap.sh"
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
grep '^pkgdata_DATA' "$srcdir/src/local.mk" | grep -q 'src/prior/README.md'; ok $? 'the cards of the networks are installed beside them'
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
done_testing
