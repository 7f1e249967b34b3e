#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ct-convert --projections: measured scans in files of MATLAB and HDF5, pictures, numpy and raw numbers become stacks.
. "$srcdir/tests/tap.sh"
python_with h5py && python_with scipy || { skip 'measured scans' 'no h5py or scipy'; done_testing; }
PYTHONPATH=$srcdir/tests; export PYTHONPATH
calls numpy exr h5py scipy.io
py() { called "$srcdir/tests/t-scans.py" "$@"; }
py make || exit 99
stack() { ct-convert -f --projections "$@"; }
cat >cone.json <<'JSON'
{"mode": "parallel", "DSO": 100, "DSD": 150, "nDetector": [3, 20], "dDetector": [1, 1], "totalAngle": 180, "unit": "mm"}
JSON
if ct-convert --projections auto a.mat probe.exr 2>&1 | grep -q 'is not installed'; then
	skip 'files of MATLAB and HDF5' 'built without'
else
	exits 0 'a sinogram of MATLAB 5 is read' stack auto a.mat a.exr
	py integrals a.exr; ok $? 'a sinogram of MATLAB 5 keeps every value'
	py placed a.exr; ok $? 'a sinogram of MATLAB has its source and pixels where its parameters say'
	ct-info a.exr >out; has out 'beam *fan' 'a sinogram of MATLAB is a fan'
	exits 0 'a sinogram of MATLAB 7.3 is read' stack auto b.mat b.exr
	py integrals b.exr && py placed b.exr; ok $? 'MATLAB 7.3 gives the same stack as MATLAB 5'
	exits 0 'lengths in metres of MATLAB are read' stack auto metres.mat m.exr; py placed m.exr; ok $? 'lengths in metres become millimetres'
	for bad in "inch;distanceUnit: 'inch' is not mm, cm or m" 'units;effectivePixelSizePost of .* is not pixelSizePost of 200' \
		'angles;parameters.angles: has 5 angles for 12 views' 'cols;numDetectorsPost: is 560, but sinogram has 20' \
		'none;parameters.distanceSourceOrigin: is missing' 'other;has no sinogram'; do
		exits 3 "a sinogram that contradicts itself is refused: ${bad%;*}" stack auto "${bad%;*}.mat" no.exr
		has err "${bad%;*}.mat: .*${bad#*;}" "the error names file and field: ${bad%;*}"
	done
	exits 5 'a detector before the axis is refused with status 5' stack auto behind.mat no.exr
	exits 0 'a column of NaN in line integrals is mended' stack auto nan.mat n.exr; py mended n.exr; ok $? 'a lost column becomes the mean of its neighbours'
	has err '1 of 20 pixels of the detector are bad' 'a lost column is counted in a warning'
	exits 0 'views are chosen by first, last and step' stack auto --views 2:9:3 a.mat v.exr; py every_other v.exr; ok $? 'views 2, 5 and 8 are kept'
	exits 0 'coefficients of water are taken' stack auto --water 1,.1 a.mat w.exr; py watered w.exr; ok $? 'p of water becomes p + .1 p^2'
	ct-info w.exr >out; has out 'water *1,0.1,0,0' 'a stack names the coefficients of its water'
	exits 3 'coefficients of water that fall are refused' stack auto --water 1,-.5 a.mat no.exr; has err 'a.mat: --water: the polynomial does not rise at' 'the error of falling coefficients says where'
	for bad in x 1,2,3,4,5 1,; do exits 2 "coefficients of water that are none are refused: $bad" stack auto --water $bad a.mat no.exr; done
	for bad in 3:2 0:13 0:4:0 1.5:4 x 1; do exits 2 "views that are none are refused: $bad" stack auto --views $bad a.mat no.exr; done
	exits 3 'a file of MATLAB with two scans is refused' stack auto two.mat no.exr; has err 'two.mat: has two scans, CtDataFull.sinogram and CtDataLimited.sinogram' 'the error of two scans names both'
	exits 2 'a flat field for line integrals is refused' stack auto --flat flat.npy a.mat no.exr
	exits 0 'a stack is read again' stack auto --views 0:12 a.exr again.exr; py integrals again.exr && py placed again.exr; ok $? 'a stack that is read again keeps values and rays'
	exits 0 'Data Exchange is read' stack auto --pitch .01 a.h5 x.exr; py ball x.exr >off; ok $? "counts become line integrals of the ball, off by $(cat off)"
	has err '2 of 60 pixels of the detector are bad' 'a dead and a hot pixel are counted in a warning'
	py degrees x.exr; ok $? 'angles of Data Exchange in degrees are read'
	ct-info x.exr >out; has out 'pitch-mm *0.01 0.01' 'the size of a pixel is that of --pitch'
	exits 0 'Data Exchange in rad is read' stack auto rad.h5 r.exr; py degrees r.exr; ok $? 'angles of Data Exchange in rad are read'
	has err '1 mm is assumed' 'a scan without size of pixels is warned of'
	exits 0 'angles without a unit are read' stack auto bare.h5 r.exr; py degrees r.exr; ok $? 'angles without a unit are degrees'
	exits 3 'an unknown unit of angles is refused' stack auto grad.h5 no.exr; has err "the unit 'gradians' is not deg or rad" 'the error of an unknown unit names it'
	exits 0 'fields that are one picture, a mean, are read' stack auto --pitch .01 mean.h5 x.exr; py ball x.exr; ok $? 'fields that are one picture give the ball'
	exits 2 'counts without a flat field are refused' stack auto noflat.h5 no.exr; has err 'pass it by --flat' 'the error of a missing flat field names --flat'
	exits 0 'a flat field of a file of its own is taken' stack auto --flat flat.npy --pitch 1 noflat.h5 x.exr; py ball x.exr; ok $? 'a flat field of a file of its own gives the ball'
	exits 2 'Data Exchange without angles needs a scanner file' stack auto noangle.h5 no.exr
	exits 0 'Data Exchange takes its rays of a scanner file' stack auto --scanner cone.json noangle.h5 x.exr; py degrees x.exr; ok $? 'the angles of the scanner file are taken'
	exits 0 'views without a photon are warned of' stack auto zero.h5 z.exr; has err 'values are below 0.0001 of the flat field' 'starved values are counted in a warning'
	exits 3 'HDF5 of another kind is refused' stack auto other.h5 no.exr; has err 'expected Data Exchange' 'the error of other HDF5 says what was expected'
	for f in a.mat b.mat a.h5; do
		size=$(wc -c <$f)
		for part in 4 150 400 700 $((size / 2)) $((size - 9)); do
			head -c $part $f >cut; stack auto cut no.exr 2>err; code=$?
			case $code in 2|3|7) ;; *) echo "$f at $part: $code" ;; esac
		done
	done >wrong; [ ! -s wrong ]; ok $? "truncated files of MATLAB and HDF5 are refused $(head -n 2 wrong)"
