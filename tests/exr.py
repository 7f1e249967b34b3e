# SPDX-License-Identifier: Apache-2.0
"""exr.py: the pixels of a stack, read by a few lines that know OpenEXR and nothing of ours.

    python3 exr.py A B    are the stacks A and B the same to 1e-4 of A's largest value?
"""
import struct
import sys
import zlib


def header(b, at):
    """Attributes of one part, and where the next begins; None at the end of all."""
    found = {}
    while b[at]:
        end = b.index(b'\0', at)
        name, at = b[at:end].decode(), end + 1
        at = b.index(b'\0', at) + 1
        n = struct.unpack_from('<i', b, at)[0]
        found[name], at = b[at + 4:at + 4 + n], at + 4 + n
    return found, at + 1


def plain(data, n):
    """A chunk of n bytes: ZIP's differences and halves undone."""
    if len(data) == n:
        return data
    x = bytearray(zlib.decompress(data))
    for i in range(1, n):
        x[i] = (x[i - 1] + x[i] - 128) & 255
    out = bytearray(n)
    out[0::2], out[1::2] = x[:(n + 1) // 2], x[(n + 1) // 2:]
    return bytes(out)


def names(channels):
    """Of a list of channels, all FLOAT."""
    found, at = [], 0
    while channels[at]:
        end = channels.index(b'\0', at)
        found.append(channels[at:end].decode())
        at = end + 17
    return found


def read(name, channel='Y'):
    """Views in the order of the file, each a list of its floats row by row."""
    b = open(name, 'rb').read()
    magic, version = struct.unpack_from('<ii', b)
    many, parts, at = version & 0x1000, [], 8
    assert magic == 20000630
    while b[at]:
        found, at = header(b, at)
        x0, y0, x1, y1 = struct.unpack('<4i', found['dataWindow'])
        parts.append((x1 - x0 + 1, y1 - y0 + 1, 16 if found['compression'][0] == 3 else 1))
        has = names(found['channels'])
        if not many:
            break
    at += 1 if many else 0
    at += 8 * sum((h + lines - 1) // lines for _, h, lines in parts)
    views = [[0.0] * (w * h) for w, h, _ in parts]
    while at < len(b):
        k = struct.unpack_from('<i', b, at)[0] if many else 0
        at += 4 if many else 0
        y, n = struct.unpack_from('<ii', b, at)
        w, h, lines = parts[k]
        rows = min(lines, h - y)
        data = plain(b[at + 8:at + 8 + n], 4 * w * rows * len(has))
        for i in range(rows):
            row = 4 * w * (i * len(has) + has.index(channel))
            views[k][(y + i) * w:(y + i + 1) * w] = struct.unpack('<%df' % w, data[row:row + 4 * w])
        at += 8 + n
    return views


def size(name):
    """Columns and rows of the first view."""
    x0, y0, x1, y1 = struct.unpack('<4i', header(open(name, 'rb').read(), 8)[0]['dataWindow'])
    return x1 - x0 + 1, y1 - y0 + 1


if __name__ == '__main__':
    a, b = (sum(read(name), []) for name in sys.argv[1:3])
    most, worst = max(map(abs, a)), max(abs(x - y) for x, y in zip(a, b))
    print('# %g of %g' % (worst, most))
    sys.exit(not (len(a) == len(b) and most > 1 and worst < 1e-4 * most))
