#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Cross-compiles for 64-bit ARM and runs the kernels' tests there under qemu-user, on Debian:
#   scripts/check-aarch64.sh [TEST...]        default: all C tests that are fast under emulation
# Needs gcc-aarch64-linux-gnu and qemu-user, which it installs, and unpacks the libraries of that
# architecture beside the build. Without C++: no DICOM, no pictures.
set -e
top=$(cd "$(dirname "$0")/.." && pwd)
build=$top/build-aarch64 root=$top/build-aarch64/root
if [ "$(id -u)" -eq 0 ]; then as_root=; else as_root=sudo; fi
export DEBIAN_FRONTEND=noninteractive
"$top/scripts/install-deps.sh"
if ! command -v qemu-aarch64 >/dev/null || ! command -v aarch64-linux-gnu-gcc >/dev/null; then
	$as_root apt-get update -qq
	$as_root apt-get install -y -qq --no-install-recommends gcc-aarch64-linux-gnu libc6-dev-arm64-cross \
		qemu-user >/dev/null
fi
mkdir -p "$root"
if [ ! -e "$root/unpacked" ]; then
	dpkg --print-foreign-architectures | grep -q '^arm64$' || {
		$as_root dpkg --add-architecture arm64
		$as_root apt-get update -qq
	}
	names=$(apt-get install -s --no-install-recommends libopenexr-dev:arm64 libdnnl-dev:arm64 \
		libjansson-dev:arm64 zlib1g-dev:arm64 libdeflate-dev:arm64 libxxhash-dev:arm64 libpng-dev:arm64 |
		sed -n 's/^Inst \([^ ]*:arm64\) .*/\1/p' | grep -vE '^(libc6|libc6-dev|linux-libc-dev|libcrypt)')
	# shellcheck disable=SC2086
	(cd "$root" && apt-get download -qq $names && for d in *.deb; do dpkg -x "$d" . && rm "$d"; done)
	touch "$root/unpacked"
fi
cd "$top" && [ -x configure ] || ./bootstrap >/dev/null 2>&1
cd "$build"
lib=$root/usr/lib/aarch64-linux-gnu
if [ ! -f Makefile ]; then
	PKG_CONFIG_LIBDIR=$lib/pkgconfig PKG_CONFIG_SYSROOT_DIR=$root "$top/configure" \
		--host=aarch64-linux-gnu --without-vtk --without-oiio --without-hdf5 --enable-werror \
		CPPFLAGS="-isystem $root/usr/include -isystem $root/usr/include/aarch64-linux-gnu" \
		LDFLAGS="-L$lib -L$root/lib/aarch64-linux-gnu -Wl,-rpath-link,$lib:$root/lib/aarch64-linux-gnu" >configure.log 2>&1 ||
		{ tail -n 20 configure.log; exit 1; }
fi
default='core vec-v1 solve resample degrade consistency ssim-volume metrics columns phantom loss-total loss splat'
tests=
for t in ${*:-$default}; do tests="$tests tests/t-$t"; done
# shellcheck disable=SC2046
make $(make -s --eval='print-built: ; @echo $(BUILT_SOURCES)' print-built) >make.log 2>&1
# shellcheck disable=SC2086
make -j"$(nproc)" libct.a $tests >make.log 2>&1 || { tail -n 40 make.log; exit 1; }
export QEMU_LD_PREFIX=/usr/aarch64-linux-gnu
export QEMU_SET_ENV="LD_LIBRARY_PATH=$lib:$root/lib/aarch64-linux-gnu"
passed=0 failed=0
for t in $tests; do
	qemu-aarch64 "$t" >"$t.arm" 2>&1 || echo "$t ended with $?"
	passed=$((passed + $(grep -c '^ok' "$t.arm"))) failed=$((failed + $(grep -c '^not ok' "$t.arm" || true)))
	grep -A3 '^not ok' "$t.arm" || true
	grep -q '^1\.\.' "$t.arm" || { failed=$((failed + 1)); tail -n 5 "$t.arm"; }
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
