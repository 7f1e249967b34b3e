# SPDX-License-Identifier: Apache-2.0
"""The package ctsr for Python: the commands' voxels, numpy and nibabel, errors, Ctrl-C, threads."""
import gc, os, pickle, re, shutil, signal, subprocess, sys, tempfile, threading, time, warnings, weakref
import numpy as np
import ctsr

n = 0
bad = 0


def ok(is_so, name):
    global n, bad
    n += 1
    bad |= not is_so
    print('%s %d - %s' % ('ok' if is_so else 'not ok', n, name), flush=True)
    return is_so


def fails(status, words, f, *a, **k):
    try:
        f(*a, **k)
    except ctsr.Error as e:
        return e.status == status and re.search(words, str(e)) is not None or print('#', e.status, e)
    return False


def run(*line):
    subprocess.run(line, check=True)


def same(a, b):
    return a.data.shape == b.data.shape and np.array_equal(a.data, b.data) and np.allclose(a.affine, b.affine)


header = open(sys.argv[1]).read()
from ctsr import _abi
ok(set(_abi.NAMES) <= set(re.findall(r'\bctsr_\w+(?=\()', header)), 'it calls what ctsr.h declares')
ok(ctsr.__version__ == ctsr.version(), 'the package and the library have one version')
ok(ctsr.version() == subprocess.run(['ct-sr', '--version'], capture_output=True, text=True).stdout.split()[-1], 'version')

run('ct-phantom', '-q', '--size', '24x20x16', '--spacing', '2', 'ellipsoids', 'hr.nii')
hr = ctsr.read('hr.nii')
ok(hr.data.shape == (24, 20, 16) and hr.data.flags.f_contiguous and np.allclose(hr.spacing, 2), 'a volume')
ok('ct-phantom' in hr.meta['history'], 'with its metadata')

run('ct-degrade', '-q', '-x', '2', '--sigma', '.85', '--noise', '5', '-s', '3', 'hr.nii', 'lr.nii')
lr = ctsr.degrade(hr, 2, .85, noise=5, seed=3)
ok(same(lr, ctsr.read('lr.nii')), 'degrade: the voxels of ct-degrade')
run('ct-degrade', '-q', '-x', '1,1,2', '--sigma', '.85', 'hr.nii', 'along.nii')
for words, said in (['-p', 'P3', '--decimate', 'sinc'], dict(protocol='P3', decimate='sinc')), (['-p', 'P1n', '--noise', '0'], dict(protocol='P1n', noise=0)), \
        (['-p', 'P1', '--sigma', '0'], dict(protocol='P1', sigma=0)), (['-p', 'P3'], dict(protocol='P3')):
    run('ct-degrade', '-q', '-f', '-x', '2', *words, 'hr.nii', 'said.nii')
    ok(same(ctsr.degrade(hr, 2, **said), ctsr.read('said.nii')), 'degrade: what is said counts in place of the protocol, though it is 0: %s' % ' '.join(words))
