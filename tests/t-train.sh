#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-train: it learns, resumes to the same bytes, stops when asked, and refuses what does not fit.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }

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
pictures || { echo '1..0 # SKIP no OpenImageIO'; exit 0; }
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
exits 3 'a folder without pictures is refused with status 3' ct-train z.safetensors .
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
