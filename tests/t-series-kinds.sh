#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Series as scanners and archives leave them: passes, copies, parts, frames, zones, cut files, burnt-in writing.
. "$srcdir/tests/tap.sh"
mkdir empty
ct-convert empty e.nii 2>err
if grep -q 'with-vtk' err; then skip 'series' 'built without vtk-dicom'; done_testing; fi
if ! python_with pydicom || ! "$PY" -c 'import nibabel'; then skip 'series' 'no pydicom or no nibabel'; done_testing; fi
calls numpy nibabel pydicom dicom
py() { called "$srcdir/tests/t-series-kinds.py" "$@"; }
py make; ok $? 'the series of this test are made'
one() { exits 0 "$2 are one stack" ct-convert -f "$1" o.nii; py planes o.nii $3 $4; ok $? "$2 give $3 planes"; }
several() { # several FOLDER N WORDS NAME [SPACING]
	exits 5 "$4 are refused with status 5" ct-convert -f "$1" d.nii
	has err "mixed: $2 series" "$4 are listed as $2 series"
	has err "$3" "$4 are told apart by: $3"
	exits 0 "one of the $4 is converted with --series" ct-convert -f --series 1 "$1" o.nii
	py planes o.nii 6 $5
	ok $? "one of the $4 has six planes"
}

# stacks that lie in one another
several pass-acquisition 2 'AcquisitionNumber 2$' 'acquisitions whose places alternate'
several pass-three 3 'AcquisitionNumber 3$' 'three acquisitions whose places alternate'
several pass-reversed 2 'AcquisitionNumber 2$' 'acquisitions in opposite directions'
several pass-phase 2 'NominalPercentageOfCardiacPhase 50$' 'phases of the heart'
several pass-kernel 2 'ConvolutionKernel B70f$' 'kernels'
several pass-kvp 2 'KVP 140$' 'energies'
several pass-contrast 2 'ContrastBolusAgent Iodine$' 'scans with and without contrast'
several pass-space 2 'FrameOfReferenceUID 1.9.8$' 'frames of reference'
several pass-study 2 'StudyInstanceUID 1.9.8$' 'studies under one SeriesInstanceUID'
several nameless-number 2 "'synthetic' SeriesNumber 3 of study 1.2.3$" 'series without UID one behind the other'
several nameless-study 2 'SeriesNumber 1 of study 1.9.8$' 'studies without SeriesInstanceUID'
several pass-about 2 'SeriesDescription native$' 'descriptions of one series'
one each-space 'slices each of a space and a description of its own' 12
several turns 2 'KVP 140$' 'energies in turn' 5
exits 5 'energies that alternate in pairs are refused with status 5' ct-convert -f pairs d.nii
has err 'mixed: 2 series' 'energies that alternate in pairs are listed as two series'
one by-design 'passes of one acquisition' 12
[ ! -s err ]
ok $? 'passes of one acquisition give no message'
one shot 'acquisitions one behind the other' 12
one anew 'acquisitions whose numbers begin again' 12
one zones-kvp 'zones of two energies' 12
has err 'warning: slices .* differ in KVP' 'zones of two energies give a warning'
ct-convert pass-acquisition d.nii 2>err
[ "$(sed -n '1s/.*: mixed: .*/mixed/p; 2s/.*series \(.\): .*/\1/p; 3s/.*series \(.\): .*/\1/p' err | tr -d '\n')" = mixed12 ]
ok $? 'the error of a mixed folder stands before its list of series'

# copies
one copied 'files under two names' 6
has err '6 of 12 files used: 6 repeated$' 'files under two names are counted as repeated'
one rounded 'copies whose positions are rounded' 6
has err '6 of 12 files used: 6 repeated$' 'copies whose positions are rounded are counted as repeated'
ct-info rounded >out; has out '^fit  *yes' 'ct-info finds a folder with rounded copies fit'
several same-acquisition 2 'AcquisitionNumber 2$' 'acquisitions with the same UIDs'
several same-phase 2 'NominalPercentageOfCardiacPhase 50$' 'phases with the same UIDs'
exits 5 'other pixels under the same UID are refused with status 5' ct-convert same d.nii
has err 'two slices at one place: same/00.dcm and same/06.dcm' 'the error of other pixels under one UID names both files'
exits 5 'a slice that was scanned twice is refused with status 5' ct-convert rescan d.nii
has err 'two slices at one place: rescan/03.dcm and rescan/06.dcm, 0.02 mm apart' 'the error of a slice that was scanned twice gives the distance'
one seam-0 'equal slices a hundredth of a millimetre apart at a seam' 11 2.501
exits 5 'unequal slices at a seam are refused with status 5' ct-convert seam-1 d.nii
has err 'two slices at one place' 'the error of unequal slices at a seam says that two lie at one place'

