#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# One step, one function: a command, libctsr and the package for Python make the same of the same, and refuse the same in
# the same words.
unset CTSR_CPU
. "$srcdir/tests/tap.sh"
lib=$(ls "$builddir"/libctsr.so.0 2>/dev/null)
if [ -z "$lib" ] || ! python_with numpy; then echo '1..0 # SKIP no shared library, or no numpy'; exit 0; fi
! sanitized ct-project || { echo '1..0 # SKIP sanitizers are not of Python'; exit 0; }
CTSR_LIBRARY=$lib PYTHONDONTWRITEBYTECODE=1 PYTHONPATH="$srcdir/python"; export CTSR_LIBRARY PYTHONDONTWRITEBYTECODE PYTHONPATH
c() { "$builddir/tests/one-step" "$@"; }
calls numpy ctsr
py() { called "$srcdir/tests/one-step.py" "$@"; }
# step NAME END STEP 'IN...' 'KEY=VALUE...' COMMAND...: the three make OUT, which ends so; the command's is OUT in COMMAND
step() {
	name_=$1 end_=$2 step_=$3 in_=$4 how_=$5; shift 5
	n=$((n + 1))
	# shellcheck disable=SC2086
	{ exits 0 "$name_" "$@" "a$n.$end_"
		exits 0 "step $n: the library runs $step_ on $in_" c $step_ $in_ "b$n.$end_" $how_
		exits 0 "step $n: Python runs $step_ on $in_" py $step_ $in_ "c$n.$end_" $how_; }
	exits 0 "step $n: command, library and Python make the same numbers by $step_ of $in_" py same "a$n.$end_" "b$n.$end_" "c$n.$end_"
}
# refused NAME STATUS END STEP 'IN...' 'KEY=VALUE...' COMMAND...: with the same words behind the name of the file or argument
refused() {
	name_=$1 status_=$2 end_=$3 step_=$4 in_=$5 how_=$6; shift 6
	exits "$status_" "$name_" "$@" "no.$end_"; words "s/^ct-[a-z]*: //; s/--expert t-start/start/; s/--expert operator/pixel/; s/--quantity density/density/; s/--//g" >want
	# shellcheck disable=SC2086
	{ exits "$status_" "the library refuses $step_ of $in_ with status $status_" c $step_ $in_ "no.$end_" $how_; words >got; }
	# shellcheck disable=SC2086
	{ exits "$status_" "Python refuses $step_ of $in_ with status $status_" py $step_ $in_ "no.$end_" $how_; words >too; }
	cmp -s want got && cmp -s got too; ok $? "command, library and Python refuse $step_ of $in_ in the same words"
	cmp -s want got && cmp -s got too || sed 's/^/# /' want got too
	[ ! -e "no.$end_" ]; ok $? "$step_ of $in_ that is refused makes no output"
}
# The message, without the name and what only a command or only a call can do about it. An option of a command is a member
# of that meaning: a call that names one with its dashes is seen.
words() { sed "$1; s/^[^: ]*: //; s/ (but see .*//; s/: give .*//; s/\(ct-[a-z]*\) --/\1 /g; s/^units //; s/\(low\|fine\|sinc\)\.exr/projections/; s/fine\.nii/reference/; 1q" err; }
# figures NAME STEP 'IN...' 'KEY=VALUE...' OPTION...: the three report the same of ct-metrics, of views those of --per-slice
figures() {
	name_=$1 step_=$2 in_=$3 how_=$4; shift 4
	n=$((n + 1)); views=''
	case $in_ in *.exr*) views="--per-slice v$n.csv" ;; esac
	# shellcheck disable=SC2086
	case $step_ in compare) exits 0 "$name_" ct-metrics -q "$@" $views $in_ ;; *) exits 0 "$name_" ct-metrics -q --consistency $in_ ;; esac
	{ grep -E '^(psnr|ssim|mae|rmse|bias|max|gradient|residual-(max|p95|rms|mean))' out; [ -z "$views" ] || awk -F, 'NR > 1 {print $1, $3, $7}' "v$n.csv"; } >"a$n.txt"
	# shellcheck disable=SC2086
	{ exits 0 "step $n: the library gives the figures of $step_ for $in_" c $step_ $in_ "b$n.txt" $how_
		exits 0 "step $n: Python gives the figures of $step_ for $in_" py $step_ $in_ "c$n.txt" $how_; }
	cmp -s "a$n.txt" "b$n.txt" && cmp -s "a$n.txt" "c$n.txt"; ok $? "step $n: command, library and Python give the same figures of $step_ for $in_"
}
n=0
ct-phantom -q --size 24x24x24 --spacing 2 ellipsoids fine.nii && ct-degrade -q -x 2 fine.nii lr.nii && ct-degrade -q -x 2,2,1 fine.nii lr-axes.nii &&
	ct-upsample -q -m linear lr.nii up.nii && ct-upsample -q -m linear lr-axes.nii up-axes.nii; ok $? 'a phantom, its scans and their refinements are made'
