# SPDX-License-Identifier: Apache-2.0
"""import.py OUT BUILD DEV WORK: are the networks that train.py left in OUT better than those that are shipped?

BUILD is a build of ctsr, DEV a folder of CTs that nobody trained on, WORK keeps what is measured. Prints a table and
"better" or "not" for each network; the status is 0 if one is better, 1 if none is."""
import glob
import os
import sys


def main():
    if len(sys.argv) != 5:
        raise SystemExit(__doc__)
    out, build, dev, work = sys.argv[1:]
    files = sorted(f for name in ('projections', 'volume-*') for f in glob.glob(f'{out}/{name}.safetensors'))
    if not files:
        raise SystemExit(f'{out}: no projections.safetensors and no volume-*.safetensors')
    better = 0
    for f in files:
        print(f)
        if os.path.basename(f).startswith('projections'):
            import measure_projections as how
        else:
            import measure_volume as how
        better += bool(how.measure(f, work, build, dev))
    return not better


if __name__ == '__main__':
    sys.exit(main())
