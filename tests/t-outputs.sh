#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What a run writes: looked at before the work, in every command, and kept if it cannot be written.
. "$srcdir/tests/tap.sh"
ct-phantom --size 16x16x16 --spacing 4 marks a.nii
ct-degrade -x 2 a.nii lr.nii && ct-upsample -x 2 -m linear lr.nii up.nii
ct-project -n 8 a.nii a.exr && ct-project -n 8 --coarsen 2 a.nii low.exr
printf hello >text

# A name that cannot be written, and inputs that are not there: the output is what is told.
each() { # each NAME: every command, with OUT NAME.EXT
	for i in "ct-convert none.nii $1.nii" "ct-degrade -x 2 none.nii $1.nii" \
		"ct-upsample -x 2 none.nii $1.nii" "ct-upsample -x 2 --std $1.nii none.nii o.nii" "ct-project none.nii $1.exr" \
		"ct-fdk none.exr $1.nii" "ct-ddnm none.exr $1.exr" \
		"ct-ddnm -k 2 --std $1.exr none.exr o.exr" "ct-nabgs -b none.nii none.exr $1.ply" \
		"ct-fuse none.nii none.nii none.exr $1.nii" \
		"ct-fuse --residual-out $1.nii none.nii none.nii none.exr o.nii" \
		"ct-compose none.nii none.ply $1.nii" \
		"ct-compose --residual-out $1.nii none.nii none.ply o.nii" \
		"ct-metrics none.nii none.nii --per-slice $1.csv" \
		"ct-metrics none.nii none.nii --consistency none.nii --map $1.nii" \
		"ct-phantom cube $1.nii" "ct-train $1.safetensors none.exr" "ct-sr none.nii $1.nii"; do
		exits 4 "$i" $i
		grep -qE ": $1\.[a-z]+: " err; ok $? "the error of $i names the output"
	done
}
each nofolder/out
each /proc/out
mkdir is.nii is.exr is.ply is.csv is.safetensors; : >is.nii/file; each is
rm -r is.*
exits 4 'a file in a folder that does not exist is refused with status 4' ct-phantom -q --size 8x8x8 cube 'no dir/x/a.nii'
has err '^ct-phantom: no dir/x/a.nii: there is no folder no dir/x: make it first (mkdir -p)$' 'the error names the folder that is missing, and how to make it'
for f in nii exr ply csv safetensors; do ln -s /nowhere/at/all link.$f; done; each link
rm link.*
( trap '' XFSZ; ulimit -f 0; ct-upsample -x 2 none.nii full.nii 2>&1; echo $? ) | cat >err
[ "$(sed -n '$p' err)" = 4 ] && grep -q 'full.nii: File too large' err; ok $? 'a limit of 0 bytes for files is an error that names the output'
( ulimit -f 1; ct-phantom --size 32x32x32 cube full.nii 2>&1; echo $? ) | cat >err
[ "$(sed -n '$p' err)" = 4 ] && grep -q 'full.nii: File too large' err; ok $? 'a limit on the size of files is an error, no end'
[ -z "$(ls | grep -vE '^(a|lr|up)\.nii$|^(a|low)\.exr$|^(text|out|err)$')" ]; ok $? 'and nothing is left'

# Of two outputs one has no room: neither is there, and what was there stays.
printf 'before\n' >two.nii.gz
both() { # both COMMAND...: the first output fits, and OUT does not
	rm two.nii.gz; "$@" && n=$(cat one.nii two.nii.gz | wc -c); rm one.nii; printf 'before\n' >two.nii.gz
	( trap '' XFSZ; TMPDIR=nowhere prlimit --fsize=$((n / 2)) "$@" 2>&1; echo $? ) | cat >err # between both
	[ "$(sed -n '$p' err)" = 4 ] && grep -q 'one.nii: File too large' err; ok $? "$1: a disk that is full in between"
	[ "$(cat two.nii.gz)" = before ] && ! ls | grep -qE '^one|^two.nii.gz.'; ok $? "$1: a disk that is full in between leaves only what was there"
}
for x in auto prior; do both ct-upsample -m $x -qf --std two.nii.gz lr.nii one.nii; done
rm two.nii.gz

