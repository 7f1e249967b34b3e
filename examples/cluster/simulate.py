#!/usr/bin/env python3
"""What jobs would take on a cluster, before there is one; Python's standard library alone.

    examples/cluster/simulate.py --nodes 10 --cores 16 --memory 64G --bandwidth 1e9 jobs/plan.json...
    examples/cluster/simulate.py --copies 1000 --nodes 1,10,100 --bandwidth 1e9,1e10 scan.csv

Jobs are those of plans of ct-sr, or of tables: lines of name, count, threads, seconds, memory, read, write, after,
in any order, as the first line names them; `after` names jobs of the same table, all of which it waits for.

The model: the queue is in order, and what fits runs on the first node that has the cores and the memory, past what
does not fit. A job holds both while it starts (--latency), reads, computes and writes. Transfers of one node share
its link alike, and nodes share the file system as they can use it (max-min fair). What a dead node ran is queued
again, from its beginning. Nothing is modelled of caches, of seconds that depend on neighbours, nor of priorities.
"""
import argparse
import csv
import heapq
import itertools
import json
import math
import os
import random
import sys

MEMORY = 4 << 30  # of a job of which nobody tells, as the Snakefile and slurm.py ask for
READ, COMPUTE, WRITE, END = range(1, 5)  # what a job does after it has started


class Job:
    def __init__(self, name, threads, seconds, memory, read, write, after):
        self.name, self.threads, self.seconds, self.memory = name, threads, seconds, memory
        self.bytes = {READ: read, WRITE: write}
        self.after = after  # numbers of jobs
        self.before = []    # jobs that wait for it
        self.node, self.phase, self.tries = None, 0, 0


class Node:
    def __init__(self, number, cores, memory):
        self.number, self.cores, self.memory, self.up = number, cores, memory, True
        self.jobs, self.used, self.peak = set(), 0, 0
        self.transfers, self.served, self.rate = [], 0.0, 0.0  # bytes that each transfer has had


def fail(text):
    sys.exit(f"simulate.py: {text}")


def number(text):
    """1e9, or 64G as ct-sr reads it."""
    unit = "KMGT".find(text[-1:].upper()) + 1
    value = float(text[:-1] if unit and text else text) * 1024 ** unit
    if not value >= 0:
        raise ValueError
    return value


def numbers(text):
    return [number(t) for t in text.split(",")]


def counts(text):
    values = [int(t) for t in text.split(",")]
    if min(values) < 1:
        raise ValueError
    return values


# Jobs: of plans, of tables.

def size_of(path):
    if os.path.isdir(path):
        return sum(e.stat().st_size for e in os.scandir(path) if e.is_file())
    return os.stat(path).st_size


def read_plan(path, first, rate):
    """A file that is not there yet is as large as its job says that it needs on disk."""
    with open(path, encoding="utf-8") as f:
        told = json.load(f)["jobs"]
    folder = os.path.basename(os.path.dirname(os.path.abspath(path)))
    maker = {o: n for n, j in enumerate(told) for o in j["outputs"]}

    def size(name):
        if name in maker:
            return told[maker[name]]["disk-bytes"] or 0
        return size_of(name) if os.path.exists(name) else 0

    def job(j):
        read, write, seconds = sum(map(size, j["inputs"])), sum(map(size, j["outputs"])), j["seconds"]
        if seconds is None and rate and os.path.basename(j["command"][0]) == "ct-merge":
            seconds = (read + write) / rate
        return Job(f"{folder}/{j['name']}", j["threads"], seconds, j["memory-bytes"], read, write,
                   [first + maker[i] for i in j["inputs"] if i in maker])

    return [job(j) for j in told]


def read_table(path, first, _):
    jobs, named = [], {}
    with open(path, encoding="utf-8", newline="") as f:
        lines = csv.DictReader(f)
        if "name" not in (lines.fieldnames or ()):
            raise ValueError("no column 'name'")
        for line in lines:
            def cell(key, kind, default):
                return kind(line[key]) if line.get(key) else default

            name, n = line["name"], cell("count", int, 1)
            try:
                after = [k for a in cell("after", str.split, []) for k in named[a]]
            except KeyError as e:
                fail(f"{path}: {name}: after {e}, which no line before names")
            named[name] = range(first + len(jobs), first + len(jobs) + n)
            jobs += [Job(f"{name}-{k + 1}" if n > 1 else name, cell("threads", int, 1), cell("seconds", float, None),
                         cell("memory", number, None), cell("read", number, 0), cell("write", number, 0), after)
                     for k in range(n)]
    return jobs


