#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The published method on a small phantom: by ct-sr, by hand, interrupted; and ours.
. "$srcdir/tests/tap.sh"
ct-phantom -q -w -512:3071 ellipsoids --size 32x32x32 --spacing 4 hr.nii; ok $? 'ct-phantom makes a phantom in the window of the paper'
ct-convert hr.nii - | ct-degrade -x 4 - - | ct-upsample -x 4 -m cubic - cubic.nii.gz
ok $? 'convert, degrade, upsample join by pipes'
ct-project --views 8 - - <hr.nii | ct-info - >info.txt; ok $? 'project and info join by pipes'
grep -q cone info.txt; ok $? 'and the scan is told'
ct-degrade -q --clip -512:3071 -x 4 hr.nii lr.nii
set -- -x 4 --paper --expert views=16,iterations=200,gaussians=4000
exits 0 'the published method is kept' ct-sr -q "$@" --keep k lr.nii sr.nii
for f in lr.nii up.nii up-proj.exr lr-proj.exr sr-proj.exr residual.ply commands.sh; do
	[ -s "k/$f" ]; ok $? "$f is kept"
done
db() { ct-metrics hr.nii "$1" | awk '/^psnr/ {print $2}'; }
# of few views the published method is below cubic; its figures are below
awk "BEGIN {exit !($(db sr.nii) > $(db cubic.nii.gz) - 1.5)}"; ok $? "near cubic: $(db sr.nii) against $(db cubic.nii.gz) dB"
ct-info k/residual.ply >info.txt; grep -qi 'negative' info.txt; ok $? 'the residual has a sign'
ct-sr -q "$@" - - <lr.nii >pipe.nii; ok $? 'from a pipe to a pipe'
ct-info pipe.nii >info.txt; ok $? 'and nothing but the volume comes out'
echo mine >mine.nii
exits 4 'a run that goes on writes over nothing' ct-sr -q "$@" --keep k lr.nii mine.nii
exits 0 'a finished run of the paper has nothing to do' ct-sr -q "$@" --keep k lr.nii sr.nii
voxels() { ct-convert -q --type f32 "$1" - | tail -c 131072; }
voxels sr.nii >a
# interrupted in the middle, resumed
(export CTSR_TEST_SIGNAL='ct-sr 40 15'; exec setsid ct-sr -q "$@" --keep i lr.nii cut.nii) >/dev/null; s=$?
[ $s -eq 75 ]; ok $? "SIGTERM stops the paper at the network (status $s)"
[ -s i/sr-proj.exr.state ]; ok $? 'the views that the network has made are kept'
[ ! -e cut.nii ]; ok $? 'the paper that is stopped leaves no half-written output'
exits 0 'the paper that was stopped is resumed' ct-sr -q "$@" --keep i lr.nii cut.nii
voxels cut.nii >b; cmp -s a b; ok $? 'the same voxels after an interruption'
for f in mha nrrd; do
	exits 0 "to .$f" ct-sr -Q draft lr.nii o.$f; ct-sr -q -f -Q draft lr.nii o.nii
	exits 0 "a result named .$f has the voxels of one named .nii" ct-metrics -q --min psnr=1000 o.nii o.$f
done
exits 0 'the published method takes an output named .mha' ct-sr -q --paper --expert views=4,iterations=2,gaussians=20 lr.nii chain.mha
head -c 10 chain.mha | grep -q '^ObjectType'; ok $? 'an output of the published method named .mha is MetaImage'
exits 0 'a dry run prints the commands' ct-sr --dry-run -x 4 --paper lr.nii no.nii
[ "$(sed 's/ .*//' out | tr '\n' ' ')" = 'mkdir ct-convert ct-upsample ct-project ct-project ct-ddnm ct-nabgs ct-compose # ' ]
ok $? 'a dry run of the paper prints all commands in order'
[ ! -e no.nii ]; ok $? 'a dry run of the paper makes no output'
for q in draft fast balanced; do
	exits 0 "$q" ct-sr -x 4 -Q $q lr.nii $q.nii
	awk "BEGIN {exit !($(db $q.nii) > $(db cubic.nii.gz))}"; ok $? "better than cubic: $(db $q.nii) dB"