ok(same(ctsr.degrade(hr, (1, 1, 2), .85), ctsr.read('along.nii')), 'degrade: one sigma is of the axes that are reduced')
ok(fails(2, 'sigma: one number is of the axes that are reduced, and none is', ctsr.degrade, hr, 1, .85), 'degrade: one sigma where no axis is reduced')
ok(fails(2, 'mask and window are of volumes', ctsr.metrics, ctsr.project(hr, views=2), ctsr.project(hr, views=2), window=(0, 1)), 'metrics: a window of projections is refused')
ok(fails(2, 'value_range is of projections', ctsr.metrics, hr, hr, value_range=9), 'metrics: a range of volumes is refused')
run('ct-upsample', '-q', '-m', 'prior', '-p', sys.argv[2], '--std', 'std.nii', 'lr.nii', 'sr.nii')
sr = ctsr.superres('lr.nii', prior=sys.argv[2], error=True)
ok(same(sr, ctsr.read('sr.nii')) and same(sr.error, ctsr.read('std.nii')), 'superres: those of ct-upsample -m prior, and its error')
ok(sr.error.meta['quantity'] == 'expected error' and fails(3, 'expected error', ctsr.superres, sr.error, 2), 'a predicted error says what it is, and is no CT')
ok(fails(2, 'error: needs method=auto', ctsr.upsample, lr, method='cubic', error=True), 'cubic interpolation predicts no error, as of ct-upsample')
ok(fails(2, 'noise: needs method=auto', ctsr.upsample, lr, method='cubic', noise=3), 'nor does it know noise, as of ct-upsample')
ok(sr.report['operator'].factor == (2, 2, 2) and sr.report['prior'] and sr.report['residual'] < 20, 'and what was done')
run('ct-upsample', '-q', '-m', 'cubic', '-x', '1,1,3', 'hr.nii', 'cubic.nii')
blind = ctsr.Image(lr.data, lr.affine)
ctsr.write(blind, 'blind.nii'); run('ct-sr', '-q', '--prior', sys.argv[2], 'blind.nii', 'blind-sr.nii')
ok(same(ctsr.superres(blind, prior=sys.argv[2]), ctsr.read('blind-sr.nii')), 'a scan that says nothing: the voxels of ct-sr')
ctsr.write(blind, 'beside.nii')
with open('beside.json', 'w') as f:
    f.write('{"Modality": "CT", "Manufacturer": "Siemens", "SliceThickness": 6, "SpacingBetweenSlices": 4}')
run('ct-sr', '-q', '-Q', 'draft', '-x', '1,1,2', 'beside.nii', 'beside-sr.nii')
by_header = ctsr.superres('beside.nii', (1, 1, 2), quality='draft')
ok(same(by_header, ctsr.read('beside-sr.nii')) and not same(by_header, ctsr.superres(blind, (1, 1, 2), quality='draft')), 'the JSON beside a scan counts, as for ct-sr')
try:
    ctsr.superres(blind, estimate=False)
    ok(False, 'which is an error, if asked for')
except ctsr.Error:
    ok(True, 'which is an error, if asked for')
ok(same(ctsr.superres(hr, (1, 1, 3), method='cubic'), ctsr.read('cubic.nii')), 'factors of their own')
ok(same(ctsr.superres(lr, method='tv', threads=1), ctsr.superres(lr, method='tv', threads=3)), 'any number of threads')
run('ct-project', '-q', '-n', '8', 'hr.nii', 'p.exr')
p = ctsr.project(hr, views=8)
q = ctsr.read_projections('p.exr')
ok(p.data.shape[0] == 8 and np.array_equal(p.data, q.data) and all(np.allclose(p.views[3][k], q.views[3][k]) for k in 'uv'),
   'project: the pixels of ct-project')
run('ct-fdk', '-q', '--grid', 'hr.nii', 'p.exr', 'fdk.nii')
ok(same(ctsr.fdk(p, hr), ctsr.read('fdk.nii')), 'fdk: the voxels of ct-fdk')
m = ctsr.metrics(hr, sr)
text = subprocess.run(['ct-metrics', 'hr.nii', 'sr.nii'], capture_output=True, text=True).stdout
ok(abs(m['psnr'] - float(re.search(r'^psnr (\S+)', text, re.M)[1])) < 1e-3, 'metrics: the figures of ct-metrics')
ok(ctsr.consistency(sr, lr)['rms'] < 10, 'consistency')
try:
    ctsr.estimate_operator(blind, 2)
    ok(False, 'too few edges are an error')
except ctsr.Error as e:
    ok('too few edges' in str(e), 'too few edges are an error')
run('ct-phantom', '-q', '--size', '64x64x64', '--spacing', '2', 'ellipsoids', 'large.nii')
made = ctsr.degrade('large.nii', 2, .85)
found = ctsr.estimate_operator(ctsr.Image(made.data, made.affine), 2)
ok(found.factor == (2, 2, 2) and found.decimate == 'sinc' and .5 < found.sigma[0] < 1.3, f'the operator is measured: {found.sigma}')

