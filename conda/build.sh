#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# As conda-build runs it, in the source: into $PREFIX, against the libraries there.
set -e
[ -x configure ] || ./bootstrap
CPPFLAGS="-I$PREFIX/include ${CPPFLAGS:-}" LDFLAGS="-L$PREFIX/lib -Wl,-rpath,$PREFIX/lib ${LDFLAGS:-}" \
	./configure --prefix="$PREFIX" --with-vtk=no --with-oiio=yes --with-hdf5=no
make -j"${CPU_COUNT:-1}"
make install