"$PY" - <<'PY'
import ctsr, numpy as np
def put(name, image, **meta):
    image.meta.update(meta)
    image.meta.pop('input', None)
    ctsr.write(image, name)
up = ctsr.read('up.nii')
up.affine[0, 3] += 5000
put('beside.nii', up)
hu = ctsr.read('up.nii')
put('mu.nii', ctsr.Image(hu.data, hu.affine), quantity='mu')
put('grey.nii', ctsr.Image((np.clip(hu.data, -1024, 3071) + 1024) / 4095, hu.affine))
plain = ctsr.read('fine.nii')
plain.meta.pop('window')
put('plain.nii', plain)
clipped = ctsr.read('fine.nii')
clipped.meta.pop('window')
clipped.data = np.clip(clipped.data, -1000, 500)
put('clipped.nii', clipped, clip='-1000:500')
put('mask.nii', ctsr.Image(hu.data > -200, hu.affine), quantity='other')
put('wide.nii', ctsr.Image(hu.data, hu.affine), window='-1024:2000')
PY
ok $? 'volumes of other places, quantities and windows are written'
ct-degrade -q -x 2 clipped.nii over.nii; ok $? 'one that has overshoots'

# Projections.
step 'a volume is projected' exr project fine.nii 'views=6' ct-project -q -n 6 fine.nii
step 'overshoots' exr project over.nii 'views=6 overshoot=1 window=-1000:500' ct-project -q -n 6 --overshoot -w -1000:500 over.nii
py same a2.exr b2.exr && ! py same a2.exr a1.exr 2>/dev/null; ok $? 'projections with overshoots are not those of the phantom'
step 'large pixels' exr project fine.nii 'views=6 coarsen=4 pixel=1' ct-project -q -n 6 --coarsen 4 --pixel mean fine.nii
step 'a narrow window' exr project plain.nii 'views=6 window=-200:300' ct-project -q -n 6 -w -200:300 plain.nii
step 'the window of the volume' exr project wide.nii 'views=6' ct-project -q -n 6 wide.nii
step 'a factor an axis' exr project lr-axes.nii 'views=6' ct-project -q -n 6 lr-axes.nii
refused 'another quantity' 3 exr project mu.nii 'views=6' ct-project -q -n 6 mu.nii
refused 'another window' 2 exr project wide.nii 'views=6 window=0:100' ct-project -q -n 6 -w 0:100 wide.nii