z = ctsr.Projections.new(q.views, *q.data.shape[1:])
z.data[...] = 1
left = float(np.vdot(p.data.astype(float), z.data))
ok(z.data.shape == q.data.shape and left > 0, 'projections of a geometry')
y = ctsr.Projections.new(q.views, *q.data.shape[1:])
y.data = 2 * z.data
z.data[...] *= 2
ok(y.data.any() and same(ctsr.fdk(y, hr), ctsr.fdk(z, hr)), 'pixels that are set are those that a call reads')
few = ctsr.fit(p, hr, gaussians=20, iterations=2, full=True)
for what, change in (('pixels of another shape', lambda: setattr(z, 'data', z.data[0])), ('a view', lambda: z.views[0]['u'].fill(0)),
                     ('Gaussians', lambda: few.density.fill(0)), ('an array of Gaussians', lambda: setattr(few, 'density', 0))):
    try:
        change()
        ok(False, '%s cannot be set, where no call would read it' % what)
    except (AttributeError, ValueError):
        ok(True, '%s cannot be set, where no call would read it' % what)
ctsr.write(sr, 'o.nii.gz'); ctsr.write(sr, 'o.nrrd'); ctsr.write_projections(p, 'o.exr')
ok(same(ctsr.read('o.nii.gz'), sr) and same(ctsr.read('o.nrrd'), sr) and np.array_equal(ctsr.read_projections('o.exr').data, p.data), 'written and read')

# the options of ct-sr, by their names; what it prints
for options, words in (dict(quality='draft'), ['-Q', 'draft']), (dict(quality='fast', sigma=.85), ['-Q', 'fast', '--sigma', '.85']), \
        (dict(factor=(1, 1, 2), slice_thickness=5), ['-x', '1,1,2', '--slice-thickness', '5']), \
        (dict(factor=(1, 1, 2), profile='triangle'), ['-x', '1,1,2', '--profile', 'triangle']), \
        (dict(factor=(1, 1, 2), decimate='mean', sigma=.5, noise=3), ['-x', '1,1,2', '--decimate', 'mean', '--sigma', '.5', '--noise', '3']), \
        (dict(factor=(1, 1, 2), profile='profile.txt'), ['-x', '1,1,2', '--profile', 'profile.txt']):
    open('profile.txt', 'w').write('-4 1\n-2 2\n0 3\n2 2\n4 1\n')
    p, lines = subprocess.run(['ct-sr', '-f', *words, 'blind.nii', 'by-command.nii'], capture_output=True, text=True), []
    by_name = ctsr.superres('blind.nii', log=lines.append, **options)  # with the networks beside CTSR_LIBRARY
    ok(p.returncode == 0 and same(by_name, ctsr.read('by-command.nii')), 'the voxels of ct-sr %s' % ' '.join(words) + p.stderr * p.returncode)
    said = [re.sub(r'^ct-sr: (warning: )?(blind.nii: )?|; [^;]* s, [^;]* MiB$|(?<= )--(?=sigma|denoise)', '', line) for line in p.stderr.strip().split('\n')]
    mine = [re.sub(r'; [^;]* s, [^;]* MiB$', '', line) for line in lines]
    ok(said == mine, 'log gets what ct-sr %s prints, with the names of members' % ' '.join(words)) or print('#', said, '#', mine)