# The same file twice, by whatever names.
ln -s a.nii s.nii; ln a.nii h.nii; ln -s . d; cp a.nii before.nii
twice() { # twice WHAT COMMAND...
	what=$1; shift
	exits 4 "$*" "$@"
	has err "$what" "is $what"
}
for i in a.nii ./a.nii s.nii h.nii d/a.nii "$PWD/a.nii"; do
	twice 'an input of the same run' ct-degrade -f -x 2 a.nii "$i"
done
cmp -s a.nii before.nii; ok $? 'and the input is as it was'
twice 'an input of the same run' sh -c 'ct-degrade -f -x 2 - a.nii <a.nii'
twice 'an input of the same run' sh -c 'ct-degrade -f -x 2 a.nii - >>a.nii'
ln a.exr a.ply; ln a.exr a.safetensors; ln up.nii up.png # known by content
twice 'an input of the same run' ct-nabgs -f -b up.nii a.ply a.ply
twice 'an input of the same run' ct-metrics -f a.nii up.nii --consistency lr.nii --map lr.nii
twice 'an input of the same run' ct-fdk -f --grid a.nii a.exr a.nii
twice 'an input of the same run' ct-train -f a.safetensors a.exr
twice 'an input of the same run' ct-sr -f a.nii a.nii
mkdir kept
twice 'written between' ct-sr -x 2 --paper -k kept a.nii kept/lr.nii
cp a.nii kept/up.nii
twice 'written between' ct-sr -x 2 --paper -k kept kept/up.nii out.nii
rm kept/up.nii
twice 'written between' ct-sr -x 4 --paper -k kept a.nii d/kept/up.nii
has err 'kept/up.nii' 'the error of an output that is written between names it'
ct-sr --dry-run --paper --expand 7 a.nii new.nii | grep -q 'ct-convert.* --expand=7'
ok $? 'ct-sr hands on how far IN may expand'
twice 'another output of the same run' ct-compose --residual-out new.nii up.nii lr.nii ./new.nii
twice 'another output of the same run' ct-ddnm -k 2 --std new.exr low.exr d/new.exr
twice 'another output of the same run' ct-upsample --std new.nii lr.nii d/new.nii
twice 'an input of the same run' ct-upsample -f --std a.nii a.nii new.nii
cp a.exr new.exr.state
twice 'an input' ct-ddnm -f new.exr.state new.exr
twice 'an input of the same run' ct-view -f a.nii up.png -o up.png
rm new.exr.state
exits 2 'REF and TEST of one stream are refused with status 2' ct-metrics - -
exits 2 'two outputs to standard output are refused with status 2' ct-ddnm -k 2 --std - low.exr -
exits 0 'a dry run asks nothing of OUT' ct-upsample --dry-run -x 2 lr.nii nofolder/out.nii
exits 0 'OUT and IN may be pipes' sh -c 'ct-degrade -x 2 - - <a.nii | ct-info - >info'