# frames of one file
one enhanced 'frames of one file' 6
for c in groups stacks index times; do
	ct-convert $c d.nii 2>err; a=$?; ct-convert $c/e.dcm d.nii 2>err.file; b=$?
	[ $a -ne 0 ] && [ $a -eq $b ] && cmp -s err err.file; ok $? "$c: a file of frames and its folder are refused alike"
done
has err 'TemporalPositionIdentifier 2$' 'the error of frames of several times names the time'
ct-convert groups d.nii 2>err
has err 'NumberOfFrames is 6, but 4 functional groups' 'frames without a functional group are reported as damage'
exits 5 'two frames at one place are refused with status 5' ct-convert twice d.nii
has err 'twice/e.dcm (frame 4) and twice/e.dcm (frame 7)' 'the error of two frames at one place gives their numbers'
exits 5 'a frame that is missing is refused with status 5' ct-convert frame-lost d.nii
has err 'between frame-lost/e.dcm (frame 2) and frame-lost/e.dcm (frame 3)' 'the error of a missing frame gives the numbers beside it'
one parts-whole 'parts of a concatenation' 6
one parts-backwards 'parts of a concatenation in any order' 6
for c in first middle last; do
	exits 3 "a concatenation without its $c part is refused" ct-convert parts-$c d.nii
	has err 'part . of a concatenation, and part . of 3 is not here' "the error of a concatenation without its $c part says which is missing"
done
exits 3 'a part of an incomplete concatenation is refused with status 3' ct-convert parts-last/a.dcm d.nii
exits 0 'a part of a concatenation is converted with the others' ct-convert -f parts-whole/b.dcm o.nii
py planes o.nii 6
ok $? 'a part of a concatenation stands for all six planes'
one frames 'frames placed by SpacingBetweenSlices' 6
has err 'frames have no positions of their own' 'frames without positions give a warning'
for c in nowhere times; do
	exits 5 "frames-$c: frames without positions are refused with status 5" ct-convert frames-$c d.nii
	has err 'frame 1 has no position' "frames-$c: the error names the frame without a position"
done

# pictures that do not belong
for c in other none; do
	exits 3 "an outermost slice of another modality ($c) is refused with status 3" ct-convert modality-$c d.nii
	has err "modality-$c/05.dcm: Modality is '.*', and that of its series is 'CT'" "the error of another modality ($c) names the file"
	exits 0 "--skip-damaged leaves out a slice of another modality ($c)" ct-convert -f --skip-damaged modality-$c o.nii
	has err "skipped: .*05.dcm: Modality is" "a slice of another modality ($c) that is left out is told"
done
exits 5 'slices of two PatientNames are refused with status 5' ct-convert name-other d.nii
has err 'mixed: 2 series of different patients' 'the error of two PatientNames says that patients differ'
one name-cases 'slices of one PatientName in several cases of letters' 6
one frame-other 'frames of a file without its localizer' 5
has err 'warning: 1 frame is not used: localizer' 'a frame that is not used is told'
one parts-unsaid 'a part of a concatenation of unknown size' 6
has err 'warning: .*no InConcatenationTotalNumber' 'a concatenation of unknown size gives a warning'

# zones
for c in zones zones-between; do
	exits 0 "$c: slices that are farther apart by their own header are converted" ct-convert -f $c o.nii
	py planes o.nii 12
	ok $? "$c: slices that are farther apart by their own header are not missing"