def read_jobs(a):
    jobs, took = [], {}
    if a.took:
        with open(a.took, encoding="utf-8") as f:
            took = {name: float(s) for name, s in (line.split() for line in f)}
    for _ in range(a.copies):
        for path in a.files:
            try:
                jobs += (read_plan if path.endswith(".json") else read_table)(path, len(jobs), a.rate)
            except (OSError, KeyError, TypeError, ValueError) as e:
                fail(f"{path}: is neither a plan nor a table of jobs: {e!r}")
    spread = random.Random(f"{a.seed} spread")
    for n, j in enumerate(jobs):
        j.number = n
        j.seconds = took.get(j.name, j.seconds)
        if j.seconds is None:
            if a.unknown is None:
                fail(f"{j.name}: nobody tells its seconds; --unknown, or --took, says so")
            j.seconds = a.unknown
        if a.spread:
            j.seconds *= spread.lognormvariate(-a.spread ** 2 / 2, a.spread)
        j.memory = MEMORY if j.memory is None else j.memory
        for k in j.after:
            jobs[k].before.append(j)
    return jobs


class Transfers:
    """Bytes between nodes and the file system that all share."""

    def __init__(self, nodes, link, shared):
        self.nodes, self.link, self.shared, self.order, self.moved = nodes, link, shared, itertools.count(), 0.0

    def begin(self, job, n):
        heapq.heappush(job.node.transfers, (job.node.served + n, next(self.order), job, n))
        self.share()

    def drop(self, node):
        self.moved += sum(n - (end - node.served) for end, _, _, n in node.transfers)
        node.transfers = []
        self.share()

    def share(self):
        busy = sorted((n for n in self.nodes if n.transfers), key=lambda n: -len(n.transfers))
        left, flows = self.shared, sum(len(n.transfers) for n in busy)
        for n in busy:  # those whose link gives each the least first
            n.rate = min(self.link / len(n.transfers), left / flows)
            left -= n.rate * len(n.transfers)
            flows -= len(n.transfers)

    def next(self):
        return min((max(n.transfers[0][0] - n.served, 0) / n.rate for n in self.nodes if n.transfers), default=math.inf)

    def go_on(self, seconds):
        """The jobs whose transfer is done after so many seconds, of which none is before."""
        done = []
        for n in self.nodes:
            if not n.transfers:
                continue
            n.served += n.rate * seconds
            while n.transfers and n.transfers[0][0] <= n.served * (1 + 1e-12) + 1e-3:
                _, _, job, size = heapq.heappop(n.transfers)
                self.moved += size
                done.append(job)
        if done:
            self.share()
        return done


