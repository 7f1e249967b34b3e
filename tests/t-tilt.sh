#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# DICOM stacks that are no grid: tilted gantries, uneven and missing slices.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'series that are no grid are put on one' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'series that are no grid are put on one' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-tilt.py" "$@"; }
py make; ok $? 'series that are no grid are made'
size() { ct-info "$1" >info; grep -q "^size  *$2\$" info; ok $? "the size of $1 is $2"; sed -n 's/^size/# &/p' info; }
# 20 degrees over 8 x 2.5 mm: 6.84 mm, of 0.75: 9.12 rows
for s in axial sagittal oblique; do
	exits 0 "a tilted $s series is read" ct-convert lean-$s $s.nii
	has err 'tilted by 20.00 degrees: slices are moved in their planes, 6.84 mm over 18.79 mm' "the tilt of the $s series is reported in degrees"
	size $s.nii '12 20 9'; py check $s.nii 0.5; ok $? "every voxel of the tilted $s series keeps its place"
done
exits 0 'a series tilted the other way, askew, is read' ct-convert back back.nii; size back.nii '19 20 9'
py check back.nii 0.316; ok $? 'every voxel of a series tilted backwards keeps its place'
exits 0 'a series of uneven gaps is read' ct-convert uneven uneven.nii
has err 'gaps run from 2 to 5 mm: 9 slices are resampled to 14 planes, 1.92308 mm apart' 'the range of uneven gaps is reported in mm'
size uneven.nii '12 10 14'; py check uneven.nii 1; ok $? 'every voxel of an uneven series keeps its place'
exits 0 'a tilted and uneven series is read' ct-convert both both.nii
py check both.nii 0.206; ok $? 'every voxel of a tilted and uneven series keeps its place'
exits 0 'a series tilted along a bow is read' ct-convert bent bent.nii; py check bent.nii 0.526; ok $? 'every voxel of a series along a bow keeps its place'
exits 5 'an absurdly tilted series is refused with status 5' ct-convert far d.nii; has err 'drift sideways by 320 mm' 'the error of an absurd tilt names the drift'
for how in rectify shear error; do
	exits 5 "a tilt of 46 degrees is refused with --tilt $how" ct-convert --tilt $how steep d.nii
	has err 'steep/00.dcm: slices drift .* (46.0 degrees), and no gantry tilts by more than 45' "the error of --tilt $how says that no gantry tilts by 46 degrees"
done
exits 0 'a series tilted by 44 degrees is read' ct-convert most most.nii; has err 'tilted by 44.00 degrees' 'a tilt of 44 degrees is reported'
for g in resample error; do
	exits 5 "missing slices are refused with --gaps $g" ct-convert --gaps $g missing d.nii
	has err '3 slices are missing: spacing is 2.5 mm, but 5 mm between missing/06.dcm and missing/02.dcm' "the error of --gaps $g names the files beside the gap"
done
exits 0 'missing slices are interpolated with --gaps fill' ct-convert --gaps fill missing filled.nii
has err 'gap: 1 missing between 37.25,-28.375,137.5 and 37.25,-28.375,142.5 mm, interpolated' '--gaps fill reports the first gap'
has err 'gap: 2 missing between .*,147.5 and .*,155 mm' '--gaps fill reports the second gap'
size filled.nii '12 10 12'; py check filled.nii 1; ok $? 'every voxel of a filled series keeps its place'
has info '^  filled  *37.25,-28.375,137.5:37.25,-28.375,142.5 37.25,' 'the file notes which slices were filled'
exits 0 'missing slices of a tilted series are interpolated' ct-convert --gaps fill leanmissing lean.nii; size lean.nii '12 21 10'
py check lean.nii 0.462; ok $? 'every voxel of a tilted and filled series keeps its place'
# other readers: nifti_tool, and plastimatch, which is built on ITK
for s in axial sagittal oblique uneven both; do
	if command -v nifti_tool >/dev/null; then
		nifti_tool -check_hdr -check_nim -infiles $s.nii >check 2>&1
		[ "$(grep -c 'IS GOOD' check)" -eq 2 ]; ok $? "$s: nifti_tool finds no fault"
	else
		skip "$s: nifti_tool finds no fault" 'no nifti_tool'
	fi
	if command -v plastimatch >/dev/null; then
		plastimatch convert --input $s.nii --output-img $s.mha --output-type float >/dev/null 2>&1
		py itk $s.nii $s.mha; ok $? "$s: ITK reads the same voxels at the same places"
	else
		skip "$s: ITK reads the same voxels at the same places" 'no plastimatch'
	fi
done
exits 5 'a tilted series is refused with --tilt error' ct-convert --tilt error lean-axial d.nii; has err 'tilted gantry.* (20.0 degrees)' 'the error of --tilt error names the angle'
exits 5 'an uneven series is refused with --gaps error' ct-convert --gaps error uneven d.nii; has err 'uneven slices: gaps run from 2 to 5 mm' 'the error of --gaps error names the gaps'
exits 0 'a tilted series becomes sheared with --tilt shear' ct-convert --tilt shear lean-axial shear.nii; has err 'tilted by 20.00 degrees: the affine is sheared' '--tilt shear reports that the affine is sheared'
py sheared shear.nii; ok $? 'voxels and places of --tilt shear are those of the slices'
exits 5 'ct-upsample refuses a sheared volume' ct-upsample -x 2 shear.nii d.nii
for s in both bent; do exits 5 "--tilt shear refuses the series $s" ct-convert --tilt shear $s d.nii; has err 'no sheared grid' "the error of $s with --tilt shear says no sheared grid"; done
[ ! -e d.nii ]; ok $? 'series that were refused leave no file'
for t in 1 3; do ct-convert -qf -t $t --gaps fill leanmissing t$t.nii; done
tail -c +3000 t1.nii >t1; tail -c +3000 t3.nii >t3; cmp -s t1 t3; ok $? 'the same bytes for any number of threads'
done_testing
