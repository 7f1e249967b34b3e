"""What commands say of themselves to programs: describe.py WHAT TOOL..."""
import json, re, subprocess, sys
import xml.etree.ElementTree as ET

TYPES = {'flag', 'integer', 'number', 'text', 'choice', 'file'}
TAGS = {'image', 'file', 'boolean', 'integer', 'double', 'string', 'string-enumeration'}


def says(tool, how):
    return subprocess.run([tool, how], check=True, capture_output=True, text=True).stdout


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
        assert (o['type'] == 'file') == ('direction' in o) and (o['type'] == 'choice') == ('words' in o), o
        assert 'least' not in o or o['least'] <= o.get('default', o['least']) <= o['most'], o
        assert o['type'] != 'choice' or 'default' not in o or o['default'] in o['words'], o
        assert 'modes' not in o or o['modes'] in flat or o in d['expert'], o
        for e in o.get('ends', []):
            assert all('.' + n in flat for n in e['names']), o


def form(tool):
    """The parameters of --xml, as the Slicer Execution Model wants them."""
    root = ET.fromstring(says(tool, '--xml'))
    assert root.tag == 'executable' and [c.tag for c in root][:4] == ['category', 'title', 'description', 'version']
    assert root.find('title').text == tool
    all_ = [p for group in root.findall('parameters') for p in group if p.tag not in ('label', 'description')]
    assert {p.tag for p in all_} <= TAGS
    names = [p.find('name').text for p in all_]
    assert len(set(names)) == len(names) and all(re.fullmatch(r'[A-Za-z_]\w*', n) for n in names)
    places = [int(p.find('index').text) for p in all_ if p.find('index') is not None]
    assert places == list(range(len(places)))
    for p in all_:
        assert p.find('label').text and p.find('description').text
        assert (p.find('index') is None) == (p.find('longflag') is not None)
        assert (p.find('channel') is not None) == (p.tag in ('image', 'file'))
        if p.tag == 'string-enumeration':
            assert p.find('default').text in [e.text for e in p.findall('element')]
        if p.tag in ('integer', 'double', 'boolean'):
            assert p.find('default') is not None, names
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


if __name__ == '__main__':
    what, tools = sys.argv[1], sys.argv[2:]
    if what == 'slicer':
        tool, given, places = tools[0], dict(t.split('=') for t in tools[1:] if '=' in t), [t for t in tools[1:] if '=' not in t]
        print(' '.join(as_slicer(tool, given, places)))
    for tool in tools if what != 'slicer' else []:
        {'described': described, 'form': form}[what](tool)