ok(fails(2, "quality: 'best' is not one of draft, fast, balanced", ctsr.superres, lr, quality='best'), 'a quality that is none')
ok(fails(2, 'slice_thickness: the file of profile says it', ctsr.superres, lr, profile='profile.txt', slice_thickness=2), 'a thickness said twice')
ok(fails(3, 'none.txt', ctsr.superres, lr, profile='none.txt'), 'a profile that is not there')
beams = ctsr.project('lr.nii', views=3)
for message, f, x, options in (('trust: needs estimate, and no sigma', ctsr.superres, lr, dict(trust=True, sigma=.85)),
                               ('trust: needs estimate, and no sigma', ctsr.upsample, lr, dict(trust=True)),
                               ('noise does nothing, as the volume says no operator', ctsr.upsample, 'blind.nii', dict(factor=2, noise=3)),
                               ('iterations does nothing', ctsr.upsample, 'blind.nii', dict(factor=2, iterations=5)),
                               ('estimate: needs method=', ctsr.upsample, 'blind.nii', dict(method='linear', estimate=True)),
                               ('estimate: not with sigma', ctsr.upsample, lr, dict(method='dc', sigma=.85, estimate=True)),
                               ('a factor of 1 refines nothing', ctsr.superres, 'blind.nii', dict(factor=1, quality='draft')),
                               ('tolerance: inf is outside', ctsr.upsample, lr, dict(method='tv', tolerance=np.inf)),
                               ('iterations: 1000000 is outside', ctsr.upsample, lr, dict(method='tv', iterations=10**6)),
                               ('noise: nan is not a number', ctsr.superres, lr, dict(noise=np.nan)),
                               ('sigma: nan is not a number', ctsr.superres, lr, dict(sigma=np.nan)),
                               ('slice_thickness: nan is not a number', ctsr.superres, lr, dict(slice_thickness=np.nan)),
                               ('eta: nan is not a number', ctsr.ddnm, beams, dict(eta=np.nan)),
                               ('floor: nan is not a number', lambda x, **o: ctsr.compose(x, x, **o), lr, dict(floor=np.nan)),
                               ('window: nan is not a number', ctsr.reconstruct, beams, dict(window=(np.nan, 1))),
                               ('pixel: needs coarsen', ctsr.project, lr, dict(pixel='mean')),
                               ('electronic and water: need photons', ctsr.project, lr, dict(electronic=5)),
                               ('electronic and water: need photons', ctsr.project, lr, dict(water=.03)),
                               ('voxels: not with like', ctsr.reconstruct, beams, dict(like='lr.nii', voxels=9)),
                               ('cutoff: not with filter=none', ctsr.reconstruct, beams, dict(filter='none', density=True, cutoff=.5))):
    ok(fails(2, message, f, x, **options), '%s: what does nothing is refused, as of the commands' % sorted(options)[0])
bad_units = dict(zero_to_one=lr.data / 4000 + .3, bytes=np.clip(lr.data / 16 + 64, 0, 255).round(), huge=lr.data * 1e4, attenuation=lr.data / 5e4 + .02)
for name, values in bad_units.items():
    ctsr.write(ctsr.Image(values, lr.affine), name + '.nii')
    for words, f in (['ct-sr', '-x2'], lambda x: ctsr.superres(x, 2)), (['ct-upsample', '-x2', '-m', 'cubic'], lambda x: ctsr.upsample(x, 2, method='cubic')), \
            (['ct-degrade', '-x2'], lambda x: ctsr.degrade(x, 2)), (['ct-project', '-n2'], lambda x: ctsr.project(x, views=2)):
        p = subprocess.run(words + ['-q', '-f', name + '.nii', 'no' + ('.exr' if 'proj' in words[0] else '.nii')], capture_output=True, text=True)
        try:
            f(ctsr.Image(values, lr.affine))
            status = 0
        except ctsr.Error as e:
            status = e.status
        ok(status == p.returncode, '%s of %s: the status of the command, %d' % (words[0], name, p.returncode)) or print('#', status, p.stderr)

# without a library, with one of another version, without ct-convert
def imports(library, code='', **more):
    return subprocess.run([sys.executable, '-c', 'import ctsr;' + code], capture_output=True, text=True, env=dict(os.environ, CTSR_LIBRARY=library, **more)).stderr.strip()


