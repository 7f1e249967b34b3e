# SPDX-License-Identifier: Apache-2.0
"""Super-resolution of computed tomography (CT), by libctsr.

    import ctsr
    thin = ctsr.superres("thick.nii.gz", factor=(1, 1, 5))
    ctsr.write(thin, "thin.nii.gz")

Volumes are Image: a float32 array [x, y, z] in HU, and an affine to mm, RAS+. Wherever one is wanted, an image of
nibabel (its voxels and affine alone) or the name of a file (with what its header says) may be given. Every function
raises Error, which has the exit status that the commands have. Those whose work takes long take

    threads   number of threads; 0: one for each processor
    progress  called as progress(what, done, total), total 0 if not known
    log       called as log(text) with each line that the command prints, where it prints any

Ctrl-C ends a call soon, with KeyboardInterrupt. Other threads of Python run meanwhile.
"""
from __future__ import annotations

import ctypes as c
import math
import operator
import os
import subprocess
import tarfile
import tempfile
import threading
import time
import warnings
import weakref
from typing import Any, Callable, Dict, NamedTuple, Optional, Sequence, Union

import numpy as np

from . import _abi as abi

__version__ = '0.1.0'
__all__ = ['Error', 'Image', 'Operator', 'Projections', 'version', 'read', 'write', 'degrade', 'estimate_operator',
           'superres', 'upsample', 'paper', 'project', 'ddnm', 'read_projections', 'write_projections', 'backproject', 'reconstruct', 'fdk', 'Gaussians',
           'fit', 'read_gaussians', 'write_gaussians', 'compose', 'metrics', 'consistency']
_lib = abi.load()
_DECIMATE = ('sinc', 'point', 'mean')
_METHODS = ('auto', 'linear', 'cubic', 'bspline', 'lanczos', 'sinc', 'dc', 'tv', 'htv', 'prior', 'arssr')
_PRESETS = ('fast', 'balanced')
_QUALITIES = ('draft',) + _PRESETS
_BEAMS = ('cone', 'parallel', 'fan')
_PIXELS = ('point', 'mean', 'sinc')
_INTEGRALS = ('siddon', 'joseph')
Progress = Callable[[str, int, int], Any]
Axes = Union[float, Sequence[float]]


class Error(Exception):
    """A call that failed. status: 1 failed, 2 usage, 3 input invalid, 4 output not writable, 5 geometry refused,
    6 numerical failure, 7 no memory."""

    def __init__(self, status: int, message: str):
        super().__init__(message)
        self.status = status

    def __reduce__(self):  # of another process, too
        return type(self), (self.status, str(self))


class _Handle:
    """An object of the library, freed with this. What it reads stays with it."""

    def __init__(self, pointer, free, *keeps):
        self.p, self.keeps = pointer, keeps
        self._end = weakref.finalize(self, free, pointer)


class _Call:
    """The context of one call: threads, progress, what was raised in a callback."""

    def __init__(self, threads=0, progress: Optional[Progress] = None, log=None, seed=0, overwrite=False, history=None):
        for name, f in (('progress', progress), ('log', log)):
            if f is not None and not callable(f):
                raise TypeError('%s: %r cannot be called' % (name, f))
        self.x, self.raised, self.stop = abi.Context(c.sizeof(abi.Context)), None, False
        self.x.threads, self.x.seed = _whole(threads, 32, 'threads'), _whole(seed, 64, 'seed')
        self.x.overwrite = bool(overwrite)
        self.x.history = _text(history, 'history') if history else None

        def on_progress(_, what, done, total):
            try:
                if progress and not self.stop:
                    progress(what.decode(), done, total)
            except BaseException as e:
                self.raised, self.stop = e, True
            return int(self.stop)

        def on_log(_, level, text):
            try:
                log(text.decode(errors='replace'))
            except BaseException as e:
                self.raised, self.stop = e, True

        self.x.progress = abi.PROGRESS(on_progress)
        if log:
            self.x.log = abi.LOG(on_log)

    def run(self, f, *arguments, made=(), free=None):
        """f(*arguments, &context, &error). What it made is freed where that raises."""
        self.go(f, *arguments, c.byref(self.x), made=made, free=free)

    def go(self, f, *arguments, made=(), free=None, daemon=False):
        """f(*arguments, &error), in a thread of its own, so that the main thread receives signals. Ctrl-C asks it to stop. If it does
        not stop soon, it ends alone later; what it uses is kept until then."""
        e, code, ended, alone, lock = abi.Error(), [], threading.Event(), [], threading.Lock()
        words = [a.p if isinstance(a, _Handle) else a for a in arguments] + [c.byref(e)]

        def drop():
            for x in made:
                (free or _lib.ctsr_volume_free)(x)

        def call():
            code.append(f(*words))
            with lock:
                ended.set()
                if alone:
                    drop()
            arguments  # are there until here

        if threading.current_thread() is threading.main_thread():
            threading.Thread(target=call, daemon=daemon).start()
            until = None
            while not ended.is_set():  # join() takes a thread that it was interrupted at for ended
                try:
                    ended.wait(.05)
                    if until and time.monotonic() > until:
                        with lock:
                            if not ended.is_set():
                                alone.append(True)
                                break
                except BaseException as x:  # Ctrl-C
                    self.raised, self.stop = x, True
                    until = until or time.monotonic() + .5
        else:
            call()
        if self.raised:
            if not alone:
                drop()  # it came too late
            raise self.raised
        _check(code[0], e)


