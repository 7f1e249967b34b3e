#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-train: its options, its kinds, when it stops.
. "$srcdir/tests/tap.sh"

# Every option of ct-train by what it does to the weights, the log and the metadata.
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
cat >look.py <<'END'
"""What is asked of priors and logs; True ends with 0."""
import json, re, struct, sys
def whole(name):
    b = open(name, 'rb').read()
    n = struct.unpack('<Q', b[:8])[0]
    return json.loads(b[8:8 + n]), b[8 + n:]
def weights(name):
    return whole(name + '.safetensors')[1]
def meta(name, key):
    return whole(name + '.safetensors')[0]['__metadata__'].get(key)
def losses(name):
    return [(int(s), float(x)) for s, x in re.findall(r'step (\d+): loss ([0-9.]+),', open(name + '.log').read())]
def held(name):
    return [(int(s), float(x)) for s, x in re.findall(r'step (\d+): held-out loss ([0-9.]+)', open(name + '.log').read())]
def mean(x):
    return sum(v for _, v in x) / len(x)
ok = eval(sys.argv[1])
sys.exit(not ok)
END
is() { python3 look.py "$1" 2>err; ok $? "$2"; sed 's/^/# /' err; } # is EXPRESSION NAME
for d in 0.25 0.5; do exact sphere d$d.exr "--size 64x64x64 --expert density=$d" -n 6 --det 48; done
exact ellipsoids a.exr '--size 64x64x64' -n 6 --det 48 &&
	exact marks b.exr '--size 64x64x64' -n 3 --det 48; ok $? 'projections to train on are made'
net=model_channels=32,channel_mult=1,num_res_blocks=1
train() { out=$1; shift; ct-train -a $net -p 8 --expert batch=2 -n 7 --expert lr=1e-3,log-every=1 "$@" 2>"$out.log"; } # train OUT ARGS...
run() { out=$1; shift; train "$out" "$@" "$out.safetensors" a.exr; }
run plain
is '[s for s, _ in losses("plain")] == list(range(1, 8)) and min(x for _, x in losses("plain")) > 0' 'a loss each step'
run three --expert=log-every=3
is 'weights("three") == weights("plain") and [s for s, _ in losses("three")] == [3, 6, 7]' 'log-every=3, and the last'
is 'all(abs(x - y) < 2e-5 for (_, x), y in zip(losses("three"), (mean(losses("plain")[i:j]) for i, j in ((0, 3), (3, 6), (6, 7)))))' \
	'is the mean of what was not told'
for o in --expert=lr=2e-3 '--expert=warmup=5' '--expert=cosine=yes' '--expert=decay=0.5' '--expert=clip=0.01' --expert=ema=0.2 '--expert=scales=2' \
	'-s 1' --expert=batch=3; do
	# shellcheck disable=SC2086
	run other $o -f
	is 'len(weights("other")) == len(weights("plain")) and weights("other") != weights("plain")' "$o"
done
run other -f --expert=scales=1,warmup=0,decay=0,clip=1e9,ema=0.9
is 'weights("other") == weights("plain")' 'not so defaults, nor a clip and an average that nothing comes near'
run one -n 1 --expert=warmup=10; run tenth -n 1 --expert lr=1e-4
is 'weights("one") == weights("tenth")' 'warmup=10: the first step at a tenth of the rate'

ct-train -a $net -p 8 --expert batch=2 -n 51 --expert lr=1e-3 often.safetensors a.exr 2>often.log
is '[s for s, _ in losses("often")] == [50, 51]' 'every 50 steps if nothing is said'
train colour colour.safetensors a.exr -n 1 -a "$net,in_channels=3,out_channels=3"
is 'len(weights("colour")) > len(weights("plain"))' 'three channels, all of them the picture'

