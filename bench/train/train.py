# SPDX-License-Identifier: Apache-2.0
"""train.py volume|projections --data PACK --out OUT --minutes M [--scans 4|thick-4|2] [--start STATE] [--tiny]

Trains one network until M minutes after the start, validates each minute on patients held out, and leaves in OUT:

  NETWORK.safetensors       the best average so far, F16
  NETWORK-weights.pt        the state to go on from: weights and their average,
  NETWORK-moments.pt          and AdamW's moments (--start OUT)
  NETWORK.log               a line each minute: seconds, steps, rate, losses

PACK is what pack.py made. On a GPU M is at most MOST. Ctrl-C or SIGTERM: the state is written, status 75."""
import argparse
import glob
import math
import os
import queue
import signal
import sys
import threading
import time

BEGIN = time.time()
os.environ.setdefault('PYTHONUNBUFFERED', '1')

import numpy as np  # noqa: E402
import torch  # noqa: E402
from torch import nn  # noqa: E402

import pack  # noqa: E402

MOST = 9.  # minutes on a GPU
CLOSE = 12.  # seconds for the last validation and for writing
AHEAD = 6  # batches that wait


def has_bfloat16():
    """Does this processor multiply bfloat16 in hardware?"""
    try:
        flags = open('/proc/cpuinfo').read()
    except OSError:
        return False
    return 'avx512_bf16' in flags or 'amx_bf16' in flags


def subject(name):
    if name == 'volume':
        import volume
        return volume.Volume
    import projections
    return projections.Projections


def close(task):
    getattr(task, 'close', lambda: None)()
    task.left = True


class Log:
    def __init__(self, path):
        self.file = open(path, 'a')

    def __call__(self, text):
        print(text, flush=True)
        self.file.write(text + '\n')
        self.file.flush()