# Gaussians on a base.
few='gaussians=200 iterations=20'; with='-g 200 -n 20'
ct-project -q -n 6 over.nii over.exr && ct-project -q -n 6 fine.nii fine.exr && ct-project -q -n 6 --overshoot -w -1000:500 over.nii open.exr
ct-upsample -q -m linear over.nii over-up.nii
step 'Gaussians' ply fit 'up.nii fine.exr' "$few" ct-nabgs -q $with -b up.nii fine.exr
step 'with overshoots' ply fit 'over-up.nii open.exr' "$few" ct-nabgs -q $with -b over-up.nii open.exr
step 'a factor an axis' ply fit 'up-axes.nii fine.exr' "$few" ct-nabgs -q $with -b up-axes.nii fine.exr
step 'the whole' ply fit 'up.nii fine.exr' "$few full=1" ct-nabgs -q $with -m full -b up.nii fine.exr
refused 'a base beside the scan' 5 ply fit 'beside.nii fine.exr' "$few" ct-nabgs -q $with -b beside.nii fine.exr
refused 'a base of another quantity' 3 ply fit 'mu.nii fine.exr' "$few" ct-nabgs -q $with -b mu.nii fine.exr
refused 'a base that is no HU' 3 ply fit 'grey.nii fine.exr' "$few" ct-nabgs -q $with -b grey.nii fine.exr

# A base and Gaussians.
g1=a7.ply g2=a8.ply g4=a10.ply
step 'composed' nii compose "up.nii $g1" '' ct-compose -q up.nii $g1
step 'with overshoots' nii compose "over-up.nii $g2" 'gain=0.5 floor=-2000' ct-compose -q -g 0.5 --floor=-2000 over-up.nii $g2
step 'the whole' nii compose "up.nii $g4" '' ct-compose -q up.nii $g4
step 'on other voxels' nii compose "up-axes.nii $g1" 'spacing=3' ct-compose -q -s 3 up-axes.nii $g1
step 'in agreement with a scan' nii compose "up.nii $g1" 'lr=lr.nii' ct-compose -q --consistent lr.nii up.nii $g1
refused 'another quantity' 3 nii compose "mu.nii $g1" '' ct-compose -q mu.nii $g1
refused 'no HU' 3 nii compose "grey.nii $g1" '' ct-compose -q grey.nii $g1

# Other detectors.
step 'parallel rays' exr project fine.nii 'views=6 beam=1' ct-project -q -n 6 --beam parallel fine.nii
step 'another number of pixels' exr project fine.nii 'views=6 columns=20 rows=12' ct-project -q -n 6 --det 20x12 fine.nii

# A coarser grid.
step 'degraded' nii degrade fine.nii 'factor=2' ct-degrade -q -x 2 --sigma 0 fine.nii
step 'by a factor an axis, blurred' nii degrade fine.nii 'factor=2,3,1 sigma=1,0.5,0' ct-degrade -q -x 2,3,1 --sigma 1,0.5,0 fine.nii
step 'by means of cells, with noise' nii degrade fine.nii 'factor=1.5 decimate=2 noise=20' ct-degrade -q -x 1.5 --sigma 0 --decimate mean --noise 20 fine.nii
step 'a CT that was clipped' nii degrade clipped.nii 'factor=2 decimate=1' ct-degrade -q -x 2 --sigma 0 --decimate point clipped.nii
step 'another quantity is degraded' nii degrade mu.nii 'factor=2' ct-degrade -q -x 2 --sigma 0 mu.nii
step 'by a protocol with noise' nii degrade fine.nii 'factor=2 protocol=P1n' ct-degrade -q -x 2 -p P1n fine.nii
step 'by a protocol, its blur another' nii degrade fine.nii 'factor=2 protocol=P3 sigma=0.7' ct-degrade -q -x 2 -p P3 --sigma 0.7 fine.nii
step 'by a protocol, its sampling another' nii degrade fine.nii 'factor=2 protocol=P3 decimate=0' ct-degrade -q -x 2 -p P3 --decimate sinc fine.nii
step 'by a protocol without its blur' nii degrade fine.nii 'factor=2 protocol=P1 sigma=0' ct-degrade -q -x 2 -p P1 --sigma 0 fine.nii
step 'by a protocol without its noise' nii degrade fine.nii 'factor=2 protocol=P1n noise=0' ct-degrade -q -x 2 -p P1n --noise 0 fine.nii
step 'clipped first' nii degrade fine.nii 'factor=2 protocol=P2 clip=-512:300' ct-degrade -q -x 2 -p P2 --clip=-512:300 fine.nii
step 'by slices of a profile' nii degrade fine.nii 'factor=1,1,4 profile=trapezoid slice_thickness=9' ct-degrade -q -x 1,1,4 --profile trapezoid --slice-thickness 9 fine.nii
step 'by slices of a profile, on a protocol' nii degrade fine.nii 'factor=2,2,4 protocol=P2 profile=box slice_thickness=9' ct-degrade -q -x 2,2,4 -p P2 --profile box --slice-thickness 9 fine.nii
refused 'a protocol of which nothing is left' 2 nii degrade fine.nii 'factor=2 protocol=P1 sigma=1 decimate=1' ct-degrade -q -x 2 -p P1 --sigma 1 --decimate point fine.nii
refused 'a factor longer than an axis' 5 nii degrade fine.nii 'factor=2,2,30' ct-degrade -q -x 2,2,30 --sigma 0 fine.nii
step 'as the release, which clips' nii degrade fine.nii 'factor=2 protocol=release' ct-degrade -q -x 2 -p release fine.nii
refused 'no HU is not degraded' 3 nii degrade grey.nii 'factor=2' ct-degrade -q -x 2 --sigma 0 grey.nii