def _check(code, e):
    if code:
        raise Error(e.code, e.message.decode(errors='replace'))


def _whole(x, bits, what):
    """A whole number that fits so many bits without a sign."""
    try:
        n = operator.index(x)
    except TypeError:
        raise TypeError('%s: %r is not a whole number' % (what, x)) from None
    if not 0 <= n < 1 << bits:
        raise OverflowError('%s: %d is not from 0 to 2**%d - 1' % (what, n, bits))
    return n


def _text(s, what):
    """As bytes that end in a zero, and hold none."""
    if not isinstance(s, str):
        raise TypeError('%s: %r is not text' % (what, s))
    b = s.encode()
    if b'\0' in b:
        raise ValueError('%s: %r holds a NUL' % (what, s))
    return b


def _path(path):
    """A name of a file: text, bytes or a path."""
    b = os.fsencode(path)
    if b'\0' in b:
        raise ValueError('path: %r holds a NUL' % (path,))
    return b


def _array(x, dtype=None):
    """A numpy array. The mask of a masked array would be lost, and the imaginary part of complex numbers; text is no
    number."""
    if isinstance(x, np.ma.MaskedArray):
        raise TypeError('a masked array: fill it, as by x.filled(-1024)')
    x = np.asarray(x)
    if x.dtype.kind not in 'biufO' or any(isinstance(v, (complex, str, bytes)) for v in x.flat if x.dtype.kind == 'O'):
        raise TypeError('an array of %s: expected real numbers' % x.dtype)
    return np.asarray(x, dtype)


def _real(x, what):
    """Not NaN, which would be taken for what is not given."""
    if np.isnan(x).any():
        raise Error(2, '%s: nan is not a number' % what)
    return x


def _three(x: Axes, what):
    x = _real(_array(x, float), what)
    if x.shape not in ((), (1,), (3,)):
        raise ValueError('%s: %r: expected one number or three' % (what, x.tolist()))
    return abi.D3(*np.broadcast_to(x, (3,)))


def _some(x, n, what):
    """So many numbers, of which none is left out."""
    a = _real(_array(x, float), what)
    if a.shape != (n,):
        raise ValueError('%s: %r: expected %d numbers' % (what, x, n))
    return (c.c_double * n)(*a)


def _given(x: Axes, what):
    """Where 0 would be taken for what is not given."""
    x = _three(x, what)
    if 0 in tuple(x):
        raise Error(2, 'the %s 0 is not positive' % what)
    return x


def _index(words, word, what):
    if word not in words:
        raise Error(2, '%s: %r is not one of %s' % (what, word, ', '.join(words)))
    return words.index(word)


class Image:
    """A volume: data, float32 [x, y, z], HU unless meta["quantity"] says otherwise; affine, float64 [4, 4], of voxel
    indices to mm, RAS+; meta, texts by keys. An array that is float32 and of Fortran order is not copied."""

    def __init__(self, data, affine=None, meta: Optional[Dict[str, str]] = None):
        self.data = _array(data, np.float32)
        self.affine = np.eye(4) if affine is None else _array(affine, float).copy()
        self.meta = dict(meta or {})
        self.report: Dict[str, Any] = {}  #: of superres: what was done
        self.error: Optional[Image] = None  #: of superres(error=True): the predicted error, HU
        if self.data.ndim != 3 or self.affine.shape != (4, 4):
            raise Error(2, 'an image has three axes and an affine of 4 x 4')
        if not np.array_equal(self.affine[3], [0, 0, 0, 1]):
            raise Error(2, 'the last row of an affine is 0 0 0 1, not %s' % ' '.join('%g' % x for x in self.affine[3]))

    @classmethod
    def of(cls, x, log=None, units: Optional[str] = None) -> 'Image':
        """An Image, the name of a file (as read has it), an image of nibabel, or an array."""
        if isinstance(x, cls):
            return x
        if isinstance(x, (str, bytes, os.PathLike)):
            return read(x, log, units)
        if isinstance(x, (Projections, Gaussians)):
            raise TypeError('expected a volume, not %s' % type(x).__name__)
        if hasattr(x, 'affine') and hasattr(x, 'dataobj'):
            data, units = np.asanyarray(x.dataobj), getattr(getattr(x, 'header', None), 'get_xyzt_units', lambda: ('mm', ''))()[0]
            mm = {'meter': 1e3, 'micron': 1e-3}.get(units, 1)
            three = (data.shape + (1,))[:3]  # as read has them
            return cls(data.reshape(three) if data.size == np.prod(three) else data, np.diag([mm, mm, mm, 1]) @ x.affine)
        return cls(x)

    def nibabel(self):
        """As nibabel.Nifti1Image."""
        import nibabel
        return nibabel.Nifti1Image(np.asarray(self.data), self.affine)

    @property
    def spacing(self):
        """Size of a voxel along each axis, mm."""
        return np.linalg.norm(self.affine[:3, :3], axis=0)

    def _handle(self) -> _Handle:
        now = Image(self.data, self.affine)  # they may be others than at first
        data = np.require(now.data, requirements=('F', 'ALIGNED'))
        v, e = abi.H(), abi.Error()
        _check(_lib.ctsr_volume_new(c.byref(v), c.byref((c.c_size_t * 3)(*data.shape)),
                                    c.byref((c.c_double * 12)(*now.affine[:3].ravel())),
                                    data.ctypes.data_as(c.POINTER(c.c_float)), c.byref(e)), e)
        h = _Handle(v, _lib.ctsr_volume_free, data)
        for key, value in self.meta.items():
            _check(_lib.ctsr_volume_set(v, _text(key, 'meta'), _text(value, 'meta %s' % key), c.byref(e)), e)
        return h

    @classmethod
    def _own(cls, v) -> 'Image':
        """What the library made. The array is its memory, which lives as long as the array."""
        h, n, a = _Handle(v, _lib.ctsr_volume_free), (c.c_size_t * 3)(), (c.c_double * 12)()
        p = _lib.ctsr_volume_data(v, c.byref(n), c.byref(a))
        flat = (c.c_float * (n[0] * n[1] * n[2])).from_address(c.addressof(p.contents))
        flat._keeps = h
        meta, i = {}, 0
        while (key := _lib.ctsr_volume_key(v, i)) is not None:
            meta[key.decode(errors='replace')] = _lib.ctsr_volume_get(v, key).decode(errors='replace')
            i += 1
        return cls(np.frombuffer(flat, np.float32).reshape(tuple(n), order='F'),
                   np.vstack([np.reshape(a, (3, 4)), [0, 0, 0, 1]]), meta)


