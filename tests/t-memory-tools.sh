#!/bin/sh
# --memory of the commands whose input is large: within it, the same voxels, from files and streams,
# and nothing left.
. "$srcdir/tests/tap.sh"
. "$srcdir/tests/peak.sh"
export TMPDIR="$PWD/tmp"; mkdir tmp
ct-phantom -q --size 272x256x256 ellipsoids hr.nii && ct-degrade -q --sigma 1 -x 4 hr.nii lr.nii &&
	ct-upsample -q -m cubic lr.nii up.nii || exit 99
# both MIB NAME COMMAND: with all memory to $D/..., which is here, and within MIB to the same below made
both() {
	D=. && eval "look peak $3 -q -t 1 >told"; ok $? "$2"
	cp used all
	D=made && eval "look peak $3 -q -t 1 --memory ${1}M >within"; ok $? 'and in less memory'
	within "$1" 'which it is'
	cp all used; beyond "$1" 'it would go'
	cmp told within; ok $? 'and says the same'
}
same() { look same "$1" "made/$1"; ok $? 'the same voxels'; }
both 70 'a box' 'ct-convert --crop 9:265,3:,:250 hr.nii $D/box.nii'; same box.nii
both 70 'axes turned' 'ct-convert --reorient SAL hr.nii $D/turned.nii'; same turned.nii
both 70 'a cube' 'ct-convert --cube 264 hr.nii $D/cube.nii'; same cube.nii
both 70 'other voxels' 'ct-convert --iso 2.5 hr.nii $D/iso.nii'; same iso.nii
both 70 'whole numbers' 'ct-convert --type i16 hr.nii $D/short.nii'; same short.nii
both 70 'reduced' 'ct-degrade -x 4 --sigma 1 --clip -1000:900 --noise 3 hr.nii $D/low.nii'; same low.nii
both 70 'reduced along no axis' 'ct-degrade -x 1 hr.nii $D/as-is.nii'; same as-is.nii
ct-convert -q --type f32 hr.nii - | gzip -1 >hr.nii.gz
for t in 2 3; do
	ct-convert -q -f -t $t --memory 84M --reorient SAL hr.nii.gz - >made/turned.nii; same turned.nii
	ct-degrade -q -f -t $t --memory 84M -x 4 --sigma 1 --clip -1000:900 --noise 3 - - <hr.nii.gz >made/low.nii; same low.nii
