# SPDX-License-Identifier: Apache-2.0
"""What commands say of themselves to programs: describe.py WHAT TOOL..."""
import json, os, pickle, re, shutil, subprocess, sys
import xml.etree.ElementTree as ET

TYPES = {'flag', 'integer', 'number', 'text', 'choice', 'file'}


def says(tool, how):
    return subprocess.run([tool, how], check=True, capture_output=True, text=True).stdout


def condition(c, d):
    """In the words of the help: --method=tv|htv, or OUT to be a file."""
    option, key = ([o['name'] for o in d[k]] for k in ('options', 'expert'))
    return ('--expert ' if c['name'] in key else '--' if c['name'] in option else '') + c['name'] + ('=' + '|'.join(c['words']) if 'words' in c else '') + ' to be a file' * ('file' in c)


def before(c, d):
    """The operands in front of one that is needed: REF and"""
    names = [a['name'] for a in d['arguments']]
    return '' if 'file' in c or c['name'] not in names else ''.join(n + ' and ' for n in names[:names.index(c['name'])])


def conditions(o, d):
    """needs --method=tv|htv or --estimate; not with --sigma"""
    text = []
    for key, words in ('needs', 'needs '), ('not_with', 'not with '):
        all_ = [before(c, d) * (key == 'needs') + condition(c, d) for c in o.get(key, [])]
        if all_:
            text.append(words + (', '.join(all_[:-1]) + ' or ' if all_[1:] else '') + all_[-1])
    return '; '.join(text)


def described(tool):
    """--describe says what --help says."""
    d, text = json.loads(says(tool, '--describe')), says(tool, '--help')
    options, keys = text.split('Keys of --expert:')[0], text.split('Keys of --expert:')[1:] or ['']
    assert d['name'] == tool and d['brief'] in text and set(d['exit']) == set('01234567') | {'75'}
    assert [o['name'] for o in d['options']] == re.findall(r'^  (?:-\w,|   ) --([\w-]+)', options, re.M), 'options'
    assert [o['name'] for o in d['expert']] == re.findall(r'^      ([\w-]+)=', keys[0], re.M), 'keys'
    usage = text.split('\n')[0].split('[OPTION]...')[1].split()
    assert [('[%s]' if a['optional'] else '%s') % a['name'] + '...' * a['list'] for a in d['arguments']] == usage, 'arguments'
    flat = re.sub(r'\s+', ' ', text)
    for o in d['options'] + d['expert'] + d['arguments']:
        assert o['type'] in TYPES and o['help'] in flat, o
        assert re.fullmatch('[a-zA-Z]', o.get('letter', 'a')), o
        assert (o['type'] == 'file') == ('direction' in o) and (o['type'] == 'choice') == ('words' in o), o
        assert o['type'] != 'file' or '|' not in o.get('value', ''), o  # one of N|FILE may be no file
        assert 'least' not in o or o['least'] <= o.get('default', o['least']) <= o['most'], o
        assert o['type'] != 'choice' or 'default' not in o or o['default'] in o['words'], o
        assert o in d['expert'] or '[%s]' % conditions(o, d) in flat + '[]', o
        assert 'default' in o or o in d['arguments'] or o['help'] + ' (default' not in flat, o
        assert ('alone' in o) == ('--%s[=' % o['name'] in flat), o
        for e in o.get('ends', []):
            assert all('.' + n in flat for n in e['names']), o
            assert 'with' not in e or condition(e['with'], d) in flat, o
    assert len(re.findall(r'\[(?:needs|not with) ', options)) == sum(bool(conditions(o, d)) for o in d['options'] + d['arguments'])


def form(tool):
    """The parameters of --xml, by the rules of ModuleDescription.xsd of the Slicer Execution Model."""
    root = ET.fromstring(says(tool, '--xml'))
    assert root.tag == 'executable' and [c.tag for c in root][:7] == ['category', 'title', 'description', 'version', 'documentation-url', 'license', 'contributor']
    assert root.find('title').text == tool
    all_ = [p for group in root.findall('parameters') for p in group if p.tag not in ('label', 'description')]
    names = [p.find('name').text for p in all_]
    assert len(set(names)) == len(names) and all(re.fullmatch(r'[A-Za-z_]\w*', n) for n in names)
    places = [int(p.find('index').text) for p in all_ if p.find('index') is not None]
    assert places == list(range(len(places)))
    for p in all_:
        assert p.find('label').text and p.find('description').text
        has = [c.tag for c in p]
        if p.tag == 'image':
            assert set(p.attrib) <= {'fileExtensions'} and sorted(has) == ['channel', 'description', 'index', 'label', 'name']
            assert p.find('channel').text in ('input', 'output')
            continue
        assert p.tag in ('boolean', 'integer', 'double', 'string') and not p.attrib and len(set(has)) == len(has)
        assert {'name', 'label', 'longflag', 'description'} <= set(has) <= {'name', 'label', 'flag', 'longflag', 'description', 'default'}
        assert p.tag == 'string' or 'default' in has, names
    assert not any(group.attrib for group in root.findall('parameters'))
    return all_


def as_slicer(tool, given, places):
    """The command line that Slicer makes: all numbers and choices, flags that are set, texts that are not empty."""
    line = [tool]
    for p in form(tool):
        name, default = p.find('name').text, p.find('default')
        value = given.get(name, default.text if default is not None else '')
        if p.find('longflag') is None or not value or value == 'false':
            continue
        line += [p.find('longflag').text] + ([] if p.tag == 'boolean' else [value])
    return line + places