class Operator(NamedTuple):
    """How a low-resolution CT is made of a high-resolution one."""
    factor: tuple      #: along each axis
    sigma: tuple       #: of the Gaussian blur, in fine voxels
    decimate: str      #: sinc (band-limited), point or mean
    noise: float       #: standard deviation, HU


def _operator(factor: Axes, sigma: Axes = 0, decimate='sinc', noise=0.):
    o = abi.Operator(c.sizeof(abi.Operator))
    o.factor, o.sigma, o.noise = _given(factor, 'factor'), _three(sigma, 'sigma'), noise
    if np.size(sigma) == 1 and np.any(sigma):  # of the axes that are reduced
        if all(f == 1 for f in o.factor):
            raise Error(2, 'sigma: one number is of the axes that are reduced, and none is: expected three')
        o.sigma = abi.D3(*[s if f != 1 else 0 for f, s in zip(o.factor, o.sigma)])
    o.decimate = _index(_DECIMATE, decimate, 'decimate')
    return o


def version() -> str:
    """Of the library."""
    return _lib.ctsr_version().decode()


_FOREIGN = 'of which ct-convert makes a volume'  # the library, of a file of DICOM


def _is_many(path):
    """A folder, an archive, or what is called DICOM. Of a pipe the name alone says it."""
    if os.path.isdir(path) or path.lower().endswith(('.dcm', '.zip', '.tar')):
        return True
    try:
        if not os.path.isfile(path):
            return False
        with open(path, 'rb') as f:
            return f.read(4) == b'PK\3\4' or tarfile.is_tarfile(path)
    except OSError:  # the library says why
        return False


def _convert(path, log, units, series) -> Image:
    with tempfile.TemporaryDirectory() as t:
        made = os.path.join(t, 'dicom.nii')
        options = ['--%s=%s' % (key, x) for key, x in (('units', units), ('series', series)) if x is not None]
        try:
            p = subprocess.run(['ct-convert', *options, '--', path, made], stderr=subprocess.PIPE, text=True)
        except FileNotFoundError:
            raise Error(1, '%s: DICOM is read by the command ct-convert, which is not installed: install ctsr and ctsr-dicom, '
                        'or convert it to NIfTI first' % path) from None
        if p.returncode:
            raise Error(p.returncode, p.stderr.strip())
        for line in p.stderr.split('\n'):
            if ': warning: ' in line:
                (log or warnings.warn)(line.split(': warning: ', 1)[1])
        return read(made)


def read(path, log=None, units: Optional[str] = None, series: Optional[str] = None) -> Image:
    """NIfTI, with what a JSON sidecar beside it says of the scanner; NRRD or MetaImage; DICOM, of a folder, a file or an archive,
    by the command ct-convert, with these units and of this series. Warnings go to log, or become those of Python."""
    path, v = os.fsdecode(_path(path)), abi.H()
    if _is_many(path):
        return _convert(path, log, units, series)
    try:
        _Call().go(_lib.ctsr_volume_read, c.byref(v), _path(path), _lib.ctsr_formats_all(), made=[v], daemon=True)
        image = Image._own(v)
    except Error as e:
        if _FOREIGN not in str(e):
            raise
        return _convert(path, log, units, series)
    if 'nifti.doubt' in image.meta:
        (log or warnings.warn)('%s: %s' % (path, image.meta['nifti.doubt']))
    return image


def write(image, path, overwrite=False, threads=0) -> None:
    """By the end of the name: .nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd. int16 if all voxels are whole numbers that fit, else float32."""
    end = os.fsdecode(path).lower()
    form = _lib.ctsr_nrrd if end.endswith(('.nrrd', '.nhdr')) else \
        _lib.ctsr_metaimage if end.endswith(('.mha', '.mhd')) else _lib.ctsr_nifti
    h = Image.of(image)._handle()
    _Call(threads, overwrite=overwrite).run(_lib.ctsr_volume_write, h, _path(path), form())


