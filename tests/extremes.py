# SPDX-License-Identifier: Apache-2.0
"""extremes.py [ROW...]: scans that no hospital makes, through ct-sr as it comes, and a table of what came out.

A row passes when ct-sr ends well, and gives the same bytes with 1 and with 2 threads; every voxel is finite; the header's grid is that of the scan, cell-centred; the result, degraded as its header says, agrees
with the scan to the row's bound (of the largest value, or the noise that was assumed), as ct-sr claims; and its
error to the truth, where there is one, is at most that of cubic interpolation times the row's bound. Or when
what cannot be done is refused: one line, and the status that the row names.
"""
import json
import os
import re
import resource
import subprocess
import sys
import tempfile

try:
    import nibabel as nib
    import numpy as np
    import pydicom
except ImportError:
    if sys.executable != "/usr/bin/python3" and os.path.exists("/usr/bin/python3"):
        os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])
    sys.exit(print("extremes.py: needs a Python with nibabel and pydicom", file=sys.stderr) or 77)

ROWS = []


def row(name, **how):
    ROWS.append(dict({"name": name, "x": "2", "affine": np.diag([2.0, 2, 2, 1]), "degrade": [], "slabs": False,
                      "worse": 1.0, "differs": 1e-5, "status": 0, "args": []}, **how))


def body(n, at=1000.0, around=-1000.0):
    """An ellipsoid with a bar of twice the value and a hole: edges in all directions."""
    g = np.stack(np.meshgrid(*[(np.arange(m) + 0.5) / m * 2 - 1 for m in n], indexing="ij"))
    v = np.where((g ** 2).sum(0) < 0.6, at, around)
    v = np.where((abs(g[0] - 0.2) < 0.1) & (abs(g[1]) < 0.5) & (abs(g[2]) < 0.4), 2 * at - around, v)
    return np.where(((g + 0.3) ** 2).sum(0) < 0.04, around, v).astype("f4")


def checks(n):
    return np.where(np.indices(n).sum(0) % 2, 500, -500).astype("f4")