fi
exits 0 'counts of numpy are read' stack counts --scanner cone.json --flat flat.npy --dark dark.npy views.npy x.exr; py ball x.exr; ok $? 'counts of numpy become the ball'
exits 0 'counts of raw numbers are read' stack counts --raw 20x3x12:f32:1,1,1 --scanner cone.json --flat flat.npy --dark dark.npy views.raw x.exr; py ball x.exr; ok $? 'counts of raw numbers become the ball'
if [ -e v00.tif ] && pictures; then
	exits 0 'counts of pictures are read' stack counts --scanner cone.json --flat flat.tif --dark dark.tif v??.tif x.exr; py ball x.exr; ok $? 'counts of pictures become the ball'
	! grep 'is before' err; ok $? 'views in the order of their numbers give no warning of it'
	for i in 0 1 2 3 4 5 6 7 8 9 10 11; do cp "v$(printf %02d $i).tif" w$i.tif; done
	stack counts --scanner cone.json --flat flat.tif --dark dark.tif w*.tif x.exr 2>err; has err 'w11.tif is before w2.tif: ' 'views that a shell sorts by letters are warned of'
	exits 3 'a flat field of another type than the views is refused' stack counts --scanner cone.json --flat whole.tif --dark dark.tif v??.tif no.exr
	has err 'whole.tif: its 65535 becomes 1, but of v00.tif 1 does' 'the error of another type names both files'
	exits 3 'a dark field of another type than the views is refused' stack counts --scanner cone.json --flat flat.tif --dark whole.tif v??.tif no.exr
	exits 3 'a view of another type than the first is refused' stack counts --scanner cone.json --flat flat.tif v0?.tif v10.tif whole.tif no.exr
