#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-view draws patients the way radiologists look at them.
. "$srcdir/tests/tap.sh"
python=no; command -v python3 >/dev/null && python=yes
cat >png.py <<'END'
import struct, sys, zlib
def read(path): # 8-bit RGB, not interlaced
	b = open(path, "rb").read()
	assert b[:8] == b"\x89PNG\r\n\x1a\n"
	at, data = 8, b""
	while at < len(b):
		n, kind = struct.unpack(">I4s", b[at:at + 8])
		if kind == b"IHDR":
			w, h, depth, colour = struct.unpack(">IIBB", b[at + 8:at + 18])
			assert (depth, colour) == (8, 2), (depth, colour)
		if kind == b"IDAT":
			data += b[at + 8:at + 8 + n]
		at += 12 + n
	data, rows, old, n = zlib.decompress(data), [], bytes(3 * w), 3 * w
	for y in range(h):
		f, line = data[y * (n + 1)], bytearray(data[y * (n + 1) + 1:(y + 1) * (n + 1)])
		for i in range(n):
			a, up, c = (line[i - 3] if i > 2 else 0), old[i], (old[i - 3] if i > 2 else 0)
			p = a + up - c
			paeth = min((abs(p - a), 0, a), (abs(p - up), 1, up), (abs(p - c), 2, c))[2]
			line[i] = (line[i] + (0, a, up, (a + up) // 2, paeth)[f]) & 255
		rows.append([tuple(line[3 * x:3 * x + 3]) for x in range(w)])
		old = line
	return rows
END
run() { # run NAME: Python from standard input
	if [ "$python" = yes ]; then
		{ echo 'from png import *'; cat; } >t.py; python3 t.py 2>err; ok $? "$1"; sed 's/^/# /' err
	else
		cat >/dev/null; skip "$1" 'no python3'
	fi
}
# what is drawn: density 0.7 0.2 0.5 0.3 0.6 0.4 at R L A P S I, 0.6 of the half extent from the middle
ct-phantom --size 40x40x40 marks v.nii || exit 99
exits 0 'ct-view draws three planes of a volume' ct-view --window -1024:3071 v.nii v.png
run 'all six sides of a patient are where radiologists expect them' <<'END'
p = read("v.png")
assert (len(p), len(p[0])) == (128, 40), (len(p), len(p[0]))
R, L, A, P, S, I = (round(255 * d) for d in (0.7, 0.2, 0.5, 0.3, 0.6, 0.4))
for top, (up, down, left, right) in ((0, (A, P, R, L)), (44, (S, I, R, L)), (88, (S, I, A, P))):
	got = [p[top + y][x][0] for y, x in ((8, 20), (31, 20), (20, 8), (20, 31))]
	assert all(abs(g - w) <= 1 for g, w in zip(got, (up, down, left, right))), (top, got)
assert p[41][20] == (0, 0, 0)
END
exits 4 'ct-view does not overwrite a picture' ct-view v.nii v.png
exits 0 'ct-view -f overwrites a picture' ct-view -f v.nii v.png
exits 0 'ct-view draws one plane twice as large' ct-view -p coronal -z 2 v.nii c.png
ct-view -p coronal -z 2 - - <v.nii >d.png; ok $? 'ct-view reads and writes pipes'
cmp -s c.png d.png; ok $? 'a picture through pipes has the same bytes'
run 'a picture of --zoom 2 has twice the pixels' <<'END'
p = read("c.png")
assert (len(p), len(p[0])) == (80, 80)
assert all(p[y][x] == p[y ^ 1][x ^ 1] for y in range(80) for x in range(80))
END
ct-phantom --size 20x20x20 --spacing 4 marks lr.nii || exit 99
exits 0 'ct-view -e draws volumes of two spacings with error maps' ct-view -e -w -1024:3071 -o e.png v.nii lr.nii v.nii
run 'volumes of two spacings have one scale, and errors at edges only' <<'END'
p = read("e.png")
assert (len(p), len(p[0])) == (6 * 40 + 5 * 4, 3 * 40 + 2 * 4)
for y in list(range(132, 172)) + list(range(176, 216)):
	assert all(q == (0, 0, 0) for q in p[y][:40]), y
	assert all(q == (0, 0, 0) for q in p[y][88:]), y
errors = sum(q != (0, 0, 0) for y in range(132, 172) for q in p[y][44:84])
assert 20 < errors < 400, errors
assert all(p[y][44 + x] == p[y ^ 1][44 + (x ^ 1)] for y in range(40) for x in range(40))
END
if [ "$python" = yes ]; then # 10 m to the left
	python3 -c 'import struct
b = bytearray(open("lr.nii", "rb").read())
for at in 268, 292: b[at:at + 4] = struct.pack("<f", 1e4)
open("far.nii", "wb").write(b)'
	exits 5 'an error map of volumes that do not overlap is refused with status 5' ct-view -e -p axial v.nii lr.nii far.nii m.png
	has err '^ct-view: file 3 does not overlap with the first' 'the error of volumes that do not overlap gives the file'
else
	skip 'an error map of volumes that do not overlap is refused' 'no python3'
fi
# projections
ct-project --views 10 --det 24x20 v.nii p.exr || exit 99
exits 0 'ct-view draws five views of a stack' ct-view --views 5 p.exr p.png
run 'five views are drawn in three columns' <<'END'
p = read("p.png")
assert (len(p), len(p[0])) == (2 * 20 + 4, 3 * 24 + 2 * 4), (len(p), len(p[0]))
assert all(q == (0, 0, 0) for q in p[30][56:])
assert max(q[0] for row in p for q in row) == 255 and p[0][0] == (0, 0, 0)
END
exits 0 'ct-view -e draws two stacks' ct-view --views 3 -e p.exr p.exr q.png
# refusals, memory
exits 2 'a volume and a stack in one picture are refused with status 2' ct-view v.nii p.exr m.png
has err 'v.nii is a volume but p.exr is a stack' 'the error of a volume and a stack names both'
exits 2 'an output that is not PNG is refused with status 2' ct-view v.nii m.nii
exits 2 'a picture without an input is refused with status 2' ct-view m.png
exits 2 '-e with a single volume is refused with status 2' ct-view -e v.nii m.png
exits 2 'an empty window is refused with status 2' ct-view -w 5:5 v.nii m.png
printf 'hello' >t.txt
exits 3 'a text file is refused by ct-view with status 3' ct-view t.txt m.png
[ ! -e m.png ]; ok $? 'refused runs of ct-view leave no picture'
# too little memory, from what the loader needs up (127: it is below) to enough; a library may abort (134, 139)
if (ulimit -v 4000000 && exec ct-view --version) >/dev/null 2>&1; then
	codes=
	for k in 250 300 350 375 400 405 410 415 420 425 430 440 450 475 500 600; do
		codes=$codes\ $( (ulimit -v ${k}000; ct-view -f v.nii low.png; echo $?) 2>err )
	done
	echo "$codes" | grep -qxE '( (0|1|7|127|134|139))+'; ok $? "too little memory ends ct-view with a known status:$codes"
	[ "${codes##* }" = 0 ] && [ -s low.png ]; ok $? 'with enough memory ct-view draws the picture'
else
	skip 'too little memory ends ct-view with a known status' 'a sanitizer takes more than any limit'
fi
done_testing
