#!/bin/sh
# Series as scanners and archives leave them: passes, copies, parts, frames, zones, cut files, burnt-in writing.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'series' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'series' 'no pydicom or no nibabel'; done_testing; fi
py() { PYTHONPATH=$srcdir/tests PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/t-series-kinds.py" "$@"; }
py make; ok $? 'series are made'
one() { exits 0 "$2 are one stack" ct-convert -f "$1" o.nii; py planes o.nii $3 $4; ok $? "of $3 planes"; }
several() { # several FOLDER N WORDS NAME [SPACING]
	exits 5 "$4 are divided" ct-convert -f "$1" d.nii; has err "mixed: $2 series" 'and refused'; has err "$3" 'by what tells them apart'
	exits 0 "one of the $4 is read" ct-convert -f --series 1 "$1" o.nii; py planes o.nii 6 $5; ok $? 'whole, and alone'
}

# stacks that lie in one another
several pass-acquisition 2 'AcquisitionNumber 2$' 'acquisitions whose places alternate'
several pass-three 3 'AcquisitionNumber 3$' 'three of them'
several pass-reversed 2 'AcquisitionNumber 2$' 'acquisitions in opposite directions'
several pass-phase 2 'NominalPercentageOfCardiacPhase 50$' 'phases of the heart'
several pass-kernel 2 'ConvolutionKernel B70f$' 'kernels'
several pass-kvp 2 'KVP 140$' 'energies'
several pass-contrast 2 'ContrastBolusAgent Iodine$' 'scans with and without contrast'
several turns 2 'KVP 140$' 'energies in turn' 5
exits 5 'energies in turn, by pairs' ct-convert -f pairs d.nii; has err 'mixed: 2 series' 'are divided'
one by-design 'passes of one acquisition' 12; [ ! -s err ]; ok $? 'without a word'
one shot 'acquisitions one behind the other' 12
one anew 'acquisitions whose numbers begin anew' 12
one zones-kvp 'zones of two energies' 12; has err 'warning: slices .* differ in KVP' 'with a warning'
ct-convert pass-acquisition d.nii 2>err; [ "$(sed -n '1s/.*: mixed: .*/mixed/p; 2s/.*series \(.\): .*/\1/p; 3s/.*series \(.\): .*/\1/p' err | tr -d '\n')" = mixed12 ]; ok $? 'the error comes first, then a list without warnings'

# copies
one copied 'files under two names' 6; has err '6 of 12 files used: 6 repeated$' 'and counted'
one rounded 'copies whose positions are rounded' 6; has err '6 of 12 files used: 6 repeated$' 'and counted'
ct-info rounded >out; has out '^fit  *yes' 'ct-info agrees'
several same-acquisition 2 'AcquisitionNumber 2$' 'acquisitions with the same UIDs'
several same-phase 2 'NominalPercentageOfCardiacPhase 50$' 'phases with the same UIDs'
exits 5 'other pixels under the same UID' ct-convert same d.nii; has err 'two slices at one place: same/00.dcm and same/06.dcm' 'are refused where nothing tells them apart'
exits 5 'a slice that was scanned again' ct-convert rescan d.nii; has err 'two slices at one place: rescan/03.dcm and rescan/06.dcm, 0.02 mm apart' 'is refused'
one seam-0 'a seam of a hundredth of a millimetre with equal slices' 11 2.501
exits 5 'one with unequal slices' ct-convert seam-1 d.nii; has err 'two slices at one place' 'is refused'

# frames of one file
one enhanced 'frames' 6
for c in groups stacks index times; do
	ct-convert $c d.nii 2>err; a=$?; ct-convert $c/e.dcm d.nii 2>err.file; b=$?
	[ $a -ne 0 ] && [ $a -eq $b ] && cmp -s err err.file; ok $? "$c: a file of frames and its folder are refused alike"
done
has err 'TemporalPositionIdentifier 2$' 'times are told apart'
ct-convert groups d.nii 2>err; has err 'NumberOfFrames is 6, but 4 functional groups' 'frames without a functional group are damage'
exits 5 'two frames at one place' ct-convert twice d.nii; has err 'twice/e.dcm (frame 4) and twice/e.dcm (frame 7)' 'are named by their numbers'
one parts-whole 'parts of a concatenation' 6
one parts-backwards 'parts in any order' 6
for c in first middle last; do
	exits 3 "a concatenation without its $c part is refused" ct-convert parts-$c d.nii; has err 'part . of a concatenation, and part . of 3 is not here' 'and says which'
done
exits 3 'so is one that is named by a part' ct-convert parts-last/a.dcm d.nii
exits 0 'a part that is named stands for all' ct-convert -f parts-whole/b.dcm o.nii; py planes o.nii 6; ok $? 'that lie beside it'
one frames 'frames that SpacingBetweenSlices parts' 6; has err 'frames have no positions of their own' 'with a warning'
for c in nowhere times; do
	exits 5 "frames-$c" ct-convert frames-$c d.nii; has err 'frame 1 has no position' 'frames of no known place are refused'
done

# zones
for c in zones zones-between; do
	exits 0 "$c: slices that are meant to lie further apart" ct-convert -f $c o.nii; py planes o.nii 12; ok $? 'are not missing'
done
exits 5 'without a field that says so' ct-convert lost d.nii; has err '3 slices are missing' 'they are'
exits 5 'a slice that is missing among wide ones' ct-convert zones-lost d.nii; has err '1 slice is missing' 'is one'

# files without an ending
cp -r bare cut
for n in 129 131 132 150 200 300; do
	head -c $n bare/IM0005 >cut/IM0005
	exits 3 "an outermost slice cut to $n bytes is an error" ct-convert cut d.nii; has err 'cut/IM0005: damaged: ' 'that names it'
done
exits 0 'with --skip-damaged' ct-convert -f --skip-damaged cut o.nii; has err 'warning: cut/IM0005: skipped' 'it is named'
mv cut/IM0005 cut/other.x; head -c 150 bare/IM0005 >cut/other.x
exits 3 'so is one with another ending' ct-convert cut d.nii
cat >eio.c <<'X'
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
ssize_t read(int fd, void *p, size_t n)
{
	static ssize_t (*real)(int, void *, size_t);
	char link[40], name[400];
	ssize_t k;
	if (!real)
		*(void **)&real = dlsym(RTLD_NEXT, "read");
	snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
	k = readlink(link, name, sizeof name - 1);
	if (k > 6 && memcmp(name + k - 6, "IM0005", 6) == 0) {
		errno = EIO;
		return -1;
	}
	return real(fd, p, n);
}
X
if ! sanitized ct-convert && cc -shared -fPIC -o eio.so eio.c -ldl 2>/dev/null; then
	exits 3 'a slice that cannot be read is an error' env LD_PRELOAD="$PWD/eio.so" ct-convert bare d.nii
	has err 'bare/IM0005: unreadable: Input/output error' 'that says why'
else
	skip 'a slice that cannot be read is an error' 'no compiler, or a sanitizer'
fi

# DICOMDIR
if command -v dcmmkdir >/dev/null; then
	mkdir -p low cap/IMAGES/A; for f in bare/IM*; do cp "$f" "cap/IMAGES/A/${f#bare/}"; done
	for f in cap/IMAGES/A/*; do dcmodify -nb -i StudyDate=20200101 -i StudyTime=120000 -i StudyID=1 -i PatientName=P -i ImageType='ORIGINAL\PRIMARY\AXIAL' "$f" 2>/dev/null; done
	(cd cap && dcmmkdir +r -I -Nxc +id . >/dev/null 2>&1 IMAGES/A/*)
	if [ -f cap/DICOMDIR ]; then
		mkdir -p low/images/a ver/IMAGES/A dcm/IMAGES/A
		cp cap/DICOMDIR low/dicomdir; cp cap/DICOMDIR 'ver/DICOMDIR;1'; cp cap/DICOMDIR dcm/DICOMDIR
		for n in 0 1 2 3 4 5; do
			cp cap/IMAGES/A/IM000$n low/images/a/im000$n; cp cap/IMAGES/A/IM000$n "ver/IMAGES/A/IM000$n;1"; cp cap/IMAGES/A/IM000$n dcm/IMAGES/A/IM000$n.dcm
		done
		for d in cap low ver dcm; do exits 0 "$d: names of a DICOMDIR, as discs write them, are found" ct-convert -f $d o.nii; py planes o.nii 6; ok $? 'all of them'; done
		rm low/images/a/im0003; exits 3 'but for one that is not there' ct-convert low d.nii; has err 'IM0003: unreadable: listed in low/dicomdir, but not there' 'which is named'
	else
		skip 'DICOMDIR' 'dcmmkdir made none'
	fi
else
	skip 'DICOMDIR' 'no dcmtk'
fi

# what protects
deid() { exits 0 "$1 without identity" ct-convert -f --deid burnt-$1 deid-$1/; }
deid yes; has err 'BurnedInAnnotation of the source is YES: the pixels may show names' 'warns'
py tag deid-yes BurnedInAnnotation YES; ok $? 'writing burnt into one slice is said of all'
py tag deid-yes PatientIdentityRemoved NO; ok $? 'and identity is not said to be removed'
py tag deid-yes LossyImageCompression 01 && py tag deid-yes LossyImageCompressionRatio 12.5 && py tag deid-yes LossyImageCompressionMethod ISO_15444_1; ok $? 'loss in one slice is said of all, with its ratio and method'
deid no; [ ! -s err ] && py tag deid-no BurnedInAnnotation NO && py tag deid-no LossyImageCompression 00 && py tag deid-no PatientIdentityRemoved YES; ok $? 'what all slices deny is denied'
for c in silent half; do
	deid $c; py tag deid-$c BurnedInAnnotation - && py tag deid-$c LossyImageCompression -; ok $? "$c: what is not known is not said"
done
ct-convert -q --deid burnt-yes one.dcm; "$PY" -c 'import pydicom, sys; d = pydicom.dcmread("one.dcm"); sys.exit(d.BurnedInAnnotation != "YES" or d.PatientIdentityRemoved != "NO")'; ok $? 'nor is it of frames in one file'
[ ! -e d.nii ]; ok $? 'no file is left by failures'
done_testing
