#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# DICOM goes to NIfTI plane by plane: the file is what it is by way of a volume, of which there is none in memory.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'DICOM goes to NIfTI plane by plane' 'built without vtk-dicom'; done_testing; fi
if ! python_with nibabel || ! "$PY" -c 'import pydicom'; then skip 'DICOM goes to NIfTI plane by plane' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-planes.py" "$@"; }
py make; ok $? 'series to go plane by plane are made'
way() { # way SERIES ARGUMENTS: OUT one.nii, and two.nii as a volume, which -v shows
	exits 0 "$*" ct-convert -q -f "${@}" one.nii
	ct-convert -v -f "${@}" two.nii 2>/dev/null && py same one.nii two.nii; ok $? "$* plane by plane is the same as a volume"
}
way whole; py type one.nii 4; ok $? 'planes that fit int16 are int16'
ct-convert -q whole - | tail -c 2160 >tail; tail -c 2160 one.nii | cmp -s - tail; ok $? 'and to a pipe'
way half; way whole --type f32; py type one.nii 16; ok $? '--type f32 makes planes of float'
way half --type i16; py type one.nii 4; ok $? '--type i16 rounds planes to int16'
way whole --units other --tilt shear
way far; py type one.nii 16; ok $? 'what does not fit int16 is float'
exits 6 '--type i16 refuses what does not fit' ct-convert --type i16 far no.nii
has err 'no.nii: a voxel does not fit int16' 'the error of a voxel beyond int16 names the file'
exits 3 'a slice that cannot be read is refused' ct-convert broken no.nii
has err 'broken/4.dcm: TransferSyntaxUID 1.2.840.10008.1.2.9' 'the error of an unknown transfer syntax names file and UID'
ls | grep -q '^no.nii'; [ $? -eq 1 ]; ok $? 'planes that were refused leave no file'
way broken --skip-damaged --gaps fill
exits 0 'a series is converted over a file with -f' ct-convert -f whole one.nii; py same one.nii two.nii; [ $? -eq 1 ]; ok $? 'a forced conversion replaces the file'
ct-convert -q whole a.nii --sidecar a.json && ct-convert -q whole b.nii.gz --sidecar b.json && cmp -s a.json b.json
ok $? 'compressed or not the sidecar is the same'
if ! sanitized ct-convert; then
	all=$(py peak ct-convert -q large large.nii.gz); one=$(py peak ct-convert -q large large.nii)
	echo "# $all and $one MiB"
	[ $((one + 15)) -lt "$all" ]; ok $? 'the 20 MB of a volume are not in memory'
else
	skip 'memory' 'sanitizers take their own'
fi
done_testing