else
	skip 'pictures of counts' 'no tifffile, or built without OpenImageIO'
fi
stack auto --scanner cone.json whole.npy x.exr 2>err; has err '^ct-convert: warning: whole.npy: whole numbers are taken for line integrals: --projections counts' 'counts that are taken for line integrals are warned of'
exits 5 'a flat field of another size is refused' stack counts --scanner cone.json --flat ringed5.npy views.npy no.exr
exits 2 'numpy without a scanner file is refused' stack counts --flat flat.npy views.npy no.exr; has err 'pass a scanner file by --scanner' 'the error of missing rays names --scanner'
exits 0 'rings are removed when that is asked for' stack integral --scanner cone.json --rings 9 ringed.npy u.exr; py unringed u.exr; ok $? 'a ring is gone'
stack integral --scanner cone.json ringed.npy u.exr; ! py unringed u.exr; ok $? 'a ring stays when nothing is asked for'
exits 2 'rings of an even width are refused' stack integral --scanner cone.json --rings 8 ringed.npy no.exr
exits 0 'attenuation of water makes HU' stack integral --scanner cone.json --mu-water .02 ringed.npy u.exr; ct-info u.exr >out; has out 'window *-1000:49000' 'the window follows from the attenuation of water'
stack auto --scanner cone.json u.exr again.exr; ct-info again.exr >out; has out 'window *-1000:49000' 'a stack whose rays a scanner file replaces keeps its window'
has out 'ct-convert.*ringed.npy' 'a stack whose rays a scanner file replaces keeps its history'
exits 0 'a line integral that is infinite is read' stack integral --scanner cone.json lost.npy u.exr; py lost_one u.exr; ok $? 'an infinite value costs the pixel one view, not all of them'
exits 0 'a computed scan of a small ball is read' stack integral --scanner cone.json small.npy u.exr; [ ! -s err ]; ok $? 'air that a shadow passes is no bad pixel'
sed 's/"totalAngle": 180/"angles": [0,15,30,45,60,75,90,105,120,135,150,165]/' cone.json >each.json
exits 0 'a scanner file with the angle of each view is taken' stack integral --scanner each.json ringed.npy u.exr; py degrees u.exr; ok $? 'each view is at its angle of the scanner file'
for bad in 's/, "totalAngle": 180//;no totalAngle, angles or vectors' 's/"totalAngle"/"offDetector": 3, &/;offDetector is one number, not 2' 's/"totalAngle"/"offOrigin": 3, &/;offOrigin is one number, not 3'; do
	sed "${bad%;*}" cone.json >bad.json
	exits 3 "a scanner file that leaves rays open is refused: ${bad#*;}" stack integral --scanner bad.json ringed.npy no.exr; has err "bad.json: ${bad#*;}" "the error of open rays says so: ${bad#*;}"
done
exits 2 'projections to a volume are refused' ct-convert --projections auto views.npy a.nii
exits 2 'a gantry is not rectified in projections' stack integral --scanner cone.json --tilt shear ringed.npy no.exr
[ ! -e no.exr ]; ok $? 'scans that were refused leave no stack'
done_testing
