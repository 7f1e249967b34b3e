#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# libctsr as it is installed: its symbols, what it does not call, and programs that are built with it.
unset CTSR_CPU
. "$srcdir/tests/tap.sh"
for tool in nm make pkg-config; do
	command -v $tool >/dev/null || { skip 'libctsr' "$tool is not here"; done_testing; }
done
so=$builddir/libctsr.so.0 a=$builddir/libctsr.a
value() { sed -n "s/^$1 = //p" "$builddir/Makefile"; }
san=$(value SAN_FLAGS)

# What is exported is what ctsr.h declares, and what the list says.
nm -D --defined-only "$so" | awk '{ print $3 }' | grep -v '^_\|^\.' | sort >exported
diff "$srcdir/src/ctsr/ctsr.symbols" exported >differ; ok $? 'the library exports the symbols of ctsr.symbols'
sed 's/^/# /' differ
grep -o 'ctsr_[a-z0-9_]*(' "$srcdir/src/ctsr/ctsr.h" | tr -d '(' | sort -u >declared
while read -r name; do grep -qx "$name" declared || echo "$name"; done <exported >missing
[ ! -s missing ]; ok $? 'each is in ctsr.h'
sed 's/^/# /' missing
if command -v objdump >/dev/null; then
	objdump -p "$so" | grep -q 'SONAME *libctsr.so.0$'; ok $? 'its soname is libctsr.so.0'
else
	skip 'its soname' 'objdump is not here'
fi

# A path "-" is standard input or output; fprintf writes to files.
nm "$a" 2>/dev/null | awk '/\.o:$/ { o = $0 }
	$1 == "U" && $2 ~ /^(printf|vprintf|puts|putchar|perror|stderr|exit|_exit|abort|getenv|secure_getenv|setenv|putenv|signal|sigaction|fork|system|srand|rand|umask|setlocale)$/ { print o, $2 }
	$1 == "U" && $2 ~ /^(stdin|stdout)$/ && o !~ /^(io|safetensors)\.o/ { print o, $2 }' >calls
[ ! -s calls ]; ok $? 'it does not print, exit, read the environment or handle signals'
sed 's/^/# /' calls
# Data that can change: the level of the processor, files to remove, the wish of the command line.
nm "$a" 2>/dev/null | awk '/\.o:$/ { o = $0 } $2 ~ /^[bBC]$/ { print o, $3 }' |
	grep -v -e '^simd.o: chosen$' -e '^temp.o: table$' -e '^units.o: said$' -e '__odr_asan' -e '\.[0-9]*$' >state
[ ! -s state ]; ok $? 'it has no global state'
sed 's/^/# /' state

# Installed, and used from there alone.
mkdir root
${MAKE:-make} -s -C "$builddir" DESTDIR="$PWD/root" MAKEFLAGS= install-library >made 2>&1; ok $? 'make install-library installs the library below DESTDIR'
pc=$(find "$PWD/root" -name ctsr.pc)
[ -n "$pc" ] || { sed 's/^/# /' made; done_testing; }
export PKG_CONFIG_PATH="${pc%/*}:$PKG_CONFIG_PATH" PKG_CONFIG_SYSROOT_DIR="$PWD/root"
lib=${pc%/pkgconfig/*}
cc=$(value CC)
flags="-std=c17 -Wall -Wextra -Werror -pedantic $san"
# shellcheck disable=SC2046,SC2086
$cc $flags "$srcdir/examples/superres.c" -o shared $(pkg-config --cflags --libs ctsr) 2>err; ok $? 'the example builds with the shared library'
# shellcheck disable=SC2046,SC2086
$cc $flags "$srcdir/examples/superres.c" -o static $(pkg-config --cflags --static --libs ctsr | sed 's/-lctsr/-l:libctsr.a/') 2>>err
ok $? 'and with the static one'
sed 's/^/# /' err
export LD_LIBRARY_PATH="$lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
ct-phantom -q --size=24x24x24 --spacing=2 shepp-logan hi.nii && ct-degrade -q -x 2 -p P1 hi.nii lo.nii && ct-upsample -q -m tv lo.nii command.nii
ok $? 'the commands make a phantom, its scan and its refinement'
for how in shared static; do
	./$how lo.nii $how.nii 2 >out 2>err; ok $? "the $how program runs"
	grep -q 'residual' out; ok $? "the $how program reports the data residual"
	# behind the header, which tells who wrote it, are the voxels
	bytes=$((24 * 24 * 24 * 4))
	tail -c $bytes command.nii >want; tail -c $bytes $how.nii >got
	cmp want got; ok $? 'and makes the voxels of ct-upsample'
done
exits 3 'a file that is not there is status 3' ./shared none.nii x.nii 2
has err 'none.nii' 'the error of the program names a file that is not there'
cp lo.nii was.nii; exits 4 'files that exist stay' ./shared hi.nii lo.nii 2; cmp -s lo.nii was.nii; ok $? 'a file that exists is not changed by the program'
exits 2 'a factor that is none is status 2' ./shared lo.nii x.nii 5000
exits 2 'a factor that is no number is status 2' ./shared lo.nii x.nii 2x

# A program that names NIfTI alone holds no other reader.
cat >alone.c <<'END'
#include <ctsr.h>
int main(int argc, char **argv)
{
	const ctsr_format *const list[] = {ctsr_nifti(), NULL};
	ctsr_volume *v = NULL;
	ctsr_error e;
	int rc = argc < 2 || ctsr_volume_read(&v, argv[1], list, &e);

	ctsr_volume_free(v);
	return rc;
}
END
# shellcheck disable=SC2046,SC2086
$cc $flags alone.c -o alone $(pkg-config --cflags --static --libs ctsr | sed 's/-lctsr/-l:libctsr.a/') 2>err; ok $? 'a program that reads NIfTI'
./alone hi.nii; ok $? 'a program that names NIfTI alone reads a volume'
nm alone | grep -E 'exr_|pickle|headed|safetensors|ct_dnn|format_ply' >others
[ ! -s others ]; ok $? 'and holds no reader of EXR, PyTorch, safetensors, MetaImage or NRRD'
sed 's/^/# /' others

# C++ and C89-minded compilers take the header.
if command -v g++ >/dev/null; then
	echo '#include <ctsr.h>
	int main() { return ctsr_version()[0] == 0; }' >plus.cc
	# shellcheck disable=SC2046,SC2086
	g++ -Wall -Wextra -Werror -pedantic $san plus.cc -o plus $(pkg-config --cflags --libs ctsr) && ./plus; ok $? 'a program in C++ includes ctsr.h'
else
	skip 'a program in C++ includes ctsr.h' 'g++ is not here'
fi
done_testing