# A volume of projections.
ct-project -q -n 8 --beam parallel fine.nii parallel.exr && ct-project -q -n 8 --beam fan --arc 220 wide.nii fan.exr; ok $? 'projections of parallel rays and of a fan are made'
step 'reconstructed' nii reconstruct fine.exr '' ct-fdk -q fine.exr
step 'with overshoots, on a grid of its own' nii reconstruct open.exr 'like=over-up.nii filter=hann' ct-fdk -q --grid over-up.nii --filter hann open.exr
step 'of parallel rays, as density' nii reconstruct parallel.exr 'density=1 voxels=20' ct-fdk -q --quantity density --grid 20 parallel.exr
step 'without a filter, as density' nii reconstruct fine.exr 'filter=none density=1' ct-fdk -q --filter none --quantity density fine.exr
step 'a short scan of a fan, in its window' nii reconstruct fan.exr 'parker=1' ct-fdk -q --parker fan.exr
step 'by iteration' nii reconstruct fine.exr 'method=cgls iterations=3' ct-fdk -q -m cgls -n 3 fine.exr
step 'with the least variation' nii reconstruct fine.exr 'method=tv iterations=3 tv=40 nonnegative=1' ct-fdk -q -m tv -n 3 --tv 40 --nonnegative fine.exr
refused 'iterations of what filters' 2 nii reconstruct fine.exr 'iterations=3' ct-fdk -q -n 3 fine.exr
refused 'a filter of what iterates' 2 nii reconstruct fine.exr 'method=cgls filter=hann' ct-fdk -q -m cgls --filter hann fine.exr
refused 'a variation without the solver that has one' 2 nii reconstruct fine.exr 'method=sirt tv=3' ct-fdk -q -m sirt --tv 3 fine.exr
refused 'a method for another beam' 2 nii reconstruct fine.exr 'method=fbp' ct-fdk -q -m fbp fine.exr
refused 'a window that contradicts the projections' 2 nii reconstruct fine.exr 'window=0:100' ct-fdk -q -w 0:100 fine.exr
refused 'a grid beside the projections' 5 nii reconstruct fine.exr 'like=beside.nii' ct-fdk -q --grid beside.nii fine.exr
refused 'HU without a filter' 2 nii reconstruct fine.exr 'filter=none' ct-fdk -q --filter none fine.exr
refused 'no projections' 3 nii reconstruct up.nii '' ct-fdk -q up.nii

