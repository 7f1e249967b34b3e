#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# --dry-run tells the cost of every command in the same words, and makes nothing.
. "$srcdir/tests/tap.sh"
ct-phantom --size 16x16x16 --spacing 4 ellipsoids hr.nii
ct-degrade -x 2 hr.nii lr.nii
ct-upsample -x 2 -m linear lr.nii up.nii
ct-project -n 4 hr.nii p.exr
ct-project -n 4 --coarsen 4 hr.nii low.exr
cost() { # cost STATE TOOL ARGS...: STATE is a regular expression of what follows the disk
	state=$1; shift
	exits 0 "$1 --dry-run" "$@" --dry-run
	[ "$(tail -n 4 out | cut -c1-10 | tr -d '\n')" = 'work      time      memory    disk      ' ]
	ok $? 'a dry run ends with the four lines of the cost'
	grep -Eq '^time      ([1-9][0-9]* s|[0-9.]+ h) on [1-9][0-9]* threads$' out &&
		grep -Eq '^memory    [1-9][0-9]* MiB$' out &&
		grep -Eq "^disk      [1-9][0-9]* MiB$state\$" out; ok $? 'a dry run states disk in one form'
	[ ! -e new ]; ok $? 'a dry run makes no output'
}
kept=', and [1-9][0-9]* MiB of state until it is done'
cost '' ct-upsample lr.nii new
cost '' ct-project -n 4 hr.nii new
cost '' ct-fdk p.exr new
cost '' ct-fdk -m sirt p.exr new
cost "$kept" ct-ddnm -x 4 -n 2 low.exr new
cost "$kept" ct-nabgs -b up.nii -g 50 --expert max-gaussians=100 p.exr new
cost "$kept" ct-fuse -n 2 up.nii lr.nii p.exr new
cost "$kept" ct-train -a model_channels=32,channel_mult=1:2 -p 8 --expert batch=1 new p.exr
exits 0 'a dry run is printed as JSON' ct-nabgs --dry-run --json -b up.nii -g 50 --expert max-gaussians=100 p.exr new
python3 -c '
import json
c = json.load(open("out"))
assert set(c) == {"work", "seconds", "threads", "memory-bytes", "disk-bytes", "state-bytes"}
assert c["disk-bytes"] == 4400 and c["memory-bytes"] > 0 and c["seconds"] > 0'
ok $? 'with the same numbers'
ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean hr.nii thick.nii
cost '' ct-upsample -m prior -p "$builddir/slices.safetensors" thick.nii new
has out '^work *tv and the prior of 4096 voxels$' 'a dry run of the prior names it'
done_testing