# the same but for a power of two: a stack is seen as parts of its largest value
for d in 0.25 0.5; do train d$d d$d.safetensors d$d.exr; done
is 'weights("d0.25") == weights("d0.5")' 'twice the density is the same picture'
exact sphere dark.exr '--size 64x64x64' -n 2 --det 48 --expert offset=9999,0
exits 3 'a stack that is dark' ct-train no.safetensors dark.exr
has err 'dark.exr: no projection value is positive' 'a stack without a positive value is named in the error'

# names and hashes of what it was trained on
mkdir -p f/below && cp a.exr f/0.exr && cp b.exr f/1.exr && cp b.exr f/.hidden && cp b.exr f/below
train both both.safetensors a.exr b.exr; train folder folder.safetensors f/
is 're.fullmatch("a.exr xxh3:([0-9a-f]{32}); b.exr xxh3:([0-9a-f]{32})", meta("both", "dataset")) is not None' 'two DATA by name and hash'
train alone alone.safetensors b.exr
is 'meta("both", "dataset") == meta("plain", "dataset") + "; " + meta("alone", "dataset")' 'the hash that each has alone'
is 're.fullmatch("f xxh3:[0-9a-f]{32}", meta("folder", "dataset")) is not None' 'a folder by its name'
is 'weights("both") == weights("folder")' 'which is what is in it, by name, nothing hidden and nothing below'
is 'meta("plain", "licence") is None and meta("plain", "step") == "7" and meta("plain", "image_size") == "8"' 'step and size'

# held-out pictures
run held --validate b.exr --expert=validate-every=3,validate-pieces=4
is 'weights("held") == weights("plain") and [s for s, _ in held("held")] == [3, 6, 7]' 'validate-every=3, and the last'
is 'min(x for _, x in held("held")) > 0 and losses("held") == losses("plain")' 'tells a loss, and changes none'
run more --validate b.exr --expert=validate-every=7,validate-pieces=5
is '[s for s, _ in held("more")] == [7] and held("more") != held("held")[2:]' 'validate-pieces'
ct-phantom -q -f --size 64x64x64 ellipsoids c.nii; ct-project -q -f -n 2 --det 16 c.nii c.exr
train some some.safetensors -n 1 -p 24 --validate a.exr a.exr c.exr; has some.log 'warning: 2 of 8 pictures are smaller than a piece of 24 x 24, and not used$' 'pictures that are too small are counted in a warning'
[ "$(grep -c 'warning: .* pictures are smaller' some.log)" -eq 1 ]; ok $? 'pictures that are large enough are not warned of'
exits 5 'or are too small' ct-train -a $net -p 64 --validate b.exr no.safetensors a.exr

# more steps of the same, with and without the cosine, which ends at the last
for c in '' --expert=cosine=yes; do
	# shellcheck disable=SC2086
	run part -f $c -n 4; exits $([ -z "$c" ]; echo $((3 * $?))) "goes on to another step $c" \
		ct-train -a $net -p 8 --expert batch=2 -n 7 --expert lr=1e-3 $c --resume part.safetensors a.exr
	[ -n "$c" ] || is 'weights("part") == weights("plain")' 'to the same weights'
done
has err "steps was '4', not '7'" 'the error of other steps names both'

# a state of which one tensor has another name
python3 - <<'END'
import re
b = open('plain.safetensors.state', 'rb').read()
n = 8 + int.from_bytes(b[:8], 'little')
head, found = re.subn(rb'.("\s*:\s*{\s*"dtype")', rb'~\1', b[8:n], count=1)
assert found == 1
open('plain.safetensors.state', 'wb').write(b[:8] + head + b[n:])
END
exits 3 'a broken state is refused with status 3' ct-train -a $net -p 8 --expert batch=2 -n 9 --expert lr=1e-3 --resume plain.safetensors a.exr
has err '^ct-train: plain.safetensors.state: ' 'a broken state is named in the error'

