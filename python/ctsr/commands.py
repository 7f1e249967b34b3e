# SPDX-License-Identifier: Apache-2.0
"""What the commands say of themselves (ct-sr --describe), for those who generate from it."""
from __future__ import annotations

import json
import subprocess
from typing import Any, Dict, List

PRINTS = ('help', 'version', 'json', 'dry-run')  # instead of a result, or for people


def described(command: str) -> Dict[str, Any]:
    """All that --describe says. OSError: there is no such command."""
    return json.loads(subprocess.run([command, '--describe'], check=True, capture_output=True, text=True).stdout)


def parameters(d: Dict[str, Any]) -> List[Dict[str, Any]]:
    """Arguments in their order, then options that compute. A list of files whose last is written is IN and OUT."""
    all_: List[Dict[str, Any]] = []
    for a in d['arguments']:
        if a.get('direction') == 'both':
            all_ += [{**a, 'name': 'IN', 'direction': 'in'}, {**a, 'name': 'OUT', 'direction': 'out', 'list': False}]
        else:
            all_.append(a)
    all_ = [dict(a, place=k) for k, a in enumerate(all_)]
    return all_ + [o for o in d['options'] if o['name'] not in PRINTS]


def identifier(name: str) -> str:
    """slice-thickness as a name of Python."""
    return name.replace('-', '_')