# Projections on a finer detector.
ct-project -q -n 2 --det 32 --coarsen 4 --pixel mean fine.nii low.exr && ct-project -q -n 2 --det 32 --coarsen 4 --pixel sinc fine.nii sinc.exr
ok $? 'ct-project makes projections of --pixel mean and of --pixel sinc'
prior=$srcdir/src/prior/prior.safetensors rdn=$srcdir/src/prior/rdn-4.safetensors
step 'a prior' exr ddnm low.exr "steps=3 prior=$prior" ct-ddnm -q -n 3 -p "$prior" low.exr
step 'another sampler, of other pixels' exr ddnm sinc.exr "steps=3 prior=$prior sampler=ddim" ct-ddnm -q -n 3 --sampler ddim -p "$prior" sinc.exr
step 'a network of super-resolution' exr ddnm low.exr "prior=$rdn" ct-ddnm -q -p "$rdn" low.exr
ct-upsample -q lr.nii tv.nii && ct-project -q -n 3 tv.nii tv.exr; ok $? 'projections of a refined CT'
step 'the default of a refined CT' exr ddnm tv.exr "prior=$prior" ct-ddnm -q -p "$prior" tv.exr; own=a$n.exr
step 'two samples, from another start' exr ddnm tv.exr "prior=$prior samples=2 start=30 steps=2" ct-ddnm -q -p "$prior" -k 2 --expert t-start=30 -n 2 tv.exr
step 'Gaussians, weighted by what projections carry' ply fit "tv.nii $own" "$few" ct-nabgs -q $with -b tv.nii $own
refused 'a start without one' 2 exr ddnm low.exr "prior=$prior start=30" ct-ddnm -q -p "$prior" --expert t-start=30 low.exr
step 'no network' exr ddnm low.exr 'sampler=none' ct-ddnm -q --sampler none low.exr
refused 'noise for a sampler that knows none' 2 exr ddnm low.exr "sampler=ddim sigma_y=0.1 prior=$prior" ct-ddnm -q --sampler ddim --sigma-y .1 -p "$prior" low.exr
refused 'samples of a single call' 2 exr ddnm low.exr "sampler=once samples=2 prior=$rdn" ct-ddnm -q --sampler once -k 2 -p "$rdn" low.exr
refused 'another factor' 2 exr ddnm low.exr "factor=2 prior=$prior" ct-ddnm -q -x 2 -p "$prior" low.exr
refused 'a larger factor than that of the pixels' 2 exr ddnm low.exr "factor=8 prior=$prior" ct-ddnm -q -x 8 -p "$prior" low.exr
refused 'an operator that is not that of the pixels' 2 exr ddnm sinc.exr "pixel=1 prior=$prior" ct-ddnm -q --expert operator=mean -p "$prior" sinc.exr
refused 'also without a network' 2 exr ddnm sinc.exr 'factor=8 sampler=none' ct-ddnm -q -x 8 --sampler none sinc.exr
refused 'a sampler that is not for the network' 2 exr ddnm low.exr "sampler=ddim prior=$rdn" ct-ddnm -q --sampler ddim -p "$rdn" low.exr
refused 'Gaussians for a prior' 3 exr ddnm low.exr "prior=$g1" ct-ddnm -q -p "$g1" low.exr

