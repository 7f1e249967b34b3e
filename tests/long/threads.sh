#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# threads.sh [TEST...]: what uses threads, under ThreadSanitizer: the C tests of kernels, solvers and the
# fit, and the commands with four threads. Builds in build-thread. oneDNN and its OpenMP are not built for
# it, so what happens inside them is not looked at. TEST: the name of a C test, without t-; "-" is none.
. "$(dirname "$0")/lib.sh"
default='core solve columns resample degrade consistency tv ssim-volume metrics edges difference structures splat mixture loss loss-total project fdk joint gsfit net-layers unet superres padding refine'
tests=${*:-$default}
build=$srcdir/build-thread
[ -x "$srcdir/configure" ] || (cd "$srcdir" && ./bootstrap >/dev/null 2>&1)
mkdir -p "$build" && cd "$build" || exit 99
[ -f Makefile ] || "$srcdir/configure" CC="${CC:-gcc}" CXX="${CXX:-g++}" CFLAGS='-g -O1' --enable-sanitize=thread --without-vtk --without-oiio >configure.log 2>&1 ||
	{ tail -n 20 configure.log; exit 1; }
[ "$tests" != - ] || tests=
programs=
for t in $tests; do programs="$programs tests/t-$t"; done
# shellcheck disable=SC2086
{ make -j"$(nproc)" && { [ -z "$programs" ] || make -j"$(nproc)" $programs; }; } >make.log 2>&1 || { tail -n 40 make.log; exit 1; }
printf 'called_from_lib:libgomp.so\ncalled_from_lib:libdnnl.so\nrace:libdnnl.so\nrace:libgomp.so\n' >"$work/quiet"
export TSAN_OPTIONS="suppressions=$work/quiet:halt_on_error=1:exitcode=66"
# Where the kernel spreads addresses wider than this compiler's runtime knows, it cannot begin.
fixed=
./ct-phantom --version >/dev/null 2>&1 || fixed='setarch -R'
# judge STATUS NAME: a race is a failure; whether the numbers are right is for make check
judge() {
	! grep -q 'WARNING: ThreadSanitizer' "$work/err" && [ "$1" -lt 124 ] && [ "$1" -ne 66 ]
	tally $? "$2 (status $1) $(grep -m 1 -A 4 'WARNING: ThreadSanitizer' "$work/err" | tr '\n' ' ')"
}
[ -z "$tests" ] || row 'C tests under TSan'
for t in $tests; do
	srcdir=$srcdir timeout 900 $fixed "tests/t-$t" >"$work/out" 2>"$work/err"
	judge $? "$t"
done
PATH=$build:$PATH
cd "$work" || exit 99
row 'commands with four threads under TSan'
command_with() { timeout 900 $fixed "$@" >out 2>err; judge $? "$*"; }
command_with ct-phantom -q -t 4 --size 24x24x24 --spacing 4 marks hr.nii
command_with ct-degrade -q -t 4 -x 2 hr.nii lr.nii
command_with ct-upsample -q -t 4 -x 2 lr.nii up.nii
command_with ct-upsample -m prior -q -t 4 -x 2 --std std.nii lr.nii restored.nii
command_with ct-info -q -t 4 --estimate hr.nii
command_with ct-project -q -t 4 -n 20 hr.nii hr.exr
command_with ct-project -q -t 4 -n 8 --coarsen 4 hr.nii low.exr
command_with ct-fdk -q -t 4 hr.exr fdk.nii
command_with ct-fdk -q -t 4 -m tv --iterations 5 hr.exr tv.nii
command_with ct-ddnm -q -t 4 -x 4 -n 2 low.exr sr.exr
command_with ct-nabgs -q -t 4 -b up.nii -n 60 -g 300 hr.exr residual.ply
command_with ct-fuse -q -t 4 -n 4 up.nii lr.nii hr.exr fused.nii
command_with ct-compose -q -t 4 up.nii residual.ply out.nii
command_with ct-metrics -q -t 4 hr.nii out.nii
command_with ct-train -q -t 4 --arch model_channels=32,channel_mult=1 -p 8 --expert batch=4 -n 3 t.safetensors hr.exr
finish
