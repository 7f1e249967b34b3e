#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What fails: the parts of make check-long can, and the file system at any call.
. "$srcdir/tests/tap.sh"

# The parts of make check-long can pass, and can fail: with few tries of one command, then of one that
# breaks what they look for.
mkdir broken
# breaks TOOL: the lines that follow are run in its place, the true one being $true
breaks() {
	rm -f broken/ct-*
	{ echo "#!/bin/sh"; echo "true=$builddir/$1"; cat; } >broken/"$1"
	chmod +x broken/"$1"
}
passes() { # passes PART ARGS...: all that was tried
	builddir=$builddir sh "$srcdir/tests/long/$1.sh" "$2" "$3" >out 2>&1
	[ $? -eq 0 ] && awk -F'|' '/^row/ {n++; bad += $4 == 0 || $4 != $5} END {exit !(n && !bad)}' out
	ok $? "$1 $3 passes"
	sed 's/^/# /' out
}
fails() { # fails WORDS PART ARGS...: for that reason
	words=$1; shift
	for t in "$builddir"/ct-*; do [ ! -x "$t" ] || [ -e broken/"${t##*/}" ] || ln -s "$t" broken/; done
	builddir=$PWD/broken sh "$srcdir/tests/long/$1.sh" "$2" "$3" >out 2>&1
	[ $? -eq 1 ] && grep -q "$words" out; ok $? "$1 $3 fails: $words"
	grep -q "$words" out || sed 's/^/# /' out
	rm -f broken/ct-*
}
passes full 2 ct-degrade
echo 'for o; do :; done; $true "$@" || { s=$?; : >$o.abcdef; exit $s; }' | breaks ct-degrade
fails 'is left' full 2 ct-degrade
echo '$true "$@"; exit 0' | breaks ct-degrade
fails 'status 0' full 2 ct-degrade
# a sanitizer takes all addresses
if (ulimit -v 4000000 && exec ct-degrade --version) >/dev/null 2>&1; then
	passes memory 3 ct-degrade
	echo '[ "$(ulimit -v)" = unlimited ] || kill -ABRT $$; exec $true "$@"' | breaks ct-degrade
	fails 'status 134' memory 3 ct-degrade
else
	skip 'memory' 'no room for a limit here'
fi
# one at each of its first calls, and at others: FAULT_AT is set for one that is to fail
if command -v "${CC:-cc}" >/dev/null && ! sanitized ct-degrade; then
	passes faults 400 ct-degrade
	passes faults 400 ct-info
	passes faults 300 ct-ddnm
	passes faults 1100 ct-project # the output in its place is no failure
	passes faults 1100 ct-fdk # a library leaves out what it gets no memory for
	echo '[ -z "$FAULT_AT" ] || kill -ABRT $$; exec $true "$@"' | breaks ct-degrade
	fails 'status 134' faults 60 ct-degrade
else
	skip 'faults' 'no compiler here, or a sanitizer'
fi
if command -v python3 >/dev/null; then
	passes peak 1 ct-upsample
	echo 'python3 -c "b = b\"x\" * (300 << 20)"; exec $true "$@"' | breaks ct-upsample
	fails 'held 3[0-9][0-9] MiB' peak 1 ct-upsample
else
	skip 'peak' 'no python3'
fi
builddir=$builddir sh "$srcdir/tests/long/kill.sh" 3 ct-fuse >out 2>&1
has out '^row|kill|SIGKILL, ct-fuse|3|3$' 'the part kill passes for ct-fuse'
echo 'case "$*" in *--resume*) exec $true "$@" -n 2 ;; esac; exec $true "$@"' | breaks ct-fuse
fails 'another result\|ended with' kill 6 ct-fuse
passes two 2 ct-fuse
echo 'case "$*" in *other*race/1) until [ -s race/1 ]; do sleep 0.1; done; exec $true --force "$@" ;; esac; exec $true "$@"' | breaks ct-fuse
fails 'both say' two 2 ct-fuse

# The file system fails at one call (tests/long/io-fault.c): what was there stays, several outputs are there together or
# not at all, what was computed is kept, and an output is on the disk before and after it has its name.
part calls
if ! cc -O1 -shared -fPIC -o fault.so "$srcdir/tests/long/io-fault.c" -ldl 2>err || sanitized ct-sr; then
	skip 'the file system fails at one call' 'no compiler here, or sanitizers'; done_testing
fi
mkdir tmp; TMPDIR=$PWD/tmp; export TMPDIR
faulty() { env LD_PRELOAD="$PWD/fault.so" IO_LOG="$PWD/log" "$@"; } # faulty IO_...=... COMMAND
left() { find . -mindepth 1 -name '.ctsr-*'; }
ct-phantom -q --size 16x16x16 --spacing 4 marks hr.nii && ct-degrade -q -x 2 hr.nii lr.nii