done
ct-convert -q --type f32 lr.nii - | tail -c 2048 >lr.raw
ct-convert -q --raw 8x8x8:f32:16 lr.raw plain.nii; ok $? 'a scan that does not say how it was made'
exits 0 'a scan that does not say how it was made is refined' ct-sr -x 4 plain.nii blind.nii
exits 0 'by the published method' ct-sr -q "$@" plain.nii blind2.nii
ct-sr --dry-run --paper "$@" plain.nii blind3.nii | sh >/dev/null 2>&1; voxels blind2.nii >a; voxels blind3.nii >b
cmp -s a b; ok $? 'the commands that a dry run prints make the same voxels'
exits 2 'no projections, no views' ct-sr --expert views=16 lr.nii no.nii
exits 2 'a seed without --paper is refused with status 2' ct-sr -s 3 lr.nii no.nii
has err '^ct-sr: --seed: needs --paper or --release' 'the error of a seed without --paper names --seed'
exits 0 '--seed is accepted with --paper' ct-sr --dry-run -s 3 --paper lr.nii no.nii
[ "$(grep -c -- '--seed=3' out)" -eq 2 ]; ok $? 'which two commands draw from'
exits 3 'a dry run of a file that is not there' ct-sr --dry-run none.nii no.nii
has err 'none.nii: No such file' 'the error of a dry run names a file that is not there'
# the factor that the header says
for x in 1,1,4 2; do
	ct-degrade -fq -x $x hr.nii by.nii; ct-sr -qf -Q draft -x $x by.nii want.nii; voxels want.nii >a
	exits 0 "-x $x of the header" ct-sr -f -Q draft by.nii sr.nii
	voxels sr.nii >b; cmp -s a b; ok $? 'is what -x makes'
	ct-sr -q -Q draft - - <by.nii >pipe.nii; voxels pipe.nii >b; cmp -s a b; ok $? 'of a pipe, too'
done
exits 2 'another is an error' ct-sr -x 4 by.nii no.nii
exits 0 'one that is used up says nothing' ct-sr --dry-run --paper sr.nii no.nii
has out '-x4 ' 'the paper of a volume whose factor is used up is 4 times finer'
exits 2 'projections of a pipe that says otherwise' ct-sr --paper - no.nii <by.nii
has err 'the factor 4,4,4 contradicts the file, which was reduced 2,2,2 times' 'the error of a factor that contradicts the file names both'
ct-degrade -fq -x 1,1,4 hr.nii by.nii
exits 2 'projections of a scan that says otherwise' ct-sr --paper by.nii no.nii
has err '^ct-sr: --factor 1,1,4: projections take one whole number' 'the error of a factor an axis for projections says one number'
ct-degrade -fq -x 1 hr.nii by.nii
exits 2 'a scan that was not reduced' ct-sr by.nii no.nii
has err '^ct-sr: by.nii: a factor of 1 refines nothing' 'the error of a factor of 1 says that nothing is refined'
printf junk >bad.nii
exits 3 'an input that is no volume ends ct-sr with status 3' ct-sr -x 4 bad.nii no.nii
[ ! -e no.nii ]; ok $? 'runs of ct-sr that are refused leave no output'

# The line that ct-sr ends with: what really ran.
part says
says() { # says PATTERN NAME: the last line of err, less seconds and MiB, is that
	sed -nE '$s/; [0-9.]+ s, [0-9]+ MiB$//p' err | grep -qE "^ct-sr: $1\$"; ok $? "$2"
	tail -n 1 err | sed 's/^/# /'
}
number='[0-9.]+(e-[0-9]+)?'
ct-phantom -q --size 48x48x32 shepp-logan t.nii
ct-degrade -q -x 2 t.nii scan.nii
ct-degrade -q -x 2 --noise 15 t.nii noisy.nii
exits 0 'a scan that says how it was made' ct-sr -x 2 scan.nii up.nii
[ "$(wc -l <err)" -eq 1 ]; ok $? 'ct-sr prints one line to standard error'
blur='blur 0.8493 voxels, sinc \(from the file\)'
says "24x24x16 to 48x48x32, 2 times; $blur; noise 0 HU \\(from the file\\); tv, [0-9]+ iterations \\(band-limited\\), then the prior; data residual $number HU RMS" \
	'sizes, factor, operator, solver, prior'
