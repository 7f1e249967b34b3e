#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-sr --paper --keep: what is done again and what is not, by content; the script; one run a folder; signals at
# every step; nothing left without --keep.
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
exits 0 'a run of the paper keeps its files' "$@" in.nii sr.nii
alone sr.nii 'a run that keeps makes the bytes of one that does not'
exits 0 'the same command again has nothing to do' "$@" in.nii sr.nii
said '7 of 7' 'a finished run leaves all steps out'
cp in.nii other-name.nii
exits 0 'the input may have another name' "$@" other-name.nii sr.nii
said '7 of 7' 'an input of another name that holds the same is the same'
cp cube.nii in.nii
exits 0 'another patient of the same name is refined' "$@" in.nii sr.nii
alone sr.nii 'another patient of the same name gets a result of his own'
cp marks.nii in.nii; touch -r k/lr.nii in.nii
exits 0 'an input that is not newer is looked at' "$@" in.nii sr.nii
alone sr.nii 'an input counts by what it holds, not by its time'
rm sr.nii
exits 0 'an output that is gone is made' "$@" in.nii sr.nii
said '6 of 7' 'only the step of the output that is gone is done again'
printf x >>sr.nii
cp sr.nii mine.nii
exits 4 'an output that was changed is not written over' "$@" in.nii sr.nii
has err '^ct-sr: sr.nii: was changed since a run made it; --force overwrites it' 'the error says what would overwrite it'
cmp -s sr.nii mine.nii; ok $? 'the output that was changed stays as it was'
exits 0 'with --force it is made again' "$@" -f in.nii sr.nii
has err '^ct-sr: warning: sr.nii: was changed, and is made again' 'an output that is spoilt is warned of'
alone sr.nii 'an output that is spoilt is as it was afterwards'
exits 0 'other options go on where they are the same' ct-sr -v -x 2 --paper --expert views=3,iterations=2,gaussians=20 --keep k in.nii sr.nii
said '2 of 7' 'what does not depend on the number of views is left out'
exits 0 'the options of before are taken again' "$@" in.nii sr.nii
alone sr.nii 'the result of the options of before is as before'
sed '1s/ct-sr [^:]*/ct-sr 0.0.0/' k/run.state >old && ! cmp -s old k/run.state && cat old >k/run.state
exits 0 'what another version kept is made again' "$@" in.nii sr.nii
grep -q 'steps were done' err; [ $? -eq 1 ]; ok $? 'nothing that another version kept is left out'
alone sr.nii 'the result after another version is right'
# A person's own file in the place of a kept one.
own_lr() { cat cube.nii >k/lr.nii; }
own_up_proj() { ct-project -q -f -n 2 --method joseph -w -512:3071 --overshoot k/up.nii k/up-proj.exr; }
own_sr_proj() { ct-ddnm -q -f --sampler none -x 2 k/lr-proj.exr k/sr-proj.exr; }
own_residual() { ct-nabgs -q -f --base k/up.nii --iterations 3 --gaussians 9 k/sr-proj.exr k/residual.ply; }
for f in lr.nii up-proj.exr sr-proj.exr residual.ply; do
	made=$(echo "${f%.*}" | tr - _)
	cp k/$f was; "own_$made" && ! cmp -s was k/$f; ok $? "a file of one's own is put in the place of $f"
	cp k/$f mine; rm -rf c; mkdir c; cp -r in.nii k c
	sed "/ k\/$f --force$/d" k/commands.sh >c/k/commands.sh; sh c/k/commands.sh >/dev/null 2>&1; ok $? "the commands behind $f run on it"
	exits 0 "a run goes on with one's own $f" "$@" in.nii sr.nii
	has err "^ct-sr: warning: k/$f: is not what a run in this folder made: it is used as it is$" "one's own $f is told to be used"
	cmp -s k/$f mine; ok $? "one's own $f stays as it is"
	cmp -s sr.nii c/sr.nii; ok $? "the result is that of one's own $f"
	bad=''; for g in lr.nii up.nii up-proj.exr lr-proj.exr sr-proj.exr residual.ply; do cmp -s k/$g c/k/$g || bad="$bad $g"; done
	[ -z "$bad" ]; ok $? "what follows from one's own $f is made of it$bad"
	exits 0 "a run with one's own $f may be run again" "$@" -f in.nii sr.nii
	said '7 of 7' "nothing is done again beside one's own $f"
	cmp -s k/$f mine; ok $? "one's own $f stays as it is, forced or not"
	if [ $f != lr.nii ]; then
		cat cube.nii >in.nii
		exits 4 "one's own $f is refused for another patient" "$@" -f in.nii sr.nii
		has err "^ct-sr: k/$f: is not what a run made of this input with these options, so is not written over: remove it" "one's own $f of another patient is named"
		cmp -s k/$f mine; ok $? "one's own $f of another patient stays as it is"
		cat marks.nii >in.nii
	fi
	echo junk >k/$f
	exits 3 "a kept $f that is junk is refused" "$@" in.nii sr.nii
	has err "k/$f: " "the error of a kept $f that is junk names it"
	[ "$(cat k/$f)" = junk ]; ok $? "a kept $f that is junk stays as it is"
	rm k/$f
	exits 0 "a run makes $f where it was removed" "$@" in.nii sr.nii
	alone sr.nii "the result without one's own $f is as before"
