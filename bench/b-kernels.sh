#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# b-kernels.sh: ticks of the processor's counter that a call of each kernel takes at each level, of
# size 256: the least of nine rounds of sixteen calls. The table is that of tests/t-kernels*.c.
# Then GUPS (1e9 updates of a voxel by a view, a second of CPU time with one thread, of the clock with
# more) of our back-projection, and of the assembly of RabbitCT on the same pixels and matrices, in turn in one process.
#   RABBITCT=folder   its sources (https://github.com/HPC-Dwarfs/RabbitCT, MIT), compiled in a folder
#                     that is removed, with the flags of its mk/include_GCC.mk
#   SIZES=128         edges of the volume
#   VIEWS=32          views of 512x512 pixels; RabbitCT's own scan has 496
#   THREADS=1         of both
#   ROUNDS=7          to take the median of
set -e
builddir=${builddir:-.}
for t in t-kernels t-kernels-scan t-kernels-model; do "$builddir/tests/$t" time; done
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
peers=
if [ -n "$RABBITCT" ]; then
	for simd in AVX=8 AVX512=16; do
		name=${simd%=*}
		(cd "$RABBITCT/src" && gcc -shared -fPIC -O3 -ffast-math -march=native -std=c99 -w \
			-D_GNU_SOURCE -DARRAY_ALIGNMENT=64 -DSIMD_NAME="\"$name\"" -DVECTORSIZE="${simd#*=}" \
			-I. -o "$dir/$name.so" LolaASM.c analyseGeometry.c "fastRabbit$name.S" -fopenmp -lm)
		case $name in AVX512) grep -qw avx512f /proc/cpuinfo || continue ;; esac
		peers="$peers RabbitCT-$name=$dir/$name.so"
	done
else
	echo 'b-kernels.sh: without RabbitCT: RABBITCT is not set'
fi
for n in ${SIZES:-128}; do
	# shellcheck disable=SC2086
	OMP_NUM_THREADS=${THREADS:-1} "$builddir/bench/backproject-calls" "$n" "${VIEWS:-32}" "${THREADS:-1}" "${ROUNDS:-7}" $peers >"$dir/told"
	grep -v -e '^Padd' -e '^SIMD' -e '^Alloc' -e '^Wrote' "$dir/told"
done