# its numbers are those of the steps
ct-upsample -v -x 2 --estimate --tolerance 0.1 scan.nii u.nii 2>err.up
n=$(sed -nE 's/.* ([0-9]+) iterations.*/\1/p' err.up)
has err "; tv, $n iterations" 'the iterations that ct-upsample tells'
ct-upsample -m prior -v -x 2 --estimate --tolerance 0.1 scan.nii r.nii 2>err.re
sed -nE 's/.*within ([0-9.e-]+) HU RMS.*/\1/p' err.re >fit; sed -nE 's/.*data residual ([0-9.e-]+) HU.*/\1/p' err >said
awk 'NR == FNR {a = $1; next} {exit !(a > 0 && ($1 - a) ^ 2 <= (.06 * a) ^ 2)}' fit said; ok $? 'the residual that ct-upsample tells'
exits 0 'noise of the file, to a pipe' sh -c 'ct-sr -x 2 noisy.nii - >p.nii'
says "24x24x16 to 48x48x32, 2 times; $blur; noise 15 HU \\(from the file\\); tv, [0-9]+ iterations \\(band-limited\\), then the prior; data residual [0-9](\.[0-9])? HU RMS" \
	'noise that stays as far as it is not amplified'
has err '^ct-sr: [0-9.]* HU RMS of noise kept, not sharpened; --denoise takes it off$' 'and is said to stay'
exits 0 'the same without its noise' ct-sr -f --denoise -x 2 noisy.nii p.nii
says "24x24x16 to 48x48x32, .*; data residual (15|1[0-4])(\.[0-9])? HU RMS" 'noise that is taken off, to which it is consistent'
ct-info p.nii >info; has info ' denoised  *[0-9.]* HU RMS of noise taken off (--denoise)$' 'and the header says so'
exits 0 'no noise to take off' ct-sr -q -f --denoise -x 2 -Q draft scan.nii p.nii
ct-info p.nii >info; has info ' denoised  *nothing taken off: no noise is certain' 'and the header says that nothing went'
tail -c 6912 noisy.nii >n.raw && ct-convert -q --raw 12x12x12:f32:4 --orient RAS n.raw bare.nii
exits 0 'a blur that few edges show is measured' ct-sr -Q draft -x 2 bare.nii m.nii
has err '^ct-sr: assumed: nothing, as too few edges show the blur; --sigma says it$' 'ct-sr says that it assumes nothing where few edges show the blur'
says "12x12x12 to 24x24x24, 2 times; blur not known; no certain noise \\(measured\\); bspline" 'edges that do not tell'
for o in --slice-thickness=5 --decimate=mean; do
	exits 0 "$o of a blur that few edges show" ct-sr -Q draft -x 2 $o bare.nii "m$o.nii"
	has err 'few edges show the blur, without which the sampling or profile that is given does nothing; --sigma' "ct-sr says that $o does nothing there"
done
ct-info m.nii >info; ! grep -qE '^  (factor|sigma|decimate) ' info; ok $? 'the header of a result of unknown blur names no operator'
exits 3 'the data consistency of a result of unknown blur is refused with status 3' ct-metrics --consistency bare.nii m.nii
ct-sr -q -f -Q draft --spacing 3.5 --sidecar m.json bare.nii m.nii && ! grep -q Sigma m.json; ok $? 'the sidecar of a result that was only interpolated names no blur'
ct-phantom -q --size 96x96x96 shepp-logan big.nii && ct-degrade -q -x 2 big.nii h.nii
tail -c 442368 h.nii >h.raw && ct-convert -q --raw 48x48x48:f32:4 --orient RAS h.raw h.nii -f
ct-degrade -q -x 2 --noise 20 big.nii l.nii && tail -c 442368 l.nii >l.raw && ct-convert -q --raw 48x48x48:f32:4 --orient RAS l.raw loud.nii
exits 0 'a scan with edges enough is refined without a given blur' ct-sr -f -Q draft -x 2 h.nii m.nii
says "48x48x48 to 96x96x96, 2 times; blur [0-9.,]+ voxels, (sinc|point|mean) \\(measured\\); no certain noise \\(measured\\); (tv\\+htv|h?tv), [0-9]+ iterations \\([a-z, -]+\\); data residual $number HU RMS" \
	'what was measured'
