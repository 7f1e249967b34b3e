#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A wheel that needs nothing installed but Python and numpy: libctsr, the libraries that it needs, the networks.

    scripts/wheel.py [BUILD [FOLDER]]    from a build (default: build), into FOLDER (default: dist)

Its name tells pip the oldest glibc that it runs with: that of the machine where it was built, or older. It reads NIfTI,
NRRD and MetaImage, and no DICOM. Needs patchelf and readelf (apt-get install patchelf binutils)."""
import base64
import glob
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

# What every Linux has that pip calls manylinux: the C library, and what GCC's runtime is on it.
SYSTEM = re.compile(r'(ld-linux.*|lib(c|m|dl|rt|pthread|util|gcc_s|stdc\+\+|z))\.so\.')
NETWORKS = 'slices.safetensors', 'prior.safetensors'


def run(*line):
    return subprocess.run(line, check=True, stdout=subprocess.PIPE, text=True).stdout


def names_needed(library):
    """The names of the libraries that one needs, but those that every system has."""
    return [n for n in re.findall(r'\(NEEDED\).*\[(.*)\]', run('readelf', '-dW', library)) if not SYSTEM.match(n)]


def needed(library):
    """With their files."""
    here = dict(re.findall(r'^\s*(\S+) => (/\S+)', run('ldd', library), re.M))
    missing = [n for n in names_needed(library) if n not in here]
    if missing:
        sys.exit('wheel.py: %s needs %s, which is not found' % (library, ', '.join(missing)))
    return {n: here[n] for n in names_needed(library)}


def licence(library):
    """Debian's file of the licence of an installed library, and its package."""
    for path in library, os.path.realpath(library), os.path.realpath(library).replace('/usr/', '/', 1):
        found = subprocess.run(['dpkg-query', '-S', path], capture_output=True, text=True)
        if found.returncode == 0:
            package = found.stdout.split(':')[0]
            return package, '/usr/share/doc/%s/copyright' % package
    return None, None


def collect(lib, library):
    """libctsr and what it needs into the folder lib, each under a name of its own, so that a program that has loaded another
    libgomp keeps that."""
    done, wanted = {}, {'libctsr.so.0': os.path.realpath(library)}
    while wanted:
        name, path = wanted.popitem()
        done[name] = name if name == 'libctsr.so.0' else re.sub(r'\.so', '-ctsr.so', name, count=1)
        to = os.path.join(lib, done[name])
        shutil.copyfile(path, to)
        run('strip', '--strip-unneeded', to)  # before patchelf, whose work it would damage
        if name != 'libctsr.so.0':
            package, text = licence(path)
            if not text or not os.path.exists(text):
                sys.exit('wheel.py: %s: no licence is found, which has to travel with it' % path)
            shutil.copyfile(text, os.path.join(lib, 'licences', package))
        wanted.update({n: p for n, p in needed(path).items() if n not in done})
    for name in done:
        to = os.path.join(lib, done[name])
        steps = [('--replace-needed', n, done[n]) for n in names_needed(to) if n in done]
        for step in steps + [('--set-soname', done[name]), ('--set-rpath', '$ORIGIN')]:
            run('patchelf', *step, to)  # one at a time: patchelf 0.14 mixes up several


def glibc(lib):
    """The newest version of glibc's symbols that one of the libraries asks for."""
    text = ''.join(run('readelf', '-VW', f) for f in glob.glob(lib + '/*.so*'))
    return max(tuple(map(int, v.split('.'))) for v in re.findall(r'GLIBC_(\d+\.\d+)', text))


def main():
    top = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    build, out = (sys.argv[1:] + ['build', 'dist'][len(sys.argv) - 1:])[:2]
    library = os.path.join(build, 'libctsr.so.0')
    if not os.path.exists(library):
        sys.exit('wheel.py: %s: is not there: run make, or name the folder of the build' % library)
    for tool in 'patchelf', 'readelf', 'strip', 'ldd':
        if not shutil.which(tool):
            sys.exit('wheel.py: %s is not installed: apt-get install patchelf binutils' % tool)
    version = re.search(r"^__version__ = '(.*)'", open(top + '/python/ctsr/__init__.py').read(), re.M)[1]
    with tempfile.TemporaryDirectory() as work:
        package, info = work + '/ctsr', '%s/ctsr-%s.dist-info' % (work, version)
        shutil.copytree(top + '/python/ctsr', package, ignore=shutil.ignore_patterns('__pycache__'))
        os.makedirs(package + '/lib/licences')
        os.mkdir(info)
        collect(package + '/lib', library)
        for name in NETWORKS:
            shutil.copyfile('%s/src/prior/%s' % (top, name), '%s/lib/%s' % (package, name))
        shutil.copyfile(top + '/src/prior/README.md', package + '/lib/README.md')
        shutil.copyfile(top + '/debian/copyright', package + '/lib/licences/ctsr')
        shutil.copyfile(top + '/COPYING', info + '/COPYING')
        tag = 'py3-none-manylinux_%d_%d_%s' % (*glibc(package + '/lib'), platform.machine())
        with open(info + '/WHEEL', 'w') as f:
            f.write('Wheel-Version: 1.0\nGenerator: wheel.py of ctsr\nRoot-Is-Purelib: false\nTag: %s\n' % tag)
        with open(info + '/METADATA', 'w') as f:
            f.write('Metadata-Version: 2.1\nName: ctsr\nVersion: %s\nSummary: Super-resolution of computed tomography\n'
                    'License: Apache-2.0\nLicense-File: COPYING\nRequires-Python: >=3.9\nRequires-Dist: numpy\n'
                    'Description-Content-Type: text/markdown\n\n%s' % (version, open(top + '/python/README.md').read()))
        os.makedirs(out, exist_ok=True)
        path = '%s/ctsr-%s-%s.whl' % (out, version, tag)
        record = '%s/RECORD' % os.path.basename(info)
        rows = []
        with zipfile.ZipFile(path + '.part', 'w', zipfile.ZIP_DEFLATED) as z:
            for file in sorted(f for f in glob.glob(work + '/**', recursive=True) if os.path.isfile(f)):
                name, data = os.path.relpath(file, work), open(file, 'rb').read()
                entry = zipfile.ZipInfo(name)  # of 1980, so that the same files make the same bytes
                entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o100644 << 16
                z.writestr(entry, data)
                digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b'=').decode()
                rows.append('%s,sha256=%s,%d\n' % (name, digest, len(data)))
            z.writestr(zipfile.ZipInfo(record), ''.join(rows) + record + ',,\n')
        os.replace(path + '.part', path)
    print(path)


main()
