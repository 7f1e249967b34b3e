#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# No command removes or changes a file or folder that it was not told to write: what stands beside OUT has names
# like OUT, like temporary files of any version, and like working folders with a mark that is not theirs.
. "$srcdir/tests/tap.sh"
mkdir in w && cd in || exit 99
ct-phantom -q -w -512:3071 --size 16x16x16 --spacing 4 marks hr.nii
ct-degrade -q -x 2 hr.nii lr.nii
ct-degrade -q -x 4 hr.nii lr4.nii
ct-upsample -q -x 2 -m linear lr.nii up.nii
ct-project -q -n 12 hr.nii hr.exr
ct-phantom -q -w -512:3071 --size 24x24x24 --spacing 4 marks big.nii && ct-project -q -n 8 --coarsen 4 big.nii low.exr
ct-nabgs -q -n 20 -g 100 --expert max-gaussians=100 -b up.nii hr.exr residual.ply >/dev/null
ct-convert -q hr.nii dicom/ 2>/dev/null
[ -s residual.ply ] || exit 99
cd ../w || exit 99
host=$(uname -n) boot=$(cat /proc/sys/kernel/random/boot_id)
mark() { # mark FOLDER OF [HOST [BOOT [INODE]]]: a working folder of a killed run
	mkdir -m 700 "$1"
	printf 'ctsr temporary 1\ninode %s\nof %s\nhost %s\nboot %s\n' "${5-$(stat -c %i "$1")}" "$2" "${3-$host}" "${4-$boot}" >"$1/mark"
	echo data >"$1/data"
}
neighbours() { # neighbours OUT: more than 30, named like it
	for end in .ct-thorax .ct-abdome .ct-Ab3xY9 .state.ct-000000 .ct-locked .state.ct-locked .tmp .part .json.ct-ABCDEF; do
		echo "$1$end" >"$1$end"; echo "$1$end" >"x$1$end"
	done
	for end in .ct-pelvis .ct-XXXXXX .state.ct-folder .ct-q00000; do
		mkdir -p "$1$end/deep"; echo a >"$1$end/a.dcm"; echo b >"$1$end/deep/b"; cp "$1$end/a.dcm" "$1$end/ctsr0001.dcm"
	done
	ln -s ../in/hr.nii "$1.ct-linked"; ln -s nowhere "$1.ct-broken"; mkfifo "$1.ct-fifo00"
	k=$((k + 1))
	n=$(printf .ctsr-tmp-n%02d $k)
	echo file >"${n}fff"; mkdir -m 700 "${n}eee"; mkdir -m 700 "${n}uuu"; echo mine >"${n}uuu/data"
	mark "${n}hhh" "$1" elsewhere 0-0
	mark "${n}iii" "$1" "$host" "$boot" 1
	mark "${n}bbb" "$1x"; mark "${n}sss" "$1.state.more"; mark "${n}eeX" ''
	mark "${n}rrr" "$1"; chmod 755 "${n}rrr"
	mark "${n}mmm" "$1"; echo note >"${n}mmm/note"
	mark "${n}ddd" "$1"; rm "${n}ddd/data"; mkdir "${n}ddd/data"; echo scan >"${n}ddd/data/scan.dcm"
	mark "${n}DDD" "$1"; rm "${n}DDD/data"; mkdir -p "${n}DDD/data/ctsr0001.dcm"
	mark "${n}lll" "$1"; mv "${n}lll/mark" "${n}lll.mark"; ln -s "../${n}lll.mark" "${n}lll/mark"
	mark "${n}aaa" "$1"; cp -a "${n}aaa" "${n}ccc"; rm -r "${n}aaa"
	mark "${n}zzz" "$1"; echo more >>"${n}zzz/mark"
	mark "${n}long" "$1"; mark "ctsr-tmp-$k" "$1"; ln -s "ctsr-tmp-$k" "${n}LLL"
}
outs='o.nii o.nii.gz o.mha o.nrrd series o.dcm o.exr o.png o.html o.ply o.safetensors o2.nii o.csv o.json o.txt'
k=0
for o in $outs; do neighbours "$o"; done
cp -r ../in/hr.nii keep.ct-folder
but=$(for o in $outs o.safetensors.state kept; do printf ' ! ( -path ./%s -o -path ./%s/* )' $o $o; done)
seen() { # all but what was to be written
	set -f
	# shellcheck disable=SC2086
	{ find . -mindepth 1 $but -printf '%y %m %u %p %l\n'; find . -type f $but -exec cksum {} +; } | sort
	set +f
}
seen >../before
[ "$(grep -c '^[dflp] ' ../before)" -gt 200 ]; ok $? "there are $(grep -c '^[dflp] ' ../before) neighbours"
stays() { # stays NAME: nothing is gone or changed, nothing came
	seen >../after
	cmp -s ../before ../after; ok $? "$1: all that stands beside it is as it was"
	diff ../before ../after | head -n 20 | sed 's/^/# /'
}
run() { # run OUT COMMAND...: twice, the second time over what is there
	o=$1; shift
	if "$@" >../out 2>../err && "$@" -f >>../out 2>>../err && [ -e "$o" ]; then stays "$*"; else ok 1 "$*: $(tail -n 1 ../err)"; fi
}
i=../in
for o in o.nii o.nii.gz o.mha o.nrrd; do run $o ct-convert -q $i/hr.nii $o; done
[ ! -e $i/dicom ] || for o in series/ o.dcm; do run $o ct-convert -q $i/hr.nii $o; done
rm -rf o.nii o.exr series
run o.nii ct-phantom -q --size 9x9x9 cube o.nii; rm o.nii
run o.nii ct-degrade -q -x 2 $i/hr.nii o.nii; rm o.nii
run o.nii ct-upsample -q -x 2 $i/lr.nii o.nii; rm o.nii
run o2.nii ct-upsample -q -m prior -x 2 --std o2.nii $i/lr.nii o.nii; rm o.nii
rm o2.nii; run o2.nii ct-sr -q --confidence o2.nii $i/lr.nii o.nii; rm o.nii
[ ! -e $i/dicom ] || run series/ ct-sr -q -x 2 $i/dicom/ series/
run o.exr ct-project -q -n 6 $i/hr.nii o.exr
run o.nii ct-fdk -q $i/hr.exr o.nii; rm o.nii
run o.nii ct-compose -q $i/up.nii $i/residual.ply o.nii; rm o.nii
run o.nii ct-fuse -q -n 4 $i/up.nii $i/lr.nii $i/hr.exr o.nii; rm o.nii o.exr
run o.exr ct-ddnm -q -x 4 -n 2 $i/low.exr o.exr
run o.ply ct-nabgs -q -b $i/up.nii -n 20 -g 100 --expert max-gaussians=100 $i/hr.exr o.ply
run o.safetensors ct-train -q --arch model_channels=32,channel_mult=1 -p 8 --expert batch=2 -n 2 o.safetensors $i/hr.exr
run o.nii ct-metrics -q --consistency $i/lr.nii --map o.nii $i/hr.nii; rm -f o.nii
run o.nii ct-sr -q -x 4 --paper --expert views=6,iterations=20,gaussians=100 --keep kept $i/lr4.nii o.nii; rm -rf kept o.nii
TMPDIR=. run o.nii ct-sr -q -x 4 --paper --expert views=6,iterations=20,gaussians=100 $i/lr4.nii o.nii; rm -f o.nii
[ ! -e $i/dicom ] || run o.json ct-convert -q --sidecar=o.json $i/dicom/ o.nii; rm -f o.nii
run o.csv ct-metrics -q --per-slice=o.csv $i/hr.nii $i/up.nii
run o.html ct-report -q $i/lr.nii $i/up.nii o.html
run o.png ct-view -q $i/hr.nii o.png
signalled 1 9 ct-nabgs -q -b $i/up.nii -n 20 -g 100 --expert max-gaussians=100 -f $i/hr.exr o.ply 2>/dev/null
run o.ply ct-nabgs -q -f -b $i/up.nii -n 20 -g 100 --expert max-gaussians=100 $i/hr.exr o.ply
lib=$(ls "$builddir"/libctsr.so.0 "$builddir"/.libs/libctsr.so.0 2>/dev/null | head -n 1)
if [ -n "$lib" ] && python_with numpy && ! sanitized ct-sr; then
	for o in o.nii o.nii.gz o.mha o.nrrd; do
		rm -f $o
		CTSR_LIBRARY=$lib PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$srcdir/python "$PY" -c "
import ctsr, sys
v = ctsr.read(sys.argv[1])
ctsr.write(v, sys.argv[2])
ctsr.write(v, sys.argv[2], overwrite=True)" $i/hr.nii $o 2>../err
		[ -s $o ]; ok $? "Python writes $o"; sed 's/^/# /' ../err
		stays "Python, $o"
	done
else
	skip 'Python' 'no shared library, or no numpy'
fi
done_testing