done
look peak ct-convert -q -t 1 --memory 70M hr.nii.gz made/packed.nii.gz; ok $? 'compressed'
within 70 'which is'
gzip -dc made/packed.nii.gz >made/hr.nii; same hr.nii
rm made/*

ct-degrade -q -x 1 --clip 5:10 hr.nii std.nii
both 82 'metrics' 'ct-metrics hr.nii up.nii'
both 96 'more metrics' 'ct-metrics --mask hr.nii --ssim 3d --edges --std std.nii --per-slice $D/s.csv hr.nii up.nii'
cmp s.csv made/s.csv; ok $? 'the same lines'
both 82 'structures' 'ct-metrics --psnr --structures --blob-sigma 1.5 hr.nii up.nii'
both 82 'tissues' 'ct-metrics --psnr --tissues --flat hr.nii up.nii'
both 82 'high frequencies' 'ct-metrics --psnr --hfen hr.nii up.nii'
both 86 'all frequencies' 'ct-metrics --psnr --fsc $D/f.csv hr.nii up.nii'
cmp f.csv made/f.csv; ok $? 'the same lines'
# what is only just too much is known to be
ct-phantom -q --size 200x200x200 ellipsoids a.nii && ct-degrade -q -x 1 --noise 20 a.nii b.nii || exit 99
for o in '--structures 200' '--hfen 192' '--tissues 175' '--fsc=- 170' '--flat 145'; do
	look peak ct-metrics -t 1 --psnr "${o% *}" a.nii b.nii >told && beyond "${o#* }" "${o% *}"
	look peak ct-metrics -t 1 --psnr "${o% *}" --memory "${o#* }M" a.nii b.nii | cmp -s - told; ok $? 'and in a little less'
	within "${o#* }" 'which it is'
done
rm std.nii a.nii b.nii
both 70 'a certificate' 'ct-metrics --consistency lr.nii --map $D/residual.nii up.nii'; same residual.nii

ct-project -q -n 12 --det 96 hr.nii p12.exr && ct-nabgs -q -b up.nii -n 5 -g 500 p12.exr g.ply >/dev/null || exit 99
both 76 'composed' 'ct-compose --consistent lr.nii up.nii g.ply $D/fine.nii'; same fine.nii
both 76 'on other voxels' 'ct-compose --spacing 2.2 up.nii g.ply $D/other.nii'; same other.nii
ct-compose -q --residual-out r.nii up.nii g.ply sum1.nii || exit 99
both 70 'of voxels' 'ct-compose up.nii r.nii $D/sum.nii'; same sum.nii
for p in '' '--photons 1e5 --coarsen 2 --pixel mean' '--rotate 9,5,2 --method joseph'; do
	rm -f made/* p.exr
	both 70 "projected $p" "ct-project -n 3 --det 64 $p hr.nii \$D/p.exr"
	[ "$(ct-info p.exr | grep '^hash')" = "$(ct-info made/p.exr | grep '^hash')" ]; ok $? 'the same pixels'
done
rm made/*
ct-degrade -q -x 1 --clip -1024:3071 hr.nii clipped.nii
both 70 'overshoot and all' 'ct-project -n 3 --det 64 --overshoot clipped.nii $D/p2.exr'
rm clipped.nii made/*
ct-degrade -q -x 4 -p P3 hr.nii points.nii
for k in 1 2; do ct-upsample -q -m cubic --brick $k/2 points.nii s$k.nii; done
look peak ct-merge -q s2.nii s1.nii made/whole.nii; ok $? 'joined'
within 20 'some planes'
rm made/* s?.nii
if command -v ct-view >/dev/null; then
	both 166 'drawn' 'ct-view -e hr.nii up.nii $D/p.png'
	cmp p.png made/p.png; ok $? 'the same picture'
	for o in '--mip=max' '-p axial --surface=0 -l'; do
		rm made/* p.png
		both 166 "$o" "ct-view $o hr.nii up.nii \$D/p.png"
		cmp p.png made/p.png; ok $? 'the same picture'
	done
	rm made/*
fi
exits 0 'an estimate' ct-project --dry-run -t 1 -n 3 --memory 72M hr.nii made/p.exr
has out '^memory *72 MiB' 'of the memory'
has out '^disk .* 1[0-9][0-9] MiB of state' 'and the disk'
exits 0 'one that fits' ct-project --dry-run -n 3 --memory 2G hr.nii made/p.exr
grep -q '^disk.*state' out; [ $? -eq 1 ]; ok $? 'needs no disk besides'

if ct-convert -q hr.nii series/; then # with DICOM
	look peak ct-convert -q -t 1 series/ slices.nii; ok $? 'slices of a scanner'
	within 82 'plane by plane'
	both 82 'turned' 'ct-convert --reorient SAL series/ $D/side.nii'; same side.nii
	look peak ct-convert -q -t 1 --memory 82M slices.nii made/series/; ok $? 'slices for one'
	within 82 'that is'
	rm -r series made/*
fi
for t in 'ct-degrade -x 2' ct-convert ct-project 'ct-compose up.nii' 'ct-metrics hr.nii'; do
	case $t in *metrics*) o= ;; *project) o=made/x.exr ;; *) o=made/x.nii ;; esac
	# shellcheck disable=SC2086
	exits 7 "$t in too little" $t --memory 20M -t 2 hr.nii $o
	has err "^${t%% *}: --memory 20M: this takes [0-9]*M\$" 'in words'
	# shellcheck disable=SC2086
	exits 2 "$t in no size" $t --memory lots hr.nii $o
done
exits 4 'no folder for what does not fit' env TMPDIR=/nonexistent sh -c 'ct-convert --reorient SAL --memory 70M hr.nii - >none'
has err '/nonexistent: no room for [0-9]* MiB: ' 'is named'
alone ''
[ -z "$(ls -A tmp)" ]; ok $? 'nor there'
done_testing
