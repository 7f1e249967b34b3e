#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# network.sh [SIDE]: a checkpoint of the largest published network of guided diffusion (558 million random weights, in 32
# and in 16 bits) super-resolves a picture of SIDE (512) pixels in less than 6 GB (peak resident set). It says how much
# that was, and the CPU seconds that one call of the network took. 3.4 GB of disk under TMPDIR.
builddir=$(cd "${builddir:?where tests/t-pt is}" && pwd)
. "$(dirname "$0")/lib.sh"
side=${1:-512}
words=in_channels=3,out_channels=6,model_channels=256,num_res_blocks=2,attention_resolutions=16:32:64,channel_mult=0.5:1:1:2:2:4:4,num_head_channels=64
for py in python3 /usr/bin/python3; do "$py" -c 'import numpy' 2>/dev/null && break; done
"${builddir:?}/tests/t-pt" shapes $words >shapes || exit 99
ct-phantom -q --size 64x64x64 --spacing 4 ellipsoids v.nii &&
	ct-project -q --views 1 --det "${side}x$side" --expert pitch=1 --coarsen 4 --pixel mean v.nii y.exr || exit 99
run() { # run STEPS: the peak in kB and the CPU seconds in $peak and $cpu
	env time -f '%M %U' -o used ct-ddnm -f -q -t 1 --steps "$1" --prior net.pt --arch num_head_channels=64 \
		y.exr o.exr 2>err || return 1
	read -r peak cpu <used
}
for form in f32 f16; do
	row "a network of 558 million weights in $form, $side pixels"
	"$py" "$srcdir/tests/long/network.py" shapes net.pt $form 2>err; tally $? 'no checkpoint: numpy?'
	run 1; tally $? 'does not run'
	once=$cpu
	run 2; tally $? 'does not run twice'
	[ "$peak" -lt 5859375 ]; tally $? "$peak kB"
	echo "# $part: $form: $peak kB, $(awk "BEGIN {printf \"%.1f\", $cpu - $once}") CPU seconds a call"
	rm -f net.pt
done
finish