class Cluster:
    def __init__(self, jobs, a, nodes, bandwidth):
        self.jobs, self.a, self.now, self.events, self.order = jobs, a, 0.0, [], itertools.count()
        self.nodes = [Node(n, a.cores, a.memory) for n in range(nodes)]
        self.bandwidth, self.files = bandwidth, Transfers(self.nodes, a.link, bandwidth)
        self.queue = {}  # of each demand, the numbers of jobs that could start
        self.left, self.looks, self.turn, self.changed = len(jobs), False, -1, True
        self.requeued, self.lost, self.held, self.trace = 0, 0.0, 0.0, []
        for j in jobs:
            j.waits, j.node, j.phase, j.tries = len(j.after), None, 0, 0
            if j.threads > a.cores or a.slack * j.memory > a.memory:
                fail(f"{j.name}: no node has {j.threads} cores and {a.slack * j.memory:.0f} bytes of memory")
            if not j.waits:
                self.enter(j)
        for at, n, back in a.kill:
            if n < nodes:
                self.at(at, self.down, self.nodes[n])
                self.at(back, self.rise, self.nodes[n])
        for n in self.nodes:
            self.doom(n, random.Random(f"{a.seed} node {n.number}"), 0)

    def at(self, time, what, *args):
        if time < math.inf:
            heapq.heappush(self.events, (time, next(self.order), what, args))

    def enter(self, job):
        heapq.heappush(self.queue.setdefault((job.threads, self.a.slack * job.memory), []), job.number)
        self.changed = True

    # Nodes die and come back.

    def doom(self, node, fate, after):
        if self.a.mtbf:
            self.at(self.now + after + fate.expovariate(1 / self.a.mtbf), self.die, node, fate)

    def die(self, node, fate):
        if node.up:
            self.down(node)
            self.at(self.now + self.a.repair, self.rise, node)
        self.doom(node, fate, self.a.repair)

    def down(self, node):
        node.up = False
        self.files.drop(node)
        for j in sorted(node.jobs, key=lambda j: j.number):
            self.requeued += 1
            self.lost += (self.now - j.start) * j.threads
            self.leave(j)
            j.tries += 1
            self.enter(j)

    def rise(self, node):
        node.up = self.changed = True

    # Jobs start, go on and leave.

    def look(self):
        """Start what fits, in order."""
        full, self.looks = set(), False
        starts = min(self.a.starts or math.inf, (self.a.most or math.inf) - sum(len(n.jobs) for n in self.nodes))
        while starts > 0:
            best = min(((q[0], d) for d, q in self.queue.items() if q and d not in full), default=None)
            if best is None:
                break
            threads, memory = demand = best[1]
            node = next((n for n in self.nodes if n.up and n.cores >= threads and n.memory >= memory), None)
            if node is None:
                full.add(demand)
                continue
            self.start(self.jobs[heapq.heappop(self.queue[demand])], node)
            starts -= 1
        self.changed = starts == 0 and bool(self.a.starts)

    def start(self, job, node):
        job.node, job.start, job.phase = node, self.now, 0
        node.cores -= job.threads
        node.memory -= self.a.slack * job.memory
        node.used += job.memory
        node.peak = max(node.peak, node.used)
        node.jobs.add(job)
        self.at(self.now + self.a.latency, self.step, job, job.tries)

    def step(self, job, tries):
        if tries != job.tries:
            return  # its node has died since
        job.phase += 1
        n = job.bytes.get(job.phase, 0)
        if job.phase == END:
            self.end(job)
        elif job.phase == COMPUTE:
            self.at(self.now + job.seconds, self.step, job, tries)
        elif n and min(self.a.link, self.bandwidth) < math.inf:
            self.files.begin(job, n)
        else:
            self.files.moved += n
            self.step(job, tries)

    def leave(self, job):
        node = job.node
        node.cores += job.threads
        node.memory += self.a.slack * job.memory
        node.used -= job.memory
        node.jobs.remove(job)
        self.held += (self.now - job.start) * job.threads
        self.changed = True

    def end(self, job):
        self.leave(job)
        self.trace.append((job.name, job.node.number, job.start, self.now))
        self.left -= 1
        for b in job.before:
            b.waits -= 1
            if not b.waits:
                self.enter(b)

    def run(self):
        while True:
            if self.changed and not self.a.interval:
                self.look()
            elif self.changed and not self.looks:
                self.looks = True
                self.turn = max(self.turn + 1, math.ceil(self.now / self.a.interval - 1e-9))
                self.at(max(self.turn * self.a.interval, self.now), self.look)
            if not self.left:
                return self
            to_file, to_event = self.files.next(), self.events[0][0] - self.now if self.events else math.inf
            if min(to_file, to_event) == math.inf:
                fail(f"{self.left} jobs are left, and no node")
            done = self.files.go_on(min(to_file, to_event))
            self.now += min(to_file, to_event)
            for j in done:
                self.step(j, j.tries)
            while self.events and self.events[0][0] <= self.now:
                _, _, what, args = heapq.heappop(self.events)
                what(*args)

    def told(self):
        cores, work = len(self.nodes) * self.a.cores, sum(j.threads * j.seconds for j in self.jobs)
        alone, size = min(self.a.link, self.bandwidth), sum(sum(j.bytes.values()) for j in self.jobs)
        longest = []
        for j in self.jobs:
            longest.append(self.a.latency + j.seconds + sum(j.bytes.values()) / alone +
                           max((longest[k] for k in j.after), default=0))
        span = self.now or math.inf
        return {
            "nodes": len(self.nodes),
            "bandwidth": self.bandwidth,
            "jobs": len(self.jobs),
            "makespan-s": self.now,
            "least-s-by-cores": work / cores,
            "least-s-by-bandwidth": size / self.bandwidth,
            "least-s-by-longest-chain": max(longest, default=0),
            "core-seconds": work,
            "cores-held": self.held / cores / span,
            "cores-computing": work / cores / span,
            "bytes": self.files.moved,
            "bandwidth-used": self.files.moved / self.bandwidth / span,
            "peak-memory-bytes": [n.peak for n in self.nodes],
            "requeued": self.requeued,
            "lost-core-seconds": self.lost,
        }