def degrade(image, factor: Axes, sigma: Optional[Axes] = None, decimate: Optional[str] = None, noise: Optional[float] = None, seed=0, threads=0,
            progress: Optional[Progress] = None, history: Optional[str] = None, protocol: Optional[str] = None,
            profile=None, slice_thickness: Optional[float] = None, clip: Optional[Sequence[float]] = None) -> Image:
    """The low-resolution CT, as ct-degrade: a Gaussian of `sigma` fine voxels, then the sampling, then `noise` HU; by default 0,
    sinc and 0, where ct-degrade takes P1.

    sigma     one number is of the axes that are reduced
    protocol  P1, P2, P3, P1n, P3n or release, in whose place are sigma, decimate and noise that are said
    profile   of slices: gaussian, box, triangle, trapezoid, or pairs of mm and weight. slice_thickness: of slices, mm
    clip      LO, HI in HU, first"""
    out, h = abi.H(), Image.of(image)._handle()
    said = [x is not None for x in (sigma, decimate, noise)]
    o = _operator(factor, sigma if said[0] else 0, decimate if said[1] else 'sinc', noise if said[2] else 0)
    o.said = sum(1 << i for i in range(3) if said[i])
    o.protocol = _text(protocol, 'protocol') if protocol is not None else None
    if profile is not None:
        o.profile = _text(profile if isinstance(profile, str) else ''.join('%r %r\n' % (float(a), float(b)) for a, b in profile), 'profile')
    if slice_thickness is not None:
        o.slice_thickness = _given(slice_thickness, 'slice_thickness')[0]
    if clip is not None:
        o.clip = _some(clip, 2, 'clip')
        if not any(o.clip):
            raise Error(2, 'the clip 0 to 0 is none')
    _Call(threads, progress, seed=seed, history=history).run(_lib.ctsr_degrade, c.byref(out), h, c.byref(o), made=[out])
    return Image._own(out)


def estimate_operator(image, factor: Axes, threads=0, progress: Optional[Progress] = None) -> Operator:
    """Measured on a low-resolution CT that is to be refined `factor` times: its blur on edges, its noise where it is
    flat."""
    h, o = Image.of(image)._handle(), _operator(factor)
    _Call(threads, progress).run(_lib.ctsr_estimate_operator, c.byref(o), h)
    return Operator(tuple(o.factor), tuple(o.sigma), _DECIMATE[o.decimate], o.noise)


def superres(image, factor: Optional[Axes] = None, spacing: Optional[Axes] = None, quality='balanced',
             sigma: Optional[Axes] = None, decimate: Optional[str] = None, noise: Optional[float] = None,
             profile=None, slice_thickness: Optional[float] = None, method: Optional[str] = None,
             estimate=True, prior=None, memory: float = 0, error=False, threads=0,
             progress: Optional[Progress] = None, log=None, history: Optional[str] = None, denoise: float = 0,
             trust=False, units: Optional[str] = None) -> Image:
    """The CT on a finer grid, over the same field of view, as ct-sr; result.report says what was done.

    factor    times finer along each axis, or one number; default: what the metadata say, else thick slices to the
              voxel size in plane, else 2. spacing: size of the new voxels instead, mm
    quality   draft inverts blur and sampling; fast and balanced also add predicted detail
    sigma, decimate, noise   how the scan was made, if known: in new voxels, as in Operator, in HU
    profile, slice_thickness   of the slices: gaussian, box, triangle, trapezoid or the name of a file; mm
    method    in place of that of the quality: as in upsample
    estimate  measure what is not known of that, as ct-sr does; False: such a scan is an error, or with draft is interpolated
    prior     file of the slice prior; default: the installed one
    memory    bytes that the call may use; 0: what is free
    error     result.error is the predicted error, one standard deviation of each voxel, HU
    denoise   share of the noise to take off, 0 (the scan's own stays) to 1
    trust     take the estimate as measured: no bounds on what may be softness of the scan itself
    units     of the values: auto (default: what cannot be HU is refused), hu or other, such as micro-CT"""
    _index(_QUALITIES, quality, 'quality')
    return _refine('superres', image, factor, spacing, method or ('auto' if quality == 'draft' else 'prior'),
                   quality if quality in _PRESETS else 'balanced', sigma, decimate, noise, profile, slice_thickness, estimate, prior,
                   memory, error, None, 300, .1, threads, progress, log, history, denoise, trust, units)


def upsample(image, factor: Optional[Axes] = None, spacing: Optional[Axes] = None, method='auto', preset='balanced',
             sigma: Optional[Axes] = None, decimate: Optional[str] = None, noise: Optional[float] = None,
             profile=None, slice_thickness: Optional[float] = None, estimate=False, prior=None, memory: float = 0,
             error=False, start=None, iterations=300, tolerance: float = .1, threads=0,
             progress: Optional[Progress] = None, log=None, history: Optional[str] = None,
             denoise: float = 0, trust=False, units: Optional[str] = None) -> Image:
    """The CT on a finer grid by any method, as ct-upsample: what superres does, with the defaults of that command, and nothing is
    measured unless `estimate`. method: auto, linear, cubic, bspline, lanczos, sinc, dc, tv, htv, prior or arssr, as in
    ct-upsample(1). preset: of the prior, fast or balanced. start: begin with this volume, on the grid of the result; iterations,
    tolerance (HU): at most so many of tv and htv, which stop when one moves less. arssr needs its network as `prior`."""
    return _refine('upsample', image, factor, spacing, method, preset, sigma, decimate, noise, profile, slice_thickness, estimate,
                   prior, memory, error, start, iterations, tolerance, threads, progress, log, history, denoise, trust, units)


