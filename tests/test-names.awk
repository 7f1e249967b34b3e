# SPDX-License-Identifier: Apache-2.0
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