# A result with nowhere to go is kept as the state, and is the same bytes when it is written.
kept() { # kept SUFFIX COMMAND...: the output is appended
	suffix=$1; shift
	exits 0 "$1 whole" "$@" "whole.$suffix"
	ln -s /dev/full "o.$suffix"
	exits 4 "$1 without room" "$@" "o.$suffix"
	has err 'No space left on device; the result is kept: --resume' 'a full disk names --resume, and that all is kept'
	[ "$(stat -c %a "o.$suffix.state")" = 600 ]; ok $? "the state of $1 is for its owner alone"
	rm "o.$suffix"
	exits 0 "$1 writes it" "$@" --resume "o.$suffix"
	ct-info "whole.$suffix" | sed '/^history/d; /whole/d' >1; ct-info "o.$suffix" | sed '/^history/d; /o\./d' >2
	cmp -s 1 2; ok $? "$1 makes the same with --resume as in one run"
	[ ! -e "o.$suffix.state" ]; ok $? 'and no state is left'
	rm -f "o.$suffix"
}
kept exr ct-ddnm -q -x 2 -n 2 -k 2 low.exr
kept ply ct-nabgs -q -b up.nii -n 30 -g 50 --expert max-gaussians=50 a.exr
kept nii ct-fuse -q -n 3 up.nii lr.nii a.exr
train() { ct-train -q -a model_channels=32,channel_mult=1:1,num_res_blocks=1 -p 8 --expert batch=1 -n 2 "$@" a.exr; }
ln -s /dev/full t.safetensors
exits 4 'ct-train without room ends with status 4' train t.safetensors
has err 'No space left on device; the result is kept' 'ct-train without room says that the result is kept'
rm t.safetensors
exits 0 'ct-train --resume writes a result that was kept' train --resume t.safetensors
[ -s t.safetensors ]; ok $? 'the network that ct-train --resume writes is there'

# Only its own state: one that is none, or another's, stays as it is.
cp text n.exr.state
exits 4 'no state is no state' ct-ddnm -x 2 -n 1 low.exr n.exr
exits 4 '--force takes no text in place of a state' ct-ddnm -f -x 2 -n 1 low.exr n.exr
has err 'n.exr.state: is not the state of a run' 'and that is said'
cmp -s text n.exr.state; ok $? 'a text in place of a state stays as it was'
for c in "ct-nabgs -f -n 1 -g 9 -b up.nii a.exr n.ply" "ct-fuse -f -n 1 up.nii lr.nii a.exr n.nii" \
	"ct-train -f -n 1 n.safetensors low.exr"; do
	out=$(echo "$c" | grep -o ' n\.[a-z]*' | cut -c 2-)
	cp text "$out.state"
	exits 4 "$c" $c
	cmp -s text "$out.state"; ok $? "a text in place of the state of $out stays as it was"
done
cp t.safetensors mine.safetensors
exits 4 '--resume without a state writes over nothing' train --resume mine.safetensors
has err 'mine.safetensors: exists' 'the error of --resume without a state says that the output exists'
cmp -s t.safetensors mine.safetensors; ok $? 'what was there is there'

# Rights and links.
rm -f o.nii; cp up.nii o.nii; chmod 600 o.nii
exits 0 '--force writes over a file of mode 600' ct-upsample -f -x 2 -m linear lr.nii o.nii
[ "$(stat -c %a o.nii)" = 600 ]; ok $? 'that keeps its rights'
chmod 664 o.nii; exits 0 '--force writes over a file of mode 664' ct-upsample -f -x 2 -m linear lr.nii o.nii
[ "$(stat -c %a o.nii)" = 664 ]; ok $? 'a file of mode 664 keeps its rights'
( umask 027; ct-upsample -x 2 -m linear lr.nii new.nii )
[ "$(stat -c %a new.nii)" = 640 ]; ok $? 'a new one has those of the mask'
mkdir far; cp up.nii far/o.nii; ln -s far/o.nii l.nii
exits 0 '--force writes over a symbolic link' ct-upsample -f -x 2 -m cubic lr.nii l.nii
[ -L l.nii ] && ! cmp -s up.nii far/o.nii; ok $? 'a symbolic link that is written over is followed'

# A name that ends as that of a format which a command does not write there is refused before anything is
# done, in every argument and option that writes; help tells which those are.
part ends
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

