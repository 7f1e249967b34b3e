#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-field: every published configuration gives a CT, at a tiny budget; states; what is refused.
. "$srcdir/tests/tap.sh"
psnr() { ct-metrics "$1" "$2" | sed -n 's/^psnr //p'; }
above() { awk "BEGIN {exit !($1 > $2)}"; } # above A B
ct-phantom --size=16x16x16 --spacing=4 ellipsoids hr.nii
ct-degrade -x 2 hr.nii lr.nii && ct-project --views 4 --det 16x16 hr.nii p.exr
[ -s lr.nii ] && [ -s p.exr ]; ok $? 'a CT and its projections are made'

good() { # good FILE SIZE NAME: a CT of that size, finite and in the window
	ct-info "$1" >info 2>&1
	awk -v size="$2" '{sub(/^[a-z]+ +/, "& ")} $1 == "size" {good += $2 " " $3 " " $4 == size} $1 == "min" {good += $2 >= -1024}
		$1 == "max" {good += $2 <= 3071} $1 == "nan" || $1 == "infinite" {good += $2 == 0} END {exit good != 5}' info
	ok $? "$3"
}
tiny='--expert count=8 --expert fine=4 --expert batch=16'
for like in nerf cunerf; do
	# shellcheck disable=SC2086
	exits 0 "--like $like fits a CT" ct-field -q --like $like --network 2x8 -b 3 $tiny lr.nii $like.nii
	good $like.nii '16 16 16' "the result of $like is a CT on the finer grid"
done
for like in naf sax-nerf; do
	exits 0 "--like $like fits projections" ct-field -q --like $like -b 2 --expert count=8 --expert batch=16 --expert levels=3 p.exr $like.nii
	good $like.nii '16 16 16' "the result of $like is a CT on the grid of the scan"
done
ct-phantom --size=8x8x8 --spacing=8 ellipsoids eight.nii
exits 0 'the published network of cunerf' ct-field -q --like cunerf -b 1 --expert count=8 --expert fine=4 --expert batch=8 \
	--expert at-skip=concatenate -x 1 eight.nii c.nii
good c.nii '8 8 8' 'the published network of cunerf keeps the grid of IN'
exits 0 'projections without more are naf' ct-field -q -b 1 --expert count=8 --expert batch=16 --expert levels=3 --grid 8 p.exr n.nii
good n.nii '8 8 8' '--grid 8 makes a grid of 8 voxels'
exits 0 'a field is fitted to point samples' ct-field -s 7 --samples points -b 150 lr.nii points.nii
has out '^iterations 150' 'a fit reports its iterations'
exits 0 'a field is fitted through the operator' ct-field -b 60 lr.nii profile.nii
ct-upsample -m linear lr.nii linear.nii
above "$(psnr hr.nii profile.nii)" "$(psnr hr.nii linear.nii)"; ok $? 'a fit through the operator is better than linear interpolation'
above "$(psnr hr.nii points.nii)" "$(psnr hr.nii linear.nii) - 3"; ok $? 'a fit of points is within 3 dB of linear interpolation'
ct-degrade -x 2 profile.nii again.nii && above "$(psnr lr.nii again.nii)" 32; ok $? 'a fit degraded again is the scan to 32 dB'
exits 0 'the grid of a volume' ct-field -q --samples points -b 2 --grid hr.nii lr.nii grid.nii
good grid.nii '16 16 16' '--grid of a volume is the grid of OUT'
ct-info grid.nii | grep -q '^  factor *2,2,2'; ok $? 'the grid that the operator begins from keeps the operator'
ct-convert -q --crop 1:15,0:16,0:16 hr.nii part.nii && ct-field -q --samples points -b 2 --grid part.nii lr.nii other.nii
! ct-info other.nii | grep -qE '^  (factor|sigma|decimate)'; ok $? 'another grid does not say the operator, which would be false'
ct-phantom -q --size 400x8x8 --spacing 4 cube - | ct-convert -q --crop 390:400,0:8,0:8 - far.nii
exits 5 'a grid beside IN' ct-field -q --samples points -b 2 --grid far.nii lr.nii no.nii
has err 'far.nii: lies beside IN along axis 0' 'the error of a grid beside IN names the axis'; [ ! -e no.nii ]; ok $? 'a grid beside IN makes no output'
exits 0 '--json is taken by a fit' ct-field --json --samples points -b 2 lr.nii j.nii
has out '"iterations": 2' 'JSON of a fit has its iterations'
exits 0 'a budget in seconds is taken' ct-field --samples points -b 0.2s lr.nii s.nii
exits 0 'a fit reads and writes a stream' sh -c 'ct-field -q --samples points -b 2 - - <lr.nii >stream.nii'
tail -c 8192 j.nii >a && tail -c 8192 stream.nii | cmp - a; ok $? 'a fit of a stream gives the same voxels'
exits 0 '--dry-run is taken by a fit' ct-field --dry-run --like cunerf lr.nii dry.nii
has out '^time' 'a dry run of a fit estimates the time'; [ ! -e dry.nii ]; ok $? 'a dry run of a fit makes no output'

