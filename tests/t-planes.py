# SPDX-License-Identifier: Apache-2.0
"""make: series of whole numbers, of numbers too large for int16, of halves, one with a slice that is not read, and
one of 160x160x200. same A B: do two NIfTI files say the same but for their history? type A CODE: numbers of A.
peak COMMAND...: runs it and prints MiB."""
import re
import resource
import subprocess
import sys


def make():
    import dicom

    series = {"whole": (1, -1024), "far": (300, 0), "half": (0.5, 0), "broken": (1, 0)}
    for name, (slope, intercept) in series.items():
        for k in range(dicom.SLICES):
            dicom.write("%s/%d.dcm" % (name, k), "axial", k, "1.2.3.7", scale=(1, 0), RescaleSlope=slope,
                        RescaleIntercept=intercept)
    b = open("broken/4.dcm", "rb").read()
    open("broken/4.dcm", "wb").write(b.replace(b"1.2.840.10008.1.2.1\0", b"1.2.840.10008.1.2.9\0"))
    dicom.ROWS = dicom.COLUMNS = 160
    for k in range(200):
        dicom.write("large/%03d.dcm" % k, "axial", k, "1.2.3.8", scale=(1, 0))


def parts(path):
    import nibabel as nib

    image = nib.load(path)
    head = image.header
    known = b"".join(x.get_content() for x in head.extensions)
    known = re.sub(rb'"ct:history": ?"ct-convert [^"]* # ', b"", known)
    return image.dataobj.get_unscaled().tobytes(), head["datatype"], image.affine.tolist(), head["qform_code"], known


if sys.argv[1] == "make":
    make()
elif sys.argv[1] == "same":
    a, b = map(parts, sys.argv[2:4])
    sys.exit(a != b)
elif sys.argv[1] == "type":
    sys.exit(int(parts(sys.argv[2])[1]) != int(sys.argv[3]))
else:
    subprocess.check_call(sys.argv[2:])
    print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024)