def _refine(name, image, factor, spacing, method, preset, sigma, decimate, noise, profile, slice_thickness, estimate, prior, memory,
            error, start, iterations, tolerance, threads, progress, log, history, denoise, trust, units):
    o, r = abi.Options(), abi.Report(c.sizeof(abi.Report))
    getattr(_lib, 'ctsr_%s_options_init' % name)(c.byref(o), c.sizeof(o))
    o.iterations, o.tolerance = _whole(iterations, 31, 'iterations'), tolerance
    o.method, o.preset = _index(_METHODS, method, 'method'), _index(_PRESETS, preset, 'preset')
    if factor is not None:
        o.factor = _given(factor, 'factor')
    if spacing is not None:
        o.spacing = _given(spacing, 'spacing')
    if sigma is not None:
        o.sigma = _three(sigma, 'sigma')
        if np.size(sigma) == 1:  # of the axes that are refined
            o.sigma = abi.D3(o.sigma[0], math.nan, math.nan)
    if decimate is not None:
        o.decimate = _index(_DECIMATE, decimate, 'decimate')
    if slice_thickness is not None:
        o.slice_thickness = _real(slice_thickness, 'slice_thickness')
    o.profile = _path(profile) if profile is not None else None
    o.noise = math.nan if noise is None else _real(noise, 'noise')
    o.estimate, o.memory, o.denoise, o.trust = bool(estimate), memory, denoise, bool(trust)
    o.prior_file = _path(prior) if prior is not None else None
    o.units = _text(units, 'units') if units is not None else None
    out, std, h = abi.H(), abi.H(), Image.of(image, log, units)._handle()
    begin = Image.of(start)._handle() if start is not None else None
    o.start = begin.p if begin else None
    h.keeps += (begin,)
    _Call(threads, progress, log, history=history).run(
        getattr(_lib, 'ctsr_' + name), c.byref(out), c.byref(std) if error else None, c.byref(r), h, c.byref(o),
        made=[out, std])
    made = Image._own(out)
    made.error = Image._own(std) if error else None
    made.report = {'method': _METHODS[r.method], 'prior': bool(r.prior), 'residual': r.residual, 'added': r.added,
                   'off': r.off, 'back': r.back, 'iterations': r.iterations, 'slabs': r.slabs, 'why_not': r.why_not.decode(),
                   'operator': Operator(tuple(r.factor), tuple(r.sigma), _DECIMATE[r.decimate], r.noise)}
    return made


def _fixed(x):
    """An array that shows what the library has, and cannot change it."""
    a = np.array(x)
    a.flags.writeable = False
    return a


def _rays(x, what='projections') -> _Handle:
    if not isinstance(x, Projections):
        raise TypeError('%s: expected Projections, as project and read_projections make them, not %s' % (what, type(x).__name__))
    return x._h


class Projections:
    """X-ray projections: data, float32 [view, row, column], density x mm; views, for each view its "source", "centre"
    of the detector, and steps "u" between columns and "v" between rows, mm. Pixels can be changed, views cannot."""

    def __init__(self, handle: _Handle):
        n, e, view = (c.c_size_t * 3)(), abi.Error(), abi.View()
        p = _lib.ctsr_projections_data(handle.p, c.byref(n))
        flat = (c.c_float * (n[0] * n[1] * n[2])).from_address(c.addressof(p.contents))
        flat._keeps = handle
        self._h, self.views = handle, []
        self.deviation: Optional['Projections'] = None  #: of ddnm: of the samples
        self._data = np.frombuffer(flat, np.float32).reshape(tuple(n))
        for i in range(n[0]):
            _check(_lib.ctsr_projections_view(c.byref(view), handle.p, i, c.byref(e)), e)
            self.views.append({k: _fixed(getattr(view, k)) for k, _ in abi.View._fields_})

    @property
    def data(self) -> np.ndarray:
        return self._data

    @data.setter
    def data(self, x):  # the pixels are memory of the library
        x = _array(x, np.float32)
        if x.shape != self._data.shape:
            raise ValueError('data: %r pixels, expected %r' % (x.shape, self._data.shape))
        self._data[...] = x

    @classmethod
    def new(cls, views: Sequence[Dict[str, Sequence[float]]], rows: int, columns: int, beam='cone') -> 'Projections':
        """All zero, of a detector that moved in any way."""
        p, e = abi.H(), abi.Error()
        v = (abi.View * len(views))(*[abi.View(*[_some(x[k], 3, k) for k, _ in abi.View._fields_]) for x in views])
        _check(_lib.ctsr_projections_new(c.byref(p), _index(_BEAMS, beam, 'beam'), len(views), _whole(rows, 64, 'rows'),
                                         _whole(columns, 64, 'columns'), v,
                                         c.byref(e)), e)
        return cls(_Handle(p, _lib.ctsr_projections_free))