mkdir one four
(cd one && ct-field -q -t 1 -b 12 ../lr.nii r.nii)
(cd four && ct-field -q -t 4 -b 12 ../lr.nii r.nii)
cmp one/r.nii four/r.nii; ok $? '1 and 4 threads fit the same bytes'
mkdir whole cut
long() { cd "$1" && shift && exec setsid ct-field -q --expert every=5 --samples points -b 60 "$@" ../lr.nii r.nii; }
(long whole); ok $? 'a fit of 60 iterations ends'
(export CTSR_TEST_SIGNAL='ct-field 30 9'; long cut); [ -e cut/r.nii.state ] && [ ! -e cut/r.nii ]; ok $? 'a fit that is killed leaves its state'
(long cut) 2>err; [ $? -eq 4 ]; ok $? 'the state of a fit is not overwritten'
(export CTSR_TEST_SIGNAL='ct-field 20 15'; long cut --resume); [ $? -eq 75 ]; ok $? 'a fit stops on SIGTERM with 75'
(export CTSR_TEST_SIGNAL='ct-field 9 15'; long cut --resume --expert every=7); [ $? -eq 75 ]; ok $? 'other places to save are no other run'
exits 3 'a state of other options' sh -c 'cd cut && ct-field -q --samples points -b 61 --expert every=5 --resume ../lr.nii r.nii'
(long cut --resume) && cmp whole/r.nii cut/r.nii; ok $? 'a resumed fit gives the same bytes'
[ ! -e cut/r.nii.state ]; ok $? 'a finished fit removes its state'
mkdir late # the last report is that of the grid, of which each is one strip here
ct-phantom --size=40x40x40 ellipsoids big.nii
late() { cd late && exec setsid ct-field -q --expert every=0 --samples points -b 3 --grid ../big.nii "$@" ../lr.nii r.nii; }
(export CTSR_TEST_SIGNAL='ct-field 4 15'; late); [ $? -eq 75 ] && [ -e late/r.nii.state ]; ok $? 'stopped on the grid: the state stays'
(late --resume) && [ -s late/r.nii ] && [ ! -e late/r.nii.state ]; ok $? 'the state of a fit stopped on the grid serves'
mv late/r.nii late.nii; (late) && cmp late/r.nii late.nii; ok $? 'a fit stopped on the grid resumes to the same bytes'

