#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-phantom and ct-project: pipes, options, statuses, what the files say.
. "$srcdir/tests/tap.sh"
small='--size 24x24x24 --spacing 4'
# shellcheck disable=SC2086
# phantoms, projections, pipes
exits 0 'ct-phantom makes a phantom of marks' ct-phantom $small marks m.nii
exits 0 'ct-project makes five projections of a phantom' ct-project -n 5 m.nii m.exr
# shellcheck disable=SC2086
ct-phantom $small marks - 2>e1 | ct-project -n 5 - - >pipe.exr 2>e2
[ -s pipe.exr ] && [ ! -s e1 ] && [ ! -s e2 ]; ok $? 'ct-phantom and ct-project work in a pipe'
ct-project -t 1 -n 5 m.nii - >one.exr; ct-project --threads=4 -n 5 m.nii - >four.exr
[ -s one.exr ] && cmp -s one.exr four.exr; ok $? 'ct-project writes the same bytes with one and four threads'
exits 0 '--like uses the geometry of another stack' ct-project --like m.exr m.nii like.exr
exits 2 '--like with -n is refused with status 2' ct-project --like m.exr -n 4 m.nii new.exr
# shellcheck disable=SC2086
exits 0 'ct-phantom --like makes closed-form projections' ct-phantom $small --like m.exr marks exact.exr
exits 3 'ct-phantom --like refuses a file that does not exist' ct-phantom --like none.exr marks new.exr
exits 2 'an unknown phantom is refused with status 2' ct-phantom $small cat new.nii
has err "'cat' is not one of ellipsoids|" 'the error of an unknown phantom lists the known ones'
exits 2 'an unknown beam is refused with status 2' ct-project --beam laser m.nii new.exr
exits 2 'a window that contradicts the file is refused with status 2' ct-project -w -512:3071 m.nii new.exr
has err '-512:3071' 'the error of a window that contradicts the file gives the window'
exits 0 'a window that is that of the file is accepted' ct-project -w -1024:3071 -n 2 m.nii same.exr
exits 2 'an unknown quantity is refused with status 2' ct-project --quantity mu m.nii new.exr
exits 4 'ct-project does not overwrite an output' ct-project -n 5 m.nii m.exr
exits 0 'ct-project -f overwrites an output' ct-project -f -n 5 m.nii m.exr
# volumes that the rays do not hit
ct-phantom -q --size 400x8x8 --spacing 4 ellipsoids - | ct-convert -q --crop 390:400,0:8,0:8 - far.nii
exits 0 'ct-project accepts a volume beside the scan' ct-project --like m.exr far.nii dark.exr
has err 'warning: far.nii: lies beside the scan: . of 5 views see it' 'ct-project warns of a volume beside the scan'
exits 5 'ct-nabgs refuses a base beside the scan with status 5' ct-nabgs -n 1 -g 9 --base far.nii m.exr new.ply
has err 'far.nii: lies beside the scan' 'the error of a base beside the scan names the base'
exits 5 'ct-fdk refuses a grid beside the scan with status 5' ct-fdk -m sirt --grid far.nii m.exr new.nii
has err 'far.nii: ' 'the error of a grid beside the scan names the grid'
[ ! -e new.exr ] && [ ! -e new.nii ] && [ ! -e new.ply ]; ok $? 'a grid or base beside the scan leaves no output'
# geometry
exits 5 'a source inside the volume is refused with status 5' ct-project --expert dso=60 m.nii new.exr
has err '60 mm' 'the error of a source inside the volume gives its distance'
exits 5 'a fan beam with two detector rows is refused with status 5' ct-project --beam fan --det 8x2 m.nii new.exr
exits 0 'ct-project makes fan projections' ct-project --beam fan -n 3 m.nii fan.exr
exits 0 'ct-project makes parallel projections with every option of the detector' ct-project --beam parallel -n 3 --arc 90 --expert start=45 --det 20x10 \
	--expert pitch=5,6,offset=1,2 m.nii par.exr
exits 2 'a pitch of words is refused with status 2' ct-project --expert pitch=a,b m.nii new.exr
exits 5 'a detector that --coarsen does not divide is refused with status 5' ct-project --coarsen 5 m.nii new.exr
for p in point mean sinc; do
	exits 0 "ct-project makes coarse pixels of kind $p" ct-project -n 3 --coarsen 4 --pixel $p m.nii "$p.exr"
