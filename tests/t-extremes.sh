#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-sr of scans that no hospital makes: the rows of extremes.py.
. "$srcdir/tests/tap.sh"
! sanitized ct-sr || { echo '1..0 # SKIP with a sanitizer ct-sr takes more memory'; exit 0; }
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
python3 "$srcdir/tests/extremes.py" >rows 2>err
[ $? -ne 77 ] || { echo "1..0 # SKIP $(cat err)"; exit 0; }
while IFS='|' read -r _ name _ _ _ _ verdict _; do
	case $name in ' scan '|---|'') continue ;; esac
	[ "$verdict" = ' ok ' ]; ok $? "$name:$verdict"
done <rows
grep -q '^[0-9]* rows, 0 wrong,' rows; ok $? "all rows: $(tail -n 1 rows) $(tail -n 1 err)"
done_testing
