#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-train --patience: it stops where held-out data no longer gain, what is written is the best, and a
# training that was interrupted judges as one that was not.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
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
	exact marks b.exr '--size 64x64x64' -n 3 --det 48; ok $? 'projections to train on are made'
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
ct-phantom -q -s 9 --size 40x40x40 marks held.nii
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
done_testing
