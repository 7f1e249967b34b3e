#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What is in a folder of DICOM files: ct-info FOLDER, as text and JSON.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'ct-info reads folders of DICOM files' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom; then skip 'ct-info reads folders of DICOM files' 'no pydicom'; done_testing; fi
PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" - <<'END'
from dicom import *
for k in range(9):
    write("good/%d.dcm" % k, "axial", k, "1.6.1", ConvolutionKernel="B30f", KVP=120, RescaleType="HU")
    write("lean/%d.dcm" % k, "axial", k, "1.6.2", ORIGIN + np.array([0, np.sin(t), np.cos(t)]) * 2.5 * k,
          SeriesDescription=None)
    if k not in (4, 5):
        write("holes/%d.dcm" % k, "padded", k, "1.6.3")
    write("all/a/%d.dcm" % k, "axial", k, "1.6.4")
    write("all/b/%d.dcm" % k, "axial", k, "1.6.5", Modality="MR")
write("all/a/scout.dcm", "sagittal", 0, "1.6.4", ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
open("all/a/x.txt", "w").write("x\n")
END
tar cf good.tar good; printf 'x' >good/notes.txt
for what in good good/3.dcm good.tar; do
	exits 0 "$what: what ct-convert would make" ct-info $what
	has out '^series  *1$' 'the folder holds one series'; has out '^grid  *12 10 9$' 'the grid of the series is 12 10 9'
done
rm good/notes.txt
exits 0 "a series that is fit" ct-info good
line() { grep -q "^$1  *$2\$" out; ok $? "$1 $2"; }
line files 9; line picture 9; line series 1; line slices 9; line size '12 10'; line kernel B30f
line kvp 120; line uid 1.6.1; line spacing-mm '0.5 0.75'; line gap-mm '2.5 2.5 2.5'; line tilt-deg 0
line grid '12 10 9'; line fit yes; line range '-\{0,1\}[0-9]* [0-9]*'; line unit HU
line padding none; has out '^missing-fields' 'fields that are missing are listed'
exits 0 "ct-info reads a tilted series" ct-info lean
line tilt-deg 20; has out '^  tilted gantry$' 'a tilted gantry is remarked on'; line grid '12 20 9'; line fit yes
has out '^  SeriesDescription$' 'a field that is missing'
exits 5 "a series with missing slices ends with status 5" ct-info holes
line fit no; has out '^why-not  *2 slices are missing' 'the reason why a series does not fit is told'
has out '^  2  after-mm .*  before-mm ' 'the gap lies between two positions in mm'; line padding '-2000 -2000'; has err '2 slices are missing' 'missing slices are said as by conversion'
exits 0 "several series, one of CT slices" ct-info all
[ "$(grep -c '^series ' out)" -eq 3 ] && [ "$(grep -c '^fit  *yes' out)" -eq 1 ]; ok $? 'one series of three is fit'
line 'not DICOM' 1; has out '^kind  *localizer$' 'the localizer is named by its kind'
has out "^why-not  *all/b/0.dcm: modality is 'MR', not CT$" 'a series of MR says why it does not fit'
exits 3 "a series of another modality is refused" ct-info --series 1.6.5 all
exits 3 "an empty folder is refused by ct-info" ct-info empty
: >good/bad.dcm
exits 3 'a damaged file of a folder is status 3' ct-info good; has err 'good/bad.dcm: damaged: it is empty' 'a damaged file of a folder is named in the error'
has out '^  good/bad.dcm  state damaged  why it is empty$' 'a damaged file is listed with its reason'
rm good/bad.dcm
printf 'x' >>good/3.dcm; head -c -30 good/3.dcm >cut; mv cut good/3.dcm
exits 3 'a picture that is cut off' ct-info good; has err 'truncated' 'a picture that is cut off is said to be truncated'
ct-info --json all | "$PY" -c 'import json, sys
o = json.load(sys.stdin)
assert o["files"] == 20 and o["picture"] == 19 and o["not DICOM"] == 1 and o["trouble"] == [], o
a = [s for s in o["series"] if s["uid"] == "1.6.4" and s["kind"] == "slices"][0]
assert a["fit"] is True and a["grid"] == [12, 10, 9] and a["gap-mm"] == [2.5] * 3 and a["gaps"] == [], a
assert a["range"][0] < a["range"][1] and "KVP" in a["missing-fields"], a
assert [s["fit"] for s in o["series"]].count(True) == 1'
ok $? 'several series are one JSON document'
ct-phantom -q --size 8x8x8 sphere v.nii
exits 5 'folders and a file, the last one not fit' ct-info --json all v.nii holes
"$PY" -c 'import json
a = json.load(open("out"))
assert [o["file"] for o in a] == ["all", "v.nii", "holes"] and a[0]["files"] == 20, a
assert [s["fit"] for s in a[2]["series"]] == [False], a'
ok $? 'are one JSON document'
exits 2 'ct-convert has no --json' ct-convert --json good o.nii
[ ! -e o.nii ]; ok $? 'folders that were refused leave nothing written'
done_testing
