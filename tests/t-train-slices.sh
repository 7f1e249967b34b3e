#!/bin/sh
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

run known; ok $? 'trains on a folder'
run same -p 12 --expert=batch=1024,lr=1e-3,decay=0.01,depth=3,ema=0.999 -x 4
same known same; ok $? 'at its defaults'
ct-info -v known.safetensors >out; has out '^  *4.shape' 'a prior of both axes'
small="$small -x 2 --expert=depth=1"
run plain
for o in '-p 8' --expert=batch=512 --expert=lr=2e-3 '--expert=decay=10' --expert=ema=0.1 '--expert=noise=30' '--expert=thick=yes' '--expert=cubes=3' '--expert=cube=26' --expert=slices=2,depth=4 \
	'--expert=width=23' '--expert=components=19' '-s 1' '-n 2'; do
	run other -f $o; s=$?
	[ $s -eq 0 ] && ! same plain other; ok $? "$o is something else"
done
run deep --expert=hidden=4; ct-info -v deep.safetensors >out; has out '^  *2.w2 .*72.*24' 'as many hidden layers as are said'
exits 2 'one hidden layer' ct-train $small --expert hidden=1 no.safetensors scans; has err 'hidden: 1 is outside \[2, 10\]' 'the error of one hidden layer names its range'
run thick --expert=thick=yes; ct-info -v thick.safetensors >out; has out '^  *thick-2.shape' 'one of slices with one coarse axis'
ct-train $small one.safetensors scans/1.nii scans/2.nii 2>one.log; ok $? 'trains on files'
same plain one; ok $? 'whose examples are the same'
run kept -f --cache kept; ls kept >was
ct-train $small --cache kept two.safetensors scans/2.nii 2>two.log; ls kept >is
[ "$(wc -l <was)" -ge 3 ] && cmp was is; ok $? 'whatever stands beside a file'
run after --expert=again=yes --with plain.safetensors; ! same plain after; ok $? 'a second pass learns from what the first made'
for k in 1 2; do
	run after-kept -f --cache kept --expert=again=yes --with plain.safetensors
	same after after-kept; ok $? "the same of kept examples, run $k"
done
[ "$(wc -l <was)" -eq "$(($(find kept -type f | wc -l) / 2))" ]; ok $? 'which are those of the first pass, and as many more'
run seen --validate held.nii --expert=validate-every=1
[ "$(grep -c 'held-out loss [0-9]' seen.log)" -eq 1 ]; ok $? 'tells what it knows of others'
cmp plain.safetensors.state seen.safetensors.state; ok $? 'and learns nothing from them but what to expect'
ct-train $small --cache as-is --validate held.nii as-is.safetensors scans 2>as-is.log
[ "$(grep -l ' 1:1 ' as-is/* | wc -l)" -eq 2 ] && [ "$(find as-is -type f | wc -l)" -eq 6 ]; ok $? 'of volumes as they are'
ct-train $small -v more.safetensors scans held.nii 2>err; has err '^ct-train: 6 examples$' 'all that fit are examples'

exits 0 'a patch of fewer values than components by default' ct-train -k slices -x 2 -n 1 --expert=cubes=1,cube=24,width=24,noise=0 fewer.safetensors scans
exits 2 'no components' ct-train $small --expert components=0 no.safetensors scans; has err 'components: 0 is outside \[1, 4096\]' 'the error of 0 components names its range'
exits 3 'fewer slices than a cell has' ct-train $small --expert slices=2 no.safetensors scans; has err 'depth 1 and slices 2$' 'are refused'
! grep -q 'examples' err; ok $? 'before examples are made'
exits 2 'half a piece' ct-train $small --expert batch=300 no.safetensors scans
has err '--expert batch: expected a multiple of 256' 'the error of a wrong batch names its multiple'
ct-phantom -q --size 11x40x40 ellipsoids little.nii
exits 3 'a volume of 11 voxels' ct-train $small no.safetensors little.nii
has err '^ct-train: little.nii: no volume is large enough for an example$' 'is too small'
exits 3 'to validate, too' ct-train $small --validate little.nii no.safetensors scans
has err '^ct-train: little.nii: no volume is large enough for an example$' 'which is said'
ct-phantom -q --size 40x40x40 constant flat.nii
cp scans/1.nii nan.nii; printf '\000\000\300\177' | dd of=nan.nii bs=1 conv=notrunc seek=$(($(wc -c <nan.nii) - 4)) 2>/dev/null
exits 6 'NaN' ct-train $small no.safetensors nan.nii; has err 'nan.nii: voxel' 'is named'
exits 3 'nothing at all' ct-train $small no.safetensors flat.nii
has err '^ct-train: flat.nii: every voxel is ' 'is told'
mkdir none; exits 3 'an empty folder' ct-train $small no.safetensors none
exits 2 'bytes are two numbers' ct-train $small --bytes 1 no.safetensors scans

