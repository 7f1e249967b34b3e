#!/bin/sh
# DICOM stacks that are no grid: tilted gantries, uneven and missing slices.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'tilted series' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'tilted series' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-tilt.py" "$@"; }
py make; ok $? 'series are made'
size() { ct-info "$1" >info; grep -q "^size  *$2\$" info; ok $? "$1: $2"; sed -n 's/^size/# &/p' info; }
# 20 degrees over 8 x 2.5 mm: 6.84 mm, of 0.75: 9.12 rows
for s in axial sagittal oblique; do
	exits 0 "$s, tilted" ct-convert lean-$s $s.nii
	has err 'tilted by 20.00 degrees: slices are moved in their planes, 6.84 mm over 18.79 mm' 'is told'
	size $s.nii '12 20 9'; py check $s.nii 0.5; ok $? 'every voxel is where it was'
done
exits 0 'the other way, askew' ct-convert back back.nii; size back.nii '19 20 9'
py check back.nii 0.316; ok $? 'every voxel is where it was'
exits 0 'uneven' ct-convert uneven uneven.nii
has err 'gaps run from 2 to 5 mm: 9 slices are resampled to 14 planes, 1.92308 mm apart' 'is told'
size uneven.nii '12 10 14'; py check uneven.nii 1; ok $? 'every voxel is where it was'
exits 0 'tilted and uneven' ct-convert both both.nii
py check both.nii 0.206; ok $? 'every voxel is where it was'
exits 0 'tilted along a bow' ct-convert bent bent.nii; py check bent.nii 0.526; ok $? 'every voxel is where it was'
exits 5 'absurdly tilted' ct-convert far d.nii; has err 'drift sideways by 320 mm' 'is refused'
for how in rectify shear error; do
	exits 5 "46 degrees, --tilt $how" ct-convert --tilt $how steep d.nii
	has err 'steep/00.dcm: slices drift .* (46.0 degrees), and no gantry tilts by more than 45' 'no gantry tilts so'
done
exits 0 '44 degrees' ct-convert most most.nii; has err 'tilted by 44.00 degrees' 'are put right'
for g in resample error; do
	exits 5 "--gaps $g: slices are missing" ct-convert --gaps $g missing d.nii
	has err '3 slices are missing: spacing is 2.5 mm, but 5 mm between missing/06.dcm and missing/02.dcm' 'and where'
done
exits 0 '--gaps fill' ct-convert --gaps fill missing filled.nii
has err 'gap: 1 missing between 37.25,-28.375,137.5 and 37.25,-28.375,142.5 mm, interpolated' 'the first'
has err 'gap: 2 missing between .*,147.5 and .*,155 mm' 'the second'
size filled.nii '12 10 12'; py check filled.nii 1; ok $? 'every voxel is where it was'
has info '^  filled  *37.25,-28.375,137.5:37.25,-28.375,142.5 37.25,' 'the file says so'
exits 0 'tilted, too' ct-convert --gaps fill leanmissing lean.nii; size lean.nii '12 21 10'
py check lean.nii 0.462; ok $? 'every voxel is where it was'
# other readers: nifti_tool, and plastimatch, which is built on ITK
for s in axial sagittal oblique uneven both; do
	if command -v nifti_tool >/dev/null; then
		nifti_tool -check_hdr -check_nim -infiles $s.nii >check 2>&1
		[ "$(grep -c 'IS GOOD' check)" -eq 2 ]; ok $? "$s: nifti_tool finds no fault"
	else
		skip "$s: nifti_tool" 'no nifti_tool'
	fi
	if command -v plastimatch >/dev/null; then
		plastimatch convert --input $s.nii --output-img $s.mha --output-type float >/dev/null 2>&1
		py itk $s.nii $s.mha; ok $? "$s: ITK reads the same voxels at the same places"
	else
		skip "$s: ITK" 'no plastimatch'
	fi
done
exits 5 '--tilt error' ct-convert --tilt error lean-axial d.nii; has err 'tilted gantry.* (20.0 degrees)' 'says so'
exits 5 '--gaps error' ct-convert --gaps error uneven d.nii; has err 'uneven slices: gaps run from 2 to 5 mm' 'says so'
exits 0 '--tilt shear' ct-convert --tilt shear lean-axial shear.nii; has err 'tilted by 20.00 degrees: the affine is sheared' 'says so'
py sheared shear.nii; ok $? 'voxels and places are those of the slices'
exits 5 'which our commands refuse' ct-upsample -x 2 shear.nii d.nii
for s in both bent; do exits 5 "$s" ct-convert --tilt shear $s d.nii; has err 'no sheared grid' 'is no sheared grid'; done
[ ! -e d.nii ]; ok $? 'no file is left'
for t in 1 3; do ct-convert -qf -t $t --gaps fill leanmissing t$t.nii; done
tail -c +3000 t1.nii >t1; tail -c +3000 t3.nii >t3; cmp -s t1 t3; ok $? 'the same bytes for any number of threads'
done_testing