def spot(n, value):
    v = np.full(n, -1000, "f4")
    v[tuple(m // 2 for m in n)] = value
    return v


def noise(n, sd=100.0):
    return np.random.default_rng(7).normal(0, sd, n).astype("f4")


N = (24, 24, 24)  # of a truth
M = (12, 12, 12)  # of a scan without one
tilt = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
oblique = np.eye(4)
oblique[:3, :3] = tilt * 2
oblique[:3, 3] = [-31, 17, 5]
far = np.diag([2.0, 2, 2, 1])
far[:3, 3] = [5000, -7000, 12345.5]
sheared = np.diag([2.0, 2, 2, 1])
sheared[1, 2] = 0.7
limits = np.where(body(N) > 0, 32767, -32768).astype("f4")


def as_is(folder):
    pass


def by_place(folder):
    files = [os.path.join(folder, f) for f in os.listdir(folder)]
    return sorted(((pydicom.dcmread(f), f) for f in files), key=lambda s: float(s[0].ImagePositionPatient[2]))


def tilted(degrees):
    """Slices that are moved in their planes, as those of a gantry that leans are."""
    def move(folder):
        slices = by_place(folder)
        first = float(slices[0][0].ImagePositionPatient[2])
        for d, path in slices:
            p = list(map(float, d.ImagePositionPatient))
            p[1] += np.tan(np.radians(degrees)) * (p[2] - first)
            d.ImagePositionPatient = ["%.10g" % c for c in p]
            d.save_as(path)
    return move


def missing(folder):
    os.remove(by_place(folder)[7][1])


# a truth is degraded by ct-degrade, whose header says how; a scan is as it is
row("all air", truth=np.full(N, -1024, "f4"), worse=None)
row("all water", truth=np.zeros(N, "f4"), worse=None)
row("all air, nothing known", scan=np.full(M, -1024, "f4"))
row("all water, nothing known", scan=np.zeros(M, "f4"))
row("metal, 30000 HU", truth=np.where(spot(N, 1) > 0, 30000, body(N)).astype("f4"))
row("metal block, 30000 HU", truth=np.where(body(N) > 2000, 30000, body(N)).astype("f4"))
row("metal block, nothing known", truth=np.where(body(N) > 2000, 30000, body(N)).astype("f4"), bare=True)
row("one bright voxel", truth=spot(N, 3000))
row("one bright voxel, nothing known", scan=spot(M, 3000))
OTHER = ["--units", "other"]  # no CT reaches so far
row("limits of int16, not as HU", truth=limits, status=3)
row("limits of int16", truth=limits, degrade=OTHER, args=OTHER)
row("limits of int16, as int16", scan=limits[::2, ::2, ::2].astype("i2"))
row("checkerboard of the scan", scan=checks(M))
row("checkerboard of the truth", truth=checks(N))
row("checkerboard of the truth, points", truth=checks(N), degrade=["--sigma", "0", "--decimate", "point"])
row("noise only", scan=noise(M))
row("noise only, a truth", truth=noise(N))
row("noise, said", truth=body(N), degrade=["--noise", "50"])
row("1x1x1", scan=np.full((1, 1, 1), 40, "f4"))
row("1x1x1, known", truth=noise((2, 2, 2)), worse=None)
row("2x2x2", scan=noise((2, 2, 2)))
row("7x513x31", scan=body((7, 513, 31)), args=["-Q", "draft"])
row("1x1x64", scan=body((3, 3, 64))[1:2, 1:2])
row("voxels of .05 mm", truth=body(N), affine=np.diag([0.05, 0.05, 0.05, 1]))
row("voxels of 50 mm", truth=body(N), affine=np.diag([50.0, 50, 50, 1]))
row("voxels of .3x.3x5 mm", truth=body(N), affine=np.diag([0.3, 0.3, 5, 1]))
row("slices 16 times as thick", worse=1.1, truth=body((24, 24, 64)), affine=np.diag([0.3, 0.3, 0.3, 1]), x="1,1,16",
    degrade=["--sigma", "0", "--decimate", "mean"])
row("oblique", truth=body(N), affine=oblique)
row("left-handed", truth=body(N), affine=np.diag([-2.0, 2, 2, 1]))
row("metres away", truth=body(N), affine=far)
row("no blur, sinc", truth=body(N), degrade=["--sigma", "0", "--decimate", "sinc"])
row("no blur, points", truth=body(N), degrade=["--sigma", "0", "--decimate", "point"])
row("blur of 10 voxels", differs=1e-4, truth=body(N), degrade=["--sigma", "10"])
# no scan that was blurred so has such edges: nothing fits, and it is said how little
row("blur of 10 voxels, given", scan=body(M), args=["--sigma", "10"], differs=1)
row("no blur, given", scan=body(M), args=["--sigma", "0", "--decimate", "point"])
row("1 time", scan=body(M), x="1", status=2)
row("1.5 times", truth=body((24, 24, 24)), x="1.5")
row("3 times", truth=body(N), x="3")
row("4 times", truth=body(N), x="4")
row("8 times", truth=body(N), x="8")
row("16 times", worse=1.001, truth=body((32, 32, 32)), x="16")
row("20 times", worse=1.001, truth=body((40, 40, 40)), x="20")
row("1025 times", scan=body(M), x="1025", status=2)
row("along one axis", truth=body(N), x="1,1,2")
row("values of 1e30, not as HU", scan=body(M) * np.float32(1e27), status=3)
row("values of 1e30", scan=body(M) * np.float32(1e27), args=OTHER)
row("values of 1e-30", scan=body(M) * np.float32(1e-33), status=3)
row("values of 1e30, known", truth=body(N) * np.float32(1e27), degrade=OTHER, args=OTHER)
row("values of 3e38", scan=body(M) * np.float32(1.1e35), args=OTHER, status=6)
row("values of 3e38, known", truth=body(N) * np.float32(1.1e35), degrade=OTHER, args=OTHER, status=6)
row("a voxel that is NaN", scan=spot(M, np.nan), status=6)
row("a voxel that is infinite", scan=spot(M, np.inf), status=6)

# a scan is written as a series of slices by ct-convert, which `dicom` then does something to
row("DICOM", truth=body((48, 48, 48)), dicom=as_is)
row("DICOM, oblique", scan=body(N), affine=oblique, args=["-Q", "draft"], dicom=as_is)
row("DICOM, left-handed", scan=body(N), affine=np.diag([-2.0, 2, 2, 1]), args=["-Q", "draft"], dicom=as_is)
row("DICOM, metres away", scan=body(N), affine=far, args=["-Q", "draft"], dicom=as_is)
row("DICOM, limits of int16", scan=limits.astype("i2"), args=["-Q", "draft"], dicom=as_is)
row("DICOM, 20 degrees tilted", scan=body(N), args=["-Q", "draft"], dicom=tilted(20))
row("DICOM, 40 degrees tilted", scan=body(N), args=["-Q", "draft"], dicom=tilted(40))
row("a sheared grid", scan=body(M), affine=sheared, status=5)
row("DICOM, a slice missing", scan=body(N), args=["-Q", "draft"], dicom=missing, status=5)
row("DICOM, one slice", scan=body((24, 24, 3))[:, :, 1:2], dicom=as_is, status=5)

# sizes that are cut
row("64x64x640 in slabs", truth=body((64, 64, 640)), x="1,1,4", degrade=["--sigma", "0", "--decimate", "mean"],
    args=["-Q", "draft", "--memory", "55M"], slabs=True)
row("64x64x640 in slabs, points", truth=body((64, 64, 640)), degrade=["--sigma", "0", "--decimate", "point"],
    args=["-Q", "draft", "--memory", "50M"], slabs=True)
row("96x96x96, which sinc does not cut", truth=body((96, 96, 96)), args=["-Q", "draft", "--memory", "70M"])


def run(*words):
    p = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=3600)  # a busy machine
    return p.returncode, p.stdout, p.stderr


def need(*words):
    status, out, err = run(*words)
    if status:
        raise SystemExit("%s: status %d: %s" % (" ".join(words), status, err))
    return out


def write(path, v, affine):
    nib.save(nib.Nifti1Image(v, affine), path)


def values(path):
    return nib.load(path).get_fdata(dtype="f8")


def make_scan(r):
    """lr.nii, and what ct-sr is to read: that, or a series, of which lr.nii is then what ct-convert reads."""
    make_volume(r)
    if "dicom" not in r:
        return "lr.nii"
    need("ct-convert", "-q", "lr.nii", "series/")
    r["dicom"]("series")
    if not r["status"]:
        need("ct-convert", "-q", "-f", "series", "lr.nii")
    return "series"


def make_volume(r):
    if "scan" in r:
        return write("lr.nii", r["scan"], r["affine"])
    write("hr.nii", r["truth"], r["affine"])
    need("ct-degrade", "-q", "-x", r["x"], *r["degrade"], "hr.nii", "lr.nii")
    if r.get("bare"):
        v = nib.load("lr.nii")
        write("lr.nii", np.array(v.dataobj), v.affine)


def grid_is_right():
    lo, hi = nib.load("lr.nii"), nib.load("a.nii")
    f = np.array(hi.shape) / np.array(lo.shape)
    want = lo.affine @ np.vstack([np.column_stack([np.diag(1 / f), (1 / f - 1) / 2]), [0, 0, 0, 1]])
    return np.allclose(hi.affine, want, rtol=1e-5, atol=1e-5 * abs(want).max())


def differs():
    """RMS of D x - y by what the header of the result says of D, or None if nobody knows D; the range of y; the
    noise that was assumed."""
    y = values("lr.nii")
    m = json.loads(need("ct-info", "--json", "a.nii"))["metadata"]
    span = max(float(abs(y).max()), 1e-30)
    if m["upsample"] == "bspline":  # edges tell nothing of D
        return None, span, 0
    if "sigma" in json.loads(need("ct-info", "--json", "lr.nii")).get("metadata", {}):
        c = json.loads(need("ct-metrics", "--json", "--consistency", "lr.nii", "a.nii"))
        c = c.get("consistency", c)
        return c["residual-rms-hu"], span, float(m.get("noise", 0))
    need("ct-degrade", "-q", "-f", "-x", m["factor"], "--sigma", m["sigma"], "--decimate", m["decimate"],
         "--units=other", "a.nii", "back.nii")
    return float(np.sqrt(((values("back.nii") - y) ** 2).mean())), span, float(m.get("noise", 0))


def error(path, truth):
    return float(np.sqrt(((values(path) - truth) ** 2).mean()))


def judge(r):
    """What is wrong, and cells of the table."""
    wrong = []
    scan = make_scan(r)
    status, out, err = run("ct-sr", "-t", "1", "-x", r["x"], *r["args"], scan, "a.nii")
    said = [s for s in err.splitlines() if not s.startswith("Try ") and ": warning: " not in s]
    if status or r["status"]:
        if status != r["status"] or os.path.exists("a.nii"):
            wrong.append("status %d" % status)
        return wrong, ["refused: %d" % status, "", "", said[0] if said else ""]
    os.mkdir("two")  # the name is in the history
    need("ct-sr", "-q", "-t", "2", "-x", r["x"], *r["args"], scan, "two/a.nii")
    if open("a.nii", "rb").read() != open("two/a.nii", "rb").read():
        wrong.append("other bytes with 2 threads")
    v = values("a.nii")
    if not np.isfinite(v).all():
        wrong.append("not finite")
    if not grid_is_right():
        wrong.append("grid")
    off, span, assumed = differs()
    bound = max(r["differs"] * span, 1.001 * assumed)
    if off is not None and not off <= bound:
        wrong.append("consistency")
    if r["slabs"] != bool(re.search(r", in \d+ slabs", err)):
        wrong.append("not in slabs" if r["slabs"] else "in slabs")
    cells = ["%dx%dx%d" % v.shape, "" if off is None else "%.2g (%.2g)" % (off, bound)]
    compared = ""
    if "truth" in r and r["worse"] is not None:
        need("ct-upsample", "-q", "-m", "cubic", "-x", r["x"], *(OTHER if r["args"] == OTHER else []), "lr.nii", "cubic.nii")
        truth = values("hr.nii")
        truth = truth[tuple(slice((m - k) // 2, (m - k) // 2 + k) for m, k in zip(truth.shape, v.shape))]
        mine, cubic = error("a.nii", truth), error("cubic.nii", truth)
        compared = "%.4g, cubic %.4g (%g)" % (mine, cubic, r["worse"])
        if not mine <= r["worse"] * cubic:
            wrong.append("%.3g times cubic" % (mine / cubic))
    line = said[-1].split(": ", 1)[1] if said else ""
    claim = re.search(r"data residual (\S+) HU", line)
    if (claim is None) != (off is None) or claim and abs(float(claim[1]) - off) > max(0.06 * off, r["differs"] * span):
        wrong.append("says " + line)
    return wrong, cells + [compared, ", ".join(p for p in line.split("; ") if re.search("iterations|bspline|linear|slabs", p))]


def main():
    names = sys.argv[1:]
    build = os.environ.get("builddir", "")
    if build and not os.path.exists(os.path.join(build, "ctsr-dicom.so")):  # configured without VTK
        ROWS[:] = [r for r in ROWS if "dicom" not in r]
    bad = 0
    print("| scan | out | D x - y, HU RMS (at most) | error, HU RMS, and of cubic (times) | how | |\n|---|---|---|---|---|---|", flush=True)
    for r in ROWS:
        if names and r["name"] not in names:
            continue
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            wrong, cells = judge(r)
            os.chdir("/")
        bad += bool(wrong)
        print("| %s | %s | %s |" % (r["name"], " | ".join(cells), "; ".join(wrong) or "ok"), flush=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print("\n%d rows, %d wrong, %.0f CPU seconds" % (len(names or ROWS), bad, used.ru_utime + used.ru_stime))
    sys.exit(bad > 0)


main()
