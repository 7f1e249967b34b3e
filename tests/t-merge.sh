#!/bin/sh
# Parts: slabs of ct-upsample and ct-restore, views of ct-ddnm; and ct-merge, which joins them.
. "$srcdir/tests/tap.sh"
hash() { ct-info --json "$1" | sed -n 's/.*"hash": "\(.*\)".*/\1/p'; }
near() { ct-metrics --window=-1024:3071 --json "$1" "$2" | sed -n 's/.*"max-hu": \([0-9.e+-]*\).*/\1/p' | awk -v m="$3" '{near = $1 < m} END {exit !near}'; }
ct-phantom -q --size 48x64x96 ellipsoids hr.nii
ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean hr.nii thick.nii
ct-degrade -q -x 4 -p P3 hr.nii point.nii && ct-degrade -q -x 4 hr.nii sinc.nii
ct-degrade -q -x 1 --noise 12 hr.nii r.nii && ct-degrade -q -x 4 -p P3 r.nii rough.nii # made linear where flat

# slabs along the longest axis: z is refined by means, so it could be any; of the sinc only x and y
for f in thick point rough; do
	ct-upsample -q -f --iterations 40 --tolerance 0 $f.nii whole.nii
	for n in 1 2 3; do exits 0 "$f, slab $n of 3" ct-upsample -q -f --iterations 40 --brick $n/3 $f.nii part$n.nii; done
	exits 0 'joined' ct-merge -f part2.nii part3.nii part1.nii merged.nii
	near whole.nii merged.nii 0.5; ok $? 'make the whole'
	[ "$(ct-info --json merged.nii | grep -c '"part')" = 0 ]; ok $? 'which is no part'
done
ct-upsample -q -f -m htv --iterations 40 --tolerance 0 rough.nii plain.nii; ! near plain.nii merged.nii 1; ok $? 'linear where flat, as well'
set -- --prior "$builddir/slices.safetensors" -w 0
ct-restore -q "$@" --iterations 40 --tolerance 0 rough.nii all0.nii && ct-restore -q "$@" --start plain.nii rough.nii all1.nii
near all0.nii all1.nii 0.01 && ! near all0.nii plain.nii 1 && near all0.nii merged.nii 0.5; ok $? 'after the prior, too'
for n in 1 2 3; do ct-restore -q "$@" --iterations 40 --brick $n/3 rough.nii slab$n.nii; done
ct-merge -q slab1.nii slab2.nii slab3.nii slabs.nii && near all0.nii slabs.nii 0.5; ok $? 'in slabs, too'
set --
# how much of the noise is given up to is the same for slabs as for the whole
ct-degrade -q -f -x 4 -p P3 --noise 15 hr.nii noisy.nii && ct-upsample -q -f --iterations 40 --tolerance 0 noisy.nii whole.nii &&
	for n in 1 2 3; do ct-upsample -q -f --iterations 40 --brick $n/3 noisy.nii s$n.nii; done && ct-merge -q -f s1.nii s2.nii s3.nii merged.nii
near whole.nii merged.nii 0.5; ok $? 'slabs of a noisy scan make the whole'
ct-restore -q --prior "$builddir/slices.safetensors" --start whole.nii noisy.nii sum.nii &&
	for n in 1 2; do ct-restore -q --prior "$builddir/slices.safetensors" --brick $n/2 --start whole.nii noisy.nii sum$n.nii; done && ct-merge -q -f sum1.nii sum2.nii merged.nii
near sum.nii merged.nii 0.5; ok $? 'and what a prior adds'
rm s?.nii
ct-info --json part2.nii | tr -d ' \n' | grep -q '"part":"2,32,64,96"'; ok $? 'a part says which it is'
ct-upsample -q --brick 3/3 -t 1 --iterations 40 rough.nii again.nii 
[ "$(hash again.nii)" = "$(hash part3.nii)" ]; ok $? 'made again it is the same'
exits 5 'a scan that cannot be cut' ct-upsample --brick 1/2 sinc.nii x.nii
has err '^ct-upsample: sinc.nii: --brick: every voxel depends on all others' 'is refused in words'
ct-degrade -q -x 1,1,4 hr.nii s.nii
ct-upsample -q --brick 1/2 --iterations 9 s.nii s1.nii
ct-info --json s1.nii | tr -d ' \n' | grep -q '"part":"1,0,32,64"'; ok $? 'sampled by sinc along z it is cut along y'
ct-upsample -q -f --iterations 9 --tolerance 0 s.nii whole.nii && ct-upsample -q --brick 2/2 --iterations 9 s.nii s2.nii
ct-merge -q -f s1.nii s2.nii merged.nii && near whole.nii merged.nii 0.5; ok $? 'and makes the whole'
ct-phantom -q --size 48x32x32 ellipsoids wide.nii && ct-degrade -q -f -x 4 -p P3 wide.nii w.nii
ct-upsample -q -f --brick 1/2 --iterations 9 w.nii s1.nii
ct-info --json s1.nii | tr -d ' \n' | grep -q '"part":"0,0,16,48"'; ok $? 'one that is longest along x along x'
ct-upsample -q -f --iterations 9 --tolerance 0 w.nii whole.nii && ct-upsample -q --brick 2/2 --iterations 9 w.nii w2.nii
ct-merge -q -f w2.nii s1.nii merged.nii && near whole.nii merged.nii 0.5; ok $? 'and makes the whole'
ct-phantom -q --size 32x48x48 ellipsoids wide.nii -f && ct-degrade -q -f -x 4 -p P3 wide.nii w.nii
ct-upsample -q -f --brick 1/2 --iterations 9 w.nii s1.nii
ct-info --json s1.nii | tr -d ' \n' | grep -q '"part":"2,0,16,48"'; ok $? 'of equal axes it is z'
for b in 0/2 3/2 1 1/2x a/b 1/7; do
	exits 2 "--brick $b" ct-upsample --brick $b point.nii x.nii
	has err 'brick: ' 'in words'
done
for n in 1 2; do ct-upsample -q -f --tolerance 4 --brick $n/2 rough.nii s$n.nii; done && ct-merge -q -f s1.nii s2.nii merged.nii
ct-upsample -q -f --tolerance 4 rough.nii whole.nii; near whole.nii merged.nii 0.2; ok $? 'slabs end where the whole does'
ct-upsample -q -f rough.nii later.nii; ! near whole.nii later.nii 1; ok $? 'which the tolerance tells'

# how it is written, and how little of it is in memory
exits 0 'compressed' ct-merge -f part1.nii part2.nii part3.nii merged.nii.gz
ct-merge -q -f part1.nii part2.nii part3.nii merged.nii
[ -n "$(hash merged.nii)" ] && [ "$(hash merged.nii.gz)" = "$(hash merged.nii)" ]; ok $? 'the same voxels'
exits 0 'rounded' ct-merge --type i16 part1.nii part2.nii part3.nii short.nii
ct-convert -q --type i16 merged.nii want.nii
[ "$(hash short.nii)" = "$(hash want.nii)" ] && [ "$(wc -c <short.nii)" -lt $((48 * 64 * 96 * 3)) ]; ok $? 'is two bytes a voxel'
rm -f x.nii; exits 2 'type of a stack' sh -c 'ct-project -q --views 2 --det 4x4 --pitch 9 hr.nii v.exr && ct-merge --type i16 v.exr x.exr'
mkfifo pipe
exits 3 'no file' ct-merge part1.nii pipe part3.nii x.nii
has err '^ct-merge: pipe: is no regular file' 'is named'
exits 3 'standard input' sh -c 'ct-merge - part2.nii part3.nii x.nii <part1.nii'
has err '^ct-merge: -: is no stack, and of a slab has to be a regular file' 'is none either'
if command -v python3 >/dev/null; then
	ct-phantom -q --size 64x64x64 ellipsoids many.nii
	for n in 1 2 3; do ct-upsample -q -x 4 --sigma 0 --decimate point -m linear --brick $n/3 many.nii m$n.nii || exit 99; done
	python3 -c '
import resource, subprocess, sys
sys.exit(subprocess.call(["ct-merge", "-q", "m1.nii", "m2.nii", "m3.nii", "large.nii"]) or
    print("# %d KiB" % resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss) or
    resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss > 30000)'
	ok $? '64 MiB are joined within 30'
	ct-upsample -q -x 4 --sigma 0 --decimate point -m linear many.nii all.nii
	[ "$(hash large.nii)" = "$(hash all.nii)" ]; ok $? 'to the voxels of one run'
else
	skip 'peak of memory' 'no python3'
fi

# of a volume to start from, and of a prior
ct-upsample -q -m bspline thick.nii start.nii
ct-upsample -q -f -m dc --start start.nii thick.nii whole.nii
for n in 1 2; do ct-upsample -q -f -m dc --start start.nii --brick $n/2 thick.nii part$n.nii || exit 99; done
exits 0 'begun with a volume' ct-merge -f part1.nii part2.nii merged.nii
near whole.nii merged.nii 0.01; ok $? 'the whole again'
p=$builddir/slices.safetensors
ct-restore -q -f -p "$p" --iterations 30 --tolerance 0 --std wstd.nii thick.nii whole.nii
for n in 1 2; do
	ct-restore -q -f -p "$p" --iterations 30 --std std$n.nii --brick $n/2 thick.nii part$n.nii; ok $? "restored, slab $n"
done
ct-merge -q -f part1.nii part2.nii merged.nii && near whole.nii merged.nii 5; ok $? 'and joined'
ct-merge -q -f std1.nii std2.nii merged.nii && near wstd.nii merged.nii 5; ok $? 'the error to expect, too'

# what is missing, damaged, or of another run
for n in 1 2 3; do ct-upsample -q -f --iterations 5 --brick $n/3 point.nii part$n.nii || exit 99; done
rm -f x.nii
exits 5 'a slab that is missing' ct-merge part1.nii part3.nii x.nii
has err '^ct-merge: voxels 32:64 of 96 are in none of the parts$' 'is named'
exits 5 'the last' ct-merge part1.nii part2.nii x.nii
has err '^ct-merge: voxels 64:96 of 96 are in none of the parts$' 'too'
exits 3 'a file that is not there' ct-merge part1.nii none.nii x.nii
has err '^ct-merge: none.nii: ' 'is named'
exits 5 'one twice' ct-merge part1.nii part2.nii part1.nii x.nii
has err '^ct-merge: part1.nii: holds 0:32 of what part1.nii holds$' 'is named'
cp part2.nii bad.nii && printf '\1' | dd of=bad.nii bs=1 seek=$(($(wc -c <bad.nii) - 700)) conv=notrunc 2>err
exits 3 'a damaged one' ct-merge part1.nii bad.nii part3.nii x.nii
has err '^ct-merge: bad.nii: is damaged' 'is named'
head -c 9000 part2.nii >cut.nii
exits 3 'one cut off' ct-merge part1.nii cut.nii part3.nii x.nii
has err '^ct-merge: cut.nii: ' 'is named'
exits 3 'what is no part' ct-merge part1.nii point.nii x.nii
has err '^ct-merge: point.nii: is no part' 'in words'
ct-upsample -q -f --iterations 6 --brick 2/3 point.nii other.nii
exits 5 'another run' ct-merge part1.nii other.nii part3.nii x.nii
has err '^ct-merge: other.nii: is of another run than part1.nii$' 'in words'
exits 2 'a slab that is to be a stack' ct-merge part1.nii part2.nii part3.nii x.exr
has err '^ct-merge: part1.nii: is a slab of a volume, which x.exr is not by its name$' 'is refused'
exits 2 'no part' ct-merge x.nii
[ ! -e x.nii ]; ok $? 'and nothing is written of any'

# views
ct-project -q --views 6 --pitch 8 --det 16x16 hr.nii in.exr
d() { ct-ddnm -f --steps 2 --samples 2 -x 2 -p "$builddir/prior.safetensors" "$@"; }
d --std wstd.exr in.exr whole.exr; ok $? 'all views'
d -v --views 0:4 --std std1.exr in.exr a.exr 2>err && d --views 4:6 -t 1 --std std2.exr in.exr b.exr; ok $? 'two parts'
[ "$(ct-info --json a.exr | tr -d ' \n' | sed 's/.*"views":\([0-9]*\).*/\1/')" = 4 ]; ok $? 'of as many'
has err '^ct-ddnm: 4 of 6 views are to be made$' 'and no others are made'
exits 0 'joined' ct-merge b.exr a.exr merged.exr
ct-merge -q std1.exr std2.exr mstd.exr
[ "$(hash merged.exr)" = "$(hash whole.exr)" ]; ok $? 'the same values'
[ "$(hash mstd.exr)" = "$(hash wstd.exr)" ]; ok $? 'and deviations'
exits 5 'views that are missing' ct-merge b.exr x.exr
has err '^ct-merge: views 0:4 of 6 are in none of the parts$' 'are named'
exits 5 'a stack is no slab' ct-merge part1.nii a.exr x.nii
for v in 4:4 5:7 -1:2 0.5:2 3; do exits 2 "--views=$v" ct-ddnm --views=$v -x 2 -p "$builddir/prior.safetensors" in.exr x.exr; done
done_testing