def project(image, beam='cone', threads=0, progress: Optional[Progress] = None, pixel='point', method='siddon', seed=0,
            log=None, **geometry) -> Projections:
    """Line integrals, as ct-project. geometry: views, columns, rows, arc, start (degrees), source_to_centre,
    source_to_detector (mm), pitch, offset (mm, two numbers), centre (mm), window (HU), overshoot (of a volume that was
    clipped before it was reduced: keep it), coarsen (pixels so many times larger, each of which is a point, mean or
    sinc of the small ones: pixel), photons, electronic, water (noise); defaults: the published scan. method: siddon
    (exact) or joseph (linear). Without pitch the pixels fill the detector of ct-project, however many they are."""
    h, g, p, e = Image.of(image, log)._handle(), abi.Geometry(), abi.H(), abi.Error()
    if beam == 'fan' and geometry.get('rows', 1) != 1:
        raise Error(5, 'a fan has one detector row, not %r' % geometry['rows'])
    if 'coarsen' in geometry and not geometry['coarsen']:
        raise Error(2, 'the coarsen 0 is not positive')
    _check(_lib.ctsr_geometry_init(c.byref(g), c.sizeof(g), h.p, c.byref(e)), e)
    g.beam, g.pitch = _index(_BEAMS, beam, 'beam'), (c.c_double * 2)()
    g.pixel, g.method = _index(_PIXELS, pixel, 'pixel'), _index(_INTEGRALS, method, 'method')
    for key, value in geometry.items():
        if key == 'size' or key not in dict(abi.Geometry._fields_):
            raise Error(2, 'project: no such geometry: %s' % key)
        now = getattr(g, key)
        if key in ('views', 'columns', 'rows', 'coarsen'):
            value = _whole(value, 64, key)
        elif key == 'overshoot':
            value = bool(value)
        setattr(g, key, _some(value, len(now), key) if hasattr(now, '__len__') else value)
    _Call(threads, progress, log, seed=seed).run(_lib.ctsr_project, c.byref(p), h, c.byref(g), made=[p], free=_lib.ctsr_projections_free)
    return Projections(_Handle(p, _lib.ctsr_projections_free))


def ddnm(projections: Projections, prior=None, sampler: Optional[str] = None, factor=0, steps=0, samples=0, label=-1,
         pixel: Optional[str] = None, eta: Optional[float] = None, sigma_y: Optional[float] = None, norm: float = 0,
         init: Optional[Projections] = None, start=-1, travel: Sequence[int] = (0, 0), guidance: float = 2000,
         iterations=100, rate: float = 1e-3, frozen=False, first_channel=False, seed=0, threads=0,
         progress: Optional[Progress] = None, log=None, history: Optional[str] = None) -> Projections:
    """Projections on a finer detector, by a diffusion prior that is held to them, as ct-ddnm; those of a refined CT,
    which are as fine, with the detail of the prior. result.deviation is the standard deviation of the samples, if
    there are at least 2. The result carries it too, and fit weights pixels by it.

    prior     file of a diffusion prior or network of super-resolution; default: the installed prior
    sampler   ddnm, ddnm+, simple, ddim, ddpm, dpm-solver++, gdp, bird, once or none; default: ddnm+, and once of a network
    factor    times finer; 0: what the projections say they were coarsened by, else 4
    steps     calls of the network a chain; 0: as published, 1 of a refined CT
    samples   mean of so many; 0: 1, and 4 of a refined CT
    pixel     what a pixel measures, mean or sinc; default: what the projections say
    init      begin from these, noised to timestep `start` of 1000; -1: 60, and 5 of a refined CT
    The others are the options of ct-ddnm(1) of that name."""
    o, out, std = abi.Ddnm(), abi.H(), abi.H()
    _lib.ctsr_ddnm_options_init(c.byref(o), c.sizeof(o))
    o.sampler = _text(sampler, 'sampler') if sampler is not None else None
    o.pixel = _index(_PIXELS, pixel, 'pixel') if pixel is not None else -1
    o.prior_file = _path(prior) if prior is not None else None
    o.factor, o.steps, o.samples = _whole(factor, 31, 'factor'), _whole(steps, 31, 'steps'), _whole(samples, 31, 'samples')
    o.label, o.start = [-1 if x == -1 else _whole(x, 31, what) for x, what in ((label, 'label'), (start, 'start'))]
    o.norm, o.guidance, o.rate = norm, guidance, rate
    o.iterations, o.frozen, o.first_channel = _whole(iterations, 31, 'iterations'), bool(frozen), bool(first_channel)
    if len(travel) != 2:
        raise ValueError('travel: %r: expected 2 numbers' % (travel,))
    o.travel = (c.c_size_t * 2)(*[_whole(x, 31, 'travel') for x in travel])
    o.eta = o.eta if eta is None else _real(eta, 'eta')
    o.sigma_y = o.sigma_y if sigma_y is None else _real(sigma_y, 'sigma_y')
    o.init, o.keeps = _rays(init, 'init').p if init is not None else None, init  # as long as the call, which may outlive Ctrl-C
    _Call(threads, progress, log, seed, history=history).run(
        _lib.ctsr_ddnm, c.byref(out), c.byref(std) if samples != 1 else None, _rays(projections), c.byref(o), made=[out, std],
        free=_lib.ctsr_projections_free)
    made = Projections(_Handle(out, _lib.ctsr_projections_free))
    made.deviation = Projections(_Handle(std, _lib.ctsr_projections_free)) if std else None
    return made


def read_projections(path) -> Projections:
    """OpenEXR, one part a view."""
    p, free = abi.H(), _lib.ctsr_projections_free
    _Call().go(_lib.ctsr_projections_read, c.byref(p), _path(path), made=[p], free=free, daemon=True)
    return Projections(_Handle(p, _lib.ctsr_projections_free))


def write_projections(p: Projections, path, overwrite=False, threads=0) -> None:
    """OpenEXR, one part a view."""
    _Call(threads, overwrite=overwrite).run(_lib.ctsr_projections_write, _rays(p), _path(path))


