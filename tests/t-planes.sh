#!/bin/sh
# DICOM goes to NIfTI plane by plane: the file is what it is by way of a volume, of which there is none in memory.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'planes' 'built without vtk-dicom'; done_testing; fi
if ! python_with nibabel || ! "$PY" -c 'import pydicom'; then skip 'planes' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-planes.py" "$@"; }
py make; ok $? 'series are made'
way() { # way SERIES ARGUMENTS: OUT one.nii, and two.nii as a volume, which -v shows
	exits 0 "$*" ct-convert -q -f "${@}" one.nii
	ct-convert -v -f "${@}" two.nii 2>/dev/null && py same one.nii two.nii; ok $? 'is the same as a volume'
}
way whole; py type one.nii 4; ok $? 'of int16'
ct-convert -q whole - | tail -c 2160 >tail; tail -c 2160 one.nii | cmp -s - tail; ok $? 'and to a pipe'
way half; way whole --type f32; py type one.nii 16; ok $? 'of float'
way half --type i16; py type one.nii 4; ok $? 'rounded'
way whole --units other --tilt shear
way far; py type one.nii 16; ok $? 'what does not fit int16 is float'
exits 6 'unless it has to' ct-convert --type i16 far no.nii
has err 'no.nii: a voxel does not fit int16' 'is told'
exits 3 'a slice that is not read' ct-convert broken no.nii
has err 'broken/4.dcm: TransferSyntaxUID 1.2.840.10008.1.2.9' 'is told'
ls | grep -q '^no.nii'; [ $? -eq 1 ]; ok $? 'nothing is left of them'
way broken --skip-damaged --gaps fill
exits 0 'over a file' ct-convert -f whole one.nii; py same one.nii two.nii; [ $? -eq 1 ]; ok $? 'it is another'
ct-convert -q whole a.nii --sidecar a.json && ct-convert -q whole b.nii.gz --sidecar b.json && cmp -s a.json b.json
ok $? 'with the same sidecar'
if ! sanitized ct-convert; then
	all=$(py peak ct-convert -q large large.nii.gz); one=$(py peak ct-convert -q large large.nii)
	echo "# $all and $one MiB"
	[ $((one + 15)) -lt "$all" ]; ok $? 'the 20 MB of a volume are not in memory'
else
	skip 'memory' 'sanitizers take their own'
fi
done_testing