def kill(text):
    """NODE@SECONDS, or NODE@SECONDS:SECONDS at which it is back."""
    node, _, times = text.partition("@")
    at, _, back = times.partition(":")
    return float(at), int(node) - 1, float(back or math.inf)


def options():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = p.add_argument
    add("files", nargs="+", metavar="PLAN.json|TABLE.csv")
    add("--copies", type=int, default=1, metavar="N", help="all of it, so many times: as many scans")
    add("--nodes", type=counts, default=[1], metavar="N[,...]", help="1; of several, a table")
    add("--cores", type=int, default=16, metavar="N", help="of a node, 16")
    add("--memory", type=number, default=64 << 30, metavar="SIZE", help="of a node, 64G")
    add("--bandwidth", type=numbers, default=[math.inf], metavar="BYTES[,...]",
        help="a second, of the file system that all share; as many as wanted")
    add("--link", type=number, default=math.inf, metavar="BYTES", help="a second, of a node; as many as wanted")
    add("--latency", type=float, default=0, metavar="S", help="from when a job has its cores to when it reads, 0")
    add("--interval", type=float, default=0, metavar="S", help="between looks of the scheduler; 0: at once")
    add("--starts", type=int, default=0, metavar="N", help="the most that a look starts; 0: any number")
    add("--most", type=int, default=0, metavar="N", help="jobs at once, as make -jN or Snakemake's --jobs; 0: any number")
    add("--slack", type=float, default=1, metavar="X",
        help="times the memory that a job takes it asks for: 1; the Snakefile and slurm.py ask for 2")
    add("--unknown", type=float, metavar="S", help="seconds of jobs of which nobody tells")
    add("--rate", type=number, metavar="BYTES",
        help="a second, that ct-merge reads and writes, where the plan tells no seconds")
    add("--took", metavar="FILE", help="lines of the name of a job and the seconds that it took")
    add("--kill", type=kill, action="append", default=[], metavar="NODE@S[:S]",
        help="node NODE, from 1, dies at S, and is back at the other")
    add("--mtbf", type=float, default=0, metavar="S", help="a node dies after so long, in the mean; 0: never")
    add("--repair", type=float, default=600, metavar="S", help="and is back after so long, 600")
    add("--spread", type=float, default=0, metavar="X", help="seconds are log-normal about what is told, by this sigma")
    add("--seed", type=int, default=0, metavar="N")
    add("--json", action="store_true")
    add("--trace", metavar="FILE", help="CSV of job, node, start and end, of the last")
    a = p.parse_args()
    if a.starts and not a.interval:
        p.error("--starts is of a look: --interval")
    return a


def show(rows):
    if len(rows) == 1:
        for key, value in rows[0].items():
            if isinstance(value, list):
                value = max(value)
            print(f"{key:26}{value:.10g}")
        return
    print("| nodes | GB/s | makespan, s | cores computing | bandwidth used | least s: cores | bandwidth | chain |")
    print("|---:|---:|---:|---:|---:|---:|---:|---:|")
    for r in rows:
        print(f"| {r['nodes']} | {r['bandwidth'] / 1e9:g} | {r['makespan-s']:.0f} | "
              f"{100 * r['cores-computing']:.0f} % | {100 * r['bandwidth-used']:.0f} % | {r['least-s-by-cores']:.0f} | "
              f"{r['least-s-by-bandwidth']:.0f} | {r['least-s-by-longest-chain']:.0f} |")


def main():
    a = options()
    jobs, rows = read_jobs(a), []
    for bandwidth in a.bandwidth:
        for nodes in a.nodes:
            c = Cluster(jobs, a, nodes, bandwidth).run()
            rows.append(c.told())
    if a.trace:
        with open(a.trace, "w", encoding="utf-8", newline="") as f:
            csv.writer(f).writerows([("job", "node", "start", "end"), *((n, k + 1, s, t) for n, k, s, t in c.trace)])
    if a.json:
        json.dump([{k: None if v == math.inf else v for k, v in r.items()} for r in rows], sys.stdout, indent=1)
        print()
    else:
        show(rows)


if __name__ == "__main__":
    main()