done
own_sr_proj; cp k/sr-proj.exr mine
exits 4 "one's own projections are refused with other options" ct-sr -v -x 2 --paper --expert views=3,iterations=2,gaussians=20 --keep k in.nii sr.nii
cmp -s k/sr-proj.exr mine; ok $? "one's own projections stay as they are with other options"
exits 0 "one's own projections serve another fit" ct-sr -v -x 2 --paper --expert views=2,iterations=3,gaussians=20 --keep k in.nii sr.nii
cmp -s k/sr-proj.exr mine; ok $? "one's own projections stay as they are for another fit"
ct-project -q -f --views=2 --det=9 --window=-512:3071 --overshoot k/up.nii k/sr-proj.exr; cp k/sr-proj.exr mine
exits 5 "one's own projections of another detector are refused" "$@" in.nii sr.nii
has err 'k/sr-proj.exr' "the error of one's own projections of another detector names them"
cmp -s k/sr-proj.exr mine; ok $? "one's own projections of another detector stay as they are"
rm k/sr-proj.exr
signalled 5 15 "$@" in.nii sr.nii >/dev/null 2>&1; [ ! -e k/sr-proj.exr ]; ok $? 'a run is stopped before its finer projections'
own_sr_proj; cp k/sr-proj.exr mine
exits 0 "one's own projections may be put where a run was stopped" "$@" in.nii sr.nii
cmp -s k/sr-proj.exr mine; ok $? "one's own projections stay as they are where a run was stopped"
rm k/sr-proj.exr; "$@" in.nii sr.nii 2>/dev/null
sed 's/--views=2/--views=3/' k/commands.sh >edited; cat edited >k/commands.sh; sh k/commands.sh >/dev/null 2>&1; cp sr.nii mine; cp k/sr-proj.exr mine.exr
exits 4 'what an edited script made in OUT is not written over' "$@" in.nii sr.nii
exits 0 'with --force a run goes on with all that it made' "$@" -f in.nii sr.nii
cmp -s sr.nii mine && cmp -s k/sr-proj.exr mine.exr; ok $? 'the result is that of the edited script'
rm k/commands.sh k/*-proj.exr k/residual.ply; exits 0 'what an edited script made may be removed' "$@" in.nii sr.nii
alone sr.nii 'the result is that of the options where all was removed'
mkdir foreign && echo mine >foreign/lr.nii
exits 4 'a folder with a volume that no run made is refused' ct-sr -q -x 2 --paper --expert views=2,iterations=2,gaussians=20 --keep foreign in.nii other.nii
[ "$(ls foreign)" = lr.nii ] && [ "$(cat foreign/lr.nii)" = mine ]; ok $? 'a folder that is refused stays as it is'
cp k/run.state whole; printf 'junk' >k/run.state
exits 4 'a state that no run wrote is refused' "$@" in.nii sr.nii
has err 'k/run.state: exists, and no run in this folder made it' 'the error of a state that no run wrote names it'
[ "$(cat k/run.state)" = junk ]; ok $? 'a state that no run wrote stays as it is'
exits 0 'a state that no run wrote is replaced by force' "$@" -f in.nii sr.nii
alone sr.nii 'the result of a forced run is right'
ct-sr -q -x 2 $few --keep p - pipe.nii <marks.nii; ok $? 'a scan from a pipe is kept'
ct-sr -q -x 2 $few --keep p - pipe.nii <cube.nii; ok $? 'another scan from a pipe is refined in the same folder'
mkdir want && ct-sr -q -x 2 $few - want/pipe.nii <cube.nii
cmp -s pipe.nii want/pipe.nii; ok $? 'the scan of the second pipe is not taken for that of the first'

# The prior counts by what it holds.
ct-degrade -q -f -x 4 -p P3 hr-marks.nii marks.nii
set -- ct-sr -v -x 4 --paper --expert views=4,iterations=40,gaussians=100
cp "$srcdir/src/prior/prior.safetensors" prior.safetensors
exits 0 'a prior may be named' "$@" --prior prior.safetensors --keep bal marks.nii bal.nii
exits 0 'the installed prior is the same one' "$@" --keep bal marks.nii bal.nii
said '7 of 7' 'a prior of another name that holds the same is the same'
rm bal/up-proj.exr
exits 0 'projections that are gone are made again' "$@" --keep bal marks.nii bal.nii
said '6 of 7' 'what follows from projections that come out the same is left out'

# The script.
mkdir -p moved/to && cp -r bal marks.nii moved/to
(cd / && sh "$dir_/moved/to/bal/commands.sh") >/dev/null 2>&1; ok $? 'commands.sh runs from any folder'
cmp -s bal.nii moved/to/bal.nii; ok $? 'commands.sh makes the bytes of the run in one process'
for f in lr.nii up.nii up-proj.exr lr-proj.exr sr-proj.exr residual.ply; do
	cmp -s bal/$f moved/to/bal/$f; ok $? "commands.sh makes the bytes of $f"
done
ct-sr -q --release -x 4 --expert views=3,iterations=30,gaussians=60 -s 7 --keep rel marks.nii rel.mha; ok $? 'a release with a seed is kept'
cp rel.mha rel1.mha; sh rel/commands.sh >/dev/null 2>&1; cmp -s rel.mha rel1.mha; ok $? 'the script of a release makes the same MetaImage'
ct-upsample -q -f -x 4 -m cubic marks.nii rel/sr.nii; ct-convert -q rel/sr.nii mine.mha
exits 0 "one's own result is converted" ct-sr -q --release -x 4 --expert views=3,iterations=30,gaussians=60 -s 7 --keep rel marks.nii rel.mha
ct-metrics -q --json rel.mha mine.mha >out; has out '"max-hu": 0.0' "the MetaImage is that of one's own result"
rm moved/to/bal.nii && printf junk >moved/to/marks.nii
sh moved/to/bal/commands.sh >/dev/null 2>&1; [ $? -eq 3 ] && [ ! -e moved/to/bal.nii ]; ok $? 'commands.sh ends at the first error'
mkdir aside
exits 0 'a folder elsewhere and names with a dash are kept' ct-sr -q -x 4 $few --keep "$dir_/aside/-k \$k'k" -- ./marks.nii -o.nii
rm -f ./-o.nii && (cd / && sh "$dir_/aside/-k \$k'k/commands.sh") >/dev/null 2>&1 && [ -s ./-o.nii ]; ok $? 'the script of a folder elsewhere makes an output that begins with a dash'
cp marks.nii ./-marks.nii
exits 0 'a dash may be before all names' ct-sr -q -x 4 $few --keep=-k -- -marks.nii -p.nii
[ -s ./-k/lr.nii ] && [ -s ./-p.nii ]; ok $? 'files in a folder named -k are made'
(cd / && sh "$dir_/-k/commands.sh") >/dev/null 2>&1; ok $? 'the script of a folder named -k runs from the root'
sed 's/--iterations=40/--iterations=20/' bal/commands.sh >edited && ! cmp -s edited bal/commands.sh && cat edited >bal/commands.sh
exits 0 'a run goes on beside a script that was edited' "$@" -f --keep bal marks.nii bal.nii
cmp -s edited bal/commands.sh; ok $? 'a script that was edited is never overwritten'
has err '^ct-sr: warning: bal/commands.sh: was edited, and stays as it is' 'a script that was edited is warned of'
said '7 of 7' 'a script that was edited changes nothing of the run'
sh bal/commands.sh >/dev/null 2>&1; ok $? 'a script that was edited runs'
exits 0 'a run follows a script that was edited' "$@" -f --keep bal marks.nii bal.nii
said '6 of 7' 'what the edited script made otherwise is used'
has err 'bal/residual.ply: is not what a run in this folder made: it is used' 'what the edited script made otherwise is told to be used'
rm bal/commands.sh; exits 0 'a script that was removed is written again' "$@" --keep bal marks.nii bal.nii
[ -s bal/commands.sh ] && ! cmp -s edited bal/commands.sh; ok $? 'the script that is written again is that of the run'

# One run a folder.
fits() { # until the fit has made iterations, or the run has ended
	until grep -q 'ct-sr: iteration [0-9]*:' err1 2>/dev/null; do
		kill -0 $1 2>/dev/null || return
		sleep 0.1
	done
}
set -- ct-sr -v -x 4 --paper --expert views=4,iterations=1000000,gaussians=200 --keep g
rm -f err1; setsid "$@" marks.nii g.nii 2>err1 & pid=$!
fits $pid
kill -STOP -$pid # it gets slower the more Gaussians it has
exits 4 'a second run in one folder is refused' "$@" marks.nii g2.nii
has err 'g: another run works in it' 'the error of a second run names the folder'
kill -CONT -$pid; kill -INT -$pid; wait $pid; [ $? -eq 75 ]; ok $? 'an interrupt of the fit ends with status 75'
has err1 '^ct-sr: stopped on request; the same command goes on$' 'a run that is stopped says how to go on'
[ -s g/residual.ply.state ]; ok $? 'a fit that is stopped leaves its state'
[ -z "$(find g . -maxdepth 1 -name '.ctsr-*')" ]; ok $? 'a fit that is stopped leaves nothing temporary'
cp g/residual.ply.state before
rm -f err1; setsid "$@" marks.nii g.nii 2>err1 & pid=$!
fits $pid
grep -q continuing err1; ok $? 'a fit that was stopped goes on from its state'
grep -q continuing err1 || sed 's/^/# /' err1
had=$(sed -n 's/.*continuing after iteration //p' err1) # and once it is further than the state
until sed -n 's/^ct-sr: iteration \([0-9]*\):.*/\1/p' err1 | awk -v had="$had" '$1 > had {n++} END {exit !n}' || ! kill -0 $pid; do sleep 0.1; done
kill -TERM -$pid; kill -INT -$pid; kill -TERM $pid; wait $pid; [ $? -eq 75 ]; ok $? 'a run that is told to stop more than once ends with status 75'
[ -s g/residual.ply.state ] && ! cmp -s before g/residual.ply.state; ok $? 'the state is that of the last stop'
rm -f err1; setsid "$@" marks.nii g.nii 2>err1 & pid=$!
fits $pid
kill -KILL $pid; wait $pid 2>/dev/null
exits 0 'a folder is free when its run was killed' timeout 120 ct-sr -x 4 $few --keep g marks.nii g.nii
[ -z "$(find g -name '*.state' ! -name run.state)" ]; ok $? 'the state of a fit with other options is gone'
# Wherever the signals meet it, the result is that of a run which none met.
set -- ct-sr -v -x 4 --paper --expert views=4,iterations=300,gaussians=200
for sig in INT KILL TERM; do
	rm -f err1; setsid "$@" --keep r marks.nii r.nii 2>err1 & pid=$!
	fits $pid
	kill -$sig -$pid; wait $pid