exits 3 'a stack is refused for --samples cubes' ct-field --samples cubes p.exr no.nii; has err 'p.exr.*cubes' 'the error of a stack for cubes names the file'
exits 3 'a CT is refused for rays of naf' ct-field --like naf lr.nii no.nii; has err 'lr.nii.*rays' 'the error of a CT for rays names the file'
exits 2 'a factor of 0 is refused' ct-field -x 0 lr.nii no.nii; has err 'factor' 'the error of a factor of 0 names the option'
exits 2 'a factor that contradicts the file is refused' ct-field -x 3 lr.nii no.nii
exits 2 'a factor for projections is refused' ct-field -x 2 p.exr no.nii
exits 2 'a budget of 0 is refused' ct-field -b 0 lr.nii no.nii; has err 'budget' 'the error of a budget of 0 names the option'
exits 2 'an unknown loss is refused' ct-field --loss l3 lr.nii no.nii
exits 2 'a TV loss of points is refused' ct-field --samples points --loss tv:1 lr.nii no.nii
exits 2 'a lattice of 10 points is refused' ct-field --samples cubes --expert count=10 lr.nii no.nii
exits 2 'a count of samples is refused for points' ct-field --samples points --expert count=8 lr.nii no.nii; has err '^ct-field: --expert count: not with --samples points' 'the error of a count of points names both'
exits 2 'a count of samples is refused for the operator' ct-field --expert count=8 lr.nii no.nii
exits 2 'further samples are refused for points' ct-field --samples points --expert fine=8 lr.nii no.nii; has err '^ct-field: --expert fine: not with --samples points' 'the error of further samples names both'
exits 2 'levels are refused for an encoding without grids' ct-field --encoding frequencies --expert levels=3 lr.nii no.nii; has err 'levels: not with --encoding frequencies' 'the error of levels names the encoding'
exits 2 'a layer at the skip is refused for a network without one' ct-field --expert at-skip=concatenate lr.nii no.nii; has err 'at-skip: this network has no skip' 'the error of at-skip says why'
exits 2 'a network of one number is refused' ct-field --network 8 lr.nii no.nii
exits 2 'a network of too many weights is refused' ct-field --network 1000x100000 lr.nii no.nii
exits 2 'more levels than the table has are refused' ct-field --expert levels=16 lr.nii no.nii
exits 2 'a rate of 0 is refused' ct-field --expert rate=0 lr.nii no.nii; has err 'rate' 'the error of a rate of 0 names the rate'
exits 2 'a window beyond float32 is refused' ct-field --samples points -w -1e308:1e308 eight.nii no.nii; has err 'window' 'the error of a window beyond float32 names the option'
exits 2 'a factor beside --grid is refused' ct-field -x 2 --grid hr.nii lr.nii no.nii
exits 3 'a scan of unknown blur is refused' ct-field -x 2 hr.nii no.nii; has err 'hr.nii.*points' 'the error of a scan of unknown blur names points'
cp lr.nii nan.nii
printf '\000\000\300\177' | dd of=nan.nii bs=1 conv=notrunc seek=$(($(wc -c <lr.nii) - 4)) 2>/dev/null
exits 6 'a NaN in the scan is refused with status 6' ct-field -b 1 nan.nii no.nii; has err 'nan.nii' 'the error of a NaN names the file'
exits 7 'a grid beyond memory is refused with status 7' ct-field --samples points -x 900 hr.nii no.nii; has err 'hr.nii.*MiB' 'the error of too little memory says MiB'
exits 3 'a scan that is no HU is refused without a window' ct-field -b 1 --units other --samples points -x 2 lr.nii no.nii
exits 0 'with a window it is fitted' ct-field -f -b 1 --units other -w -1024:3071 --samples points -x 2 lr.nii other.nii
exits 3 'a file that does not exist is refused' ct-field none.nii no.nii
exits 3 'a file that is neither CT nor stack is refused' ct-field "$srcdir/tests/tap.sh" no.nii
[ ! -e no.nii ] && [ ! -e no.nii.state ]; ok $? 'fits that were refused leave nothing'
if [ -e /dev/full ] && [ "$(id -u)" = 0 ] || [ -w /dev/full ]; then
	mkdir full && ln -s /dev/full full/r.nii
	ct-field -q -f --samples points -b 2 lr.nii full/r.nii 2>err; code=$?
	[ "$code" -eq 4 ]; ok $? 'a full disk ends a fit with status 4'
	has err 'full' 'the error of a full disk says full'
else
	skip 'a full disk ends a fit with status 4' 'no /dev/full'
fi
done_testing
