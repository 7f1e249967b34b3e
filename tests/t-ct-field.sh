#!/bin/sh
# ct-field: every published configuration gives a CT, at a tiny budget; states; what is refused.
. "$srcdir/tests/tap.sh"
psnr() { ct-metrics "$1" "$2" | sed -n 's/^psnr //p'; }
above() { awk "BEGIN {exit !($1 > $2)}"; } # above A B
ct-phantom --size=16x16x16 --spacing=4 ellipsoids hr.nii
ct-degrade -x 2 hr.nii lr.nii && ct-project --views 4 --det 16x16 hr.nii p.exr
[ -s lr.nii ] && [ -s p.exr ]; ok $? 'a scene to work on'

good() { # good FILE SIZE NAME: a CT of that size, finite and in the window
	ct-info "$1" >info 2>&1
	awk -v size="$2" '{sub(/^[a-z]+ +/, "& ")} $1 == "size" {good += $2 " " $3 " " $4 == size} $1 == "min" {good += $2 >= -1024}
		$1 == "max" {good += $2 <= 3071} $1 == "nan" || $1 == "infinite" {good += $2 == 0} END {exit good != 5}' info
	ok $? "$3"
}
tiny='--expert count=8 --expert fine=4 --expert batch=16'
for like in nerf cunerf; do
	# shellcheck disable=SC2086
	exits 0 "--like $like" ct-field -q --like $like --network 2x8 -b 3 $tiny lr.nii $like.nii
	good $like.nii '16 16 16' 'is a CT on the finer grid'
done
for like in naf sax-nerf; do
	exits 0 "--like $like" ct-field -q --like $like -b 2 --expert count=8 --expert batch=16 --expert levels=3 p.exr $like.nii
	good $like.nii '16 16 16' 'is a CT on the grid of the scan'
done
ct-phantom --size=8x8x8 --spacing=8 ellipsoids eight.nii
exits 0 'the published network of cunerf' ct-field -q --like cunerf -b 1 --expert count=8 --expert fine=4 --expert batch=8 \
	--expert at-skip=concatenate -x 1 eight.nii c.nii
good c.nii '8 8 8' 'and the grid of IN'
exits 0 'projections without more are naf' ct-field -q -b 1 --expert count=8 --expert batch=16 --expert levels=3 --grid 8 p.exr n.nii
good n.nii '8 8 8' 'on a grid of 8 voxels'
exits 0 'points' ct-field -s 7 --samples points -b 150 lr.nii points.nii
has out '^iterations 150' 'reports the iterations'
exits 0 'the operator' ct-field -b 60 lr.nii profile.nii
ct-upsample -m linear lr.nii linear.nii
above "$(psnr hr.nii profile.nii)" "$(psnr hr.nii linear.nii)"; ok $? 'is better than linear interpolation'
above "$(psnr hr.nii points.nii)" "$(psnr hr.nii linear.nii) - 3"; ok $? 'points are not far from it'
ct-degrade -x 2 profile.nii again.nii && above "$(psnr lr.nii again.nii)" 32; ok $? 'the operator leads back to the scan'
exits 0 'the grid of a volume' ct-field -q --samples points -b 2 --grid hr.nii lr.nii grid.nii
good grid.nii '16 16 16' 'is that of OUT'
ct-phantom -q --size 400x8x8 --spacing 4 cube - | ct-convert -q --crop 390:400,0:8,0:8 - far.nii
exits 5 'a grid beside IN' ct-field -q --samples points -b 2 --grid far.nii lr.nii no.nii
has err 'far.nii: lies beside IN along axis 0' 'is refused'; [ ! -e no.nii ]; ok $? 'and nothing is made'
exits 0 'JSON' ct-field --json --samples points -b 2 lr.nii j.nii
has out '"iterations": 2' 'with the iterations'
exits 0 'seconds' ct-field --samples points -b 0.2s lr.nii s.nii
exits 0 'a stream' sh -c 'ct-field -q --samples points -b 2 - - <lr.nii >stream.nii'
tail -c 8192 j.nii >a && tail -c 8192 stream.nii | cmp - a; ok $? 'gives the same'
exits 0 'a dry run' ct-field --dry-run --like cunerf lr.nii dry.nii
has out '^time' 'estimates'; [ ! -e dry.nii ]; ok $? 'and makes nothing'