done 2>/dev/null
exits 0 'a run that was stopped and killed goes on to the end' "$@" --keep r marks.nii r.nii
mkdir w && exits 0 'a run that was let alone ends' "$@" marks.nii w/r.nii
cmp -s r.nii w/r.nii; ok $? 'a run that was stopped and killed makes the bytes of one that was let alone'

# At every step: the reports of progress count views of the two projections, of the network, and iterations.
set -- ct-sr -q -x 4 --paper --expert views=4,iterations=6,gaussians=60
exits 0 'a run is made to compare with' "$@" marks.nii w/e.nii
stopped=0 all=0 bad='' where=' '
for n in 1 6 40 110 112 116 118; do
	for sig in 2 15 10; do
		[ $((n % 3)) -eq $((sig % 3)) ] || [ $n -eq 116 ] || continue # one signal a place, all at one
		rm -rf e e.nii; signalled $n $sig "$@" --keep e marks.nii e.nii >/dev/null 2>err; s=$?
		all=$((all + 1))
		[ $s -eq 75 ] && stopped=$((stopped + 1))
		where="$where$(ls e | grep -c -v 'lock\|run.state\|commands.sh') "
		[ $s -eq 75 ] || [ $s -eq 0 ] || bad="$bad $n:$sig ended with $s;"
		[ -z "$(find . e -maxdepth 1 -name '.ctsr-*')" ] || bad="$bad $n:$sig left a temporary file;"
		[ $s -eq 0 ] || [ ! -e e.nii ] || bad="$bad $n:$sig left an output;"
		"$@" --keep e marks.nii e.nii >/dev/null 2>err || bad="$bad $n:$sig does not go on: $(cat err)"
		cmp -s e.nii w/e.nii || bad="$bad $n:$sig goes on to another result;"
	done