done
exits 5 'a wider gap that no header states is refused with status 5' ct-convert lost d.nii
has err '3 slices are missing' 'the error of a wider gap counts the missing slices'
exits 5 'a stack that lacks most slices by InstanceNumber is refused with status 5' ct-convert most-lost d.nii
has err '3 slices are missing: spacing is 2.5 mm, but 7.5 mm' 'the error of a stack that lacks most slices counts them'
exits 0 '--gaps fill fills a stack that lacks most slices' ct-convert -f --gaps fill most-lost o.nii
py planes o.nii 8
ok $? 'a stack that lacks most slices gets one plane for each'
one most-apart 'uneven slices whose numbers leave none out' 8
exits 5 'a missing slice between wide ones is refused with status 5' ct-convert zones-lost d.nii
has err '1 slice is missing' 'the error of a missing slice between wide ones counts it'

# places that are too near
for c in between-.04 between-.06 between-.08 between-.2 behind-.08; do
	exits 5 "ghost-$c: a slice that is too near to its neighbour is refused with status 5" ct-convert ghost-$c d.nii
	has err 'two slices at one place: .*06.dcm, .* mm apart, and others 2.5' "ghost-$c: the error gives both distances"
done
exits 5 'a second series a little beside the first is refused with status 5' ct-convert second d.nii
one zone-thin 'slices with a zone of thin ones' 31 .5

# which series of a folder, and what is in one without
one with-scout 'slices beside a localizer' 6
has err 'series 1 of 2 is read, the only one of CT slices: 6 slices' 'the series that is read of several is told, and why'
exits 0 'a file of a folder with several series is converted' ct-convert -f with-scout/00.dcm o.nii
has err 'series 1 of 2 is read, that of the file' 'the series of a file that is named is told'
exits 0 '--series names one of several series' ct-convert -f --series 1 with-scout o.nii
if grep -q 'is read,' err; then r=1; else r=0; fi; ok $r 'a series that was asked for is not told'
mkdir others; for f in a.txt b.csv c.md d.log e.ini; do echo x >others/$f; done
exits 3 'a folder without DICOM is refused with status 3' ct-convert others d.nii
has err 'no DICOM pictures among 5 files: 5 not DICOM (a.txt, b.csv, c.md, d.log, ...)' 'the error of a folder without DICOM lists what is in it'
[ "$(wc -l <err)" -eq 1 ]; ok $? 'what is in a folder without DICOM is one line'

# scales that are not those of the values
for c in one first last two apart little slope; do
	exits 3 "jump-$c: values that jump with the scale are refused with status 3" ct-convert jump-$c d.nii
	has err "jump-$c/[0-9]*.dcm: RescaleSlope .* in .* beside it: the values jump by" "jump-$c: the error names slice and scale"
	exits 0 "jump-$c: --units hu reads values that jump with the scale" ct-convert -f --units hu jump-$c o.nii
done
ct-convert jump-one d.nii 2>err; has err 'jump-one/03.dcm: RescaleSlope 1 and RescaleIntercept -924' 'the error names the slice whose scale is rare'
ct-info jump-one >out 2>err; has out 'RescaleIntercept -924' 'ct-info tells of a slice whose scale is wrong'
for c in own zones; do
	exits 0 "scales-$c: scales that differ with the values are read" ct-convert -f scales-$c o.nii
	[ ! -s err ]; ok $? "scales-$c: scales that differ with the values give no message"
done
exits 3 'a RescaleSlope by which all numbers are within 5 HU is refused' ct-convert slope-thousandth d.nii
has err 'RescaleSlope is 0.001: all numbers of 12 bits lie within 4.095 HU' 'the error of a small RescaleSlope gives the range'
exits 0 'a RescaleSlope of a twentieth is read' ct-convert -f slope-twentieth o.nii
has err 'warning: RescaleSlope is 0.05: all values lie within' 'values of a CT that lie close together give a warning'

# values that no CT shows
told() { # told FOLDER WORDS NAME
	exits 0 "$3: the series is read" ct-convert -f "$1" o.nii
	has err "warning: .*$2" "$3: a warning says so"
}
told no-air 'no value lies below' 'an intercept of 0 of numbers that begin there'
told flat-inner 'flat-inner/03.dcm: all its values are the same' 'a slice of one value between others'
told padding-tissue 'which tissue has: [0-9]* pixels are taken for padding' 'a range of padding that holds tissue'
told turned 'turned/02.dcm: a part of its values lies below -4096 or above 16000 HU' 'a slice whose bytes are turned'
told aside 'slices lie up to 3 mm beside the first' 'a slice that lies aside'
for c in flat-outer padding-air; do
	exits 0 "$c: the series is read" ct-convert -f $c o.nii
	[ ! -s err ]; ok $? "$c: what a CT may show gives no message"
