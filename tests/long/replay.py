#!/usr/bin/env python3
"""What examples/cluster/simulate.py makes of jobs, given the seconds that each took, against the clock.

    replay.py time LOG PLAN.json...     change the plans: each job leaves a line in LOG, of when it ran
    replay.py chain FOLDER              a plan of jobs that do nothing, one after the other
    replay.py late LOG                  prints the seconds from the end of one to the start of the next, their median
    replay.py against LOG PLAN.json... -- ARGS...   prints seconds by the clock, seconds by the simulator with ARGS,
                                        and seconds of the jobs together; ends well if they differ by less than 15 %

Both count from when the first job starts to work.
"""
import json
import os
import subprocess
import sys

JOBS = 7
SIMULATE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "cluster", "simulate.py")
TIMED = 'log=$1 name=$2; shift 2; begin=$(date +%s.%N); "$@" && echo "$name $begin $(date +%s.%N)" >>"$log"'


def change(log, plans):
    for path in plans:
        with open(path, encoding="utf-8") as f:
            plan = json.load(f)
        for j in plan["jobs"]:
            name = os.path.basename(os.path.dirname(os.path.abspath(path))) + "/" + j["name"]
            j["command"] = ["/bin/sh", "-c", TIMED, "timed", os.path.abspath(log), name, *j["command"]]
        with open(path, "w", encoding="utf-8") as f:
            json.dump(plan, f)


def chain(folder):
    def at(k):
        return os.path.abspath(f"{folder}/{k}")

    os.makedirs(folder)
    with open(at(0), "w", encoding="utf-8"):
        pass
    jobs = [{"name": f"none-{k}", "command": ["touch", at(k)], "inputs": [at(k - 1)], "outputs": [at(k)], "threads": 1,
             "seconds": 1, "memory-bytes": 1 << 20, "disk-bytes": 0} for k in range(1, JOBS + 1)]
    with open(at("plan.json"), "w", encoding="utf-8") as f:
        json.dump({"jobs": jobs}, f)


def times(log):
    with open(log, encoding="utf-8") as f:
        return sorted((float(a), float(b), name) for name, a, b in (line.split() for line in f))


def late(log):
    t = times(log)
    print("%.3f" % sorted(b[0] - a[1] for a, b in zip(t, t[1:]))[(len(t) - 1) // 2])


def against(log, plans, args):
    t = times(log)
    with open("took", "w", encoding="utf-8") as f:
        f.writelines(f"{name} {end - begin}\n" for begin, end, name in t)
    told = json.loads(subprocess.run([sys.executable, SIMULATE, "--json", "--took", "took", *args, *plans], check=True,
                                     stdout=subprocess.PIPE, text=True).stdout)[0]
    clock, late_s = max(b for _, b, _ in t) - t[0][0], float(args[args.index("--latency") + 1])
    expected = told["makespan-s"] - late_s
    print("%.2f s by the clock, %.2f s by the simulator (%+.1f %%), %d jobs of %.2f s together" %
          (clock, expected, 100 * (expected / clock - 1), len(t), told["core-seconds"]))
    assert len(t) == told["jobs"]
    sys.exit(abs(expected / clock - 1) >= .15)


what, log, *rest = sys.argv[1:]
if what == "time":
    change(log, rest)
elif what == "chain":
    chain(log)
elif what == "late":
    late(log)
else:
    against(log, rest[:rest.index("--")], rest[rest.index("--") + 1:])