ok(re.search(r'ImportError: ctsr needs the library libctsr.so.0: install .*CTSR_LIBRARY', imports('/none/libctsr.so.0')), 'import without a library says what to do')
ok(re.search(r'ImportError: .*libz.so.1: has no ctsr_', imports('libz.so.1')), 'another library is no library of ctsr')
os.mkdir('series')
ok(re.search(r'series: DICOM is read by the command ct-convert, which is not installed', imports(os.environ['CTSR_LIBRARY'], 'ctsr.read("series")', PATH='')), 'DICOM without ct-convert says what is missing')
shutil.copy(os.environ['CTSR_LIBRARY'], 'libctsr.so.0')
ok(re.search(r'no prior is installed at .*slices.safetensors', imports('./libctsr.so.0', 'ctsr.superres("lr.nii")')) or os.path.exists('/usr/share/ctsr') or os.path.exists('/usr/local/share/ctsr'), 'a library without its networks says which is missing')
ok(re.search(r'no prior is installed at .*/prior.safetensors', imports('./libctsr.so.0', 'ctsr.paper("lr.nii", 2)')) or os.path.exists('/usr/share/ctsr') or os.path.exists('/usr/local/share/ctsr'), 'paper without its network: the same words')
shutil.copy(sys.argv[2], '.')
ok(imports('./libctsr.so.0', 'import os; os.mkdir("elsewhere"); os.chdir("elsewhere"); ctsr.superres("../lr.nii")') == '', 'the network beside CTSR_LIBRARY is found')

# numpy and nibabel
a = np.zeros((5, 6, 7), np.float32, 'F'); i = ctsr.Image(a, meta={'quantity': 'hu'}); a[1, 2, 3] = 9
ok(i.data is a, 'an array is not copied')
v = ctsr.superres(i, 2, method='linear').data
gc.collect()
ok(v.shape == (10, 12, 14) and v.max() > 1, 'a result lives as long as its array')
try:
    import nibabel
    b = nibabel.load('lr.nii')
    ok(same(ctsr.superres(b, 2, method='cubic'), ctsr.superres(ctsr.Image(lr.data, lr.affine), 2, method='cubic')), 'an image of nibabel')
    b = nibabel.Nifti1Image(lr.data[..., None], np.diag([1e-3, 1e-3, 1e-3, 1]) @ lr.affine)
    b.header.set_xyzt_units('meter')
    b.to_filename('metres.nii')
    i = ctsr.Image.of(nibabel.load('metres.nii'))
    ok(same(i, ctsr.read('metres.nii')) and np.allclose(i.affine, lr.affine, atol=1e-4), 'an image of nibabel in metres, of four axes: as its file')
    flat = nibabel.Nifti1Image(np.full((6, 5), 7, np.int16), lr.affine)
    flat.to_filename('flat.nii')
    ok(same(ctsr.Image.of(flat), ctsr.read('flat.nii')), 'an image of nibabel of two axes: as its file')
    ok(np.array_equal(sr.nibabel().affine, sr.affine) and np.array_equal(sr.nibabel().get_fdata(), sr.data), 'and to one')
except ImportError:
    print('# no nibabel')
run('ct-convert', '-q', '--type', 'i16', 'lr.nii', 'i16.nii')
if subprocess.run(['ct-convert', '-q', 'i16.nii', 'dicom/'], capture_output=True).returncode == 0:
    d = ctsr.read('dicom')
    ok(sorted(d.data.ravel()) == sorted(ctsr.read('i16.nii').data.ravel()), 'a folder of DICOM')
    os.rename('dicom/ctsr0001.dcm', 'dicom/IM1')
    subprocess.run(['tar', 'czf', 'dicom.tgz', 'dicom'], check=True)
    ok(same(ctsr.read('dicom/IM1'), d) and same(ctsr.read('dicom.tgz'), d), 'a file of DICOM and an archive, whatever their names')
    os.mkdir('bare')
    for name in os.listdir('dicom'):
        with open('dicom/' + name, 'rb') as f, open('bare/' + name.split('.')[0], 'wb') as g:
            g.write(f.read()[132:])
    ok(same(ctsr.read('bare/IM1'), d), 'files of DICOM without a preamble, as ct-convert reads them')
    shutil.copy('dicom/IM1', 'dicom/IM2')
    told = []
    ctsr.upsample('dicom', 2, method='linear', log=told.append)
    ok(told[:1] == ['8 of 9 files used: 1 repeated'], 'log gets what ct-convert warns of')
    with warnings.catch_warnings(record=True) as w:
        warnings.simplefilter('always'); ctsr.read('dicom')
    ok([str(x.message) for x in w] == told[:1], 'without a log it is a warning of Python')

