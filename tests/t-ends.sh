#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A name that ends as that of a format which a command does not write there is refused before anything is
# done, in every argument and option that writes; help tells which those are.
. "$srcdir/tests/tap.sh"
# rows that write say how: TOOL ROW ENDS [CONDITION ENDS]
for t in $CT_TOOLS; do
	"$t" --help | awk -v t="$t" 'NR == 1 {next}
		/^  (-[a-zA-Z],|   ) --/ {match($0, /--[a-z0-9-]+/); row = substr($0, RSTART, RLENGTH)}
		/^  [A-Z]/ {row = $1}
		/^ +\[ends in / {text = ""; on = 1}
		on {text = text " " $0}
		on && /\]$/ {on = 0; gsub(/ +/, " ", text); gsub(/^ \[ends in |\]$/, "", text); print t, row, text}'
done >rows
[ "$(grep -c . rows)" -ge 20 ]; ok $? 'there are rows of options that write'
for t in $CT_TOOLS; do
	case $t in ct-info) continue ;; esac
	grep -q "^$t " rows; ok $? "$t writes"
done
(cd "$srcdir" && grep -nE 'CT_ARG(_MAYBE)?\(.*CT_(RE|READS_)?WRITES' src/tools/*.c); [ $? -eq 1 ]
ok $? 'every row that writes says how it ends' # and those of options have to, for the compiler

known='nii nii.gz exr ply safetensors png csv json dcm IMA mha mhd nrrd nhdr hdr npy raw tif jpg nii.zst NRRD gz zip pt gzz htm v2'
try() { # try TOOL ROW ENDING EXTRA...: the command with that name there
	tool=$1 row=$2 name=x$3; shift 3
	set -- "$tool" "$@"
	case $row in --*) set -- "$@" "$row=$name" ;; esac
	for i in $operands; do
		case $i in
		"$row") set -- "$@" "$name" ;;
		"$row...") set -- "$@" none.x "$name" ;;
		KIND) set -- "$@" cube ;;
		*) set -- "$@" "none-$#" ;;
		esac
	done
	timeout 20 "$@" >out 2>err </dev/null; rc=$?
	printf '%s\n' "$*" >line
}
check() { # check TOOL ROW ENDS EXTRA...: no others
	tool=$1 row=$2 ends=$3; shift 3
	operands=$("$tool" --help | sed -n '1s/^Usage: [^ ]* [^ ]*//p')
	for end in $known; do
		mine=no
		for i in $ends; do [ "$(echo "$end" | tr A-Z a-z)" = "$i" ] && mine=yes; done
		try "$tool" "$row" ".$end" "$@"
		[ $mine = no ] || rm -f "x.$end"
		if [ $mine = yes ]; then
			grep -q "x.$end: .*is written as" err && cat line
		else
			{ [ $rc -eq 2 ] && grep -q "^$tool: x.$end: .*$row.* is written as \." err; } || cat line
		fi
	done >wrong
	[ ! -s wrong ]; ok $? "$tool $row $*: $ends, and no other"
	sed 's/^/# /' wrong
	for end in '' .5 1.5mm; do try "$tool" "$row" "$end" "$@"; ! grep -q 'is written as' err || cat line; done >wrong
	[ ! -s wrong ]; ok $? "$tool $row: a name without an end"
}
while read -r tool row text; do
	words() { echo " $1" | sed 's/,/ /g; s/ or / /g; s/ \.\([a-z]\)/ \1/g'; }
	while case $text in *' with '*', else '*) ;; *) false ;; esac; do
		opt=${text#* with }; opt=${opt%%, else*}
		value=$("$tool" --help | sed -n "s/^  .. *$opt=\(.*|\)\{0,1\}\([^ ]*\).*/=\2/p")
		# shellcheck disable=SC2046,SC2086
		check "$tool" "$row" "$(words "${text%% with *}")" $opt$value
		text=${text#*, else }
	done
	check "$tool" "$row" "$(words "$text")"
done <rows
ct-phantom -q --size 4x4x4 cube plain.nii
exits 2 'a dry run too' ct-upsample --dry-run -x 2 plain.nii up.mha
exits 0 'a name that says nothing' ct-convert plain.nii plain
exits 0 'an end in capitals is taken' ct-convert plain.nii plain.NII.GZ
gzip -t <plain.NII.GZ; ok $? 'which is what it says'
ct-convert plain.nii /dev/stdout | cat >again.nii; exits 0 'a pipe under its name' ct-metrics --min psnr=1000 plain.nii again.nii
mkfifo pipe.fifo; timeout 60 cat pipe.fifo >again.nii & ct-convert -q plain.nii pipe.fifo; ok $? 'a FIFO of any name is written'; wait; exits 0 'what a FIFO got is the same CT' ct-metrics --min psnr=1000 plain.nii again.nii
rm -f x x.5 x1.5mm; ! ls x* 2>/dev/null; ok $? 'and nothing was made'
done_testing
