# SPDX-License-Identifier: Apache-2.0
"""unet-torch.py NET forward|step PRIOR SIZE BATCH: what unet-calls does, by PyTorch; NET is the file of
the network in its words (tests/t-pt.py)."""
import importlib.util
import json
import resource
import struct
import sys
import time

import torch

net_file, kind, prior, size, batch = sys.argv[1:4] + [int(s) for s in sys.argv[4:]]
torch.set_num_threads(1)
spec = importlib.util.spec_from_file_location('net', net_file)
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)


def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def weights(path):
    b = open(path, 'rb').read()
    n = 8 + struct.unpack('<Q', b[:8])[0]
    head = json.loads(b[8:n])
    meta = head.pop('__metadata__')
    kinds = {'F32': torch.float32, 'F16': torch.float16}
    return meta, {k: torch.frombuffer(bytearray(b[n + v['data_offsets'][0]:n + v['data_offsets'][1]]),
                                      dtype=kinds[v['dtype']]).reshape(v['shape']).float() for k, v in head.items()}


def forward(net, blocks):
    x = torch.sin(0.37 * torch.arange(size * size, dtype=torch.float64)).float()
    x = x.reshape(1, 1, size, size).expand(batch, -1, -1, -1).contiguous()

    def call():
        with torch.inference_mode():
            return float((net(x, 300., 0, blocks).double() ** 2).sum())
    return call


def step(net, blocks):
    picture = torch.sin(0.37 * torch.arange(4 * size * size, dtype=torch.float32)).reshape(2 * size, 2 * size)
    left = torch.cumprod(1 - torch.linspace(1e-4, 0.02, 1000), 0)
    parameters = list(net.sd.values())
    for p in parameters:
        p.requires_grad_()
    average = [p.detach().clone() for p in parameters]
    adam = torch.optim.AdamW(parameters, lr=1e-4, weight_decay=0)

    def call():
        at = torch.randint(0, size + 1, (batch, 2)).tolist()
        x = torch.stack([picture[i:i + size, j:j + size] for i, j in at])[:, None]
        t = torch.randint(0, 1000, (batch,))
        z = torch.randn_like(x)
        a = left[t][:, None, None, None]
        loss = ((net(a.sqrt() * x + (1 - a).sqrt() * z, t, 0, blocks) - z) ** 2).mean()
        adam.zero_grad(set_to_none=True)
        loss.backward()
        adam.step()
        with torch.no_grad():
            for m, p in zip(average, parameters):
                m.lerp_(p, 1e-4)
        return float(loss)
    return call


print(peak(), flush=True)
meta, sd = weights(prior)
width = int(meta['num_head_channels'])
yes = {k: meta[k] == 'True' for k in ('use_new_attention_order', 'use_scale_shift_norm', 'resblock_updown')}
net = module.Net(sd, width, not yes['use_new_attention_order'], yes['use_scale_shift_norm'], yes['resblock_updown'])
call = {'forward': forward, 'step': step}[kind](net, int(meta['num_res_blocks']))
for _ in sys.stdin:
    start = time.process_time()
    value = call()
    print('%.9g %d %.9g' % (time.process_time() - start, peak(), value), flush=True)
