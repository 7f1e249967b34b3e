#!/bin/sh
# --memory: within it, the same voxels, and nothing beside OUT when it is done, stopped or refused.
. "$srcdir/tests/tap.sh"
. "$srcdir/tests/peak.sh"
ct-phantom -q --size 160x144x152 ellipsoids hr.nii && ct-degrade -q -x 4 hr.nii lr.nii || exit 99
bound=72
for m in bspline sinc dc tv htv; do
	few=; case $m in ?tv|tv) few='--iterations 6 --tolerance 0' ;; esac
	# shellcheck disable=SC2086
	look peak ct-upsample -q -f -t 1 -m $m $few lr.nii whole.nii
	cp used all
	# shellcheck disable=SC2086
	look peak ct-upsample -q -f -t 1 -m $m $few --memory ${bound}M lr.nii made/$m.nii; ok $? "$m"
	within $bound "$m,"
	look same whole.nii made/$m.nii; ok $? 'the same voxels'
done
cp all used; beyond $bound 'where it would go'
for t in 2 3; do
	ct-upsample -q -f -t $t -m htv --iterations 6 --tolerance 0 --memory 90M lr.nii more.nii &&
		look same more.nii made/htv.nii; ok $? "$t threads: the same voxels"
done
ct-upsample -q -m dc --start hr.nii lr.nii near.nii && look peak ct-upsample -q -t 1 -m dc --start hr.nii --memory 72M lr.nii made/near.nii
look same near.nii made/near.nii; ok $? 'from a volume to begin with, too'
within $bound 'which is'
ct-upsample -q -f --iterations 6 --tolerance 0 --std whole-s.nii lr.nii whole.nii &&
	look peak ct-upsample -q -t 1 --iterations 6 --tolerance 0 --memory 72M --std made/std.nii lr.nii made/with.nii; ok $? 'with the error to expect'
within 72 'that,'
look same whole-s.nii made/std.nii && look same whole.nii made/with.nii; ok $? 'the same voxels'
alone "$(printf '%s\n' bspline.nii dc.nii htv.nii near.nii sinc.nii std.nii tv.nii with.nii)" 'nothing else is left'
rm made/*
ct-upsample -q -f -m linear lr.nii whole.nii
TMPDIR=$(pwd)/made ct-upsample -q -m linear --memory 70M lr.nii - >stream.nii; look same stream.nii whole.nii; ok $? 'to a stream'
alone ''
exits 0 'an estimate' ct-upsample --dry-run --memory 67M -m htv lr.nii made/no.nii
has out '^memory *67 MiB' 'of the memory'
has out '^disk .* 6[89] MiB of state' 'and the disk'

exits 7 'a bound that cannot be kept' ct-upsample --memory 20M -t 2 lr.nii made/no.nii
has err '^ct-upsample: --memory 20M: this takes 67M$' 'in words'
exits 0 'which is one that can' ct-upsample -q --memory 67M -t 2 -m linear lr.nii linear.nii
for w in 100 M -1M 1e3M 600MB; do
	exits 2 "--memory=$w" ct-upsample --memory=$w lr.nii made/no.nii
	has err "'$w' is no size such as 600M or 2G" 'is no size'
done
exits 4 'no folder for what does not fit' env TMPDIR=/nonexistent sh -c 'ct-upsample --memory 70M lr.nii - >none'
has err '^ct-upsample: .*/nonexistent: no room for [0-9]* MiB: ' 'is named'
ct-upsample -q -m htv --memory 72M -t 1 --tolerance 0 lr.nii made/stopped.nii 2>err & pid=$!
listens $pid; sleep 1; kill -TERM $pid; wait $pid
[ $? -eq 75 ]; ok $? 'a signal stops it'
alone ''

# a prior of slices, slab by slab
mkdir scans; for k in 1 2; do ct-phantom -q -s $k --size 48x48x48 ellipsoids scans/$k.nii; done
ct-train -q --slices --cubes 2 --cube 40 --width 24 --components 20 -b 256 -n 20 p.safetensors scans 2>err || exit 99
restore() { ct-restore -q -f -p p.safetensors --start dc.nii "$@"; }
cp near.nii dc.nii
restore lr.nii whole.nii --std whole-std.nii
look peak ct-restore -q -t 1 -p p.safetensors --start dc.nii --memory 134M --std made/std.nii lr.nii made/r.nii; ok $? 'restores'
within 134 'slab by slab,'
look same whole.nii made/r.nii 0.01; ok $? 'the same to rounding'
look same whole-std.nii made/std.nii 0.01; ok $? 'and the error that is expected'
for t in 2 3; do
	restore -t $t --memory 136M lr.nii "t$t.nii"
done
look same t2.nii t3.nii; ok $? 'any number of threads: same bytes'
exits 7 'a bound that cannot be kept' ct-restore -p p.safetensors --memory 120M -t 1 lr.nii made/no.nii
has err '^ct-restore: --memory 120M: this takes 130M$' 'in words'
ct-restore -q -p p.safetensors --tolerance 1 --memory 140M lr.nii made/s.nii && ct-restore -q -p p.safetensors --tolerance 1 lr.nii s.nii
look same s.nii made/s.nii 0.01; ok $? 'the solver before it, too'
alone "$(printf '%s\n' r.nii s.nii std.nii)"
done_testing
