# SPDX-License-Identifier: Apache-2.0
"""The ABI of libctsr.so.0, as ctsr.h declares it. Nothing here is for users."""
import ctypes as c
import os

Error = type('Error', (c.Structure,), {'_fields_': [('code', c.c_int), ('message', c.c_char * 508)]})
PROGRESS = c.CFUNCTYPE(c.c_int, c.c_void_p, c.c_char_p, c.c_size_t, c.c_size_t)
LOG = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p)
D3, P = c.c_double * 3, c.POINTER


def _struct(name, *fields):
    return type(name, (c.Structure,), {'_fields_': [('size', c.c_size_t)] + list(fields)})


Context = _struct('Context', ('threads', c.c_uint), ('overwrite', c.c_int), ('seed', c.c_uint64), ('verbose', c.c_int),
                  ('progress', PROGRESS), ('log', LOG), ('user', c.c_void_p), ('history', c.c_char_p))
Operator = _struct('Operator', ('factor', D3), ('sigma', D3), ('decimate', c.c_int), ('noise', c.c_double),
                   ('protocol', c.c_char_p), ('profile', c.c_char_p), ('slice_thickness', c.c_double), ('clip', c.c_double * 2),
                   ('said', c.c_int))
Paper = _struct('Paper', ('factor', c.c_size_t), ('views', c.c_size_t), ('iterations', c.c_size_t), ('gaussians', c.c_size_t),
                ('prior_file', c.c_char_p), ('release', c.c_int))
Options = _struct('Options', ('method', c.c_int), ('preset', c.c_int), ('factor', D3), ('spacing', D3), ('sigma', D3),
                  ('decimate', c.c_int), ('noise', c.c_double), ('estimate', c.c_int), ('prior_file', c.c_char_p),
                  ('memory', c.c_double), ('iterations', c.c_int), ('tolerance', c.c_double), ('start', c.c_void_p),
                  ('slice_thickness', c.c_double), ('profile', c.c_char_p), ('denoise', c.c_double), ('trust', c.c_int),
                  ('units', c.c_char_p))
Report = _struct('Report', ('method', c.c_int), ('prior', c.c_int), ('factor', D3), ('sigma', D3), ('decimate', c.c_int),
                 ('noise', c.c_double), ('residual', c.c_double), ('added', c.c_double), ('iterations', c.c_size_t),
                 ('slabs', c.c_size_t), ('why_not', c.c_char * 160), ('off', c.c_double), ('back', c.c_double))
Geometry = _struct('Geometry', ('beam', c.c_int), ('views', c.c_size_t), ('columns', c.c_size_t), ('rows', c.c_size_t),
                   ('arc', c.c_double), ('start', c.c_double), ('source_to_centre', c.c_double),
                   ('source_to_detector', c.c_double), ('pitch', c.c_double * 2), ('offset', c.c_double * 2),
                   ('centre', D3), ('window', c.c_double * 2), ('overshoot', c.c_int), ('coarsen', c.c_size_t),
                   ('pixel', c.c_int), ('method', c.c_int), ('photons', c.c_double), ('electronic', c.c_double),
                   ('water', c.c_double))
Fit = _struct('Fit', ('gaussians', c.c_size_t), ('max_gaussians', c.c_size_t), ('iterations', c.c_size_t),
              ('tolerance', c.c_double), ('full', c.c_int), ('base_projections', c.c_void_p), ('uncertainty', c.c_void_p),
              ('lr', c.c_void_p), ('paper', c.c_int))
Compose = _struct('Compose', ('gain', c.c_double), ('floor', c.c_double), ('spacing', c.c_double),
                  ('window', c.c_double * 2), ('residual', c.c_void_p), ('lr', c.c_void_p))
Ddnm = _struct('Ddnm', ('sampler', c.c_char_p), ('factor', c.c_size_t), ('prior_file', c.c_char_p), ('steps', c.c_size_t),
               ('samples', c.c_size_t), ('label', c.c_int), ('pixel', c.c_int), ('eta', c.c_double),
               ('sigma_y', c.c_double), ('norm', c.c_double), ('init', c.c_void_p), ('start', c.c_int),
               ('travel', c.c_size_t * 2), ('guidance', c.c_double), ('iterations', c.c_size_t), ('rate', c.c_double),
               ('frozen', c.c_int), ('first_channel', c.c_int))
Reconstruct = _struct('Reconstruct', ('method', c.c_char_p), ('filter', c.c_char_p), ('cutoff', c.c_double), ('parker', c.c_int),
                      ('iterations', c.c_size_t), ('tolerance', c.c_double), ('nonnegative', c.c_int), ('density', c.c_int),
                      ('integral', c.c_int), ('tv', c.c_double), ('voxels', c.c_size_t), ('window', c.c_double * 2))
Metrics = _struct('Metrics', ('psnr', c.c_double), ('ssim', c.c_double), ('mae', c.c_double), ('rmse', c.c_double),
                  ('bias', c.c_double), ('max', c.c_double), ('gradient', D3))
