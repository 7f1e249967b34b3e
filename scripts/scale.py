#!/usr/bin/env python3
"""The tables and the plot of doc/scale.md, from what was measured of one scan.

    scripts/scale.py                    the tables
    scripts/scale.py jobs CASE SLABS    the jobs of one scan, for examples/cluster/simulate.py; CASE is cube or thick
    scripts/scale.py plot FILE.svg      needs matplotlib
"""
import csv
import json
import os
import subprocess
import sys
import tempfile

TOP = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
ABOUT = 32  # fine voxels about a slab: src/tools/lib/brick.c
SCANS, NODES, SLABS, BANDWIDTHS = 1000, (1, 10, 100), (1, 4, 16), (1e9, 10e9)
CLUSTER = "--cores 16 --memory 64G --slack 2 --latency 1"


# Measured, as doc/scale.md says: CPU seconds and bytes.
MERGE_S = 0.84 / 537e6  # a byte of the result
MERGE_MEMORY = 64 * 2 ** 20  # it goes through planes
PRIOR = 6.42e6


class Case:
    def __init__(self, fine, axis, unit, **measured):
        self.fine, self.axis, self.unit = fine, axis, unit  # fine voxels; cut along the axis, at whole units
        self.__dict__.update(measured)
        self.out = 4 * fine[0] * fine[1] * fine[2]

    def slabs(self, m):
        """What of the axis each of m slabs reads, of 1, and what it makes."""
        n = self.fine[self.axis]
        units = -(-n // self.unit)
        cut = [min(units * k // m * self.unit, n) for k in range(m + 1)]
        return [((min(b + ABOUT, n) - max(a - ABOUT, 0)) / n, (b - a) / n) for a, b in zip(cut, cut[1:])]

    def halo(self, m):
        return sum(reads for reads, _ in self.slabs(m))

    def jobs(self, m):
        yield "name,threads,seconds,memory,read,write,after"
        yield f"plan,1,{self.plan_s},{self.plan_memory},{self.scan},{self.scan},"
        for k, (reads, makes) in enumerate(self.slabs(m)):
            yield (f"slab{k + 1},1,{self.seconds * reads:.1f},{self.fixed + (self.need - self.fixed) * reads:.0f},"
                   f"{self.scan + PRIOR},{self.out * makes:.0f},plan")
        if m > 1:
            parts = " ".join(f"slab{k + 1}" for k in range(m))
            yield (f"merge,1,{MERGE_S * self.out:.1f},{MERGE_MEMORY:.0f},"
                   f"{self.out},{self.out},{parts}")


CASES = {
    "cube": Case((512, 512, 512), 2, 16, seconds=612, fixed=142.6e6, need=3.372e9, plan_s=6.9, plan_memory=262e6,
                 scan=4.195e6),
    "thick": Case((512, 512, 380), 1, 16, seconds=308, fixed=233.8e6, need=2.724e9, plan_s=5.9, plan_memory=410e6,
                  scan=49.81e6),
}


def simulate(case, m, *options):
    with tempfile.NamedTemporaryFile("w", suffix=".csv") as f:
        f.write("\n".join(CASES[case].jobs(m)) + "\n")
        f.flush()
        command = [sys.executable, f"{TOP}/examples/cluster/simulate.py", "--json", *CLUSTER.split(), *options, f.name]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


def joined(values):
    return ",".join(f"{v:g}" for v in values)


def one_scan():
    some = (1, 2, 4, 8, 16)
    print("\n| slabs | " + " | ".join(map(str, some)) + " |\n|---|" + "---:|" * len(some))
    for name, c in CASES.items():
        most = [max(r for r, _ in c.slabs(m)) for m in some]
        spans = [simulate(name, m, "--bandwidth", "1e9", "--link", "1e9")[0]["makespan-s"] for m in some]
        for what, values in (("work, of that of one", [f"{c.halo(m):.2f}" for m in some]),
                             ("longest slab, s", [f"{c.seconds * r:.0f}" for r in most]),
                             ("memory of it, GB", [f"{(c.fixed + (c.need - c.fixed) * r) / 1e9:.1f}" for r in most]),
                             ("until all is done, s", [f"{s:.0f}" for s in spans])):
            print(f"| {name}: {what} | " + " | ".join(values) + " |")


def all_scans():
    print("\n| scan | slabs | TB moved | GB/s | " + " | ".join(f"{n} node{'s'[:n > 1]}" for n in NODES) + " |")
    print("|---|---:|---:|---:|" + "---:|" * len(NODES))
    for name in CASES:
        for m in SLABS:
            told = simulate(name, m, "--copies", str(SCANS), "--nodes", joined(NODES), "--bandwidth",
                            joined(BANDWIDTHS), "--link", "1e9")
            for k, b in enumerate(BANDWIDTHS):
                rows = told[k * len(NODES):(k + 1) * len(NODES)]
                print(f"| {name} | {m} | {rows[0]['bytes'] / 1e12:.2f} | {b / 1e9:g} | " +
                      " | ".join(f"{r['makespan-s']:.0f} ({100 * r['cores-computing']:.0f})" for r in rows) + " |")


def what_if():
    print("\n| 100 nodes, 10 GB/s | cube, s | thick, s |\n|---|---:|---:|")
    for what, m, options in (
            ("4 slabs, as above", 4, ""),
            ("a job starts 10 s late, not 1", 4, "--latency 10"),
            ("60 s", 4, "--latency 60"),
            ("the scheduler looks every 30 s", 4, "--interval 30"),
            ("and starts 100 jobs a look", 4, "--interval 30 --starts 100"),
            ("no more than 100 jobs at once", 4, "--most 100"),
            ("seconds log-normal, sigma .3", 4, "--spread .3"),
            ("each node dies every 6 hours, and is back in 10 minutes", 4, "--mtbf 21600 --repair 600"),
            ("not divided", 1, ""),
            ("not divided, and asks for a quarter more memory than is expected", 1, "--slack 1.25")):
        told = [simulate(name, m, "--copies", str(SCANS), "--nodes", "100", "--bandwidth", "10e9", "--link", "1e9",
                         *options.split())[0] for name in CASES]
        again = f": {told[0]['requeued']} and {told[1]['requeued']} jobs again" if "mtbf" in options else ""
        print(f"| {what}{again} | " + " | ".join(f"{r['makespan-s']:.0f}" for r in told) + " |")


def measured_sizes():
    """Of a command and an edge: seconds, voxels that were made, those about slabs too, and of them not flat; bytes."""
    sizes = {}
    with open(f"{TOP}/doc/scale-sizes.csv", encoding="utf-8") as f:
        for r in csv.DictReader(f):
            edge, slab, of = int(r["edge"]), int(r["slab"]), int(r["of"])
            made = edge ** 2 * (edge // of + ABOUT * (slab > 1) + ABOUT * (slab < of))
            s = sizes.setdefault((r["command"], edge), {"cpu": 0, "made": 0, "uneven": 0, "peak": 0})
            s["cpu"] += float(r["cpu-s"])
            s["made"] += made
            s["uneven"] += float(r["not-flat"] or 0) * made
            s["peak"] = max(s["peak"], 1024 * int(r["peak-kib"]))
    return sizes


def plot(path):
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "ctsr", "svg.fonttype": "none", "font.size": 8})
    from matplotlib import pyplot
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(8, 3.2))
    nodes = (1, 3, 10, 30, 100, 200)
    for case, colour in zip(CASES, ("tab:blue", "tab:orange")):
        for b, style in zip(BANDWIDTHS, ("--", "-")):
            told = simulate(case, 4, "--copies", str(SCANS), "--nodes", joined(nodes), "--bandwidth", f"{b:g}",
                            "--link", "1e9")
            left.loglog(nodes, [r["makespan-s"] / 3600 for r in told], style, color=colour, marker=".",
                        label=f"{case}, {b / 1e9:g} GB/s")
        left.loglog(nodes, [r["least-s-by-cores"] / 3600 for r in told], ":", color=colour,
                    label=f"{case}, cores alone")
    left.set(xlabel="nodes of 16 cores", ylabel=f"hours, {SCANS} scans of 4 slabs (simulated)")
    left.legend()
    sizes = measured_sizes()
    for command, colour in (("upsample", "tab:green"), ("restore", "tab:red")):
        edges = sorted(n for c, n in sizes if c == command)
        rows = [sizes[command, n] for n in edges]
        right.loglog(edges, [1e6 * r["cpu"] / r["made"] for r in rows], "-", color=colour, marker=".",
                     label=f"ct-{command}: CPU us a voxel")
        if all(r["uneven"] for r in rows):
            right.loglog(edges, [1e6 * r["cpu"] / r["uneven"] for r in rows], ":", color=colour, marker=".",
                         label=f"ct-{command}: CPU us a voxel that is not flat")
        right.loglog(edges, [r["peak"] / n ** 3 for n, r in zip(edges, rows)], "--", color=colour, marker=".",
                     label=f"ct-{command}: peak bytes a voxel of the result")
    edges = sorted({n for _, n in sizes})
    right.set(xlabel="edge of the result, voxels (measured)", xticks=edges, xticklabels=edges, ylim=(.02, 5000))
    right.minorticks_off()
    right.legend(loc="upper right")
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def main():
    what = sys.argv[1:2]
    if what == ["jobs"]:
        print("\n".join(CASES[sys.argv[2]].jobs(int(sys.argv[3]))))
    elif what == ["plot"]:
        plot(sys.argv[2])
    else:
        one_scan()
        all_scans()
        what_if()


main()
