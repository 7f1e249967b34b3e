#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs with apt what the build needs; with `tests`, also what the tests compare with; with `fuzz`, what
# make fuzz takes; with `wheel`, what make wheel takes; with `cluster`, what make check-long PARTS=cluster takes.
set -e
build='gcc g++ make autoconf automake pkg-config zlib1g-dev libdeflate-dev libxxhash-dev libpng-dev
	libjansson-dev libopenexr-dev libdnnl-dev libvtk9-dev libvtk-dicom-dev libarchive-dev
	libopenimageio-dev libmatio-dev libhdf5-dev xz-utils time'
tests='mandoc cmark-gfm python3-numpy python3-nibabel python3-pydicom python3-skimage python3-pil python3-tifffile nifti-bin
	openimageio-tools openexr plastimatch libgdcm-tools dcmtk dicom3tools dcm2niix clang-format
	diction bsdextrautils bash-completion zsh fish chromium chromium-driver python3-selenium python3-matplotlib python3-setuptools python3-wheel python3-pip python3-nipype
	python3-torch python3-scipy python3-h5py'
fuzz='clang libclang-rt-dev'
wheel='python3 python3-venv patchelf binutils'
cluster='slurm-wlm munge snakemake procps'
case ${1:-build} in
build) want=$build ;;
tests) want="$build $tests" ;;
fuzz) want="$build $fuzz" ;;
wheel) want="$build $wheel" ;;
cluster) want="$build $cluster" ;;
*) echo "usage: $0 [build|tests|fuzz|wheel|cluster]" >&2; exit 2 ;;
esac
missing=
for p in $want; do
	dpkg-query -W -f '${Status}' "$p" 2>/dev/null | grep -q '^install ok installed$' || missing="$missing $p"
done
[ -n "$missing" ] || exit 0
if [ "$(id -u)" -eq 0 ]; then as_root=; else as_root=sudo; fi
echo "installing$missing" | tr '\n\t' '  '; echo
export DEBIAN_FRONTEND=noninteractive
$as_root apt-get update -qq
# how much, before it begins; then, on a terminal, what apt does
# shellcheck disable=SC2086
LC_ALL=C apt-get install --assume-no --no-install-recommends $missing 2>/dev/null | grep -E '^Need to get|^After this' || :
if [ -t 1 ]; then quiet=-q out=/dev/tty; else quiet=-qq out=/dev/null; fi
# shellcheck disable=SC2086
$as_root apt-get install -y $quiet --no-install-recommends $missing >$out