no() { exits 2 "$1 is refused: $3" ct-train -a "$1" "--expert=scales=$2" no.safetensors a.exr; has err "$3" "the error of --arch $1 is in words"; }
no colour 1 '"colour" is not KEY=VALUE'
no in_channels=1,colour=3 1 'there is no "colour"'
no "$(printf '%0200d' 0)" 1 'an item is too long'
for s in 0 65 1, '1;2' 1,2,3,4,5,6,7,8,9; do no $net "$s" 'up to 8 whole numbers from 1 to 64'; done
exits 5 'the largest scale there is' ct-train -a $net -p 8 --expert=scales=64 no.safetensors a.exr
[ ! -e no.safetensors ]; ok $? 'training that was refused leaves nothing'

# ct-train --kind slices: what it is trained on, its defaults, what it costs, and what is refused.
part slices
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
echo '{}' >scans/1.json
run known; ok $? 'ct-train --kind slices trains on a folder, in which a volume has a sidecar'
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
for f in kept/*; do printf XXXX | dd of="$f" bs=1 seek=60000 conv=notrunc 2>/dev/null; done
run mended -f --cache kept; same plain mended; ok $? 'examples of the cache that were damaged are made anew'
exits 4 'a cache among the data is refused' ct-train $small --cache scans no.safetensors scans/; has err 'scans/: is a folder of DATA' 'the error of a cache among the data names them'
exits 4 'OUT among the data is refused' ct-train $small scans/no.safetensors scans; [ "$(ls scans)" = '1.json
1.nii
2.nii' ]; ok $? 'nothing was written among the data'
# --resume: OUT has become another's
run again -f -n 1; cp again.safetensors mine; echo mine >again.safetensors
exits 4 'a file that is no network is not overwritten by --resume' ct-train $small --resume again.safetensors scans
has err 'again.safetensors: is not of the training that is resumed; --force overwrites it' 'the error of --resume over a file of others'
ct-train $small other.safetensors -f scans/1.nii 2>/dev/null; cp other.safetensors again.safetensors
exits 4 'nor is a network that learnt from other data' ct-train $small --resume again.safetensors scans; cmp -s other.safetensors again.safetensors; ok $? 'the network of other data stays as it was'
run seen --validate held.nii --expert=validate-every=1
[ "$(grep -c 'held-out loss [0-9]' seen.log)" -eq 1 ]; ok $? '--validate reports the loss on other volumes'
! grep -q 'held out: ' seen.log; ok $? 'volumes that are only held out are not warned of'
ln scans/1.nii twin.nii; run twice --validate twin.nii
has twice.log '^ct-train: warning: scans/1.nii: is trained on and held out' 'a volume that is trained on and held out, by whatever name, is warned of'
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
has err 'depth 1 and slices 2: .*depth as many or an even number more' 'the error of too few slices gives depth and slices'
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
cost() { ct-train --kind slices --expert=cubes=2,cube=32,components=60,width=1024,noise=0 -n 200 -t 2 --dry-run "$@" no.safetensors scans >out 2>err; }
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
[ "$memory" -ge $((n * 60 / 1048576)) ] && [ "$memory" -le $((n * 72 / 1048576)) ]
ok $? "the dry run prints the memory of weights, moments, gradients and of the state that is written ($memory MiB)"
cost --expert=cubes=40; more=$(($(mib memory) - memory))
[ "$more" -ge 3 ] && [ "$more" -le 20 ]; ok $? "the memory grows with the number of examples (by $more MiB)"
cost --half; [ "$(mib disk)" -eq $((n * 2 / 1048576 + 1)) ]; ok $? '--half halves the size on disk'
}
[ ! -e no.safetensors ]; ok $? 'refused trainings of slices leave no prior'

# ct-train --patience: it stops where held-out data no longer gain, what is written is the best, and a
# training that was interrupted judges as one that was not.
part patience
cat >look.py <<'END'
"""What is asked of priors, states and logs; True ends with 0."""
import json, re, struct, sys
def whole(name):
    b = open(name, 'rb').read()
    n = 8 + struct.unpack('<Q', b[:8])[0]
    return json.loads(b[8:n]), b[n:]
def weights(name):
    return whole(name + '.safetensors')[1]
def values(name, tensor):
    head, data = whole(name)
    a, b = head[tensor]['data_offsets']
    return struct.unpack('<%df' % ((b - a) // 4), data[a:b])
def step(name):
    return int(whole(name + '.safetensors')[0]['__metadata__']['step'])
def held(name):
    return [(int(s), float(x)) for s, x in re.findall(r'step (\d+): held-out loss ([0-9.]+)', open(name + '.log').read())]
def best(name):
    return [(int(s), float(x)) for s, x in re.findall(r'step (\d+): the best, held-out loss ([0-9.]+)', open(name + '.log').read())]
def course(name, most, patience):
    """Does the log end where it should, and OUT hold the step of the least loss?"""
    h = held(name)
    least = min(h, key=lambda x: x[1])
    last = h[-1][0] == most if h[-1][0] - least[0] < patience else h[-1][0] - least[0] == patience
    return last and [s for s, _ in h] == list(range(1, h[-1][0] + 1)) and best(name) == [least] and step(name) == least[0]
sys.exit(not eval(sys.argv[1]))
END
is() { python3 look.py "$1" 2>err; ok $? "$2"; sed 's/^/# /' err; } # is EXPRESSION NAME
exact ellipsoids a.exr '--size 64x64x64' -n 6 --det 48 &&
	exact marks b.exr '--size 64x64x64' -n 3 --det 48; ok $? 'projections to learn from with patience are made'
net=model_channels=32,channel_mult=1,num_res_blocks=1
train() { # train OUT ARGS...: too fast, so that it goes astray
	out=$1; shift
	ct-train -a $net -p 8 --expert batch=2,lr=1e-2,ema=0.5 "$@" $out.safetensors a.exr 2>"$out.log"
}
judged() { out=$1; shift; train "$out" --validate b.exr --expert=validate-every=1,validate-pieces=8 "$@"; }
judged three -n 12 --patience 3
is 'course("three", 12, 3) and held("three")[-1][0] < 12 and step("three") > 1' 'stops after three that were no better'
train until -n "$(python3 look.py 'print(step("three"))')"
is 'weights("until") == weights("three")' 'and writes the weights of the best'
judged all -n 12
is 'step("all") == 12 and held("all")[:5] == held("three")[:5] and best("all") == []' 'not by default'
is 'weights("all") != weights("three")' 'which writes the last'
judged long -n 12 --patience 1000
is 'course("long", 12, 1000)' 'a longer one ends with the steps'

# an interruption changes nothing
judged part -n 4 --patience 3
is 'weights("part") == weights("three")' 'interrupted, the best is written'
judged part -n 12 --patience 3 --resume -t 2
is 'weights("part") == weights("three") and step("part") == step("three")' 'resumed, too'
cmp part.safetensors.state three.safetensors.state; ok $? 'training that was interrupted and resumed has the same state'
judged part -n 12 --patience 3 --resume
is 'held("part") == [] and weights("part") == weights("three")' 'resumed at its end, it stays there'
cmp part.safetensors.state three.safetensors.state; ok $? 'training resumed at its end has the same state'
cp part.safetensors.state whole.state
python3 - <<'END'
import json, re, struct
b = open('whole.state', 'rb').read()
n = 8 + struct.unpack('<Q', b[:8])[0]
h = json.loads(b[8:n])
del h['__metadata__']['content']
h['__metadata__']['best'] = re.sub('^([^ ,]*[ ,]+)[0-9]+', r'\1-1', h['__metadata__']['best'])
h = json.dumps(h).encode()
open('part.safetensors.state', 'wb').write(struct.pack('<Q', len(h)) + h + b[n:])
END
exits 3 'a state whose best step is negative is refused' judged part -n 12 --patience 3 --resume
has part.log '"best": -1' 'the error of a negative best step repeats it'
mv whole.state part.safetensors.state
judged part -n 12 --patience 1000 --resume
is 'held("three") + held("part") == held("long") and weights("part") == weights("long")' 'with more patience it goes on'
judged slow -n 5 --patience 9 --expert=validate-pieces=3000
signalled 5 15 ct-train -a $net -p 8 --expert batch=2,lr=1e-2,ema=0.5 --validate b.exr --expert=validate-every=1,validate-pieces=3000 -n 5 \
	--patience 9 stopped.safetensors a.exr 2>stopped.log
s=$?; grep -q 'step 2: held' stopped.log && ! grep -q 'step 3: held' stopped.log &&  [ $s -eq 75 ]; ok $? "stopped while it judges ($s)"
judged stopped -n 5 --patience 9 --expert=validate-pieces=3000 --resume
cmp stopped.safetensors.state slow.safetensors.state; ok $? 'judges what it had not'
is 'weights("stopped") == weights("slow")' 'and ends the same'

# what is judged by is part of the run
cp a.exr other.exr
more() { exits 3 "$1" judged part -n 12 --patience 1000 --resume "$2" "$3"; has part.log "$4" 'the error of another patience names it'; }
more 'other pictures' --validate a.exr 'is of a run where --validate held something else'
more 'another time' --expert=validate-every=2 "where --expert validate-every was '1', not '2'"
more 'more pieces' --expert=validate-pieces=9 "where --expert validate-pieces was '8', not '9'"
exits 3 'a state without patience does not resume with one' judged all -n 13 --patience 3 --resume
exits 0 'without patience others may be looked at' judged all -n 13 --resume --validate a.exr

# slices: the best, of this factor, with what the error is and what else OUT is to hold
mkdir scans
for k in 1 2; do ct-phantom -q -s $k --size 40x40x40 ellipsoids scans/$k.nii; done
ct-phantom -q --size 40x40x40 marks held.nii
slices() { # slices OUT ARGS...
	out=$1; shift
	ct-train --kind slices --expert=cubes=2,cube=24,width=24,components=20,noise=0,depth=1,validate-every=1 --validate held.nii \
		 "$@" $out.safetensors scans 2>$out.log
}
slices two -x 2 -n 1
slices four --expert=lr=1,ema=0 -n 30 --patience 2 --with two.safetensors
is 'course("four", 30, 2) and held("four")[-1][0] < 30' 'slices are judged, too'
ct-info -v four.safetensors >out; has out '^  *4.shape' 'the net that was trained'
is 'values("two.safetensors", "2.w1") == values("four.safetensors", "2.w1")' 'and the one beside it'
is 'values("four.safetensors.state", "network.spread") == (1, 0, 0) != values("four.safetensors", "4.spread")' \
	'what the error is was found at the end'

# RDN and Omni-SR: the numbers of PyTorch; ct-train --kind superres, and ct-ddnm, which asks such a network once.
part supervised
net=$builddir/tests/t-super-net twin=$srcdir/tests/supervised-torch.py
if python_with torch; then
	"$PY" "$twin" make && for n in rdn-small rdn-published omni-small omni-published; do
		"$net" answer $n.pt $n.safetensors || break
	done && "$PY" "$twin" compare >same
	[ "$(grep -c ^good same)" = 4 ]; ok $? 'RDN and Omni-SR have the values and gradients of PyTorch'
	sed 's/^/# /' same
else
	skip 'RDN and Omni-SR have the values and gradients of PyTorch' 'no PyTorch'
fi

# training and refining, for each network
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii && ct-project -q --views 6 --det 48 hr.nii hr.exr &&
	ct-project -q --views 6 --det 48 --coarsen 3 --pixel mean hr.nii lr.exr
ok $? 'projections for this test are made'
rdn=net=rdn,blocks=1,layers=2,features=8,growth=6
omni=net=omni,blocks=1,features=8,num_heads=2,window=4
opts='--kind superres -x 3 -p 48 --expert batch=5,lr=1e-3'
for n in rdn omni; do
	eval "arch=\$$n"
	# shellcheck disable=SC2154
	exits 0 "$n: ct-train --kind superres runs four steps" ct-train -q $opts --arch "$arch" -n 4 $n.safetensors hr.exr
	ct-train -q $opts --arch "$arch" -n 2 -t 1 b.safetensors hr.exr &&
		ct-train -q $opts --arch "$arch" -n 4 -t 3 --resume -f b.safetensors hr.exr &&
		cmp $n.safetensors.state b.safetensors.state
	ok $? "$n: a training stopped and resumed with other threads gives the same bytes"
	rm -f b.safetensors b.safetensors.state
	exits 0 "$n: ct-ddnm refines projections with the network" ct-ddnm -q -t 1 --prior $n.safetensors lr.exr $n.exr
	for k in 1 3; do
		CT_THREADS=$k ct-ddnm -q --prior $n.safetensors lr.exr - >$k.exr
	done
	cmp 1.exr 3.exr; ok $? "$n: ct-ddnm gives the same bytes with one and three threads"
done
exits 0 'ct-train --kind superres accepts --validate' ct-train $opts --arch $rdn -n 60 --expert log-every=20,ema=0.9 --validate hr.exr \
	l.safetensors hr.exr
awk '/step 20: loss/{a=$5} /step 60: loss/{b=$5} /step 60: held/{c=$6} END{exit !(b+0 < 0.8*(a+0) && c+0 > 0 && c+0 < a+0)}' err
ok $? 'the loss of a training of super-resolution falls by a fifth'
# networks that PyTorch wrote
if python_with torch; then
	exits 0 'ct-ddnm accepts a checkpoint of PyTorch with its factor' ct-ddnm -q --prior rdn-small.pt --arch net=rdn,factor=6 hr.exr pt.exr
	exits 3 'a checkpoint of PyTorch with a wrong factor is refused with status 3' ct-ddnm -q --prior rdn-small.pt --arch net=rdn,factor=3 hr.exr pt3.exr
	has err 'factor is 3, the tensors are of another' 'the error of tensors of another factor names it'
	cp "$srcdir/tests/exr.py" .
	PYTHONPATH=. "$PY" "$twin" stack rdn 1 2 6 8 3 >same && PYTHONPATH=. "$PY" "$twin" stack omni 1 1 8 2 4 3 >>same
	[ "$(grep -c ^good same)" = 2 ]; ok $? 'PyTorch refines a stack to the same values'
	sed 's/^/# /' same
fi
ct-info omni.safetensors >info && has info 'net.*omni' 'the file of a network records its kind'

# refusals and cost
exits 2 '-x with another factor than that of the network is refused' ct-ddnm -q -x 2 --prior rdn.safetensors hr.exr x.exr
has err 'rdn.safetensors makes 3 times finer' 'the error of another factor names that of the network'
ct-project -q --views 2 --det 16 --coarsen 2 --pixel mean hr.nii two.exr
exits 2 'projections coarser by another factor are refused with status 2' ct-ddnm -q --prior rdn.safetensors two.exr x.exr
exits 0 'the factor of the network is used without -x' ct-ddnm -q --sampler once --prior rdn.safetensors hr.exr x.exr
ct-info x.exr >info && has info '^size  *144 144' 'a network of factor 3 makes the detector three times finer'
exits 2 'a diffusion sampler with a network of super-resolution is refused' ct-ddnm -q --sampler ddim --prior rdn.safetensors lr.exr y.exr
has err 'not a diffusion prior: give --sampler once' 'the error of a diffusion sampler names --sampler once'
exits 2 'a diffusion prior with --sampler once is refused with status 2' ct-ddnm -q --sampler once lr.exr y.exr
has err 'ct-train --kind superres' 'the error of a diffusion prior once names --kind superres'
exits 2 '--steps with a network of super-resolution is refused with status 2' ct-ddnm -q --steps 5 --prior rdn.safetensors lr.exr y.exr
has err 'steps' 'the error of --steps with a network of super-resolution names it'
exits 2 '--init with a network of super-resolution is refused with status 2' ct-ddnm -q --init hr.exr --prior rdn.safetensors lr.exr y.exr
exits 2 '--kind superres with net=unet is refused with status 2' ct-train -q $opts --arch net=unet y.safetensors hr.exr
exits 2 'net=rdn without --kind superres is refused with status 2' ct-train -q --arch net=rdn y.safetensors hr.exr
has err 'not with --kind pictures' 'the error of net=rdn without its kind names --kind pictures'
exits 2 'a piece that the factor does not divide is refused with status 2' ct-train -q $opts -p 50 --arch $rdn y.safetensors hr.exr
exits 5 'a piece smaller than the network accepts is refused with status 5' ct-train -q $opts -p 36 --arch $omni y.safetensors hr.exr
has err 'multiples of 4 from 16' 'the error of a wrong side names its multiples'
exits 0 'ct-ddnm --dry-run accepts a network of super-resolution' ct-ddnm --dry-run --prior omni.safetensors lr.exr y.exr
has out '6 calls' 'the dry run counts one call for each view'

# ct-train: it learns, resumes to the same bytes, stops when asked, and refuses what does not fit.
part pictures

# A stack of discs as ct-project would write it comes from the picture reader's simplest format: PGM
# is read by OpenImageIO; without it the folder cannot be read and there is nothing to test.
mkdir pics held
python3 - <<'EOF'
import random
random.seed(1)
for k in range(10):
    w, h = 48, 40
    cx, cy, r = random.uniform(12, 36), random.uniform(12, 28), random.uniform(6, 12)
    px = bytes(int(30 + 180 * max(0.0, 1 - ((x - cx) ** 2 + (y - cy) ** 2) / r ** 2) ** 0.5)
               for y in range(h) for x in range(w))
    with open(('held' if k > 7 else 'pics') + '/%d.pgm' % k, 'wb') as f:
        f.write(b'P5\n%d %d\n255\n' % (w, h) + px)
EOF
pictures || { skip 'ct-train learns from pictures' 'no OpenImageIO'; done_testing; }
small='--arch model_channels=32,channel_mult=1:1 -p 16 --expert batch=8 -s 5 --expert lr=1e-3'

# learning, resuming
# shellcheck disable=SC2086
exits 0 'ct-train trains on a folder of pictures' ct-train $small -n 60 --expert=log-every=20,validate-every=30 --validate held \
	a.safetensors pics
awk '/step 20: loss/{a=$5} /step 60: loss/{b=$5} END{exit !(b+0 < 0.75*(a+0) && b+0 > 0)}' err
ok $? 'the loss on the training pictures falls by a quarter'
awk '/step 30: held/{a=$6} /step 60: held/{b=$6} END{exit !(b+0 < a+0 && b+0 > 0)}' err
ok $? 'the loss on other pictures falls'

opts="$small --expert=clip=0.5,warmup=7"
# shellcheck disable=SC2086
{
ct-train -q $opts -n 12 b.safetensors pics
ct-train -q $opts -n 12 -t 1 d.safetensors pics
ct-train -q $opts -n 5 -t 3 c.safetensors pics
ct-train -q $opts -n 12 -t 3 --resume c.safetensors pics
}
cmp b.safetensors.state c.safetensors.state
ok $? 'a training stopped and resumed with other threads gives the same bytes'
cmp b.safetensors.state d.safetensors.state; ok $? 'a training with one thread gives the same bytes'

# refusals
# shellcheck disable=SC2086
exits 3 'a training cannot be resumed with another batch' ct-train $small --expert batch=4 -n 13 --resume a.safetensors pics
has err "a.safetensors.state: is of a run where --expert batch was '8', not '4'" 'the error of a resume with another batch gives both values'
# shellcheck disable=SC2086
exits 3 'a training cannot be resumed with other pictures' ct-train $small -n 80 --resume a.safetensors held
has err 'DATA 1 held something else' 'the error of a resume with other pictures names the argument'
cp -r pics moved
# shellcheck disable=SC2086
exits 0 'a training is resumed with the same pictures in another folder' ct-train -q $small -n 61 --resume a.safetensors moved
# shellcheck disable=SC2086
exits 3 'a training cannot be resumed with more pictures' ct-train $small -n 80 --resume a.safetensors pics held
# shellcheck disable=SC2086
exits 0 '--resume without a state begins a training' ct-train $small -q -n 1 --resume y.safetensors pics
# shellcheck disable=SC2086
exits 4 'an existing prior is not overwritten' ct-train $small a.safetensors pics
# shellcheck disable=SC2086
exits 6 'a training that diverges ends with status 6' ct-train $small --expert lr=1,decay=10 -n 2000 --expert ema=0 e.safetensors pics
has err 'diverged at step' 'the error of a training that diverges gives the step'
exits 5 'pieces that cannot be halved are refused with status 5' ct-train -p 18 z.safetensors pics
exits 5 'pieces larger than any picture are refused with status 5' ct-train -p 64 z.safetensors pics
exits 5 'scales that leave no piece are refused with status 5' ct-train -p 32 --expert=scales=2,4 z.safetensors pics
exits 3 'a folder that does not exist is refused with status 3' ct-train z.safetensors nowhere
mkdir -p none; exits 3 'a folder without pictures is refused with status 3' ct-train z.safetensors none
echo text >text.png
exits 3 'a text file instead of a picture is refused with status 3' ct-train z.safetensors text.png
has err 'text.png' 'the error of a text file instead of a picture names it'
exits 2 'an unknown word of --arch is refused with status 2' ct-train --arch colour=3 z.safetensors pics
exits 3 'channels that 32 does not divide are refused with status 3' ct-train --arch model_channels=20 z.safetensors pics
[ ! -e z.safetensors ] && [ ! -e z.safetensors.state ]; ok $? 'refused trainings leave neither prior nor state'

# outputs, signals, cost
# shellcheck disable=SC2086
ct-train -q $small --half -n 3 --licence CC0-1.0 - pics >stream.safetensors
ok $? 'ct-train --half writes a prior to standard output'
# shellcheck disable=SC2086
ct-train -q $small -n 3 whole.safetensors pics
python3 - <<'EOF'
import json, struct
def read(name):
    b = open(name, 'rb').read()
    n = struct.unpack('<Q', b[:8])[0]
    h = json.loads(b[8:8 + n])
    return h.pop('__metadata__'), h, b[8 + n:]
m, h, half = read('stream.safetensors')
_, _, whole = read('whole.safetensors')
assert m['licence'] == 'CC0-1.0' and m['step'] == '3' and m['dataset'].startswith('pics xxh3:')
assert m['channel_mult'] == '[1, 1]' and m['intensity_map'] and 'ct-train' in m['history']
assert 2 * len(half) == len(whole)
a = struct.unpack('<%de' % (len(half) // 2), half)
b = struct.unpack('<%df' % (len(whole) // 4), whole)
assert max(abs(x - y) for x, y in zip(a, b)) < 1e-3
assert max(abs(y) for y in b) > 0.1
EOF
ok $? '--half gives the same weights in half precision, with metadata'

# shellcheck disable=SC2086
signalled 5 15 ct-train -q $small -n 100000 f.safetensors pics 2>err
[ $? -eq 75 ]; ok $? 'SIGTERM ends ct-train with status 75'
[ -s f.safetensors ] && [ -s f.safetensors.state ]; ok $? 'after SIGTERM prior and state are written'
# shellcheck disable=SC2086
exits 0 '--minutes ends a training with status 0' ct-train -q $small -n 100000 --expert=cosine=yes --minutes 0.01 h.safetensors pics
[ -s h.safetensors ]; ok $? '--minutes leaves the prior trained so far'
# shellcheck disable=SC2086
exits 0 'ct-train --dry-run of pictures succeeds' ct-train $small --dry-run g.safetensors pics
has out '8 pictures, .* parameters' 'the dry run prints the number of pictures and parameters'
[ ! -e g.safetensors ]; ok $? 'the dry run writes no prior'
done_testing
