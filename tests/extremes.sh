#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# extremes.sh [ROW...]: what ct-sr makes of scans that no hospital makes; see extremes.py.
for py in python3 /usr/bin/python3; do
	"$py" -c 'import nibabel, pydicom' 2>/dev/null && exec "$py" "$(cd "$(dirname "$0")" && pwd)/extremes.py" "$@"
done
echo "$0: needs a Python with nibabel and pydicom" >&2
exit 77