# bytes b are as good as the HU they stand for
python3 - <<'END'
import struct
b = bytes(((i * i + 7 * j) // 40 % 5 * 40 + (k // 9) % 3 * 20) % 256 for k in range(48) for j in range(48) for i in range(48))
open('b.raw', 'wb').write(b)
open('hu.raw', 'wb').write(b''.join(struct.pack('<f', 14 * v - 1000) for v in b))
open('half.raw', 'wb').write(b''.join(struct.pack('<f', v / 2 + 0.25) for v in b))
open('wide.raw', 'wb').write(b''.join(struct.pack('<f', 2 * v) for v in b))
END
ct-convert -q --raw 48x48x48:u8:1 b.raw b.nii && for t in hu half wide; do
	ct-convert -q --raw 48x48x48:f32:1 $t.raw $t.nii; done; ok $? 'volumes of bytes'
exits 3 'bytes are no HU' ct-train $small no.safetensors b.nii
has err '^ct-train: b.nii: values from 0 to [0-9]* are not HU: give --bytes$' 'unless it is said what they are'
for t in half wide; do
	exits 3 "$t values neither" ct-train $small --bytes=-1000:2570 no.safetensors $t.nii
	has err "^ct-train: $t.nii: values from [0-9.]* to [0-9.]* are not HU$" 'in words'
done
ct-train $small --bytes=-1000:2570 b.safetensors b.nii 2>err; ct-train $small hu.safetensors hu.nii 2>err
same b hu; ok $? 'bytes become HU'
ct-train $small --bytes=-1000:2571 other.safetensors -f b.nii 2>err; ! same b other; ok $? 'by what is said'

# (17 + width) (68 + 1) + width^2 + 18 width + 17 weights, and 61 for each of 432 values
cost() { ct-train --kind slices --expert=cubes=2,cube=32,components=60,width=1024,noise=0 -n 200 --dry-run "$@" no.safetensors scans >out 2>err; }
cost; ok $? 'a dry run'
n=$(((17 + 1024) * 69 + 1024 * 1024 + 18 * 1024 + 17 + 61 * 432))
grep -q " on [1-4] examples, $n parameters\$" out; ok $? "tells the size of the work ($n)"
mib() { sed -n "s/^$1  *\([0-9]*\) MiB.*/\1/p" out; }
whole=$(mib disk)
[ "$whole" -eq $((n * 4 / 1048576 + 1)) ]; ok $? "disk ($whole MiB)"
[ "$(sed -n 's/^disk .* and \([0-9]*\) MiB of state.*/\1/p' out)" -eq $((n * 16 / 1048576 + 1)) ]; ok $? 'the state'
memory=$(mib memory)
[ "$memory" -eq 1 ]; ok $? "and memory ($memory MiB): two volumes an example"
cost --expert=cubes=40; memory=$(mib memory)
[ "$memory" -gt 4 ] && [ "$memory" -le 20 ]; ok $? "which grows with them ($memory MiB)"
cost --half; [ "$(mib disk)" -eq $((n * 2 / 1048576 + 1)) ]; ok $? 'half of the precision, half of the disk'
}
[ ! -e no.safetensors ]; ok $? 'what fails leaves nothing'
done_testing