# Compared with the truth.
figures 'a CT' compare 'fine.nii up.nii' ''
figures 'in a window, in a mask' compare 'fine.nii up.nii' 'window=-200:300 mask=mask.nii' -w -200:300 --mask mask.nii
figures 'reduced by a factor an axis' compare 'fine.nii up-axes.nii' ''
figures 'of overshoots' compare 'fine.nii over-up.nii' ''
figures 'with the scan' consistency 'lr.nii up.nii' ''
ct-upsample -q -m tv lr-axes.nii tv-axes.nii; figures 'by the operator of the scan, an axis for itself' consistency 'lr-axes.nii tv-axes.nii' ''
refused 'another quantity without a window' 2 csv compare 'mu.nii up.nii' '' ct-metrics -q mu.nii up.nii --per-slice
refused 'quantities that differ' 3 csv compare 'fine.nii mu.nii' '' ct-metrics -q fine.nii mu.nii --per-slice
refused 'no HU to compare' 3 csv compare 'up.nii grey.nii' '' ct-metrics -q up.nii grey.nii --per-slice
refused 'another grid' 5 csv compare 'fine.nii lr.nii' '' ct-metrics -q fine.nii lr.nii --per-slice
refused 'no operator' 3 nii consistency 'grey.nii plain.nii' '' ct-metrics -q --consistency grey.nii plain.nii --map
refused 'a scan that was refined' 3 nii consistency 'up.nii up.nii' '' ct-metrics -q --consistency up.nii up.nii --map
ct-project -q -n 6 up.nii up.exr && ct-project -q -n 5 up.nii five.exr; ok $? 'projections of a result'
figures 'projections' compare 'fine.exr up.exr' ''
figures 'with a range' compare 'fine.exr up.exr' 'range=30' --range 30
figures 'with overshoots' compare 'over.exr open.exr' ''
refused 'other views' 5 csv compare 'fine.exr five.exr' '' ct-metrics -q fine.exr five.exr --per-slice
refused 'projections and a CT' 3 csv compare 'fine.exr fine.nii' '' ct-metrics -q fine.exr fine.nii --per-slice

# The published method in one call.
some="views=3 iterations=4 gaussians=30"; expert='views=3,iterations=4,gaussians=30'
ct-phantom -q -w -512:3071 --size 24x24x24 --spacing 4 marks open.nii && ct-degrade -q -x 4 -p P2 open.nii small.nii && ct-degrade -q -x 4,4,2 fine.nii uneven.nii; ok $? 'scans for the paper'
step 'the paper' nii paper small.nii "$some prior=$prior" ct-sr -q --paper --prior "$prior" --expert $expert small.nii
step 'the release' nii paper small.nii "$some prior=$prior release=1" ct-sr -q --release --prior "$prior" --expert $expert small.nii
refused 'a factor that contradicts the scan of the paper' 2 nii paper small.nii "$some prior=$prior factor=3" ct-sr -q --paper -x 3 --prior "$prior" --expert $expert small.nii
refused 'a factor an axis is not for the paper' 2 nii paper uneven.nii "$some prior=$prior" ct-sr -q --paper --prior "$prior" --expert $expert uneven.nii
refused 'a factor that is too large for the paper' 2 nii paper lr.nii "$some prior=$prior factor=17" ct-sr -q --paper -x 17 --prior "$prior" --expert $expert lr.nii
refused 'too many Gaussians for the paper' 2 nii paper lr.nii "gaussians=600000 prior=$prior" ct-sr -q --paper --prior "$prior" --expert gaussians=600000 lr.nii
refused 'another quantity is not for the paper' 3 nii paper mu.nii "$some prior=$prior factor=2" ct-sr -q --paper -x 2 --prior "$prior" --expert $expert mu.nii
refused 'no HU is not for the paper' 3 nii paper grey.nii "$some prior=$prior factor=2" ct-sr -q --paper -x 2 --prior "$prior" --expert $expert grey.nii
refused 'Gaussians for the prior of the paper' 3 nii paper small.nii "$some prior=$g1" ct-sr -q --paper --prior "$g1" --expert $expert small.nii
exits 75 'the paper is cancelled by its progress' c paper small.nii no.nii $some "prior=$prior" stop=1
[ ! -e no.nii ]; ok $? 'the paper that is cancelled makes nothing'