done
! cmp -s point.exr mean.exr && ! cmp -s mean.exr sinc.exr; ok $? 'point, mean and sinc pixels differ'
exits 0 'ct-project makes coarse pixels of a fan' ct-project --beam fan -n 3 --coarsen 4 --pixel mean m.nii fan4.exr
has_size() { ct-info "$1" | grep -Eq "^size +$2\$"; ok $? "$3"; }
has_size fan4.exr '6 1' 'a fan four times coarser has six columns and one row'
# methods, noise, cost
exits 0 'ct-project -m joseph interpolates along the rays' ct-project -m joseph -n 5 m.nii joseph.exr
! cmp -s joseph.exr m.exr; ok $? '-m joseph gives other values than the default'
ct-project -m joseph -t 1 -n 5 m.nii - >one.exr; ct-project -m joseph -t 3 -n 5 m.nii - >three.exr
[ -s one.exr ] && cmp -s one.exr three.exr; ok $? '-m joseph writes the same bytes with one and three threads'
for s in 1 2; do ct-project -s $s -n 2 --photons 1e4 --expert electronic=5 m.nii - >n$s.exr; done
ct-project -t 3 -s 1 -n 2 --photons 1e4 --expert electronic=5 m.nii - >t1.exr
[ -s n1.exr ] && cmp -s n1.exr t1.exr; ok $? 'noise of one seed is the same with any number of threads'
ct-info n1.exr | grep -Eq 'photons +10000'; ok $? 'a noisy stack records its number of photons'
! cmp -s n1.exr n2.exr; ok $? 'another seed gives other noise'
exits 2 'electronic noise without --photons is refused with status 2' ct-project --expert electronic=5 m.nii new.exr
exits 2 'a seed without --photons is refused with status 2' ct-project -s 1 m.nii new.exr
has err '^ct-project: --seed: needs --photons' 'the error of a seed without --photons names the missing option'
exits 0 'ct-project --dry-run reports the cost' ct-project --dry-run -n 5 m.nii new.exr
has out '^time .* s on' 'the dry run of ct-project prints the time'
has out '^memory .* MiB' 'the dry run of ct-project prints the memory'
has out '^disk .* MiB' 'the dry run of ct-project prints the size on disk'
exits 0 'ct-project accepts a start beyond a whole turn' ct-project -n 2 --expert start=725 --arc 20 m.nii turn.exr
exits 0 'ct-project accepts a start within a whole turn' ct-project -n 2 --expert start=5 --arc 20 m.nii less.exr
for f in turn less; do ct-info $f.exr | grep -E '^(min|max|mean|sd) ' >i-$f; done
[ -s i-turn ] && cmp -s i-turn i-less; ok $? 'a start of 725 degrees gives the projections of 5 degrees'
exits 0 'ct-project makes one view of one pixel' ct-project -n 1 --det 1x1 m.nii pixel.exr
exits 0 'ct-project accepts a detector that lies beside the volume' ct-project -n 1 --expert offset=9999,0 m.nii off.exr
ct-info off.exr | grep -Eq '^max +0$'; ok $? 'a detector beside the volume is dark'
printf 'not a volume' >bad.nii
exits 3 'a file that is not a volume is refused with status 3' ct-project bad.nii new.exr

# scanner files: lengths scale with the volume
cat >scan.json <<'JSON'
{"scanner": {"mode": "cone", "DSO": 5.0, "DSD": 7.0, "nDetector": [12, 16], "sDetector": [4.0, 4.0],
 "nVoxel": [24, 24, 24], "sVoxel": [2, 2, 2], "offOrigin": [0, 0, 0], "offDetector": [0, 0],
 "totalAngle": 360, "startAngle": 10, "filter": null}}
JSON
exits 0 'ct-project reads a scanner file of type R2' ct-project --scanner scan.json -n 3 m.nii r2.exr
exits 0 'ct-project makes the scan of the scanner file with its own options' ct-project -n 3 --arc 360 --expert start=10,dso=240,dsd=336 \
	--det 16x12 --expert pitch=12,16 m.nii own.exr
for f in r2 own; do cp $f.exr g.exr; ct-project --like g.exr m.nii - >like-$f; done
[ -s like-r2 ] && cmp -s like-r2 like-own; ok $? 'a scanner file gives the values of the same geometry in options'
echo '{"DSO": "far"}' >bad.json
exits 3 'a scanner file with a word as distance is refused with status 3' ct-project --scanner bad.json m.nii new.exr
has err 'bad.json: DSO' 'the error of a bad scanner file names file and key'
echo '[1' >bad.json
exits 3 'a scanner file that is not JSON is refused with status 3' ct-project --scanner bad.json m.nii new.exr
exits 2 '--beam with a scanner file is refused with status 2' ct-project --beam parallel --scanner scan.json m.nii new.exr
[ ! -e new.exr ] && [ ! -e new.nii ]; ok $? 'runs of ct-project that failed leave no output'

# NaN: the last voxel of a float volume
# shellcheck disable=SC2086
ct-phantom $small --expert density=0.3 sphere f.nii
if [ "$(od -An -t d2 -j 70 -N 2 f.nii | tr -d ' ')" = 16 ]; then
	head -c -4 f.nii >nan.nii; printf '\0\0\300\177' >>nan.nii
	exits 6 'a volume with a NaN is refused with status 6' ct-project nan.nii new.exr
	has err 'voxel (23,23,23) is NaN' 'the error of a volume with a NaN gives its place'
else
	ok 1 'the sphere is stored as float'
fi

# the attributes of a stack
if command -v oiiotool >/dev/null 2>&1; then
	oiiotool --info -v m.exr >info
	has info 'ct:quantity: "lineIntegral"' 'a stack records its quantity as ct:quantity'
	has info 'ct:window: "-1024:3071"' 'a stack records its window as ct:window'
	has info 'ct:volume.size: "24,24,24"' 'a stack records the grid of its volume as ct:volume.size'
	has info 'ct:scan.dso: "375"' 'a stack records its source distance, scaled to the field of view'
	exact sphere s.exr "$small" -n 1 --det 25 && oiiotool --stats s.exr >stats
	has stats 'Stats Max: 12.00000' 'the middle of a sphere is density x diameter, 0.25 x 48 mm'
else
	skip 'quantity, window, grid, distance, middle of a sphere' 'no oiiotool'
fi

for beam in parallel fan; do
	ct-project -q -f --beam $beam -n 3 --det 24 --coarsen 4 m.nii coarse.exr && ct-info coarse.exr >out
	has out "^beam  *$beam\$" "--coarsen leaves the beam: $beam"
done
done_testing
