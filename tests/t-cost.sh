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

# What --dry-run tells of memory and disk is the size of what is held; the time is that of what was tried,
# as many times as it is to be done.
part figures
if sanitized ct-upsample; then
	skip 'memory' 'sanitizers take their own'
	done_testing
fi
cost() { "$@" --dry-run >out 2>err || cat err; } # cost TOOL ARGS...
mib() { sed -n "s/^$1  *\([0-9]*\) MiB.*/\1/p" out; }
state() { sed -n 's/^disk .* and \([0-9]*\) MiB of state.*/\1/p' out; }
seconds() { sed -n 's/^time  *\([0-9.]*\) s .*/\1/p; s/^time  *\([0-9.]*\) h .*/\1 * 3600/p' out; }
json() { sed -n "s/^  \"$1\": \"\{0,1\}\([^,\"]*\).*/\1/p" out; }
is() { # is NAME EXPRESSION: awk says so
	awk "BEGIN {exit !($2)}"; ok $? "$1 ($(echo "$2" | tr -s "\n\t " " "))"
}
ct-phantom -q --size 128x128x128 --expert oversample=1 sphere big.nii && # 8 MiB
	ct-degrade -q -x 2 big.nii lr.nii && ct-upsample -q -m linear lr.nii up.nii &&
	ct-phantom -q --size 64x64x64 --expert oversample=1 sphere mid.nii && # 1 MiB
	exact sphere low.exr '--size 64x64x64' -n 640 --det 16 &&
	exact sphere high.exr '--size 64x64x64' -n 640 --det 64 && # 10 MiB
	exact sphere many.exr '--size 64x64x64' -n 8192 --det 4 &&
	ct-project -q -n 16 --det 64 big.nii p.exr
ok $? 'figures of volumes and projections hold'

# 11 MiB of the program, and the volumes of 8 MiB that each method holds, or halves and quarters of them between its passes, and the scan twice:
# 1 + 3/4, 1 + 3/2, 1 + 6/4 + 1/8 and what tells how it agrees, 5/8, which is more; 1 + 1 + 12/4 and the same
for m in linear=27 dc=33 tv=38 htv=57; do
	cost ct-upsample -t 1 -m ${m%=*} lr.nii no.nii
	is "ct-upsample -m ${m%=*}" "$(mib memory) == ${m#*=} && $(mib disk) == 8"
done
cost ct-upsample -t 1 --std s.nii lr.nii no.nii # two of the volumes at the end, when the others are gone
is 'ct-upsample --std' "$(mib memory) == 38 && $(mib disk) == 16"
cost ct-upsample -t 1 -m htv --tolerance 0 --iterations 100 --json lr.nii no.nii; few=$(json seconds)
cost ct-upsample -t 1 -m htv --tolerance 0 --iterations 1000 --json lr.nii no.nii
is 'it takes longer than the piece that was tried' "$(json seconds) > 3 * $few"
cost ct-upsample -t 1 -m htv lr.nii no.nii; all=$(seconds); cost ct-upsample -t 1 -m htv --iterations 100000 lr.nii no.nii
is 'more iterations than it usually takes do not' "$(seconds) < 20 * $all"

# what a prior takes of a scan that is not flat
ct-phantom -q --size 128x128x128 --expert oversample=1 ellipsoids uneven.nii && ct-degrade -q -x 2 uneven.nii half.nii || exit 99
cost ct-upsample -t 1 half.nii no.nii; alone=$(seconds)
cost ct-upsample -m prior -t 1 --prior "$builddir/slices.safetensors" half.nii no.nii
is 'the prior takes longer than the inversion before it' "$(seconds) > 2 * $alone"
# and of one that is flat but for little
ct-phantom -q --size 64x64x512 ellipsoids rod.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean rod.nii rods.nii || exit 99
cost ct-upsample -m prior -t 1 --prior "$builddir/slices.safetensors" rods.nii no.nii
is 'a scan that is flat but for little' "$(seconds) < 60"