# a NIfTI file whose pixdim[1] is not what its sform says
ctsr.write(ctsr.Image(np.zeros((3, 3, 3), 'f4')), 'two.nii')
with open('two.nii', 'r+b') as f:
    f.seek(80); f.write(np.float32(2).tobytes())
told = []
ctsr.read('two.nii', log=told.append)
line = subprocess.run(['ct-convert', 'two.nii', 'one.nii'], capture_output=True, text=True, check=True).stderr.strip()
ok(len(told) == 1 and line == 'ct-convert: warning: ' + told[0], 'two sizes of a voxel are warned of, as commands do: %s' % told)
with warnings.catch_warnings(record=True) as w:
    warnings.simplefilter('always'); ctsr.upsample('two.nii', 2, method='linear')
ok([str(x.message) for x in w] == told, 'also of a file that a function is given')

# errors
e = pickle.loads(pickle.dumps(ctsr.Error(5, 'grids differ')))
ok(e.status == 5 and str(e) == 'grids differ', 'an error of another process comes whole: pickled and read again')
ok(fails(3, 'none.nii', ctsr.read, 'none.nii'), 'a file that is not there')
ok(fails(4, 'o.nrrd', ctsr.write, sr, 'o.nrrd'), 'one that is')
ok(fails(2, "'best' is not one of", ctsr.superres, lr, method='best'), 'a method that is none')
ok(fails(2, 'no such geometry: view', ctsr.project, hr, view=3), 'a geometry that is none')
ok(fails(6, '', ctsr.superres, np.full((4, 4, 4), np.nan), 2, method='cubic'), 'NaN')
ok(fails(6, 'is NaN', ctsr.write, np.full((4, 4, 4), np.nan), 'nan.nii') and not os.path.exists('nan.nii'), 'NaN is not written')
ok(fails(2, 'three axes', ctsr.superres, np.zeros((4, 4)), 2), 'a picture')
ok(fails(5, '', ctsr.metrics, hr, lr), 'other grids')



def raises(kind, f, *arguments, **options):
    try:
        f(*arguments, **options)
    except kind:
        return True
    except Exception as e:
        print('#', type(e), e)
    return False


noisy = dict(factor=2, noise=1.)
ok(raises(OverflowError, ctsr.degrade, hr, seed=2**64, **noisy), 'a seed of 65 bits')
ok(raises(OverflowError, ctsr.degrade, hr, seed=-1, **noisy), 'a negative one')
ok(raises(TypeError, ctsr.degrade, hr, seed=1.5, **noisy), 'one that is not whole')
ok(same(ctsr.degrade(hr, seed=np.uint64(2**64 - 1), **noisy), ctsr.degrade(hr, seed=2**64 - 1, **noisy)), 'the largest is taken')
ok(raises(OverflowError, ctsr.superres, lr, threads=2**32 + 1), 'threads of 33 bits')
ok(raises(OverflowError, ctsr.superres, lr, threads=-1), 'and below 0')
ok(raises(OverflowError, ctsr.project, hr, views=2**64 + 3), 'views of 65 bits')
for f in (ctsr.read, ctsr.read_projections, lambda p: ctsr.write(hr, p)):
    ok(raises(ValueError, f, 'o.nii\0.nrrd'), 'a NUL in a name')
ok(raises(ValueError, ctsr.degrade, hr, 2, history='a\0b'), 'in a text')
ok(raises(ValueError, ctsr.write, ctsr.Image(hr.data, hr.affine, {'a': 'b\0c'}), 'z.nii'), 'in metadata')
ok(raises(TypeError, ctsr.Image, np.ma.masked_less(hr.data, 0)), 'a masked array')
ok(raises(TypeError, ctsr.Image, hr.data + 1j), 'complex numbers are no voxels')
try:
    ctsr.metrics(hr, ctsr.project(hr, views=2))