done

# files without an ending
cp -r bare cut
for n in 129 131 132 150 200 300; do
	head -c $n bare/IM0005 >cut/IM0005
	exits 3 "an outermost slice cut to $n bytes is refused with status 3" ct-convert cut d.nii
	has err 'cut/IM0005: damaged: ' "the error of a slice cut to $n bytes names it"
done
exits 0 '--skip-damaged converts a series with a slice that is cut' ct-convert -f --skip-damaged cut o.nii
has err 'warning: cut/IM0005: skipped' '--skip-damaged warns of the slice that it skips'
mv cut/IM0005 cut/other.x; head -c 150 bare/IM0005 >cut/other.x
exits 3 'a slice with another suffix that is cut is refused with status 3' ct-convert cut d.nii
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
	exits 3 'a slice that cannot be read is refused with status 3' env LD_PRELOAD="$PWD/eio.so" ct-convert bare d.nii
	has err 'bare/IM0005: unreadable: Input/output error' 'the error of a slice that cannot be read gives the reason'
else
	skip 'a slice that cannot be read is refused with status 3' 'no compiler, or a sanitizer'
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
		for d in cap low ver dcm; do
			exits 0 "$d: files are found by the names that a disc writes" ct-convert -f $d o.nii
			py planes o.nii 6
			ok $? "$d: all six files of the DICOMDIR are used"
		done
		rm low/images/a/im0003
		exits 3 'a DICOMDIR of a disc that lists a missing file is refused' ct-convert low d.nii
		has err 'IM0003: unreadable: listed in low/dicomdir, but not there' 'the error of a DICOMDIR of a disc names the missing file'
	else
		skip 'files are found by the names that a disc writes' 'dcmmkdir made none'
	fi
else
	skip 'files are found by the names that a disc writes' 'no dcmtk'
fi

# what protects
deid() { exits 0 "--deid converts a series with burnt-in writing: $1" ct-convert -f --deid burnt-$1 deid-$1/; }
deid yes
has err 'BurnedInAnnotation of the source is YES: the pixels may show names' '--deid warns of writing that is burnt into the pixels'
py tag deid-yes BurnedInAnnotation YES; ok $? 'writing burnt into one slice is recorded for all slices'
py tag deid-yes PatientIdentityRemoved NO; ok $? 'with burnt-in writing the identity is not recorded as removed'
py tag deid-yes LossyImageCompression 01 && py tag deid-yes LossyImageCompressionRatio 12.5 && py tag deid-yes LossyImageCompressionMethod ISO_15444_1
ok $? 'lossy compression of one slice is recorded for all, with ratio and method'
deid no
[ ! -s err ] && py tag deid-no BurnedInAnnotation NO && py tag deid-no LossyImageCompression 00 && py tag deid-no PatientIdentityRemoved YES
ok $? 'no writing and no loss in all slices are recorded as no'
py tag deid-no LossyImageCompressionMethod -; ok $? 'the method of a compression without loss is not kept'
for c in silent half; do
	deid $c
	py tag deid-$c BurnedInAnnotation - && py tag deid-$c LossyImageCompression -
	ok $? "$c: what not all slices state is not recorded"
done
for c in word second; do
	deid $c
	py tag deid-$c BurnedInAnnotation YES && py tag deid-$c PatientIdentityRemoved NO
	ok $? "$c: a value that means YES in one slice is recorded for all"
done
ct-convert -q --deid burnt-yes one.dcm
"$PY" -c 'import pydicom, sys; d = pydicom.dcmread("one.dcm"); sys.exit(d.BurnedInAnnotation != "YES" or d.PatientIdentityRemoved != "NO")'
ok $? 'burnt-in writing is recorded in one file of frames'
[ ! -e d.nii ]; ok $? 'refused series of every kind leave no volume'
done_testing
