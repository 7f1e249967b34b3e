#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What ct-upsample tells that it will hold is what it holds, for operators of few weights and others.
. "$srcdir/tests/tap.sh"
. "$srcdir/tests/peak.sh"
if sanitized ct-upsample; then
	skip 'memory' 'sanitizers take their own'
	done_testing
fi
ct-phantom -q --size 144x144x144 ellipsoids hr.nii || exit 99
held() { # held METHOD OPTIONS...: of lr.nii, in held; what it tells, in told, MiB
	ct-upsample -m "$@" --dry-run lr.nii no.nii | sed -n 's/^memory *\([0-9]*\) MiB.*/\1/p' >told
	look peak ct-upsample -q -f -t 1 -m "$@" lr.nii o.nii
	awk '{printf "%.1f\n", $1 / 1024}' used >held
}
for d in '-x 1,1,4 --sigma 0 --decimate mean' '-x 1,1,4 --sigma 0 --decimate point' '-x 1,1,4' '-x 4 --sigma .5 --decimate point' \
	'-x 2' '-x 2,2,1 --sigma .5,.5,.5 --decimate point' '-x 2,1,1 --sigma .5,.5,.5 --decimate point --noise 15' \
	'-x 1,1,4 --sigma 0 --decimate mean --noise 15'; do
	# shellcheck disable=SC2086
	ct-degrade -q -f $d hr.nii lr.nii
	for m in dc tv htv; do
		few=; [ $m = dc ] || few='--iterations 2'
		# shellcheck disable=SC2086
		held $m $few
		# the program with the library of its network is less than what is told of it; what the sample leaves behind
		# that multipliers of noise come from is not in it
		case $d in *noise*) more=6 ;; *) more=0 ;; esac
		awk -v more=$more '{x[NR] = $1} END {exit !(NR == 2 && x[2] > x[1] - 11 && x[2] < x[1] + more)}' told held
		ok $? "$d, $m: $(cat told) MiB told, $(cat held) held"
	done
done
done_testing