mkdir one four
(cd one && ct-field -q -t 1 -b 12 ../lr.nii r.nii)
(cd four && ct-field -q -t 4 -b 12 ../lr.nii r.nii)
cmp one/r.nii four/r.nii; ok $? '1 and 4 threads, same bytes'
mkdir whole cut
long() { cd "$1" && shift && exec setsid ct-field -q --expert every=5 --samples points -b 60 "$@" ../lr.nii r.nii; }
(long whole); ok $? 'a longer run'
(export CTSR_TEST_SIGNAL='ct-field 30 9'; long cut); [ -e cut/r.nii.state ] && [ ! -e cut/r.nii ]; ok $? 'killed: the state stays'
(long cut) 2>err; [ $? -eq 4 ]; ok $? 'a state is not overwritten'
(export CTSR_TEST_SIGNAL='ct-field 20 15'; long cut --resume); [ $? -eq 75 ]; ok $? 'stops with 75'
(export CTSR_TEST_SIGNAL='ct-field 9 15'; long cut --resume --expert every=7); [ $? -eq 75 ]; ok $? 'other places to save are no other run'
exits 3 'a state of other options' sh -c 'cd cut && ct-field -q --samples points -b 61 --expert every=5 --resume ../lr.nii r.nii'
(long cut --resume) && cmp whole/r.nii cut/r.nii; ok $? 'resumes, to the same bytes'
[ ! -e cut/r.nii.state ]; ok $? 'and removes the state'
mkdir late # the last report is that of the grid, of which each is one strip here
ct-phantom --size=40x40x40 ellipsoids big.nii
late() { cd late && exec setsid ct-field -q --expert every=0 --samples points -b 3 --grid ../big.nii "$@" ../lr.nii r.nii; }
(export CTSR_TEST_SIGNAL='ct-field 4 15'; late); [ $? -eq 75 ] && [ -e late/r.nii.state ]; ok $? 'stopped on the grid: the state stays'
(late --resume) && [ -s late/r.nii ] && [ ! -e late/r.nii.state ]; ok $? 'and serves'
mv late/r.nii late.nii; (late) && cmp late/r.nii late.nii; ok $? 'to the same bytes'

exits 3 'a stack for cubes' ct-field --samples cubes p.exr no.nii; has err 'p.exr.*cubes' 'is named'
exits 3 'a CT for rays' ct-field --like naf lr.nii no.nii; has err 'lr.nii.*rays' 'is named'
exits 2 'factor 0' ct-field -x 0 lr.nii no.nii; has err 'factor' 'is named'
exits 2 'another factor than that of the file' ct-field -x 3 lr.nii no.nii
exits 2 'a factor of projections' ct-field -x 2 p.exr no.nii
exits 2 'no budget' ct-field -b 0 lr.nii no.nii; has err 'budget' 'is named'
exits 2 'a loss that is none' ct-field --loss l3 lr.nii no.nii
exits 2 'TV of points' ct-field --samples points --loss tv:1 lr.nii no.nii
exits 2 'a lattice of 10' ct-field --samples cubes --expert count=10 lr.nii no.nii
exits 2 'a network that is none' ct-field --network 8 lr.nii no.nii
exits 2 'a network that is too large' ct-field --network 1000x100000 lr.nii no.nii
exits 2 'grids that are too many' ct-field --expert levels=16 lr.nii no.nii
exits 2 'a rate of 0' ct-field --expert rate=0 lr.nii no.nii; has err 'rate' 'is named'
exits 2 'a window beyond float32' ct-field --samples points -w -1e308:1e308 eight.nii no.nii; has err 'window' 'is named'
exits 2 'a factor beside a grid' ct-field -x 2 --grid hr.nii lr.nii no.nii
exits 3 'a scan of unknown blur' ct-field -x 2 hr.nii no.nii; has err 'hr.nii.*points' 'says what serves'
cp lr.nii nan.nii
printf '\000\000\300\177' | dd of=nan.nii bs=1 conv=notrunc seek=$(($(wc -c <lr.nii) - 4)) 2>/dev/null
exits 6 'NaN' ct-field -b 1 nan.nii no.nii; has err 'nan.nii' 'is named'
exits 7 'too little memory' ct-field --samples points -x 900 hr.nii no.nii; has err 'hr.nii.*MiB' 'is said'
exits 3 'no file' ct-field none.nii no.nii
exits 3 'a file that is neither' ct-field "$srcdir/tests/tap.sh" no.nii
[ ! -e no.nii ] && [ ! -e no.nii.state ]; ok $? 'nothing is left of these'
if [ -e /dev/full ] && [ "$(id -u)" = 0 ] || [ -w /dev/full ]; then
	mkdir full && ln -s /dev/full full/r.nii
	ct-field -q -f --samples points -b 2 lr.nii full/r.nii 2>err; code=$?
	[ "$code" -eq 4 ]; ok $? 'a full disk'
	has err 'full' 'is said'
else
	skip 'a full disk' 'no /dev/full'
fi
done_testing