class Loop:
    def __init__(self, task, device, minutes, out, start, log):
        self.task, self.device, self.out, self.log = task, device, out, log
        self.end = BEGIN + 60 * minutes - (CLOSE if device == 'cuda' else min(CLOSE, 6 * minutes))
        self.net = task.network()
        self.rate, self.steps, self.best, self.stop = task.rate, 0, math.inf, False
        self.adam = torch.optim.AdamW(self.net.parameters(), lr=self.rate, betas=(.9, .99), weight_decay=task.decay,
                                      **({'fused': True} if device == 'cuda' else {}))
        if start:
            self.restore(start)
        self.average = {k: v.detach().clone() for k, v in self.net.state_dict().items()}
        self.good = {k: v.clone() for k, v in self.average.items()}
        self.sums, self.bad = [], torch.zeros((), device=device)
        self.begun = time.time()

    def feed(self, seed):
        rng = np.random.default_rng(seed)
        side = torch.cuda.Stream() if self.device == 'cuda' else None
        while not self.stop:
            try:
                if side:
                    with torch.cuda.stream(side):
                        batch, made = self.task.batch(rng), torch.cuda.Event()
                        made.record(side)
                else:
                    batch, made = self.task.batch(rng), None
            except Exception as e:
                self.log(f'batch: {e!r}')
                time.sleep(1)
                continue
            while not self.stop:
                try:
                    self.queue.put((batch, made), timeout=.5)
                    break
                except queue.Full:
                    pass

    def take(self):
        batch, made = self.queue.get()
        if made:
            torch.cuda.current_stream().wait_event(made)
            for t in batch:
                t.record_stream(torch.cuda.current_stream())
        return batch

    def part(self):
        return min(1., (time.time() - self.begun) / max(self.end - self.begun, 1e-9))

    def step(self):
        warm = min(1., (self.steps + 1) / getattr(self.task, 'warm', 300))
        for g in self.adam.param_groups:
            g['lr'] = self.rate * warm * .5 * (1 + math.cos(math.pi * self.part()))
        batch = self.take()
        with torch.autocast(self.device, torch.bfloat16, enabled=self.task.half):
            loss, base, *rest = self.task.loss(self.net, batch)
        self.adam.zero_grad(set_to_none=True)
        loss.backward()
        norm = nn.utils.clip_grad_norm_(self.net.parameters(), getattr(self.task, 'clip', 1.))
        self.bad += (~torch.isfinite(norm)).float()
        for p in self.net.parameters():
            if p.grad is not None:
                torch.nan_to_num_(p.grad, 0, 0, 0)
        self.adam.step()
        self.steps += 1
        self.follow()
        if self.steps % 10 == 0:
            self.sums.append(((rest[0] if rest else loss).detach(), base.detach()))
        if self.steps % 100 == 0:
            self.check(loss.detach())

    def follow(self):
        """The average of the weights."""
        a = min(self.task.average, (1 + self.steps) / (10 + self.steps))
        state = self.net.state_dict()
        keys = [k for k, v in state.items() if v.dtype.is_floating_point]
        with torch.no_grad():
            to = [self.average[k] for k in keys]
            torch._foreach_mul_(to, a)
            torch._foreach_add_(to, [state[k] for k in keys], alpha=1 - a)

    def check(self, loss):
        """Back to the last good average, at a lower rate, after steps that were not finite."""
        if float(self.bad) == 0 and math.isfinite(float(loss)):
            self.good = {k: v.clone() for k, v in self.average.items()}
            return
        self.rate *= .6
        self.log(f'step {self.steps}: not finite; rate {self.rate:.2g}')
        self.net.load_state_dict(self.good)
        self.adam.state.clear()
        self.average = {k: v.clone() for k, v in self.good.items()}
        self.bad.zero_()

    def validate(self):
        keep = {k: v.clone() for k, v in self.net.state_dict().items()}
        self.net.load_state_dict(self.average)
        with torch.no_grad(), torch.autocast(self.device, torch.bfloat16, enabled=self.task.half):
            held, each = self.task.validate(self.net)
        self.net.load_state_dict(keep)
        loss, base = (sum(float(v[i]) for v in self.sums) for i in (0, 1)) if self.sums else (0., 1.)
        self.sums = []
        words = ' '.join(f'{k} {v:.4f}' for k, v in each.items())
        self.log(f'{time.time() - BEGIN:.0f} s, step {self.steps}, rate {self.adam.param_groups[0]["lr"]:.2e}, '
                 f'trained {loss / max(base, 1e-12):.4f}, held out {held:.4f} ({words})')
        if held < self.best:
            self.best = held
            self.task.export(self.average, f'{self.out}/{self.task.name}.safetensors')
        return held

    def run(self):
        self.queue = queue.Queue(AHEAD)
        for i in range(2):
            threading.Thread(target=self.feed, args=(100 + i + self.steps,), daemon=True).start()
        due = time.time() + 15
        while not self.stop and time.time() < self.end:
            self.step()
            if time.time() >= due:
                self.validate()
                due = time.time() + 60
        stopped, self.stop = self.stop, True
        self.validate()
        self.save()
        return stopped

    def save(self):
        name = f'{self.out}/{self.task.name}'
        cpu = lambda t, kind: t.detach().to('cpu', kind) if t.dtype.is_floating_point else t.cpu()
        half = torch.bfloat16
        moments = {k: {n: cpu(t, half) if torch.is_tensor(t) and t.dim() else t for n, t in v.items()}
                   for k, v in self.adam.state_dict()['state'].items()}
        for path, what in ((name + '-weights.pt', {'steps': self.steps, 'average': {k: cpu(v, torch.float32) for k, v
                                                                                   in self.average.items()}}),
                           (name + '-moments.pt', moments)):
            torch.save(what, path + '.part')
            os.replace(path + '.part', path)

    def restore(self, folder):
        name = f'{folder}/{self.task.name}'
        state = torch.load(name + '-weights.pt', map_location=self.device)
        self.net.load_state_dict(state['average'])
        self.steps = state['steps']
        if os.path.exists(name + '-moments.pt'):
            moments = torch.load(name + '-moments.pt', map_location=self.device)
            whole = self.adam.state_dict()
            whole['state'] = {k: {n: t.float() if torch.is_tensor(t) else t for n, t in v.items()}
                              for k, v in moments.items()}
            self.adam.load_state_dict(whole)
        self.log(f'goes on from {folder}, step {self.steps}')


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('network', choices=['volume', 'projections'])
    p.add_argument('--data', required=True)
    p.add_argument('--out', required=True)
    p.add_argument('--minutes', type=float, required=True)
    p.add_argument('--start', help='folder of an earlier state')
    p.add_argument('--scans', default='4', choices=list(pack.SCANS),
                   help='volume: those refined 4x, thick slices refined 4x, or 2x')
    p.add_argument('--tiny', action='store_true', help='a toy network, for a test')
    a = p.parse_args()
    device = 'cuda' if torch.cuda.is_available() else 'cpu'
    if not 0 < a.minutes <= (MOST if device == 'cuda' else 1e6):
        p.error(f'--minutes: above 0, and at most {MOST:g} on a GPU')
    os.makedirs(a.out, exist_ok=True)
    kind = {'scans': a.scans} if a.network == 'volume' else {}
    log = Log(f'{a.out}/{"-".join([a.network, *kind.values()])}.log')
    if device == 'cpu' and not a.tiny:
        os.nice(19 - os.nice(0))
    torch.backends.cudnn.benchmark = True
    torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = True
    unpacking = threading.Thread(target=pack.unpack_all, args=(a.data, a.data + '/ct', max(1, (os.cpu_count() or 2) - 1)))
    unpacking.start()
    unpacking.join()
    log(f'{time.time() - BEGIN:.0f} s: {len(glob.glob(a.data + "/ct/*.nii"))} CTs; {torch.__version__}, '
        f'{torch.cuda.get_device_name() if device == "cuda" else "CPU"}')
    task = subject(a.network)(a.data, device, a.tiny, **kind)
    task.half = device == 'cuda' or has_bfloat16()
    while not task.ready():
        time.sleep(.3)
        if time.time() - BEGIN > 60 * a.minutes:
            log('no data in time')
            close(task)
            os._exit(1)
    loop = Loop(task, device, a.minutes, a.out, a.start, log)
    log(f'{time.time() - BEGIN:.0f} s: begins; {sum(q.numel() for q in loop.net.parameters())} weights')
    for s in (signal.SIGINT, signal.SIGTERM):
        signal.signal(s, lambda *_: setattr(loop, 'stop', True))
    stopped = loop.run()
    close(task)
    log(f'{time.time() - BEGIN:.0f} s: ends; best {loop.best:.4f}')
    sys.stdout.flush()
    os._exit(75 if stopped else 0)


if __name__ == '__main__':
    main()