# Outputs that exist: refused by every command, forced with -f, and overwritten in a rule of make.
part make
ct-phantom -q -w -512:3071 --size 16x16x16 --spacing 4 marks hr.nii
ct-degrade -q -x 2 hr.nii lr.nii
ct-upsample -q -x 2 -m linear lr.nii up.nii
ct-project -q -n 6 hr.nii p.exr; ct-project -q -n 6 --coarsen 2 hr.nii pl.exr
ct-nabgs -q -b up.nii -n 2 -g 20 p.exr g.ply
twice() { # twice OUT COMMAND...
	out=$1; shift
	echo old >"$out"
	exits 4 "$1 does not overwrite" "$@"
	[ "$(cat "$out")" = old ]; ok $? 'the output that is not overwritten stays as it was'
	has err "$out: exists; --force overwrites it" 'and says what does'
	MAKELEVEL=1 "$@" >out 2>err; [ $? -eq 0 ] && ! grep -qx old "$out"; ok $? "$1 in a rule does"
	sed 's/^/# /' err
	echo old >"$out"
	exits 0 "$1 --force does" "$@" --force
	! grep -qx old "$out"; ok $? '--force replaces the old output'
}
twice o.nii ct-phantom -q --size 8x8x8 marks o.nii
twice o.nii ct-convert -q hr.nii o.nii
twice o.nii ct-degrade -q -x 2 hr.nii o.nii
twice o.nii ct-upsample -q -x 2 lr.nii o.nii
twice o.exr ct-project -q -n 2 hr.nii o.exr
twice o.nii ct-fdk -q p.exr o.nii
twice o.exr ct-ddnm -q -x 2 -n 1 pl.exr o.exr
twice o.ply ct-nabgs -q -b up.nii -n 2 -g 20 p.exr o.ply
twice f.nii ct-fuse -q -n 1 up.nii lr.nii p.exr f.nii
twice o.nii ct-compose -q up.nii g.ply o.nii
twice o.nii ct-sr -q -x 2 -Q draft lr.nii o.nii
twice o.csv ct-metrics -q --per-slice o.csv hr.nii up.nii
case " $CT_TOOLS " in *' ct-view '*) twice o.png ct-view -q hr.nii o.png ;; esac
twice o.safetensors ct-train -q --arch model_channels=32,channel_mult=1 -p 8 --expert batch=1 -n 1 o.safetensors p.exr

if command -v make >/dev/null 2>&1; then
	printf '%%.hr.nii: %%.nii\n\tct-sr -q -x 2 -Q draft $< $@\n%%.kept.nii: %%.nii\n\tct-sr -v -x 2 --paper --expert views=2,iterations=2,gaussians=20 --keep $*.work $< $@\n' >Makefile
	cp lr.nii a.nii
	exits 0 'make runs a rule of ct-sr' make a.hr.nii a.kept.nii
	exits 0 'when all is there' make -q a.hr.nii a.kept.nii
	touch -d '+1 minute' a.nii
	exits 0 'when the input is newer' make a.hr.nii a.kept.nii
	has err '7 of 7 steps were done' 'though it holds the same'
	[ a.hr.nii -nt lr.nii ]; ok $? 'it is made again'
else
	skip 'a rule' 'no make'
fi

