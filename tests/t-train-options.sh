#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Every option of ct-train by what it does to the weights, the log and the metadata.
. "$srcdir/tests/tap.sh"
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
done_testing
