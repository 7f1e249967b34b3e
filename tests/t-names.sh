#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A public function is ct_NOUN_verb (CONTRIBUTING, "Names"): NOUN is the file that declares it, or a
# struct or enum of that header or of src/core that it is about; or it is one of the few words that every file uses.
. "$srcdir/tests/tap.sh"
words=' ct_fail ct_fail_errno ct_blame ct_alloc ct_alloc0 ct_grow ct_size_mul ct_log ct_progress ct_progress_until ct_stopping
	ct_check_stop ct_philox ct_slurp ct_put '
words=" $(echo $words) "
command -v nm >/dev/null || { skip 'public functions are ct_NOUN_verb' 'nm is not here'; done_testing; }
nm -g --defined-only "$builddir/libct.a" 2>/dev/null |
	sed -n 's/^[0-9a-f]* [TW] \(ct_[a-z0-9_]*\)$/\1/p' | sed 's/_v[1-4]$//' | sort -u >symbols
[ "$(wc -l <symbols)" -gt 300 ]; ok $? 'there are public functions'
cd "$srcdir" || exit 99
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
	}' symbols="$dir_/symbols" $(git ls-files 'src/*.h' 'formats/*.h' 2>/dev/null | grep . || find src formats -name '*.h') >"$dir_/bad"
[ ! -s "$dir_/bad" ]; ok $? 'public functions are ct_NOUN_verb'
sort "$dir_/bad" | sed 's/^/# /'
# shellcheck disable=SC2046
twice=$(sed -n 's/^\(struct\|enum\) \([a-z0-9_]*\) {.*/\2/p' $(find src formats -name '*.h') | sort | uniq -d)
[ -z "$twice" ]; ok $? 'no two structs share a name'
[ -z "$twice" ] || echo "$twice" | sed 's/^/# /'
done_testing
