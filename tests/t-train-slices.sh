#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-train --kind slices: what it is trained on, its defaults, what it costs, and what is refused.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
weights() { python3 -c 'import sys
b = open(sys.argv[1], "rb").read()
sys.stdout.buffer.write(b[8 + int.from_bytes(b[:8], "little"):])' "$1.safetensors"; }
same() { weights "$1" >w1; weights "$2" >w2; [ -s w1 ] && cmp -s w1 w2; } # same A B: the same weights
mkdir scans
for k in 1 2; do ct-phantom -q -s $k --size 40x40x40 ellipsoids scans/$k.nii; done
ct-phantom -q -s 9 --size 40x40x40 ellipsoids held.nii
# shellcheck disable=SC2086
{
small='--kind slices --expert=cubes=2,cube=24,width=24,components=20,noise=0 -n 1'
run() { out=$1; shift; ct-train $small "$@" $out.safetensors scans 2>$out.log; } # run OUT ARGS...

# defaults, options, data
run known; ok $? 'ct-train --kind slices trains on a folder'
run same -p 12 --expert=batch=1024,lr=1e-3,decay=0.01,depth=3,ema=0.999 -x 4
same known same; ok $? 'a training with its defaults stated gives the same weights'
ct-info -v known.safetensors >out; has out '^  *4.shape' 'a prior of slices has networks for both axes'
has out '^  *dataset  *scans xxh3:[0-9a-f]\{32\}$' 'a prior of slices records its scans with a checksum'
small="$small -x 2 --expert=depth=1"
run plain
for o in '-p 8' --expert=batch=512 --expert=lr=2e-3 '--expert=decay=10' --expert=ema=0.1 '--expert=noise=30' '--expert=thick=yes' '--expert=cubes=3' '--expert=cube=26' --expert=slices=2,depth=4 \
	'--expert=width=23' '--expert=components=19' '-s 1' '-n 2'; do
	run other -f $o; s=$?
	[ $s -eq 0 ] && ! same plain other; ok $? "$o changes the weights"
done
run deep --expert=hidden=4
ct-info -v deep.safetensors >out
has out '^  *2.w2 .*72.*24' 'hidden=4 gives four hidden layers'
exits 2 'one hidden layer is refused with status 2' ct-train $small --expert hidden=1 no.safetensors scans
has err 'hidden: 1 is outside \[2, 10\]' 'the error of one hidden layer names its range'
run thick --expert=thick=yes
ct-info -v thick.safetensors >out
has out '^  *thick-2.shape' 'thick=yes adds a network for slices with one coarse axis'
ct-train $small one.safetensors scans/1.nii scans/2.nii 2>one.log; ok $? 'ct-train --kind slices trains on single files'
same plain one; ok $? 'single files give the weights of their folder'
run kept -f --cache kept; ls kept >was
ct-train $small --cache kept two.safetensors scans/2.nii 2>two.log; ls kept >is
[ "$(wc -l <was)" -ge 3 ] && cmp was is; ok $? 'the cache of a file does not depend on the files beside it'
run after --expert=again=yes --with plain.safetensors
! same plain after
ok $? 'a second pass learns from the result of the first'
for k in 1 2; do
	run after-kept -f --cache kept --expert=again=yes --with plain.safetensors
	same after after-kept; ok $? "a second pass with a cache gives the same weights in run $k"
done
[ "$(wc -l <was)" -eq "$(($(find kept -type f | wc -l) / 2))" ]
ok $? 'the cache of a second pass has as many examples as that of the first'
run seen --validate held.nii --expert=validate-every=1
[ "$(grep -c 'held-out loss [0-9]' seen.log)" -eq 1 ]; ok $? '--validate reports the loss on other volumes'
cmp plain.safetensors.state seen.safetensors.state; ok $? '--validate does not change the training'
ct-train $small --cache as-is --validate held.nii as-is.safetensors scans 2>as-is.log
[ "$(grep -l ' 1:1 ' as-is/* | wc -l)" -eq 2 ] && [ "$(find as-is -type f | wc -l)" -eq 6 ]
ok $? 'the cache holds examples of volumes as they are'
ct-train $small -v more.safetensors scans held.nii 2>err
has err '^ct-train: 6 examples$' 'volumes that are large enough are all used as examples'

# refusals
exits 0 'fewer values in a patch than components are accepted' ct-train -k slices -x 2 -n 1 --expert=cubes=1,cube=24,width=24,noise=0 fewer.safetensors scans
exits 2 '0 components are refused with status 2' ct-train $small --expert components=0 no.safetensors scans
has err 'components: 0 is outside \[1, 4096\]' 'the error of 0 components names its range'
exits 3 'fewer slices than the depth needs are refused with status 3' ct-train $small --expert slices=2 no.safetensors scans
has err 'depth 1 and slices 2$' 'the error of too few slices gives depth and slices'
! grep -q 'examples' err; ok $? 'too few slices are refused before examples are made'
exits 2 'a batch that is no multiple of 256 is refused with status 2' ct-train $small --expert batch=300 no.safetensors scans
has err '--expert batch: expected a multiple of 256' 'the error of a wrong batch names its multiple'
ct-phantom -q --size 11x40x40 ellipsoids little.nii
exits 3 'a volume 11 voxels wide is refused with status 3' ct-train $small no.safetensors little.nii
has err '^ct-train: little.nii: no volume is large enough for an example$' 'the error of a volume 11 voxels wide names the file'
exits 3 'a volume 11 voxels wide is refused for --validate' ct-train $small --validate little.nii no.safetensors scans
has err '^ct-train: little.nii: no volume is large enough for an example$' 'the error of --validate with a small volume names the file'
ct-phantom -q --size 40x40x40 constant flat.nii
cp scans/1.nii nan.nii; printf '\000\000\300\177' | dd of=nan.nii bs=1 conv=notrunc seek=$(($(wc -c <nan.nii) - 4)) 2>/dev/null
exits 6 'a NaN in a training volume is refused with status 6' ct-train $small no.safetensors nan.nii
has err 'nan.nii: voxel' 'the error of a NaN in a training volume gives file and voxel'
exits 3 'a constant volume is refused with status 3' ct-train $small no.safetensors flat.nii
has err '^ct-train: flat.nii: every voxel is ' 'the error of a constant volume names the file'
mkdir none; exits 3 'a folder without volumes is refused with status 3' ct-train $small no.safetensors none
exits 2 '--bytes with a single number is refused with status 2' ct-train $small --bytes 1 no.safetensors scans

# --bytes: values from 0 to 255 that stand for HU
python3 - <<'END'
import struct
b = bytes(((i * i + 7 * j) // 40 % 5 * 40 + (k // 9) % 3 * 20) % 256 for k in range(48) for j in range(48) for i in range(48))
open('b.raw', 'wb').write(b)
open('hu.raw', 'wb').write(b''.join(struct.pack('<f', 14 * v - 1000) for v in b))
open('half.raw', 'wb').write(b''.join(struct.pack('<f', v / 2 + 0.25) for v in b))
open('wide.raw', 'wb').write(b''.join(struct.pack('<f', 2 * v) for v in b))
END
ct-convert -q --raw 48x48x48:u8:1 b.raw b.nii && for t in hu half wide; do
	ct-convert -q --raw 48x48x48:f32:1 $t.raw $t.nii; done; ok $? 'volumes of bytes for this test are made'
exits 3 'a volume of bytes is refused without --bytes' ct-train $small no.safetensors b.nii
has err '^ct-train: b.nii: values from 0 to [0-9]* are not HU: give --bytes$' 'the error of a volume of bytes names --bytes'
for t in half wide; do
	exits 3 "--bytes does not accept the values of $t.nii" ct-train $small --bytes=-1000:2570 no.safetensors $t.nii
	has err "^ct-train: $t.nii: values from [0-9.]* to [0-9.]* are not HU$" "the error of --bytes for $t.nii gives the range of its values"
done
ct-train $small --bytes=-1000:2570 b.safetensors b.nii 2>err; ct-train $small hu.safetensors hu.nii 2>err
same b hu; ok $? '--bytes gives the weights of the HU that the bytes stand for'
ct-train $small --bytes=-1000:2571 other.safetensors -f b.nii 2>err
! same b other
ok $? 'another range of --bytes gives other weights'

# cost: (17 + width) (68 + 1) + width^2 + 18 width + 17 weights, and 61 for each of 432 values
cost() { ct-train --kind slices --expert=cubes=2,cube=32,components=60,width=1024,noise=0 -n 200 --dry-run "$@" no.safetensors scans >out 2>err; }
cost; ok $? 'ct-train --dry-run of slices succeeds'
n=$(((17 + 1024) * 69 + 1024 * 1024 + 18 * 1024 + 17 + 61 * 432))
grep -q " on [1-4] examples, $n parameters\$" out
ok $? "the dry run prints the number of examples and of parameters ($n)"
mib() { sed -n "s/^$1  *\([0-9]*\) MiB.*/\1/p" out; }
whole=$(mib disk)
[ "$whole" -eq $((n * 4 / 1048576 + 1)) ]; ok $? "the dry run prints the size of the prior on disk ($whole MiB)"
[ "$(sed -n 's/^disk .* and \([0-9]*\) MiB of state.*/\1/p' out)" -eq $((n * 16 / 1048576 + 1)) ]
ok $? 'the dry run prints the size of the state'
memory=$(mib memory)
[ "$memory" -eq 1 ]; ok $? "the dry run prints the memory for two volumes an example ($memory MiB)"
cost --expert=cubes=40; memory=$(mib memory)
[ "$memory" -gt 4 ] && [ "$memory" -le 20 ]; ok $? "the memory grows with the number of examples ($memory MiB)"
cost --half; [ "$(mib disk)" -eq $((n * 2 / 1048576 + 1)) ]; ok $? '--half halves the size on disk'
}
[ ! -e no.safetensors ]; ok $? 'refused trainings of slices leave no prior'
done_testing
