#!/bin/sh
# ct-phantom and ct-project: pipes, options, statuses, what the files say.
. "$srcdir/tests/tap.sh"
small='--size 24x24x24 --spacing 4'
# shellcheck disable=SC2086
exits 0 'a phantom' ct-phantom $small marks m.nii
exits 0 'its projections' ct-project -n 5 m.nii m.exr
# shellcheck disable=SC2086
ct-phantom $small marks - 2>e1 | ct-project -n 5 - - >pipe.exr 2>e2
[ -s pipe.exr ] && [ ! -s e1 ] && [ ! -s e2 ]; ok $? 'both in a pipe'
ct-project -t 1 -n 5 m.nii - >one.exr; ct-project --threads=4 -n 5 m.nii - >four.exr
[ -s one.exr ] && cmp -s one.exr four.exr; ok $? 'one and four threads make the same file'
exits 0 'geometry of another stack' ct-project --like m.exr m.nii like.exr
exits 2 'which is the whole geometry' ct-project --like m.exr -n 4 m.nii new.exr
# shellcheck disable=SC2086
exits 0 'closed form' ct-phantom $small --like m.exr marks exact.exr
exits 3 'in the scan of a file that is there' ct-phantom --like none.exr marks new.exr
exits 2 'no such phantom' ct-phantom $small cat new.nii
has err "'cat' is not one of ellipsoids|" 'and says so'
exits 2 'no such beam' ct-project --beam laser m.nii new.exr
exits 2 'a window that contradicts the file' ct-project -w -512:3071 m.nii new.exr
has err '-512:3071' 'names both'
exits 0 'the same window again' ct-project -w -1024:3071 -n 2 m.nii same.exr
exits 2 'a quantity that is none' ct-project --quantity mu m.nii new.exr
exits 4 'no overwriting' ct-project -n 5 m.nii m.exr
exits 0 'unless forced' ct-project -f -n 5 m.nii m.exr
ct-phantom -q --size 400x8x8 --spacing 4 ellipsoids - | ct-convert -q --crop 390:400,0:8,0:8 - far.nii
exits 0 'a volume beside the scan' ct-project --like m.exr far.nii dark.exr; has err 'warning: far.nii: lies beside the scan: . of 5 views see it' 'says so'
exits 5 'a base beside the scan' ct-nabgs -n 1 -g 9 --base far.nii m.exr new.ply; has err 'far.nii: lies beside the scan' 'the error of a base beside the scan names the base'
exits 5 'a grid beside the scan' ct-fdk -m sirt --grid far.nii m.exr new.nii; has err 'far.nii: ' 'the error of a grid beside the scan names the grid'
[ ! -e new.exr ] && [ ! -e new.nii ] && [ ! -e new.ply ]; ok $? 'and nothing is made'
exits 5 'a source in the volume' ct-project --expert dso=60 m.nii new.exr
has err '60 mm' 'with the distance'
exits 5 'a fan of two rows' ct-project --beam fan --det 8x2 m.nii new.exr
exits 0 'fan' ct-project --beam fan -n 3 m.nii fan.exr
exits 0 'parallel, all options' ct-project --beam parallel -n 3 --arc 90 --expert start=45 --det 20x10 \
	--expert pitch=5,6,offset=1,2 m.nii par.exr
exits 2 'a pitch of two words' ct-project --expert pitch=a,b m.nii new.exr
exits 5 'coarsen what does not divide' ct-project --coarsen 5 m.nii new.exr
for p in point mean sinc; do
	exits 0 "coarse pixels: $p" ct-project -n 3 --coarsen 4 --pixel $p m.nii "$p.exr"