# of a projector all that is not the volumes and projections is of its own
cost ct-project -t 1 -n 64 --json big.nii no.exr; once=$(json seconds)
cost ct-project -t 1 -n 64 big.nii no.exr; few=$(mib memory) own=$(($(mib memory) - 12))
is 'ct-project' "$(mib disk) == 4 && $own >= 0 && $own < 20"
cost ct-project -t 1 -n 6400 big.nii no.exr
is '100 times the views, and the bytes of their file' "$(mib disk) == 400 && $(mib memory) > $few + 760 && $(mib memory) < $few + 793"
cost ct-project -t 1 -n 6400 --json big.nii no.exr
is 'in as many times the time, or so' "$(json seconds) > 20 * $once"
cost ct-project -t 1 -n 64 --photons 1e4 big.nii no.exr
is '--photons: the attenuation too' "$(mib disk) == 4 && $(mib memory) == $few + 8"
cost ct-project -t 1 -n 512 --coarsen 8 --pixel mean big.nii no.exr; mean=$(mib memory)
is '--coarsen' "$(mib disk) == 1"
cost ct-project -t 1 -n 512 --coarsen 8 big.nii no.exr
is '--pixel mean: the fine ones too, 32 MiB' "$mean - $(mib memory) >= 31 && $mean - $(mib memory) <= 36"

