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
		grep -qE ": $1\.[a-z]+: " err; ok $? 'names the output'
	done
}
each nofolder/out
each /proc/out
mkdir is.nii is.exr is.ply is.csv is.safetensors; : >is.nii/file; each is
rm -r is.*
for f in nii exr ply csv safetensors; do ln -s /nowhere/at/all link.$f; done; each link
rm link.*
( trap '' XFSZ; ulimit -f 0; ct-upsample -x 2 none.nii full.nii 2>&1; echo $? ) | cat >err
[ "$(sed -n '$p' err)" = 4 ] && grep -q 'full.nii: File too large' err; ok $? 'a full folder'
( ulimit -f 1; ct-phantom --size 32x32x32 cube full.nii 2>&1; echo $? ) | cat >err
[ "$(sed -n '$p' err)" = 4 ] && grep -q 'full.nii: File too large' err; ok $? 'a limit on the size of files is an error, no end'
[ -z "$(ls | grep -vE '^(a|lr|up)\.nii$|^(a|low)\.exr$|^(text|out|err)$')" ]; ok $? 'and nothing is left'

# Of two outputs one has no room: neither is there, and what was there stays.
printf 'before\n' >two.nii.gz
both() { # both COMMAND...: the first output fits, and OUT does not
	rm two.nii.gz; "$@" && n=$(cat one.nii two.nii.gz | wc -c); rm one.nii; printf 'before\n' >two.nii.gz
	( trap '' XFSZ; TMPDIR=nowhere prlimit --fsize=$((n / 2)) "$@" 2>&1; echo $? ) | cat >err # between both
	[ "$(sed -n '$p' err)" = 4 ] && grep -q 'one.nii: File too large' err; ok $? "$1: a disk that is full in between"
	[ "$(cat two.nii.gz)" = before ] && ! ls | grep -qE '^one|^two.nii.gz.'; ok $? 'leaves nothing'
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
has err 'kept/up.nii' 'which it names'
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
exits 2 'one stream in' ct-metrics - -
exits 2 'one stream out' ct-ddnm -k 2 --std - low.exr -
exits 0 'a dry run asks nothing of OUT' ct-upsample --dry-run -x 2 lr.nii nofolder/out.nii
exits 0 'OUT and IN may be pipes' sh -c 'ct-degrade -x 2 - - <a.nii | ct-info - >info'

# A result with nowhere to go is kept as the state, and is the same bytes when it is written.
kept() { # kept SUFFIX COMMAND...: the output is appended
	suffix=$1; shift
	exits 0 "$1 whole" "$@" "whole.$suffix"
	ln -s /dev/full "o.$suffix"
	exits 4 "$1 without room" "$@" "o.$suffix"
	has err 'No space left on device; the result is kept: --resume' 'a full disk names --resume, and that all is kept'
	[ "$(stat -c %a "o.$suffix.state")" = 600 ]; ok $? 'for its owner'
	rm "o.$suffix"
	exits 0 "$1 writes it" "$@" --resume "o.$suffix"
	ct-info "whole.$suffix" | sed '/^history/d; /whole/d' >1; ct-info "o.$suffix" | sed '/^history/d; /o\./d' >2
	cmp -s 1 2; ok $? 'the same'
	[ ! -e "o.$suffix.state" ]; ok $? 'and no state is left'
	rm -f "o.$suffix"
}
kept exr ct-ddnm -q -x 2 -n 2 -k 2 low.exr
kept ply ct-nabgs -q -b up.nii -n 30 -g 50 --expert max-gaussians=50 a.exr
kept nii ct-fuse -q -n 3 up.nii lr.nii a.exr
train() { ct-train -q -a model_channels=32,channel_mult=1:1,num_res_blocks=1 -p 8 --expert batch=1 -n 2 "$@" a.exr; }
ln -s /dev/full t.safetensors
exits 4 'ct-train without room' train t.safetensors
has err 'No space left on device; the result is kept' 'ct-train without room says that the result is kept'
rm t.safetensors
exits 0 'and writes it' train --resume t.safetensors
[ -s t.safetensors ]; ok $? 'there it is'

# Only its own state: one that is none, or another's, stays as it is.
cp text n.exr.state
exits 4 'no state is no state' ct-ddnm -x 2 -n 1 low.exr n.exr
exits 4 'by force neither' ct-ddnm -f -x 2 -n 1 low.exr n.exr
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
has err 'mine.safetensors: exists' 'and says so'
cmp -s t.safetensors mine.safetensors; ok $? 'what was there is there'

# Rights and links.
rm -f o.nii; cp up.nii o.nii; chmod 600 o.nii
exits 0 'over a file' ct-upsample -f -x 2 -m linear lr.nii o.nii
[ "$(stat -c %a o.nii)" = 600 ]; ok $? 'that keeps its rights'
chmod 664 o.nii; exits 0 'and again' ct-upsample -f -x 2 -m linear lr.nii o.nii
[ "$(stat -c %a o.nii)" = 664 ]; ok $? 'wider ones too'
( umask 027; ct-upsample -x 2 -m linear lr.nii new.nii )
[ "$(stat -c %a new.nii)" = 640 ]; ok $? 'a new one has those of the mask'
mkdir far; cp up.nii far/o.nii; ln -s far/o.nii l.nii
exits 0 'over a link' ct-upsample -f -x 2 -m cubic lr.nii l.nii
[ -L l.nii ] && ! cmp -s up.nii far/o.nii; ok $? 'which is followed'
done_testing