def backproject(p: Projections, like, threads=0, progress: Optional[Progress] = None) -> Image:
    """The adjoint of project, without its window, on the grid of `like`."""
    out, h = abi.H(), Image.of(like)._handle()
    _Call(threads, progress).run(_lib.ctsr_backproject, c.byref(out), _rays(p), h, made=[out])
    return Image._own(out)


def reconstruct(p: Projections, like=None, method='auto', filter: Optional[str] = None, cutoff: float = 0, parker=False,
                iterations=0, tolerance: float = 0, nonnegative=False, integral='siddon', tv: float = 10, density=False, voxels=0,
                window: Optional[Sequence[float]] = None, threads=0, progress: Optional[Progress] = None, log=None,
                history: Optional[str] = None) -> Image:
    """A volume, HU, as ct-fdk, where methods and filters are explained.

    like      its grid; default: that of the projected volume, or the cube that all views see
    method    auto, fdk, fbp; sirt, cgls or tv, which iterate: iterations (0: 30 of cgls, else 100), tolerance, nonnegative,
              integral (siddon or joseph), tv (weight, HU)
    filter    of the first three (ram-lak), with cutoff (0: what the voxels can show) and parker (of a short scan)
    density   the result is not HU. voxels: without `like`, along the longest side
    window    HU of density 0 and 1; default: what the projections say"""
    o, out, h = abi.Reconstruct(), abi.H(), Image.of(like)._handle() if like is not None else None
    _lib.ctsr_reconstruct_options_init(c.byref(o), c.sizeof(o))
    o.method, o.filter = _text(method, 'method'), _text(filter, 'filter') if filter is not None else None
    o.iterations, o.voxels = _whole(iterations, 31, 'iterations'), _whole(voxels, 31, 'voxels')
    o.cutoff, o.tolerance, o.tv = cutoff, tolerance, tv
    o.parker, o.nonnegative, o.density = bool(parker), bool(nonnegative), bool(density)
    o.integral = _index(_INTEGRALS, integral, 'integral')
    if window is not None:
        o.window = _some(window, 2, 'window')
    _Call(threads, progress, log, history=history).run(
        _lib.ctsr_reconstruct, c.byref(out), _rays(p), h, c.byref(o), made=[out])
    return Image._own(out)


def fdk(p: Projections, like=None, threads=0, progress: Optional[Progress] = None, log=None) -> Image:
    """Filtered backprojection, HU: reconstruct with its defaults."""
    return reconstruct(p, like, threads=threads, progress=progress, log=log)


def paper(image, factor=0, views=0, iterations=0, gaussians=0, prior=None, release=False, seed=0, threads=0,
          progress: Optional[Progress] = None, log=None, history: Optional[str] = None) -> Image:
    """The published method, as ct-sr --paper, or with `release` as its authors' programs. 0 stands for what is published.

    factor    times finer along each axis; 0: what the metadata say, else 4
    views     projections. iterations, gaussians: of the fit
    prior     file of a diffusion prior of projections; default: the installed one"""
    o, out, h = abi.Paper(c.sizeof(abi.Paper)), abi.H(), Image.of(image, log)._handle()
    o.factor, o.views = _whole(factor, 31, 'factor'), _whole(views, 31, 'views')
    o.iterations, o.gaussians = _whole(iterations, 31, 'iterations'), _whole(gaussians, 31, 'gaussians')
    o.prior_file, o.release = _path(prior) if prior is not None else None, bool(release)
    _Call(threads, progress, log, seed, history=history).run(_lib.ctsr_paper, c.byref(out), h, c.byref(o), made=[out])
    return Image._own(out)


class Gaussians:
    """A sum of signed 3-D Gaussians: position, sigma (mm) [n, 3], rotation (unit quaternions w, x, y, z) [n, 4], and
    density [n], of which density(x) = sum of density exp(-|R'(x - position)/sigma|^2 / 2). They cannot be changed."""

    def __init__(self, handle: _Handle):
        n = _lib.ctsr_gaussians_get(None, handle.p, 0, 0)
        raw = (abi.Gaussian * n)()
        _lib.ctsr_gaussians_get(raw, handle.p, 0, n)
        self._h, self._flat = handle, _fixed(np.frombuffer(raw, np.float64).reshape(n, 11) if n else np.empty((0, 11)))

    position = property(lambda self: self._flat[:, :3])
    sigma = property(lambda self: self._flat[:, 3:6])
    rotation = property(lambda self: self._flat[:, 6:10])
    density = property(lambda self: self._flat[:, 10])

    def __len__(self):
        return len(self.density)


