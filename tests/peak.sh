# SPDX-License-Identifier: Apache-2.0
# peak.sh: how much memory a command took; source it behind tap.sh.
# shellcheck shell=sh
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
cat >look.py <<'END'
"""peak COMMAND...: runs it, KiB to the file used. same A B [MOST]: are the voxels the same?"""
import resource, struct, subprocess, sys
def voxels(name):
    b = open(name, 'rb').read()
    return b[int(struct.unpack('<f', b[108:112])[0]):]
if sys.argv[1] == 'peak':
    rc = subprocess.call(sys.argv[2:])
    open('used', 'w').write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
    sys.exit(rc)
a, b = (voxels(n) for n in sys.argv[2:4])
if len(sys.argv) == 4:
    sys.exit(a != b)
a, b = (struct.unpack('<%df' % (len(v) // 4), v) for v in (a, b))
most = max(abs(x - y) for x, y in zip(a, b))
print('# %.2g apart' % most)
sys.exit(len(a) != len(b) or not most < float(sys.argv[4]))
END
look() { python3 look.py "$@"; }
within() { [ "$(cat used)" -lt $(($1 * 1024)) ]; ok $? "$2 within $1 MiB ($(($(cat used) / 1024)))"; } # within MIB NAME
beyond() { [ "$(cat used)" -gt $(($1 * 1024)) ]; ok $? "$2 beyond $1 MiB ($(($(cat used) / 1024)))"; }
mkdir made
alone() { [ "$(ls -A made)" = "$1" ]; ok $? "${2:-and leaves nothing else}"; } # alone FILES
