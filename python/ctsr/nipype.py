# SPDX-License-Identifier: Apache-2.0
"""The commands as interfaces of nipype:

    from ctsr.nipype import interface
    CtSr = interface("ct-sr")
    thin = CtSr(IN="thick.nii.gz", OUT="thin.nii.gz", factor="1,1,5").run().outputs.OUT
"""
from __future__ import annotations

import functools
import os
import re
import shlex
from typing import Any, Dict, Type

from nipype.interfaces.base import CommandLine, CommandLineInputSpec, Directory, File, InputMultiPath, TraitedSpec, isdefined, traits

from .commands import described, identifier, parameters

_OWN = set(CommandLineInputSpec().trait_names())


def _name(p: Dict[str, Any]) -> str:
    name = identifier(p['name'])
    return name + '_' if name in _OWN else name


def _trait(p: Dict[str, Any], places: int) -> Any:
    meta: Dict[str, Any] = {'desc': p['help']}
    operand = 'place' in p
    if operand:
        meta.update(position=p['place'] - places, mandatory=not p['optional'], argstr='%s')
    else:
        value = {'flag': '', 'integer': '=%d', 'number': '=%.17g'}.get(p['type'], '=%s')
        meta['argstr'] = '--' + p['name'] + value
    kind = p['type']
    if kind == 'flag':
        return traits.Bool(**meta)
    if kind in ('integer', 'number'):
        of = int if kind == 'integer' else float
        if 'least' in p:
            return traits.Range(low=of(p['least']), high=of(p['most']), **meta)
        return (traits.Int if kind == 'integer' else traits.Float)(**meta)
    if kind == 'choice':
        return traits.Enum(*p['words'], **meta)
    if p.get('direction') != 'in':
        return traits.Str(**meta)
    if p.get('list'):
        return InputMultiPath(traits.Either(File(exists=True), Directory(exists=True)), **meta)
    return traits.Either(File(exists=True), Directory(exists=True), **meta)


def _word(form: str, text: str) -> str:
    """For the shell that reads the line: one word, and an argument that is no option."""
    return shlex.quote(form % ('./' + text if form == '%s' and text.startswith('-') and text != '-' else text))


@functools.lru_cache(maxsize=None)
def interface(command: str) -> Type[CommandLine]:
    """A class of nipype that runs a command: ct-sr is CtSr. Its inputs are arguments and options, a - of their names a _;
    its outputs are the files that it writes, by the same names. run() raises RuntimeError where the command fails."""
    all_ = parameters(described(command))
    places = sum('place' in p for p in all_)
    own = {_name(p) for p in all_}
    writes = [_name(p) for p in all_ if p.get('direction') == 'out']
    name = ''.join(w.capitalize() for w in command.split('-'))
    here = {'__module__': __name__}
    given = type(name + 'Input', (CommandLineInputSpec,), {**here, **{_name(p): _trait(p, places) for p in all_}})
    made = type(name + 'Output', (TraitedSpec,), {**here, **{w: traits.Str(desc='what was written') for w in writes}})

    def _format_arg(self, name, spec, value):
        if name not in own or not isinstance(value, (str, os.PathLike, list)):
            return CommandLine._format_arg(self, name, spec, value)
        return ' '.join(_word(spec.argstr, os.fspath(x)) for x in (value if isinstance(value, list) else [value]))

    def _list_outputs(self):
        out = self.output_spec().get()
        for w in writes:
            value = getattr(self.inputs, w)
            if isdefined(value):
                out[w] = os.path.abspath(value)
        return out

    def _run_interface(self, runtime, correct_return_codes=(0,)):
        runtime = CommandLine._run_interface(self, runtime, correct_return_codes)
        if runtime.returncode not in correct_return_codes:
            self.raise_exception(runtime)  # nipype only notes it, and the outputs would be those of another run
        return runtime

    runs = type(name, (CommandLine,), {
        **here, '_cmd': command, 'input_spec': given, 'output_spec': made, '_format_arg': _format_arg, '_list_outputs': _list_outputs,
        '_run_interface': _run_interface})
    globals().update({c.__name__: c for c in (given, made, runs)})
    return runs


def __getattr__(name: str) -> Any:
    """CtSr of ct-sr, CtSrInput and CtSrOutput: pickle, so a Node or Workflow of nipype, finds classes by name, in other processes too."""
    of = re.fullmatch('((?:[A-Z][a-z]+)+?)(Input|Output)?', name)
    if not of or not name.startswith('Ct'):
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    interface('-'.join(re.findall('[A-Z][a-z]+', of[1])).lower())
    return globals()[name]