def boutiques(tool):
    """A descriptor, by the rules of schema 0.5."""
    from ctsr.boutiques import descriptor
    d = descriptor(tool)
    assert {'name', 'description', 'command-line', 'schema-version', 'inputs', 'tool-version'} <= set(d)
    assert set(d) <= {'name', 'description', 'command-line', 'schema-version', 'inputs', 'tool-version', 'error-codes', 'output-files'}
    assert d['schema-version'] == '0.5' and d['inputs'] and all(set(x) == {'code', 'description'} and x['code'] for x in d['error-codes'])
    keys = [x['value-key'] for x in d['inputs']]
    assert len(set(keys)) == len(keys) and d['command-line'] == ' '.join([tool] + sorted(keys, key=d['command-line'].index))
    ids = [x['id'] for x in d['inputs'] + d.get('output-files', [])]
    assert len(set(ids)) == len(ids) and all(re.fullmatch('[0-9_a-zA-Z]+', i) for i in ids)
    for x in d['inputs']:
        assert {'id', 'name', 'type'} <= set(x) and x['type'] in ('String', 'File', 'Flag', 'Number')
        assert set(x) <= {'id', 'name', 'type', 'description', 'value-key', 'optional', 'command-line-flag', 'command-line-flag-separator', 'list', 'value-choices',
                          'integer', 'minimum', 'maximum', 'disables-inputs'}
        assert x['type'] != 'Flag' or x['command-line-flag'] and not x.get('list')
        assert x['type'] == 'Number' or not {'integer', 'minimum', 'maximum'} & set(x)
        assert 'value-choices' not in x or x['type'] == 'String'
        assert set(x.get('disables-inputs', [])) <= set(ids)
    for x in d.get('output-files', []):
        assert set(x) == {'id', 'name', 'description', 'path-template', 'optional'} and x['path-template'] in keys
    return d


def as_boutiques(tool, given):
    """The command line of a descriptor and an invocation."""
    d = boutiques(tool)
    line = d['command-line']
    assert set(given) <= {x['id'] for x in d['inputs']}
    for x in d['inputs']:
        value = given.get(x['id'])
        assert value is not None or x['optional'], x
        text = (value or '') if x['type'] != 'Flag' else ''
        flag = x['command-line-flag'] + (x.get('command-line-flag-separator', ' ') if text else '') if value and 'command-line-flag' in x else ''
        line = line.replace(x['value-key'], flag + text)
    return line


def nipype(tool):
    """The interface takes every option; its line is the one that is wanted."""
    from ctsr.nipype import interface
    made = interface(tool)
    assert {o['name'].replace('-', '_') for o in json.loads(says(tool, '--describe'))['options']} - {'help', 'version', 'json', 'dry_run'} <= set(made().inputs.get())


def run_nipype():
    from ctsr.nipype import interface
    made = interface('ct-sr')(IN='lr.nii', OUT='n.nii', quality='draft', threads=1, quiet=True)
    assert made.cmdline == 'ct-sr --quality=draft --quiet --threads=1 lr.nii n.nii', made.cmdline
    assert made.run().outputs.OUT.endswith('/n.nii')
    load = [sys.executable, '-c', 'import pickle, sys; print(pickle.load(sys.stdin.buffer).cmdline)']
    assert subprocess.run(load, check=True, input=pickle.dumps(made), capture_output=True).stdout.decode() == made.cmdline + '\n'  # as Node and Workflow do
    try:
        print(made.run().outputs)
        raise AssertionError('a command that fails has outputs')
    except RuntimeError as e:
        assert 'ct-sr: n.nii: exists' in str(e) and 'Return code: 4' in str(e), e
    # a shell reads the line: no name does anything there
    for k, name in enumerate(('a b.nii', "it's.nii", 'x;y.nii', '-c.nii', '$HOME.nii', 'keep>n.nii', '"#&(`*')):
        shutil.copy('lr.nii', name if k < 6 else 'lr2.nii')
        made = interface('ct-convert')(IN=[name if k < 6 else 'lr2.nii'], OUT='out %s.nii' % name, quiet=True)
        assert os.path.isfile(made.run().outputs.OUT), made.cmdline
    made = interface('ct-convert')(IN=['lr.nii'], OUT='-o.nii>lr.nii', quiet=True, args='--force')
    assert made.cmdline == "ct-convert --force --quiet lr.nii './-o.nii>lr.nii'", made.cmdline
    assert os.path.getsize('lr.nii') and not os.path.exists(made.inputs.OUT) and os.path.isfile(made.run().outputs.OUT)
    made = interface('ct-convert')(IN=['lr.nii'], OUT='n.nii.gz', quiet=True)
    assert made.cmdline == 'ct-convert --quiet lr.nii n.nii.gz' and made.run().outputs.OUT.endswith('/n.nii.gz')


if __name__ == '__main__':
    what, tools = sys.argv[1], sys.argv[2:]
    given, places = dict(t.split('=') for t in tools[1:] if '=' in t), [t for t in tools[1:] if '=' not in t]
    if what == 'slicer':
        print(' '.join(as_slicer(tools[0], given, places)))
    elif what == 'invocation':
        print(as_boutiques(tools[0], given))
    elif what == 'run_nipype':
        run_nipype()
    else:
        for tool in tools:
            {'described': described, 'form': form, 'boutiques': boutiques, 'nipype': nipype}[what](tool)
