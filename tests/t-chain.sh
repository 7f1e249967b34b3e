#!/bin/sh
# A chain of commands by content: what is done again and what is not; one run a folder; signals.
. "$srcdir/tests/tap.sh"
ulimit -t 60 # what does not stop when it should is stopped
for k in marks cube; do
	ct-phantom -q -w -512:3071 --size 24x24x24 --spacing 4 $k hr.nii && ct-degrade -q -x 2 hr.nii $k.nii
	mv hr.nii hr-$k.nii
done
cp marks.nii in.nii
few='--paper --expert views=2,iterations=2,gaussians=20'
# shellcheck disable=SC2086
set -- ct-sr -v -x 2 $few --keep k
said() { has err "^ct-sr: $1 steps were done\$" "$2"; } # said 'N of M' NAME
alone() { # alone FILE...: FILE is what a run of its own makes of in.nii
	rm -rf own; mkdir own; cp in.nii own/in.nii
	(cd own && ct-sr -q -x 2 $few in.nii sr.nii); cmp -s own/sr.nii "$1"; ok $? "$2"
}
exits 0 'a chain that is kept' "$@" in.nii sr.nii
alone sr.nii 'gives the bytes of one that is not: no folder is named'
exits 0 'nothing to do' "$@" in.nii sr.nii
said '7 of 7' 'and nothing is done'
cp in.nii other-name.nii
exits 0 'an input of another name' "$@" other-name.nii sr.nii
said '7 of 7' 'is the same input'
cp cube.nii in.nii
exits 0 'another patient of the same name' "$@" in.nii sr.nii
alone sr.nii 'is another patient'
cp marks.nii in.nii; touch -r k/lr.nii in.nii
exits 0 'also if it is not newer' "$@" in.nii sr.nii
alone sr.nii 'by content'
rm sr.nii
exits 0 'OUT is gone' "$@" in.nii sr.nii
said '6 of 7' 'and made again'
printf x >>sr.nii
exits 0 'OUT is spoilt' "$@" in.nii sr.nii
alone sr.nii 'and made again'
cp cube.nii k/lr.nii
exits 0 'a file between the steps is another' "$@" in.nii sr.nii
alone sr.nii 'and made again, with what follows'
exits 0 'other options' ct-sr -v -x 2 --paper --expert views=3,iterations=2,gaussians=20 --keep k in.nii sr.nii
said '2 of 7' 'are another step'
exits 0 'back' "$@" in.nii sr.nii
alone sr.nii 'and the result is theirs'
sed '2s/ct-sr .*/ct-sr 0.0.0/' k/step-1.state >old && ! cmp -s old k/step-1.state && cat old >k/step-1.state
exits 0 'another version' "$@" in.nii sr.nii
said '6 of 7' 'is another step' # whose result is the same, so that the others are done
printf 'junk' >k/step-1.state
exits 0 'a broken state' "$@" in.nii sr.nii
said '6 of 7' 'is none'
ct-sr -q -x 2 $few --keep p - pipe.nii <marks.nii; ok $? 'from a pipe'
ct-sr -q -x 2 $few --keep p - pipe.nii <cube.nii; ok $? 'from another'
ct-sr -q -x 2 $few - want.nii <cube.nii
ct-convert -q pipe.nii - | tail -c 20000 >a; ct-convert -q want.nii - | tail -c 20000 >b
[ -s a ] && cmp -s a b; ok $? 'another patient'

# The prior counts by what it holds.
ct-degrade -q -f -x 4 -p P3 hr-marks.nii marks.nii
set -- ct-sr -v -x 4 --paper --expert views=4,iterations=40,gaussians=100
cp "$srcdir/src/prior/prior.safetensors" prior.safetensors
exits 0 'with a prior' "$@" --prior prior.safetensors --keep bal marks.nii bal.nii
exits 0 'the same one, as it is installed' "$@" --keep bal marks.nii bal.nii
said '7 of 7' 'leaves nothing to do'
printf x >>bal/up-proj.exr
exits 0 'projections are spoilt' "$@" --keep bal marks.nii bal.nii
said '6 of 7' 'and made again, the same: what follows is done'

# The script of a kept chain.
mkdir -p moved/to && cp -r bal marks.nii moved/to
(cd / && sh "$dir_/moved/to/bal/commands.sh") >/dev/null 2>&1; ok $? 'commands.sh runs from any folder'
cmp -s bal.nii moved/to/bal.nii; ok $? 'and makes the same bytes'
rm moved/to/bal.nii && printf junk >moved/to/marks.nii
sh moved/to/bal/commands.sh >/dev/null 2>&1; [ $? -eq 3 ] && [ ! -e moved/to/bal.nii ]; ok $? 'it ends at the first error'
mkdir aside
exits 0 'a folder elsewhere, names with a dash' ct-sr -q -x 4 $few --keep "$dir_/aside/-k k" -- ./marks.nii -o.nii
rm -f ./-o.nii && (cd / && sh "$dir_/aside/-k k/commands.sh") >/dev/null 2>&1 && [ -s ./-o.nii ]; ok $? 'the script of a folder elsewhere makes an output that begins with a dash'
cp marks.nii ./-marks.nii
exits 0 'a dash before all names' ct-sr -q -x 4 $few --keep=-k -- -marks.nii -p.nii
[ -s ./-k/lr.nii ] && [ -s ./-p.nii ]; ok $? 'and they are made'
(cd / && sh "$dir_/-k/commands.sh") >/dev/null 2>&1; ok $? 'the script of a folder named -k runs from the root'

