#!/usr/bin/env python3
"""The jobs of one plan of ct-sr on Slurm, without another program.

    ct-sr --plan DIR ... && examples/cluster/slurm.py DIR/plan.json [option of sbatch...]

Jobs that do not wait for each other are one job array, and each array waits for those before. Called again, with
the same plan, it does what is not done.
"""
import json
import math
import os
import subprocess
import sys

MEMORY, MINUTES, SLACK = 4096, 240, 2  # MiB and minutes of a job of which the plan says nothing; times the rest


def levels(jobs):
    """Lists of jobs: each waits for those before alone."""
    level = {}
    for j in jobs:
        n = 1 + max((level.get(i, 0) for i in j["inputs"]), default=0)
        level.update((o, n) for o in j["outputs"])
    return [[j for j in jobs if level[j["outputs"][0]] == n] for n in range(1, max(level.values()) + 1)]


def done(job):
    outputs = job["outputs"]
    return all(map(os.path.exists, outputs)) and min(map(os.path.getmtime, outputs)) >= max(
        os.path.getmtime(i) for i in job["inputs"])


def most(jobs, key, unit, default):
    return max(default if j[key] is None else max(1, math.ceil(SLACK * j[key] / unit)) for j in jobs)


def submit(plan, jobs, options):
    after = []
    for n, level in enumerate(levels(jobs)):
        command = ["sbatch", "--parsable", f"--array=0-{len(level) - 1}", f"--job-name=ct-sr-{n + 1}",
                   f"--cpus-per-task={max(j['threads'] for j in level)}",
                   f"--mem={most(level, 'memory-bytes', 2**20, MEMORY)}M",
                   f"--time={most(level, 'seconds', 60, MINUTES)}", "--kill-on-invalid-dep=yes", *after, *options,
                   os.path.abspath(__file__), "--run", plan, str(n)]
        job = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.strip().split(";")[0]
        after = [f"--dependency=afterok:{job}"]
        print(job)


def run(jobs, n):
    job = levels(jobs)[n][int(os.environ["SLURM_ARRAY_TASK_ID"])]
    if not done(job):
        os.execvp(job["command"][0], job["command"])


def main():
    again = sys.argv[1:2] == ["--run"]
    plan = os.path.abspath(sys.argv[1 + again])
    with open(plan, encoding="utf-8") as f:
        jobs = json.load(f)["jobs"]
    if again:
        run(jobs, int(sys.argv[3]))
    else:
        submit(plan, jobs, sys.argv[2:])


main()