def fit(projections: Projections, base, gaussians=0, max_gaussians=0, iterations=0, tolerance: float = 0, full=False,
        base_projections: Optional[Projections] = None, uncertainty: Optional[Projections] = None, lr=None, paper=False,
        seed=0, threads=0, progress: Optional[Progress] = None, log=None, history: Optional[str] = None) -> Gaussians:
    """Gaussians fitted to what projections have beyond those of a base volume, as ct-nabgs; with `full` to all of it.
    0 stands for the defaults of ct-nabgs: 50000 Gaussians, 500000 at most, 5000 iterations of one view each.

    base_projections  of the base, where they are known; uncertainty: standard deviation of each pixel, in place of what
              the projections carry
    lr        low-resolution CT that base and Gaussians together must reduce to
    paper     the published settings"""
    o, g, h = abi.Fit(c.sizeof(abi.Fit)), abi.H(), Image.of(base)._handle()
    o.gaussians, o.max_gaussians = _whole(gaussians, 31, 'gaussians'), _whole(max_gaussians, 31, 'max_gaussians')
    o.iterations, o.tolerance, o.full, o.paper = _whole(iterations, 31, 'iterations'), tolerance, bool(full), bool(paper)
    low = Image.of(lr)._handle() if lr is not None else None
    o.lr = low.p if low else None
    o.base_projections = _rays(base_projections, 'base_projections').p if base_projections is not None else None
    o.uncertainty = _rays(uncertainty, 'uncertainty').p if uncertainty is not None else None
    h.keeps += (low, base_projections, uncertainty)
    _Call(threads, progress, log, seed, history=history).run(
        _lib.ctsr_gaussians_fit, c.byref(g), _rays(projections), h, c.byref(o), made=[g], free=_lib.ctsr_gaussians_free)
    return Gaussians(_Handle(g, _lib.ctsr_gaussians_free))


def read_gaussians(path) -> Gaussians:
    """PLY."""
    g, free = abi.H(), _lib.ctsr_gaussians_free
    _Call().go(_lib.ctsr_gaussians_read, c.byref(g), _path(path), made=[g], free=free, daemon=True)
    return Gaussians(_Handle(g, free))


def write_gaussians(g: Gaussians, path, overwrite=False, threads=0) -> None:
    """PLY, as viewers of 3-D Gaussian splatting read it."""
    _Call(threads, overwrite=overwrite).run(_lib.ctsr_gaussians_write, g._h, _path(path))


def compose(base, residual, gain: float = 1, floor: Optional[float] = None, spacing: Optional[float] = None,
            window: Optional[Sequence[float]] = None, lr=None, threads=0, progress: Optional[Progress] = None, log=None,
            history: Optional[str] = None) -> Image:
    """A base volume and a residual, Gaussians or an image in HU, make the CT, as ct-compose.

    gain      times the residual. floor: least value, HU; default: LO of the window
    spacing   render Gaussians on voxels of so many mm
    window    HU of density 0 and 1; default: what the data say
    lr        low-resolution CT that the result is made to agree with"""
    o, out, h = abi.Compose(), abi.H(), Image.of(base)._handle()
    _lib.ctsr_compose_options_init(c.byref(o), c.sizeof(o))
    o.gain = gain
    o.floor = o.floor if floor is None else _real(floor, 'floor')
    o.spacing = o.spacing if spacing is None else _real(spacing, 'spacing')
    if window is not None:
        o.window = _some(window, 2, 'window')
    g = residual._h if isinstance(residual, Gaussians) else None
    added, low = [Image.of(x)._handle() if x is not None else None for x in (None if g else residual, lr)]
    o.residual, o.lr = added.p if added else None, low.p if low else None
    h.keeps += (added, low)
    _Call(threads, progress, log, history=history).run(
        _lib.ctsr_compose, c.byref(out), None, h, g, c.byref(o), made=[out])
    return Image._own(out)


def _numbers(x):
    return {k: list(v) if hasattr(v, '__len__') else v for k, _ in x._fields_[1:] for v in [getattr(x, k)]}


def metrics(reference, test, mask=None, window: Optional[Sequence[float]] = None, threads=0, value_range: float = 0) -> Dict[str, Any]:
    """How far a volume is from a reference on the same grid, or Projections from others of the same geometry, as ct-metrics:
    psnr (dB), ssim, mae, rmse, bias, max (HU; density mm), gradient (HU/mm, three axes); of projections also view_psnr and
    view_ssim, of each.

    window       of volumes: LO, HI in HU of PSNR and SSIM; default: -512 to 3071
    mask         of volumes: only where it is not 0
    value_range  of projections: data range; default: the largest pixel of the reference"""
    m = abi.Metrics(c.sizeof(abi.Metrics))
    rays = isinstance(reference, Projections)
    if value_range and not rays or rays and (mask is not None or window is not None):
        raise Error(2, 'metrics: mask and window are of volumes, value_range is of projections')
    if rays:
        each = [(c.c_double * reference.data.shape[0])() for _ in range(2)]
        _Call(threads).run(_lib.ctsr_compare_projections, c.byref(m), *each, _rays(reference), _rays(test, 'test'), value_range)
        return dict(_numbers(m), view_psnr=list(each[0]), view_ssim=list(each[1]))
    a, b = Image.of(reference)._handle(), Image.of(test)._handle()
    k = Image.of(mask)._handle() if mask is not None else None
    w = c.byref(_some(window, 2, 'window')) if window is not None else None
    _Call(threads).run(_lib.ctsr_compare, c.byref(m), a, b, k, w)
    return _numbers(m)


def consistency(fine, coarse, operator: Optional[Operator] = None, threads=0) -> Dict[str, float]:
    """max, p95, rms, mean (HU) of `fine`, degraded again, minus `coarse`. operator: default what
    `coarse` says, else what superres recorded in `fine`."""
    a, b = Image.of(fine)._handle(), Image.of(coarse)._handle()
    m = abi.Consistency(c.sizeof(abi.Consistency))
    o = c.byref(_operator(*operator)) if operator is not None else None
    _Call(threads).run(_lib.ctsr_check_consistency, c.byref(m), a, b, o)
    return _numbers(m)