# The paper: the examples, and the commands one after the other.
ct-project -q -n 4 lr.nii p.exr && ct-ddnm -q -x 2 -n 2 -p "$prior" p.exr p4.exr && ct-upsample -q -x 2 -m linear lr.nii p.nii &&
	ct-nabgs -q -g 100 -n 10 -b p.nii p4.exr p.ply && ct-compose -q p.nii p.ply paper-a.nii; ok $? 'the commands of the paper'
exits 0 'the example in C' "$builddir/examples/paper" lr.nii paper-b.nii 2 "$prior" 4 2 100 10
exits 4 'the example in C refuses an OUT that exists' "$builddir/examples/paper" lr.nii paper-b.nii 2 "$prior" 4 2 100 10
exits 2 'the example in C refuses a factor that is no number' "$builddir/examples/paper" lr.nii no.nii 2x "$prior" 4 2 100 10
exits 0 'examples/paper.py makes the paper of a scan' "$PY" "$srcdir/examples/paper.py" lr.nii paper-c.nii 2 "$prior" 4 2 100 10
exits 1 'paper.py refuses an OUT that exists' "$PY" "$srcdir/examples/paper.py" lr.nii paper-c.nii 2
has err '^paper-c.nii: exists' 'paper.py names the OUT that exists'
exits 1 'paper.py without arguments fails with status 1' "$PY" "$srcdir/examples/paper.py"
has err '^usage: paper.py IN OUT.nii' 'paper.py without arguments prints its usage'
exits 0 'make the same CT' py same paper-a.nii paper-b.nii paper-c.nii

# A finer grid.
slices=$builddir/slices.safetensors
step 'interpolated' nii refine lr.nii 'factor=2 method=2' ct-upsample -q -x 2 -m cubic lr.nii
step 'inverted' nii refine lr-axes.nii '' ct-upsample -q lr-axes.nii
step 'with a prior' nii refine lr.nii "prior=$slices" ct-upsample -q -m prior -p "$slices" lr.nii
ct-degrade -q -x 2 --noise 20 fine.nii noisy.nii; ok $? 'a scan with noise is made'
step 'noise is kept' nii refine noisy.nii "prior=$slices" ct-sr -q noisy.nii
step 'noise is taken off' nii refine noisy.nii "prior=$slices denoise=1" ct-sr -q --denoise noisy.nii
step 'a half of the noise' nii refine lr-axes.nii 'method=7 noise=9 denoise=0.5' ct-upsample -q -m tv --noise 9 --denoise=.5 lr-axes.nii
refused 'a share of the noise above one' 2 nii refine noisy.nii 'denoise=1.5' ct-upsample -q --denoise=1.5 noisy.nii
refused 'a tolerance of what does not iterate' 2 nii refine lr.nii 'factor=2 method=2 tolerance=1' ct-upsample -q -x 2 -m cubic --tolerance 1 lr.nii
refused 'a prior of what has none' 2 nii refine lr.nii "method=7 prior=$slices" ct-upsample -q -m tv -p "$slices" lr.nii
refused 'no HU' 3 nii refine grey.nii 'factor=2 method=2' ct-upsample -q -x 2 -m cubic grey.nii
refused 'another quantity for a prior' 3 nii refine mu.nii "factor=2 prior=$slices" ct-sr -q -x 2 mu.nii
refused 'another quantity for an interpolation' 3 nii refine mu.nii 'factor=2 method=2' ct-upsample -q -x 2 -m cubic mu.nii
step 'values of another unit are refined' nii refine grey.nii "factor=2 units=other prior=$slices" ct-sr -q -x 2 --units other grey.nii
step 'what cannot be HU is said to be' nii refine grey.nii 'factor=2 units=hu' ct-upsample -q -x 2 --units hu grey.nii
refused 'a unit that is not known' 2 nii refine grey.nii 'factor=2 units=mm' ct-upsample -q -x 2 --units mm grey.nii
refused 'nor for a prior' 3 nii refine grey.nii "factor=2 prior=$slices" ct-sr -q -x 2 grey.nii
done_testing