done
[ -z "$bad" ]; ok $? "wherever it is stopped a run goes on to the same bytes ($stopped of $all stopped, files kept:$where)"
[ -z "$bad" ] || echo "# $bad"
[ $stopped -eq $all ] && [ $all -gt 8 ]; ok $? 'all signals meet the run at work'
signalled 90 15 "$@" marks.nii e2.nii >/dev/null 2>err; [ $? -eq 75 ] && [ ! -e e2.nii ]; ok $? 'a run that keeps nothing is stopped with status 75'
[ "$(tail -n 1 err)" = 'ct-sr: stopped on request' ]; ok $? 'a run that keeps nothing has nothing to go on with'

# Nothing is written between the steps without --keep.
mkdir tmp; TMPDIR=$dir_/tmp; export TMPDIR
chmod 500 tmp
exits 0 'a run without --keep needs no temporary folder' ct-sr -q -x 4 $few marks.nii t.nii
chmod 700 tmp
[ -z "$(ls -A tmp)" ]; ok $? 'a run without --keep leaves no temporary folder'
exits 0 'a dry run prints its commands' ct-sr --dry-run -x 4 --paper marks.nii t4.nii
exits 0 'a dry run with a folder prints its commands' ct-sr --dry-run -x 4 --paper --keep none marks.nii t4.nii
[ ! -e none ] && [ -z "$(ls -A tmp)" ]; ok $? 'a dry run makes no folder'
unset TMPDIR
# what is not of a run in the folder is not replaced
for f in lr.nii commands.sh run.state; do
	mkdir mine-$f && echo mine >mine-$f/$f
	exits 4 "a folder with $f of somebody else is refused" ct-sr -q -x 2 --paper --expert views=2,iterations=2,gaussians=20 --keep mine-$f in.nii sr-mine.nii
	has err "mine-$f/$f: exists, and no run in this folder made it" "the error of $f of somebody else names it"
	[ "$(cat mine-$f/$f)" = mine ]; ok $? "$f of somebody else stays as it is"
	[ "$(ls mine-$f | grep -cv lock)" -eq 1 ]; ok $? "nothing is written beside $f of somebody else"