# on the disk before it has its name; its name after
rm -f log; faulty IO_CALL=sync,rename ct-convert -q hr.nii new.nii
[ "$(sed 's/ .*data$/ data/; s/ .*new.nii/ new/; s| /.*| here|' log | tr '\n' ' ')" = 'sync data rename new sync here folder ' ]
ok $? 'a file is synced, renamed, and then its folder is synced'; sed 's/^/# /' log
if ct-convert -q hr.nii series/ 2>/dev/null; then
	rm -f log; faulty IO_CALL=sync,rename ct-convert -q hr.nii other/
	[ "$(sed 's/ .*ctsr0.*/ slice/; s/ .*data$/ data/; s/ .*other$/ other/; s| /.*| here|' log | uniq | tr '\n' ' ')" = \
		'sync slice sync data folder rename other sync here folder ' ]
	ok $? 'a series: its slices, their folder, the name, the folder of that'; sed 's/^/# /' log
	before=$(cat series/* | cksum)
	for n in 1 2 9; do
		exits 4 "sync $n fails" faulty IO_CALL=sync IO_AT=$n ct-convert -qf lr.nii series/
		[ "$(cat series/* | cksum)" = "$before" ] && [ -z "$(left)" ]; ok $? 'the series of before is there, nothing else'
	done
	exits 4 'the folder above cannot be synced' faulty IO_CALL=sync IO_AT=10 ct-convert -qf lr.nii series/
	[ "$(ls series | wc -l)" -eq 8 ] && [ -z "$(left)" ]; ok $? 'the new series is whole'
fi
before=$(cksum <new.nii)
exits 4 'a file that cannot be synced' faulty IO_CALL=sync IO_AT=1 ct-convert -qf lr.nii new.nii
[ "$(cksum <new.nii)" = "$before" ] && [ -z "$(left)" ]; ok $? 'is not there; what was there is'

# two outputs
sr() { ct-sr -q "$@"; }
for k in 1 2; do
	: >log; exits 4 "rename $k of 2 fails" faulty IO_CALL=rename IO_AT=$k ct-sr -q --confidence map.nii lr.nii out.nii
	[ ! -e map.nii ] && [ ! -e out.nii ] && [ -z "$(left)" ]; ok $? 'none of the two is there'
	[ "$(ls tmp | sed 's/kept\.......\.//' | sort | tr '\n' ' ')" = 'map.nii out.nii ' ]; ok $? "both outputs are kept in TMPDIR when rename $k fails"
	for f in tmp/*; do grep -q "$f" err && ct-info "$f" >/dev/null; ok $? 'whole, and where is said'; done
	rm -f tmp/*
done
sr --confidence map.nii lr.nii out.nii; before=$(cksum map.nii out.nii); was=$(ls -i map.nii out.nii)
for k in 1 2; do
	exits 4 "over older ones, rename $k of 2 fails" faulty IO_CALL=rename IO_AT=$k ct-sr -qf -Q draft --confidence map.nii lr.nii out.nii
	[ "$(cksum map.nii out.nii)" = "$before" ] && [ "$(ls -i map.nii out.nii)" = "$was" ] && [ -z "$(left)" ]; ok $? 'both older ones are there'
	[ "$(ls tmp | wc -l)" -eq 2 ]; ok $? 'and the new ones are kept'; rm -f tmp/*
done
exits 4 'no second names, rename 2 of 2 fails' faulty IO_CALL=link,rename IO_AT=2 IO_ON=1 ct-sr -qf --confidence map.nii lr.nii out.nii
[ "$(cksum <out.nii)" = "$(echo "$before" | sed -n 's/ out.nii//p')" ] && ct-info map.nii >/dev/null; ok $? 'where links fail, a failed rename loses neither output'; rm -f tmp/*
exits 0 'two outputs with --force are written over older ones' sr -f --confidence map.nii lr.nii out.nii
[ -z "$(left)" ]; ok $? 'two outputs over older ones leave no temporary file'

# a small stack
for tool in "ct-sr -qf -Q fast lr.nii small.nii" "ct-upsample -qf -x 2 -m prior lr.nii small.nii" "ct-view -qf hr.nii small.png"; do
	# shellcheck disable=SC2086
	(ulimit -s 64; exec $tool) 2>err; got=$?
	[ $got -eq 0 ] || { [ $got -eq 7 ] && grep -q 'the stack is limited .* raise it with ulimit -s' err; }
	ok $? "${tool%% *} with a stack of 64 KiB: $got"
done

# rights, links, names
mkdir group && chmod g+s group && ct-convert -q hr.nii group/f.nii
if ct-convert -q hr.nii group/s/ 2>/dev/null; then
	[ -g group/s ] && [ "$(stat -c %g group/s/ctsr0001.dcm)" = "$(stat -c %g group)" ]; ok $? "a series in a folder of a group is the group's"
fi
ln -s nowhere broken.nii; exits 4 'a link that leads nowhere' ct-convert -q hr.nii broken.nii
has err '^ct-convert: broken.nii: is a symbolic link to nowhere, which is not there: remove the link' 'is said to be one'
[ -L broken.nii ] && [ ! -e nowhere ]; ok $? 'a link that leads nowhere stays as it is'
ln -s nowhere broken; exits 4 'also in the place of a folder' ct-convert -q hr.nii broken/
has err 'broken: is a symbolic link to nowhere' 'the error of a link in the place of a folder names both'
long=$(printf '%0251d' 0)
exits 0 'a name of 255 bytes' ct-convert -q hr.nii "$long.nii"; [ -s "$long.nii" ]; ok $? 'a file with a name of 255 bytes is there'
exits 4 'a name of 256' ct-convert -q hr.nii "0$long.nii"; has err 'the name is 256 bytes long, and a file.s name has at most 255' 'is refused before the work'
ct-project -q -n 4 hr.nii p.exr
exits 4 'a state of 256' ct-ddnm -q -n 2 -x 2 p.exr "$(printf '%0246d' 0).exr"
has err 'bytes long, and a file.s name has at most 255' 'the error of a state whose name is too long gives the limit of 255 bytes'
done_testing
