# SPDX-License-Identifier: Apache-2.0
"""Descriptors of Boutiques (schema 0.5) of the commands: python3 -m ctsr.boutiques ct-sr >ct-sr.json"""
from __future__ import annotations

import json
import sys
from typing import Any, Dict

from .commands import described, identifier, parameters


def _key(p: Dict[str, Any]) -> str:
    return '[%s]' % identifier(p['name']).upper()


def _input(p: Dict[str, Any]) -> Dict[str, Any]:
    reads = p.get('direction') == 'in'
    kinds = {'flag': 'Flag', 'integer': 'Number', 'number': 'Number', 'file': 'File' if reads else 'String'}
    x: Dict[str, Any] = {'id': identifier(p['name']), 'name': p['name'], 'type': kinds.get(p['type'], 'String'),
                         'description': p['help'], 'value-key': _key(p), 'optional': p.get('optional', 'place' not in p)}
    if 'place' not in p:
        x['command-line-flag'] = '--' + p['name']
        if x['type'] != 'Flag':
            x['command-line-flag-separator'] = '='
    if p.get('list'):
        x['list'] = True
    if p['type'] == 'choice':
        x['value-choices'] = p['words']
    if p['type'] == 'integer':
        x['integer'] = True
    for ours, theirs in ('least', 'minimum'), ('most', 'maximum'):
        if ours in p and x['type'] == 'Number':
            x[theirs] = p[ours]
    return x


def descriptor(command: str) -> Dict[str, Any]:
    """The descriptor of a command. An output is a String that names it, and an output file."""
    d = described(command)
    all_ = parameters(d)
    inputs = [_input(p) for p in all_]
    ids = {x['id'] for x in inputs}
    for p, x in zip(all_, inputs):
        # of what is not wanted beside it, options that are given; not single words of a choice
        apart = [identifier(c['name']) for c in p.get('not_with', []) if 'words' not in c]
        if ids.intersection(apart):
            x['disables-inputs'] = [a for a in apart if a in ids]
    line = [command] + [_key(p) for p in all_ if 'place' not in p] + [_key(p) for p in all_ if 'place' in p]
    outputs = [{'id': identifier(p['name']) + '_file', 'name': p['name'], 'description': p['help'],
                'path-template': _key(p), 'optional': 'place' not in p or bool(p.get('optional'))}
               for p in all_ if p.get('direction') == 'out']
    whole = {'name': d['name'], 'description': d['brief'], 'tool-version': d['version'], 'schema-version': '0.5',
             'command-line': ' '.join(line), 'inputs': inputs,
             'error-codes': [{'code': int(k), 'description': v} for k, v in d['exit'].items() if k != '0']}
    return {**whole, 'output-files': outputs} if outputs else whole


if __name__ == '__main__':
    if len(sys.argv) != 2:
        sys.exit('usage: python3 -m ctsr.boutiques COMMAND')
    json.dump(descriptor(sys.argv[1]), sys.stdout, indent=2)
    print()