# One run a folder; what a run starts ends with it.
fits() { # until ct-nabgs has made iterations, or the run has ended
	until grep -q 'ct-nabgs: iteration [0-9]*:' err1 2>/dev/null; do
		kill -0 $1 2>/dev/null || return
		sleep 0.1
	done
}
set -- ct-sr -v -x 4 --paper --expert views=8,iterations=1000000,gaussians=200 --keep g
rm -f err1; setsid "$@" marks.nii g.nii 2>err1 & pid=$!
fits $pid
exits 4 'two runs in one folder' "$@" marks.nii g2.nii
has err 'g: another run works in it' 'and that is said'
kill -INT -$pid; wait $pid; [ $? -eq 75 ]; ok $? 'an interrupt of the whole group stops it'
[ -s g/residual.ply.state ]; ok $? 'and the state is there'
rm -f err1; setsid "$@" marks.nii g.nii 2>err1 & pid=$!
fits $pid
grep -q continuing err1; ok $? 'from which it goes on'
grep -q continuing err1 || sed 's/^/# /' err1
cp g/residual.ply.state before
kill -TERM -$pid; kill -INT -$pid; kill -TERM $pid; wait $pid; [ $? -eq 75 ]; ok $? 'however often it is told'
[ -s g/residual.ply.state ] && ! cmp -s before g/residual.ply.state; ok $? 'and the state is the last'
rm -f err1; setsid "$@" marks.nii g.nii 2>err1 & pid=$!
fits $pid
kill -KILL $pid; wait $pid 2>/dev/null
exits 0 'killed: nothing works in its folder any more' \
	timeout 120 ct-sr -x 4 $few --keep g marks.nii g.nii
# Wherever the signals meet it, the result is that of a run which none met.
set -- ct-sr -v -x 4 --paper --expert views=8,iterations=300,gaussians=200
for sig in INT KILL TERM; do
	rm -f err1; setsid "$@" --keep r marks.nii r.nii 2>err1 & pid=$!
	fits $pid
	kill -$sig -$pid; wait $pid
done 2>/dev/null
exits 0 'goes on to the end' "$@" --keep r marks.nii r.nii
mkdir w && exits 0 'a run that was let alone' "$@" marks.nii w/r.nii
cmp -s r.nii w/r.nii; ok $? 'gives the same bytes'

# Temporary folders.
mkdir tmp; TMPDIR=$dir_/tmp; export TMPDIR
ct-sr -q -x 4 --paper --expert views=8,iterations=1000000,gaussians=200 marks.nii t.nii 2>/dev/null & pid=$!
until [ -s tmp/.ctsr-tmp-*/data/up.nii ] || ! kill -0 $pid; do sleep 0.1; done 2>/dev/null
exits 0 'another run' ct-sr -q -x 4 $few marks.nii t2.nii
[ -e tmp/.ctsr-tmp-*/data/up.nii ]; ok $? 'leaves the folder of the first alone'
kill -KILL $pid; wait $pid 2>/dev/null
flock -w 60 tmp/.ctsr-tmp-*/mark true # until the commands that it started are gone too
mkdir tmp/ct-sr.mine
exits 0 'one after it was killed' ct-sr -q -x 4 $few marks.nii t3.nii
[ "$(ls -A tmp)" = ct-sr.mine ]; ok $? 'removes what it left, and nothing else'
ls -R tmp | sed 's/^/# /'
rmdir tmp/ct-sr.mine
exits 0 'a dry run' ct-sr --dry-run -x 4 --paper marks.nii t4.nii
exits 0 'and one with a folder' ct-sr --dry-run -x 4 --paper --keep none marks.nii t4.nii
[ ! -e none ] && [ -z "$(ls -A tmp)" ]; ok $? 'make none'
# what is not of a run in the folder is not replaced
for f in lr.nii commands.sh; do
	mkdir mine-$f && echo mine >mine-$f/$f
	exits 4 "--keep with $f of somebody else" ct-sr -q -x 2 --paper --expert views=2,iterations=2,gaussians=20 --keep mine-$f in.nii sr-mine.nii
	has err "mine-$f/$f: exists, and no run in this folder made it" 'is refused'
	[ "$(cat mine-$f/$f)" = mine ]; ok $? 'and stays'
done
done_testing