except TypeError as e:
    said = str(e)
ok(said == 'expected a volume, not Projections', 'projections are no volume: ' + said)
ok(raises(TypeError, ctsr.Image, hr.data.astype('S8')), 'bytes of text are no voxels')
ok(raises(TypeError, ctsr.Image, hr.data, hr.affine * (1 + 1j)), 'complex numbers are no affine')
ok(fails(2, 'the last row of an affine is 0 0 0 1, not 0 0 0 2', ctsr.Image, hr.data, np.diag([1, 1, 1, 2.])), 'an affine that scales the last row')
ok(fails(2, 'the factor 0 is not positive', ctsr.degrade, hr, 0), 'a factor of 0 is not taken for none')
ok(fails(2, 'the factor 0 is not positive', ctsr.superres, lr, (2, 0, 2), method='tv'), 'one of 0 along an axis neither')
ok(fails(2, 'the spacing 0 is not positive', ctsr.superres, lr, spacing=0, method='tv'), 'nor is a spacing of 0')
ok(raises(ValueError, ctsr.degrade, hr, (2, 2)), 'two factors for three axes')
ctsr.write(hr, b'by-bytes.nii')
ok(same(ctsr.read(b'by-bytes.nii'), hr), 'the name of a file may be bytes')
ok(raises(TypeError, ctsr.superres, lr, factor=np.ma.array([2, 2, 2], mask=[0, 1, 0])), 'masked factors')
changed = ctsr.Image(np.zeros((2, 2, 2)), hr.affine)
for kind in (np.float64, np.int16, '>f4'):
    changed.data = np.round(hr.data).astype(kind)
    ok(same(ctsr.upsample(changed, 2, method='linear'), ctsr.upsample(ctsr.Image(np.round(hr.data), hr.affine), 2, method='linear')),
       'voxels that are set later are read as numbers of their kind: %s' % np.dtype(kind))
changed.data = hr.data[0]
ok(fails(2, 'three axes', ctsr.upsample, changed, 2, method='linear'), 'a picture that is set later is refused')
changed.data, changed.meta = hr.data, {'a': 1}
ok(raises(TypeError, ctsr.upsample, changed, 2, method='linear'), 'metadata that are no text are refused')
off = np.frombuffer(b' ' + hr.data.tobytes('F'), np.uint8)[1:].view(np.float32).reshape(hr.data.shape, order='F')
ok(not off.flags.aligned and same(ctsr.upsample(off, 2, method='linear'), ctsr.upsample(np.array(hr.data), 2, method='linear')), 'voxels at an odd address')
for few in ((-5,), (-500, 0, 500), -5):
    ok(raises(ValueError, ctsr.degrade, hr, 2, clip=few), 'a clip of not two numbers is refused: %s' % (few,))
    ok(raises(ValueError, ctsr.metrics, hr, hr, window=few), 'a window of not two numbers is refused: %s' % (few,))
    ok(raises(ValueError, ctsr.project, hr, views=2, offset=few), 'an offset of not two numbers is refused: %s' % (few,))
ok(fails(2, 'the clip 0 to 0 is none', ctsr.degrade, hr, 2, clip=(0, 0)) and fails(2, 'the slice_thickness 0 is not', ctsr.degrade, hr, (1, 1, 2), slice_thickness=0), 'a clip or a thickness of 0 is not taken for none')
ok(fails(5, 'a fan has one detector row, not 4', ctsr.project, hr, beam='fan', rows=4) and fails(2, 'the coarsen 0', ctsr.project, hr, coarsen=0), 'rows of a fan and a coarsen of 0 are refused, as of ct-project')
ok(fails(2, 'clip: nan is not a number', ctsr.degrade, hr, 2, clip=(np.nan, 100)), 'a clip from NaN on is refused')
ok(raises(TypeError, ctsr.degrade, hr, 2, progress=5), 'a progress that cannot be called is refused')
for f in (ctsr.fdk, ctsr.ddnm, lambda x: ctsr.fit(x, hr), lambda x: ctsr.backproject(x, hr), lambda x: ctsr.metrics(ctsr.project(hr, views=2), x)):
    ok(raises(TypeError, f, hr), 'a volume in place of projections is refused')