grep -qE '^ct-sr: assumed: profile [0-9.]+,[0-9.]+,[0-9.]+ mm wide [(]2.35 standard deviations[)] along x,y,z, uncertain by [0-9]+ %(, so [0-9]+ % less blur is undone)?, [a-z -]+ [(][0-9]+ % sure[)]; measured on edges; edges overshoot by [0-9]+ % [(]a sharp kernel, or thin bone[)]; --sigma and --decimate say it better$' err
ok $? 'ct-sr says how uncertain a measured profile is'
ct-info m.nii >info; has info ' assumed  *profile ' 'which the result keeps'
exits 0 'ct-sr accepts blur, sampling and noise that are given' ct-sr -Q draft -x 2,2,1 --sigma .8 --decimate point --noise 4 bare.nii g.nii
says "12x12x12 to 24x24x12, 2,2,1 times; blur 0.8,0.8,0 voxels, point \\(given\\); noise 4 HU \\(given\\); tv, [0-9]+ iterations \\(not aliased\\); data residual [1-4](\.[0-9])? HU RMS" \
	'what was given, along each axis'
# noise of neighbours that a Gaussian made alike
ct-degrade -q -x 1 --noise 40 h.nii soft0.nii -f && ct-degrade -q -f -x 1 --sigma .6,.6,.6 soft0.nii soft.nii && tail -c 442368 soft.nii >soft.raw &&
	ct-convert -q --raw 48x48x48:f32:4 --orient RAS soft.raw soft.nii -f
exits 0 'a scan with correlated noise is refined' ct-sr -Q draft -x 2 --sigma 1 soft.nii g1.nii
has err 'noise [0-9.]* HU, correlated [(]measured' 'ct-sr says that measured noise is correlated'
# the operator is given, the noise is not: it is measured
exits 0 'noise that nothing says' ct-sr -Q draft -x 2 --sigma .8493 loud.nii g2.nii
says "48x48x48 to 96x96x96, 2 times; blur 0.8493 voxels, sinc \\(given\\); noise [1-3][0-9.]+ HU \\(measured\\); tv\\+htv, [0-9]+ iterations \\(band-limited\\); data residual $number HU RMS" \
	'is measured'
exits 0 '--noise 0 is accepted for a noisy scan' ct-sr -f -Q draft -x 2 --sigma .8493 --noise 0 loud.nii g2.nii
says "48x48x48 to 96x96x96, .*; noise 0 HU \\(given\\); tv\\+htv, [0-9]+ iterations \\(band-limited\\); data residual $number HU RMS" \
	'and --noise 0 is none'
exits 0 'what a rehearsal finds' ct-sr -f -v --confidence e.nii scan.nii up.nii
has err '^ct-sr: rehearsal: what the prior adds is multiplied by 1[.]' 'ct-sr -v says by how much a rehearsal multiplies the detail' &&
	has err '^ct-sr: rehearsal: the predicted error is multiplied by ' 'ct-sr -v says by how much a rehearsal multiplies the predicted error'