# No command removes or changes a file or folder that it was not told to write: what stands beside OUT has names
# like OUT, like temporary files of any version, and like working folders with a mark that is not theirs.
part neighbours
mkdir in w && cd in || exit 99
ct-phantom -q -w -512:3071 --size 16x16x16 --spacing 4 marks hr.nii
ct-degrade -q -x 2 hr.nii lr.nii
ct-degrade -q -x 4 hr.nii lr4.nii
ct-upsample -q -x 2 -m linear lr.nii up.nii
ct-project -q -n 12 hr.nii hr.exr
ct-phantom -q -w -512:3071 --size 24x24x24 --spacing 4 marks big.nii && ct-project -q -n 8 --coarsen 4 big.nii low.exr
ct-nabgs -q -n 20 -g 100 --expert max-gaussians=100 -b up.nii hr.exr residual.ply >/dev/null
ct-convert -q hr.nii dicom/ 2>/dev/null
[ -s residual.ply ] || exit 99
cd ../w || exit 99
host=$(uname -n) boot=$(cat /proc/sys/kernel/random/boot_id)
mark() { # mark FOLDER OF [HOST [BOOT [INODE]]]: a working folder of a killed run
	mkdir -m 700 "$1"
	printf 'ctsr temporary 1\ninode %s\nof %s\nhost %s\nboot %s\n' "${5-$(stat -c %i "$1")}" "$2" "${3-$host}" "${4-$boot}" >"$1/mark"
	echo data >"$1/data"
}
neighbours() { # neighbours OUT: more than 30, named like it
	for end in .ct-thorax .ct-abdome .ct-Ab3xY9 .state.ct-000000 .ct-locked .state.ct-locked .tmp .part .json.ct-ABCDEF; do
		echo "$1$end" >"$1$end"; echo "$1$end" >"x$1$end"
	done
	for end in .ct-pelvis .ct-XXXXXX .state.ct-folder .ct-q00000; do
		mkdir -p "$1$end/deep"; echo a >"$1$end/a.dcm"; echo b >"$1$end/deep/b"; cp "$1$end/a.dcm" "$1$end/ctsr0001.dcm"
	done
	ln -s ../in/hr.nii "$1.ct-linked"; ln -s nowhere "$1.ct-broken"; mkfifo "$1.ct-fifo00"
	k=$((k + 1))
	n=$(printf .ctsr-tmp-n%02d $k)
	echo file >"${n}fff"; mkdir -m 700 "${n}eee"; mkdir -m 700 "${n}uuu"; echo mine >"${n}uuu/data"
	mark "${n}hhh" "$1" elsewhere 0-0
	mark "${n}iii" "$1" "$host" "$boot" 1
	mark "${n}bbb" "$1x"; mark "${n}sss" "$1.state.more"; mark "${n}eeX" ''
	mark "${n}rrr" "$1"; chmod 755 "${n}rrr"
	mark "${n}mmm" "$1"; echo note >"${n}mmm/note"
	mark "${n}ddd" "$1"; rm "${n}ddd/data"; mkdir "${n}ddd/data"; echo scan >"${n}ddd/data/scan.dcm"
	mark "${n}DDD" "$1"; rm "${n}DDD/data"; mkdir -p "${n}DDD/data/ctsr0001.dcm"
	mark "${n}lll" "$1"; mv "${n}lll/mark" "${n}lll.mark"; ln -s "../${n}lll.mark" "${n}lll/mark"
	mark "${n}aaa" "$1"; cp -a "${n}aaa" "${n}ccc"; rm -r "${n}aaa"
	mark "${n}zzz" "$1"; echo more >>"${n}zzz/mark"
	mark "${n}long" "$1"; mark "ctsr-tmp-$k" "$1"; ln -s "ctsr-tmp-$k" "${n}LLL"
}
outs='o.nii o.nii.gz o.mha o.nrrd series o.dcm o.exr o.png o.html o.ply o.safetensors o2.nii o.csv o.json o.txt'
k=0
for o in $outs; do neighbours "$o"; done
cp -r ../in/hr.nii keep.ct-folder
but=$(for o in $outs o.safetensors.state kept; do printf ' ! ( -path ./%s -o -path ./%s/* )' $o $o; done)
seen() { # all but what was to be written
	set -f
	# shellcheck disable=SC2086
	{ find . -mindepth 1 $but -printf '%y %m %u %p %l\n'; find . -type f $but -exec cksum {} +; } | sort
	set +f
}
seen >../before
[ "$(grep -c '^[dflp] ' ../before)" -gt 200 ]; ok $? "there are $(grep -c '^[dflp] ' ../before) neighbours"
stays() { # stays NAME: nothing is gone or changed, nothing came
	seen >../after
	cmp -s ../before ../after; ok $? "$1: all that stands beside it is as it was"
	diff ../before ../after | head -n 20 | sed 's/^/# /'
}
run() { # run OUT COMMAND...: twice, the second time over what is there
	o=$1; shift
	if "$@" >../out 2>../err && "$@" -f >>../out 2>>../err && [ -e "$o" ]; then stays "$*"; else ok 1 "$*: $(tail -n 1 ../err)"; fi
}
i=../in
for o in o.nii o.nii.gz o.mha o.nrrd; do run $o ct-convert -q $i/hr.nii $o; done
[ ! -e $i/dicom ] || for o in series/ o.dcm; do run $o ct-convert -q $i/hr.nii $o; done
rm -rf o.nii o.exr series
run o.nii ct-phantom -q --size 9x9x9 cube o.nii; rm o.nii
run o.nii ct-degrade -q -x 2 $i/hr.nii o.nii; rm o.nii
run o.nii ct-upsample -q -x 2 $i/lr.nii o.nii; rm o.nii
run o2.nii ct-upsample -q -m prior -x 2 --std o2.nii $i/lr.nii o.nii; rm o.nii
rm o2.nii; run o2.nii ct-sr -q --confidence o2.nii $i/lr.nii o.nii; rm o.nii
[ ! -e $i/dicom ] || run series/ ct-sr -q -x 2 $i/dicom/ series/
run o.exr ct-project -q -n 6 $i/hr.nii o.exr
run o.nii ct-fdk -q $i/hr.exr o.nii; rm o.nii
run o.nii ct-compose -q $i/up.nii $i/residual.ply o.nii; rm o.nii
run o.nii ct-fuse -q -n 4 $i/up.nii $i/lr.nii $i/hr.exr o.nii; rm o.nii o.exr
run o.exr ct-ddnm -q -x 4 -n 2 $i/low.exr o.exr
run o.ply ct-nabgs -q -b $i/up.nii -n 20 -g 100 --expert max-gaussians=100 $i/hr.exr o.ply
run o.safetensors ct-train -q --arch model_channels=32,channel_mult=1 -p 8 --expert batch=2 -n 2 o.safetensors $i/hr.exr
run o.nii ct-metrics -q --consistency $i/lr.nii --map o.nii $i/hr.nii; rm -f o.nii
run o.nii ct-sr -q -x 4 --paper --expert views=6,iterations=20,gaussians=100 --keep kept $i/lr4.nii o.nii; rm -rf kept o.nii
TMPDIR=. run o.nii ct-sr -q -x 4 --paper --expert views=6,iterations=20,gaussians=100 $i/lr4.nii o.nii; rm -f o.nii
[ ! -e $i/dicom ] || run o.json ct-convert -q --sidecar=o.json $i/dicom/ o.nii; rm -f o.nii
run o.csv ct-metrics -q --per-slice=o.csv $i/hr.nii $i/up.nii
run o.html ct-report -q $i/lr.nii $i/up.nii o.html
run o.png ct-view -q $i/hr.nii o.png
signalled 1 9 ct-nabgs -q -b $i/up.nii -n 20 -g 100 --expert max-gaussians=100 -f $i/hr.exr o.ply 2>/dev/null
run o.ply ct-nabgs -q -f -b $i/up.nii -n 20 -g 100 --expert max-gaussians=100 $i/hr.exr o.ply
lib=$(ls "$builddir"/libctsr.so.0 "$builddir"/.libs/libctsr.so.0 2>/dev/null | head -n 1)
if [ -n "$lib" ] && python_with numpy && ! sanitized ct-sr; then
	for o in o.nii o.nii.gz o.mha o.nrrd; do
		rm -f $o
		CTSR_LIBRARY=$lib PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$srcdir/python "$PY" -c "
import ctsr, sys
v = ctsr.read(sys.argv[1])
ctsr.write(v, sys.argv[2])
ctsr.write(v, sys.argv[2], overwrite=True)" $i/hr.nii $o 2>../err
		[ -s $o ]; ok $? "Python writes $o"; sed 's/^/# /' ../err
		stays "Python, $o"
	done
else
	skip 'Python' 'no shared library, or no numpy'
fi
done_testing