done
! cmp -s point.exr mean.exr && ! cmp -s mean.exr sinc.exr; ok $? 'differ'
exits 0 'a fan has coarse pixels too' ct-project --beam fan -n 3 --coarsen 4 --pixel mean m.nii fan4.exr
has_size() { ct-info "$1" | grep -Eq "^size +$2\$"; ok $? "$3"; }
has_size fan4.exr '6 1' 'in its one row'
exits 0 'interpolation' ct-project -m joseph -n 5 m.nii joseph.exr
! cmp -s joseph.exr m.exr; ok $? 'is another number'
ct-project -m joseph -t 1 -n 5 m.nii - >one.exr; ct-project -m joseph -t 3 -n 5 m.nii - >three.exr
[ -s one.exr ] && cmp -s one.exr three.exr; ok $? 'for any number of threads'
for s in 1 2; do ct-project -s $s -n 2 --photons 1e4 --expert electronic=5 m.nii - >n$s.exr; done
ct-project -t 3 -s 1 -n 2 --photons 1e4 --expert electronic=5 m.nii - >t1.exr
[ -s n1.exr ] && cmp -s n1.exr t1.exr; ok $? 'noise: a seed, any threads, one file'
ct-info n1.exr | grep -Eq 'photons +10000'; ok $? 'that says so'
! cmp -s n1.exr n2.exr; ok $? 'another seed, other noise'
exits 2 'electronics without photons' ct-project --expert electronic=5 m.nii new.exr
exits 2 'a seed without them' ct-project -s 1 m.nii new.exr; has err '^ct-project: --seed: needs --photons' 'is named'
exits 0 'what it would take' ct-project --dry-run -n 5 m.nii new.exr
has out '^time .* s on' 'time'; has out '^memory .* MiB' 'memory'; has out '^disk .* MiB' 'size'
exits 0 'beyond a whole turn' ct-project -n 2 --expert start=725 --arc 20 m.nii turn.exr
exits 0 'the same angle' ct-project -n 2 --expert start=5 --arc 20 m.nii less.exr
for f in turn less; do ct-info $f.exr | grep -E '^(min|max|mean|sd) ' >i-$f; done
[ -s i-turn ] && cmp -s i-turn i-less; ok $? 'the same picture'
exits 0 'one pixel, one view' ct-project -n 1 --det 1x1 m.nii pixel.exr
exits 0 'beside the volume' ct-project -n 1 --expert offset=9999,0 m.nii off.exr
ct-info off.exr | grep -Eq '^max +0$'; ok $? 'is dark'
printf 'not a volume' >bad.nii
exits 3 'not a volume' ct-project bad.nii new.exr

# scanner files: lengths scale with the volume
cat >scan.json <<'JSON'
{"scanner": {"mode": "cone", "DSO": 5.0, "DSD": 7.0, "nDetector": [12, 16], "sDetector": [4.0, 4.0],
 "nVoxel": [24, 24, 24], "sVoxel": [2, 2, 2], "offOrigin": [0, 0, 0], "offDetector": [0, 0],
 "totalAngle": 360, "startAngle": 10, "filter": null}}
JSON
exits 0 'R2 scanner file' ct-project --scanner scan.json -n 3 m.nii r2.exr
exits 0 'is the scan it says' ct-project -n 3 --arc 360 --expert start=10,dso=240,dsd=336 \
	--det 16x12 --expert pitch=12,16 m.nii own.exr
for f in r2 own; do cp $f.exr g.exr; ct-project --like g.exr m.nii - >like-$f; done
[ -s like-r2 ] && cmp -s like-r2 like-own; ok $? 'number by number'
echo '{"DSO": "far"}' >bad.json
exits 3 'a bad scanner file' ct-project --scanner bad.json m.nii new.exr
has err 'bad.json: DSO' 'file and key'
echo '[1' >bad.json
exits 3 'not JSON' ct-project --scanner bad.json m.nii new.exr
exits 2 'beam against scanner file' ct-project --beam parallel --scanner scan.json m.nii new.exr
[ ! -e new.exr ] && [ ! -e new.nii ]; ok $? 'failures leave nothing'

# NaN: the last voxel of a float volume
# shellcheck disable=SC2086
ct-phantom $small --expert density=0.3 sphere f.nii
if [ "$(od -An -t d2 -j 70 -N 2 f.nii | tr -d ' ')" = 16 ]; then
	head -c -4 f.nii >nan.nii; printf '\0\0\300\177' >>nan.nii
	exits 6 'a NaN voxel' ct-project nan.nii new.exr
	has err 'voxel (23,23,23) is NaN' 'and its place'
else
	ok 1 'the sphere is stored as float'
fi

# quantity travels
if command -v oiiotool >/dev/null 2>&1; then
	oiiotool --info -v m.exr >info
	has info 'ct:quantity: "lineIntegral"' 'quantity'
	has info 'ct:window: "-1024:3071"' 'window'
	has info 'ct:volume.size: "24,24,24"' 'grid of the volume'
	has info 'ct:scan.dso: "375"' 'distance scaled to the field of view'
	exact sphere s.exr "$small" -n 1 --det 25 && oiiotool --stats s.exr >stats
	has stats 'Stats Max: 12.00000' 'middle of a sphere: density x diameter, 0.25 x 48 mm'
else
	skip 'quantity, window, grid, distance, middle of a sphere' 'no oiiotool'
fi

for beam in parallel fan; do
	ct-project -q -f --beam $beam -n 3 --det 24 --coarsen 4 m.nii coarse.exr && ct-info coarse.exr >out
	has out "^beam  *$beam\$" "--coarsen leaves the beam: $beam"
done
done_testing