exits 0 'ct-sr -q refines a scan with status 0' ct-sr -q -f -x 2 scan.nii up.nii
[ ! -s err ]; ok $? 'ct-sr -q prints nothing to standard error'
exits 3 'an empty file ends ct-sr with status 3' ct-sr -f -x 2 err up.nii
! grep -q ' times; ' err; ok $? 'says no such line'
exits 2 'a factor that the file contradicts' ct-sr -f -x 3 scan.nii up.nii
has err '^ct-sr: scan.nii: the factor 3,3,3 contradicts the file, which was reduced 2,2,2 times$' 'names the file that the user gave'
exits 2 'one of the published method' ct-sr -f --paper -x 3 scan.nii up.nii
has err '^ct-sr: scan.nii: the factor 3,3,3 contradicts the file, which was reduced 2,2,2 times$' 'the published method names the file that the user gave, too'
[ "$(grep -c '^ct-sr: ' err)" -eq 1 ]; ok $? 'an error of the published method is one line'
ct-phantom -q -w -512:3071 --size 24x24x24 --spacing 4 cube w.nii && ct-degrade -q -x 2 w.nii window.nii
exits 0 'the published method says what it did' ct-sr -f --paper --expert views=2,iterations=2,gaussians=20 window.nii up.nii
has err '^ct-sr: 2 times finer, by the published method (paper); 2 views, 20 Gaussians, [0-9]* of them negative, after 2 iterations; error [0-9.]*; [0-9.]* s, [0-9]* MiB$' 'the published method ends with a line of what it did'
[ "$(grep -vc ': warning: ' err)" -eq 1 ]; ok $? 'beside warnings the published method says one line'
exits 0 'the published method is quiet if asked' ct-sr -q -f --paper --expert views=2,iterations=2,gaussians=20 window.nii up.nii
[ "$(grep -vc ': warning: ' err)" -eq 0 ]; ok $? '-q of the published method leaves warnings alone'
ct-phantom -q -f --size 20x20x20 ellipsoids five.nii && ct-degrade -q -f -x 1,1.25,10 five.nii five-lr.nii
exits 0 'factors that no prior knows' ct-sr -f --report five.html five-lr.nii up.nii
has err '^ct-sr: warning: five-lr.nii: ' 'a warning names it' && has five.html 'five-lr.nii: the prior has no network' 'and so does the page'
exits 2 'a factor that a stream contradicts is refused with status 2' sh -c 'ct-sr -f -x 3 - up.nii <scan.nii'
has err '^ct-sr: -: the factor 3,3,3 contradicts the file' 'the error names the stream'
# the same for a program
exits 0 'the result as JSON' ct-sr -f --json --report five.html -x 2 scan.nii up.nii
"${PY:-python3}" - <<'END'
import json, re
r = json.load(open('out'))
assert r['spacing-mm'] == [2, 2, 2], r
line = open('err').read()
assert re.search(r'; %s, %d iterations ' % (re.escape(r['method']), r['iterations']), line), (r['method'], line)
assert r['operator']['factor'] == [2, 2, 2] and r['operator']['from'] == 'from the file' and len(r['size']) == 3, r
assert r['noise']['hu'] >= 0 and r['residual-rms-hu'] >= 0 and r['seconds'] > 0 and r['iterations'] > 0, r
assert r['files'] == {'in': 'scan.nii', 'out': 'up.nii', 'report': 'five.html'}, r
END
ok $? '--json prints spacing, operator, noise, method, residual, seconds and files'
exits 2 '--json with OUT on standard output is refused' ct-sr --json scan.nii -
has err '^ct-sr: --json: OUT is standard output: name a file$' 'that error says what to do'
for o in report sidecar; do
	exits 2 "--json with --$o on standard output is refused" ct-sr --json "--$o=-" -x 2 scan.nii no.nii
	has err "^ct-sr: --json: --$o is standard output: name a file\$" "the error of --json with --$o says what to do"
done
latin=$(printf 'M\374ller.nii'); cp scan.nii "$latin"
exits 0 'JSON of a name that is not UTF-8' ct-sr -q -f --json -Q draft -x 2 "$latin" "up-$latin"
has out '"in": "M?ller.nii"' 'JSON of a name that is not UTF-8 has ? in its place'
rm "$latin" "up-$latin"
exits 0 'the published method as JSON' ct-sr -q -f --json --paper --expert views=2,iterations=2,gaussians=20 window.nii up.nii
has out '"method": "paper"' '--json of the published method names it'
has out '"gaussians": ' '--json of the published method counts Gaussians'
exits 0 'what a run would make' ct-sr --dry-run -f -x 2 scan.nii up.nii
for line in 'size      [0-9]*x[0-9]*x[0-9]*' 'spacing   [0-9.]*,[0-9.]*,[0-9.]* mm' 'factor    2,2,2' 'blur      .* [(]from the file[)]' 'noise     .* HU ' 'time      '; do
	has out "^$line" "a dry run prints ${line%% *} of the result"
