#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A PLY of Gaussians read by a few lines of Python that know PLY and nothing of ours.
. "$srcdir/tests/tap.sh"
"$builddir/tests/t-ply" g.ply; ok $? 'a file to look at'
head -n 2 g.ply | tail -n 1 | grep -q '^format binary_little_endian 1.0$'; ok $? 'PLY is written binary and little-endian'
if command -v python3 >/dev/null; then
	cat >look.py <<'END'
import math, struct
head, body = open("g.ply", "rb").read().split(b"end_header\n", 1)
lines = head.decode().split("\n")
n = next(int(l.split()[2]) for l in lines if l.startswith("element vertex "))
names = [l.split()[2] for l in lines if l.startswith("property float ")]
want = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"] + \
	["scale_%d" % i for i in range(3)] + ["rot_%d" % i for i in range(4)] + ["density"]
assert names == want, names
assert len(body) == n * 4 * len(names), (len(body), n)
rows = [dict(zip(names, r)) for r in struct.iter_unpack("<%df" % len(names), body)]
gamma = next(float(l.split("=")[1]) for l in lines if l.startswith("comment ct:gamma="))
assert "comment ct:units=mm" in lines and "comment ct:activation=prelu" in lines
rho = [r["density"] if r["density"] > 0 else gamma * r["density"] for r in rows]
most = max(map(abs, rho))
for r, v in zip(rows, rho):
	p = min(max(abs(v) / most, 0.001), 0.999)
	assert abs(r["opacity"] - math.log(p / (1 - p))) < 1e-3, (r, v)
	shown = [0.5 + r["f_dc_%d" % k] / (2 * math.sqrt(math.pi)) for k in range(3)]
	colour = (0.98, 0.62, 0.25) if v >= 0 else (0.25, 0.55, 0.98)
	assert max(abs(a - b) for a, b in zip(shown, colour)) < 1e-5, (shown, v)
	red, blue = (0.5 + 0.28209479 * r[k] for k in ("f_dc_0", "f_dc_2"))
	assert 0 <= min(red, blue) and max(red, blue) <= 1 and (red > blue) == (v >= 0), r
	assert r["nx"] == r["ny"] == r["nz"] == 0
END
	python3 look.py 2>err; ok $? 'a 3DGS viewer finds its properties, colours and opacities'
	sed 's/^/# /' err
else
	skip 'a 3DGS viewer finds its properties' 'no python3'
fi
done_testing