for name in ('label', 'start'):
    ok(raises(OverflowError, ctsr.ddnm, ctsr.project(hr, views=2), sampler='none', factor=2, **{name: 2**32}), 'a %s of 33 bits is refused' % name)
for quantity in ('density', 'mu', 'lineIntegral', 'other'):
    x = ctsr.Image(lr.data, lr.affine, {'quantity': quantity})
    why = 'its values are not HU, says its metadata' if quantity == 'other' else \
        "metadata quantity: the values are '%s': expected HU" % quantity
    ok(fails(3, why, ctsr.superres, x, 2), quantity)
    ok(fails(3, why, ctsr.estimate_operator, x, 2), quantity)
ok(fails(3, 'metadata noise: -5 HU', ctsr.superres, ctsr.Image(lr.data, lr.affine, {'noise': '-5'}), 2, method='tv'), 'noise below 0')

# progress, cancelling
seen = []
ctsr.superres(lr, method='tv', progress=lambda *x: seen.append(x))
ok(seen and all(isinstance(w, str) and d <= max(t, d) for w, d, t in seen), 'progress is told')


def stop(what, done, total):
    raise ZeroDivisionError('enough')


try:
    ctsr.superres(lr, method='tv', progress=stop)
    ok(False, 'what progress raises')
except ZeroDivisionError:
    ok(True, 'what progress raises ends the call')
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have it ignored
big = ctsr.Image(np.random.default_rng(1).normal(0, 500, (90, 90, 90)).astype(np.float32))
ticks = []
ends = threading.Event()


def interrupt(*x):
    if not ends.is_set():
        ends.set()
        os.kill(os.getpid(), signal.SIGINT)


threading.Thread(target=lambda: [ticks.append(time.sleep(.001)) for _ in iter(lambda: not ends.is_set(), False)], daemon=True).start()
try:
    ctsr.superres(big, 2, method='tv', sigma=.85, progress=interrupt)
    ok(False, 'Ctrl-C')
except KeyboardInterrupt:
    ok(len(ticks) > 0, 'Ctrl-C ends a call, and other threads ran')
ok(threading.active_count() <= 2, 'which has ended when it is raised')
run, held, coarse, begin = ctsr._Call.run, [], ctsr.project(hr, views=2), ctsr.project(hr, views=2)
ctsr._Call.run = lambda self, f, *arguments, **_: held.extend(arguments) or [].pop()  # Ctrl-C, and the call goes on for a while
left = raises(IndexError, ctsr.ddnm, coarse, init=begin)
ctsr._Call.run, begin = run, weakref.ref(begin)
gc.collect()
ok(left and begin(), 'what ddnm begins from stays while a call that was left alone reads it')
held.clear()
gc.collect()
ok(not begin(), 'what ddnm begins from is freed with its call')
with tempfile.TemporaryDirectory() as folder:
    for read in ctsr.read, ctsr.read_projections:  # as long as nobody writes: a call that hears of nothing
        pipe = os.path.join(folder, read.__name__)
        os.mkfifo(pipe)
        threading.Timer(.1, os.kill, (os.getpid(), signal.SIGINT)).start()
        signal.alarm(100)  # kills a test that waits on
        try:
            read(pipe)
            ok(False, 'Ctrl-C while %s waits' % read.__name__)
        except KeyboardInterrupt:
            ok(True, 'Ctrl-C ends %s, though nobody ever writes' % read.__name__)
        signal.alarm(0)
        os.close(os.open(pipe, os.O_WRONLY | os.O_NONBLOCK))  # it ends, alone
        while threading.active_count() > 2:
            time.sleep(.01)
print('1..%d' % n)
sys.exit(bad)