done
exits 0 'what a run would make, as JSON' ct-sr --dry-run --json -f -x 2 scan.nii up.nii
grep -q '"spacing-mm"' out && grep -q '"memory-bytes"' out; ok $? 'a dry run prints plan and cost as one object'

# ct-sr --paper and --release, run on a small phantom and held against figures that were recorded when
# every step was compared with what the paper and its release say: window -512:3071; density of the scan,
# and of cubic, not clipped; projections of the scan itself on its own detector; 50 steps from noise, DDNM+ with
# sigma_y 0.0015, eta 0.99; rates that fall over 30000 iterations; and of the release what ct-release(7) lists.
# Rounding differs between processors, in the network most.
part paper
ct-phantom -q -w -512:3071 ellipsoids --size 32x32x32 --spacing 4 hr.nii
ct-degrade -q --clip -512:3071 -x 4 -p P2 hr.nii lr.nii; ok $? 'a scan that was clipped before it was reduced'
near() { # near NAME VALUE WANT BY
	awk "BEGIN {d = $2 - $3; exit !((d < 0 ? -d : d) <= $4)}"; ok $? "$1: $2 (recorded $3)"
}
figure() { ct-info "$2" | awk -v k="$1" '$1 == k {print $2}'; }
db() { ct-metrics hr.nii "$1" | awk '/^psnr/ {print $2}'; }
set -- --expert views=6,iterations=100,gaussians=500
exits 0 'ct-sr --paper refines a scan' ct-sr -q --paper "$@" --keep p lr.nii paper.nii
exits 0 'ct-sr --release refines a scan' ct-sr -q --release "$@" --keep r lr.nii release.nii
near 'scan, least value' "$(figure min lr.nii)" -544.2321 0.001
near 'scan, projections, least value' "$(figure min p/lr-proj.exr)" -0.5534868 0.0001
near 'scan, projections, mean' "$(figure mean p/lr-proj.exr)" 4.245801 0.0001
near 'cubic, projections, least value' "$(figure min p/up-proj.exr)" -0.8905023 0.0001
near 'cubic, projections, mean' "$(figure mean p/up-proj.exr)" 4.515145 0.0001
near 'paper, projections, mean' "$(figure mean p/sr-proj.exr)" 4.337480 0.002
near 'paper, projections, deviation' "$(figure sd p/sr-proj.exr)" 6.599332 0.002
near 'release, projections, mean' "$(figure mean r/sr-proj.exr)" 4.24966 0.002
near 'release, projections, deviation' "$(figure sd r/sr-proj.exr)" 6.594114 0.002
near 'paper, PSNR' "$(db paper.nii)" 25.0421 0.002
near 'release, PSNR' "$(db release.nii)" 24.8511 0.002
[ "$(figure min paper.nii | cut -d. -f1)" -ge -512 ]; ok $? 'nothing below density 0 is left'
near 'release, projections of the scan, mean' "$(figure mean r/lr-proj.exr)" 4.245801 0.0001
# the factor decides what the release takes
ct-degrade -q --clip -512:3071 -x 8 -p P2 hr.nii lr8.nii
ct-sr --release -x 8 --dry-run lr8.nii no.nii >out; has out 'ct-ddnm .*--sigma-y=0.0025 ' 'the network of the release gets sigma-y 0.0025 at 8 times'
has out '^ct-upsample .*--method=linear --expert=zoom=yes ' 'the release upsamples by a linear zoom'
has out '^ct-project .*--expert=cells=yes .*lr.nii' 'it projects samples as cells'
has out '^ct-ddnm .*--expert=range=bytes,channel-reduce=first ' 'its network sees 8 bits of one colour'
has out '^ct-nabgs .* --release ' 'its fit is its own'
ct-convert -q --type f32 hr.nii - | tail -c 131072 >whole.raw; ct-convert -q --raw 32x32x32:f32:4 whole.raw whole.nii; ct-degrade -q -x 4 -p release whole.nii own.nii; ct-sr --release --dry-run own.nii no.nii >out
has out "^ct-project --views=300 --window=-512:$(figure max whole.nii | cut -c1-5)" 'its window is the range of the CT'
exits 0 'a scan of the release is refined' ct-sr -q --release "$@" --keep own own.nii own-sr.nii
cp own-sr.nii own-1.nii; sh own/commands.sh >/dev/null 2>&1; cmp -s own-sr.nii own-1.nii; ok $? 'the commands make the same bytes of it'
ct-metrics -q whole.nii own-sr.nii >out; ok $? 'its voxels are taken for those of the CT'
ct-sr --paper -x 8 --dry-run lr8.nii no.nii >out; has out 'ct-ddnm .*--sigma-y=0.0015 ' 'the network of the paper gets sigma-y 0.0015 at 8 times'
has out '^# about [0-9.]* [sh] on [0-9]* threads, ' 'a dry run of the paper estimates its time'
has out '^ct-nabgs .*--factor=8 --paper ' 'the fit of the paper gets --factor=8 and --paper'
# the range that the header of a scan says
ct-phantom -q --size 16x16x16 --spacing 4 ellipsoids ball.nii && ct-degrade -q -x 2 ball.nii wide.nii
for x in '' '-x 2'; do
	# shellcheck disable=SC2086
	exits 0 "the paper of a scan of another range ($x)" ct-sr -q --paper --expert views=2,iterations=2,gaussians=20 $x -f wide.nii wide-sr.nii
	ct-info wide-sr.nii >out; has out '^  window  *-1024:3071$' "the result keeps the range of the scan ($x)"