done
mkdir lent && echo mine >lent/notes.txt
exits 0 'a folder with another file is used' ct-sr -q -x 2 $few --keep lent in.nii sr-lent.nii
[ "$(cat lent/notes.txt)" = mine ]; ok $? 'another file in the folder stays as it is'
# room
(ulimit -f 8; trap '' XFSZ; exec ct-sr -q -x 4 $few --keep full marks.nii full.nii) 2>err; [ $? -eq 4 ]; ok $? 'a kept file that cannot be written ends with status 4'
has err 'full/' 'the error of a kept file that cannot be written names it'
exits 0 'a run goes on when there is room' ct-sr -q -x 4 $few --keep full marks.nii full.nii
rm -rf own; mkdir own; ct-sr -q -x 4 $few marks.nii own/full.nii; cmp -s own/full.nii full.nii; ok $? 'a run that had no room makes the right bytes afterwards'
(ulimit -f 0; trap '' XFSZ; exec ct-sr -q -x 4 $few --keep bare marks.nii bare.nii) 2>err; [ $? -eq 4 ]; ok $? 'a folder in which nothing can be written ends with status 4'
[ ! -e bare ]; ok $? 'a folder in which nothing could be written is not left'
mkdir bare; (ulimit -f 0; trap '' XFSZ; exec ct-sr -q -x 4 $few --keep bare marks.nii bare.nii) 2>err; [ -d bare ]; ok $? 'a folder that was there before stays where nothing could be written'
ct-phantom -q -w -512:3071 --size 200x200x200 constant huge.nii
exits 7 'memory that is too little is refused with status 7' ct-sr -q --paper -x 16 --keep huge huge.nii huge-sr.nii
has err '^ct-sr: huge.nii: takes at least [0-9]* MiB of memory, and [0-9]* MiB are free$' 'the error of too little memory says how much is needed'
[ ! -e huge/lr.nii ]; ok $? 'too little memory is refused before anything is made'
rm huge.nii
# the log of a page
exits 0 'a page may be asked for' ct-sr -q -x 4 $few --keep page --report page.html marks.nii page.nii
for w in 'the scan' 'the finer projections' 'the Gaussians' 'the result'; do
	has page.html "ct-sr: $w took [0-9]\{1,3\}[.][0-9] s, [0-9]\{1,3\}[.][0-9] s of CPU time" "the page says what it took to make $w"
done
has page/log.txt 'ct-sr: the page took' 'the log of a kept run is log.txt'
rm page.html; exits 0 'a page that is gone is made' ct-sr -v -x 4 $few --keep page --report page.html marks.nii page.nii
said '7 of 8' 'only the page that is gone is made again'
has page.html 'ct-sr: the finer projections took' 'the page of a run that goes on has the log of the run before'
exits 0 'a page without --keep is made' ct-sr -q -x 4 $few --report page2.html marks.nii page2.nii
has page2.html 'ct-sr: the Gaussians took' 'the page of a run that keeps nothing has its log'
done_testing