Consistency = _struct('Consistency', ('max', c.c_double), ('p95', c.c_double), ('rms', c.c_double), ('mean', c.c_double))
Gaussian = type('Gaussian', (c.Structure,), {'_fields_': [('position', D3), ('sigma', D3), ('rotation', c.c_double * 4),
                                                          ('density', c.c_double)]})
View = type('View', (c.Structure,), {'_fields_': [(n, D3) for n in ('source', 'centre', 'u', 'v')]})

H = c.c_void_p  # a volume, projections, Gaussians, a format
_E, _C = P(Error), P(Context)
_FLOATS = P(c.c_float)
_SIGNATURES = {  # result, arguments
    'version': (c.c_char_p,),
    'volume_new': (c.c_int, P(H), P(c.c_size_t * 3), P(c.c_double * 12), _FLOATS, _E),
    'volume_free': (None, H),
    'volume_data': (_FLOATS, H, P(c.c_size_t * 3), P(c.c_double * 12)),
    'volume_get': (c.c_char_p, H, c.c_char_p),
    'volume_key': (c.c_char_p, H, c.c_size_t),
    'volume_set': (c.c_int, H, c.c_char_p, c.c_char_p, _E),
    'nifti': (H,), 'nrrd': (H,), 'metaimage': (H,),
    'formats_all': (H,),
    'volume_read': (c.c_int, P(H), c.c_char_p, H, _E),
    'volume_write': (c.c_int, H, c.c_char_p, H, _C, _E),
    'estimate_operator': (c.c_int, P(Operator), H, _C, _E),
    'degrade': (c.c_int, P(H), H, P(Operator), _C, _E),
    'superres_options_init': (None, P(Options), c.c_size_t),
    'superres': (c.c_int, P(H), P(H), P(Report), H, P(Options), _C, _E),
    'geometry_init': (c.c_int, P(Geometry), c.c_size_t, H, _E),
    'projections_new': (c.c_int, P(H), c.c_int, c.c_size_t, c.c_size_t, c.c_size_t, P(View), _E),
    'projections_free': (None, H),
    'projections_read': (c.c_int, P(H), c.c_char_p, _E),
    'projections_write': (c.c_int, H, c.c_char_p, _C, _E),
    'projections_data': (_FLOATS, H, P(c.c_size_t * 3)),
    'projections_view': (c.c_int, P(View), H, c.c_size_t, _E),
    'project': (c.c_int, P(H), H, P(Geometry), _C, _E),
    'backproject': (c.c_int, P(H), H, H, _C, _E),
    'reconstruct_options_init': (None, P(Reconstruct), c.c_size_t),
    'reconstruct': (c.c_int, P(H), H, H, P(Reconstruct), _C, _E),
    'fdk': (c.c_int, P(H), H, H, _C, _E),
    'ddnm_options_init': (None, P(Ddnm), c.c_size_t),
    'ddnm': (c.c_int, P(H), P(H), H, P(Ddnm), _C, _E),
    'paper': (c.c_int, P(H), H, P(Paper), _C, _E),
    'upsample_options_init': (None, P(Options), c.c_size_t),
    'upsample': (c.c_int, P(H), P(H), P(Report), H, P(Options), _C, _E),
    'gaussians_fit': (c.c_int, P(H), H, H, P(Fit), _C, _E),
    'gaussians_free': (None, H),
    'gaussians_read': (c.c_int, P(H), c.c_char_p, _E),
    'gaussians_write': (c.c_int, H, c.c_char_p, _C, _E),
    'gaussians_get': (c.c_size_t, P(Gaussian), H, c.c_size_t, c.c_size_t),
    'compose_options_init': (None, P(Compose), c.c_size_t),
    'compose': (c.c_int, P(H), P(H), H, H, P(Compose), _C, _E),
    'compare': (c.c_int, P(Metrics), H, H, H, P(c.c_double * 2), _C, _E),
    'compare_projections': (c.c_int, P(Metrics), P(c.c_double), P(c.c_double), H, H, c.c_double, _C, _E),
    'check_consistency': (c.c_int, P(Consistency), H, H, P(Operator), _C, _E),
}
NAMES = sorted('ctsr_' + n for n in _SIGNATURES)


def load():
    """The library: what CTSR_LIBRARY names, or what a wheel holds, or what is installed."""
    held = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'lib', 'libctsr.so.0')
    path = os.environ.get('CTSR_LIBRARY') or (held if os.path.exists(held) else 'libctsr.so.0')
    if os.path.dirname(path):
        path = os.path.abspath(path)  # it looks for its networks beside itself, wherever the program goes
    try:
        lib = c.CDLL(path)
    except OSError as e:
        raise ImportError('ctsr needs the library libctsr.so.0: install the package libctsr0, or run make install in the source and '
                          'ldconfig, or name the file by the environment variable CTSR_LIBRARY (%s)' % e) from None
    for name, (result, *arguments) in _SIGNATURES.items():
        try:
            f = getattr(lib, 'ctsr_' + name)
        except AttributeError:
            raise ImportError('%s: has no ctsr_%s: it is of another version of ctsr than this package: install both from one source'
                              % (path, name)) from None
        f.restype, f.argtypes = result, arguments
    return lib