done
# a scan that was not clipped before is clipped now, and that is said
ct-convert -q --type f32 lr.nii - | tail -c 2048 >raw
ct-convert -q --raw 8x8x8:f32:16 raw plain.nii
ct-convert -q --raw 8x8x8:f32:16 --rescale 3.3e35,0 --units other raw huge.nii
exits 6 'a result beyond the range of float32' ct-upsample -q -x 2 -m dc --sigma 1 --units other huge.nii beyond.nii
has err '^ct-upsample: beyond.nii: the result: voxel .* is infinite$' 'a result that is infinite names the file and the voxel'
ct-project -n 2 -w -512:3071 --overshoot plain.nii plain.exr 2>err; has err 'does not say that it was clipped' 'a scan that does not say that it was clipped gives a warning'
[ "$(figure min plain.exr)" = 0 ]; ok $? 'a scan that does not say that it was clipped is clipped'
exits 2 'what is density has no overshoot' sh -c \
	'ct-fdk -q --quantity density p/lr-proj.exr d.nii 2>/dev/null; ct-project --overshoot d.nii no.exr'
# the scanner in a sidecar, as ct-sr reads it
cp lr.nii side.nii && printf '{"Modality": "CT", "Manufacturer": "ACME", "SliceThickness": 5, "ConvolutionKernel": "B30f"}' >side.json
exits 0 'a scan with a sidecar' ct-sr -q --paper --expert views=2,iterations=2,gaussians=20 --keep side side.nii side-sr.nii
ct-info side-sr.nii >out; has out 'ACME' 'the result of a scan with a sidecar names the scanner'
cp side-sr.nii side-1.nii; sh side/commands.sh >/dev/null 2>&1; cmp -s side-sr.nii side-1.nii; ok $? 'the commands read the sidecar likewise'
printf '{"Modality": "CT", "Manufacturer": "OTHER", "SliceThickness": 5}' >side.json
exits 0 'a sidecar that was changed is read again' ct-sr -q --paper --expert views=2,iterations=2,gaussians=20 --keep side side.nii side-sr.nii
ct-info side-sr.nii >out; has out 'OTHER' 'the result is that of the new sidecar'
done_testing