cost ct-fdk -t 1 high.exr no.nii --grid 64; small=$(mib memory)
is 'ct-fdk' "$(mib disk) == 1 && $small >= 11 && $small < 40"
cost ct-fdk -t 1 high.exr no.nii --grid 256
is 'on 64 MiB' "$(mib disk) == 64 && $(mib memory) - $small == 63"
cost ct-fdk -t 1 --grid 160 --json low.exr no.nii; once=$(json seconds)
cost ct-fdk -t 1 --grid 160 --json many.exr no.nii
is 'of 13 times the views' "$(json seconds) > 4 * $once"
for m in sirt=2 cgls=2 tv=5; do
	cost ct-fdk -t 1 -m ${m%=*} --grid 128 p.exr no.nii # 8 MiB, and 0.25
	is "ct-fdk -m ${m%=*}" "$(mib disk) == 8 && $(mib memory) >= ${m#*=} * 8 + 8 + 0.75 &&
		$(mib memory) < ${m#*=} * 8 + 8 + 0.75 + 1 + $own"
done
cost ct-fdk -t 1 -m sirt -n 1 --grid 64 high.exr no.nii; one=$(seconds)
cost ct-fdk -t 1 -m sirt -n 1000000 --grid 64 high.exr no.nii
is 'a million iterations' "$(seconds) > 1000 * $one"

calls() { sed -n 's/^work  *\([0-9]*\) calls of \([0-9.]*\) s .*/\1 \2/p' out; }
told() { # told SAMPLES THREADS: the time of 3 * SAMPLES calls a view
	# shellcheck disable=SC2046
	set -- "$@" $(calls)
	is "the time of $3 calls" "$3 == 3 * 640 * $1 && $(seconds) * $2 - $3 * $4 < $3 * 0.00051 + 2 * $2 &&
		$3 * $4 - $(seconds) * $2 < $3 * 0.00051 + 2 * $2"
}
cost ct-ddnm -t 1 -x 4 -n 3 low.exr no.exr; one=$(mib memory)
is 'ct-ddnm' "$(mib disk) == 10 && $(state) == 10 && $one > 46 && $one < 86" # 16 of weights, 20 of OUT and of its file
told 1 1
cost ct-ddnm -t 4 -x 4 -n 3 -k 2 low.exr no.exr; told 2 4
is 'a plan a thread' "$(mib memory) > $one + 3 * 2 && $(mib memory) < $one + 3 * 9"
cost ct-ddnm -t 1 -x 4 -n 3 --init high.exr low.exr no.exr
is 'and what it begins from' "$(mib memory) > $one + 3 && $(mib memory) < $one + 14 && $(mib disk) == 10 && $(state) == 10"

net=model_channels=32,channel_mult=1:2
cost ct-train -a $net -p 32 --expert batch=1 no.safetensors p.exr; flop=$(sed -n 's/.* and \([0-9.]*\) GFLOP.*/\1/p' out)
n=$(sed -n 's/.* \([0-9]*\) parameters$/\1/p' out)
is 'ct-train' "$(mib disk) == int($n / 2 ^ 18) + 1 && $(state) == int($n / 2 ^ 16) + 1 && $n > 700000"
each=$(sed -n 's/^work .* steps of \([0-9.]*\) s .*/\1/p' out)
is '10000 steps' "$(seconds) <= 10000 * ($each + 0.0051) && $(seconds) >= 10000 * ($each - 0.0051)"
cost ct-train -a $net -p 32 --expert batch=5 --half no.safetensors p.exr
is 'half of it' "$(mib disk) == int($n / 2 ^ 19) + 1 && $(state) == int($n / 2 ^ 16) + 1"
more=$(sed -n 's/.* and \([0-9.]*\) GFLOP.*/\1/p' out)
is '5 times the work a step' "$more < 5 * $flop + 0.3 && $more > 5 * $flop - 0.3 && $flop > 1 && $flop < 3"

# to the byte
pixels=$((16 * 64 * 64)) voxels=$((128 * 128 * 128))
set -- -t 1 --json -b up.nii -g 50
cost ct-nabgs "$@" -n 1 --expert max-gaussians=100 p.exr no.ply; once=$(json seconds)
is 'ct-nabgs: none are new before a control of their number' "$(json disk-bytes) == 50 * 44"
cost ct-nabgs "$@" -n 700 --expert max-gaussians=1000000 p.exr no.ply
is 'which at most doubles it, at 600' "$(json disk-bytes) == 100 * 44"
cost ct-nabgs "$@" -n 100000 --expert max-gaussians=100 p.exr no.ply
is 'up to the most' "$(json disk-bytes) == 4400 && $(json state-bytes) == 14400"
few=$(json memory-bytes) each=408 # bytes of a Gaussian, of one in a view, and of 56 floats
is 'its memory' "$few > 4 * (2 * $voxels + 3 * $pixels) && $few < 6 * (2 * $voxels + 3 * $pixels)"
cost ct-nabgs "$@" -n 100000 --expert max-gaussians=1000000 p.exr no.ply
is 'of 1000000' "$(json disk-bytes) == 44000000 && $(json memory-bytes) - $few > 999900 * $each - 2 ^ 22 &&
	$(json memory-bytes) - $few < 999900 * $each + 2 ^ 22"
would=$(json work | sed -n 's/.* it would be \([0-9]*\) s$/\1/p')
is 'more Gaussians take longer' "$would > 15000 * $(json seconds) && $would < 21000 * $(json seconds)"
cost ct-nabgs "$@" -n 10000000 --expert max-gaussians=100 p.exr no.ply
is 'as do more iterations' "$(json seconds) > 10000 * $once"
cost ct-nabgs "$@" -n 5 --expert max-gaussians=100 p.exr no.ply
is 'some are tried' "$(json seconds) < 10 * $once"
for r in '' --residual-out=r.nii; do
	cost ct-fuse -t 1 --json $r up.nii lr.nii p.exr no.nii
	is "ct-fuse $r" "$(json disk-bytes) == 4 * $voxels * (1 + (\"$r\" != \"\")) && $(json state-bytes) == 20 * $voxels"
done
is 'its memory' "$(json memory-bytes) > 20 * $voxels && $(json memory-bytes) < 60 * $voxels"
[ "$(echo no.*)" = 'no.*' ] && [ ! -e r.nii ]; ok $? 'and nothing is made'
done_testing
