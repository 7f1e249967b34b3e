#!/bin/sh
# The line that ct-sr ends with: what really ran.
. "$srcdir/tests/tap.sh"
says() { # says PATTERN NAME: the last line of err, less seconds and MiB, is that
	sed -nE '$s/, [0-9.]+ s, [0-9]+ MiB$//p' err | grep -qE "^ct-sr: $1\$"; ok $? "$2"
	tail -n 1 err | sed 's/^/# /'
}
number='[0-9.]+(e-[0-9]+)?'
ct-phantom -q --size 48x48x32 shepp-logan t.nii
ct-degrade -q -x 2 t.nii scan.nii
ct-degrade -q -x 2 --noise 15 t.nii noisy.nii
exits 0 'a scan that says how it was made' ct-sr -x 2 scan.nii up.nii
[ "$(wc -l <err)" -eq 1 ]; ok $? 'one line'
blur='blur 0.8493 voxels, sinc \(of the file\)'
says "24x24x16 -> 48x48x32, 2x, $blur, noise 0 HU \\(of the file\\), solver tv [0-9]+ iterations \\(hardly aliased\\) \\+ prior of slices, consistent to $number HU RMS" \
	'sizes, factor, operator, solver, prior'
# its numbers are those of the steps
ct-upsample -v -x 2 --estimate --tolerance 0.1 scan.nii u.nii 2>err.up
n=$(sed -nE 's/.* ([0-9]+) iterations.*/\1/p' err.up)
has err "solver tv $n iterations" 'the iterations that ct-upsample tells'
ct-restore -v -x 2 --estimate --tolerance 0.1 scan.nii r.nii 2>err.re
sed -nE 's/.*within ([0-9.e-]+) HU RMS.*/\1/p' err.re >fit; sed -nE 's/.*consistent to ([0-9.e-]+) HU.*/\1/p' err >said
awk 'NR == FNR {a = $1; next} {exit !(a > 0 && ($1 - a) ^ 2 <= (.06 * a) ^ 2)}' fit said; ok $? 'the residual that ct-restore tells'
exits 0 'noise of the file, to a pipe' sh -c 'ct-sr -x 2 noisy.nii - >p.nii'
says "24x24x16 -> 48x48x32, 2x, $blur, noise 15 HU \\(of the file\\), solver tv [0-9]+ iterations \\(hardly aliased\\) \\+ prior of slices, consistent to (15|1[0-4]|1[0-4]?\.[0-9]|[0-9]) HU RMS" \
	'noise, to which it is consistent'
tail -c 36864 noisy.nii >n.raw && ct-convert -q --raw 24x24x16:f32:4 --orient RAS n.raw bare.nii
exits 0 'measured' ct-sr -Q draft -x 2 bare.nii m.nii
says "24x24x16 -> 48x48x32, 2x, blur unknown, noise $number HU( correlated)? \\(measured\\), by bspline" 'edges that do not tell'
ct-phantom -q --size 96x96x96 shepp-logan big.nii && ct-degrade -q -x 2 big.nii h.nii
tail -c 442368 h.nii >h.raw && ct-convert -q --raw 48x48x48:f32:4 --orient RAS h.raw h.nii -f
ct-degrade -q -x 2 --noise 20 big.nii l.nii && tail -c 442368 l.nii >l.raw && ct-convert -q --raw 48x48x48:f32:4 --orient RAS l.raw loud.nii
exits 0 'edges that do' ct-sr -f -Q draft -x 2 h.nii m.nii
says "48x48x48 -> 96x96x96, 2x, blur [0-9.,]+ voxels, (sinc|point) \\(measured\\), noise 0 HU \\(measured\\), solver h?tv [0-9]+ iterations \\([a-z ]+\\), consistent to $number HU RMS" \
	'what was measured'
exits 0 'given' ct-sr -Q draft -x 2,2,1 --sigma .8 --decimate point --noise 4 bare.nii g.nii
says "24x24x16 -> 48x48x16, 2,2,1x, blur 0.8,0.8,0 voxels, point \\(given\\), noise 4 HU \\(given\\), solver tv [0-9]+ iterations \\(hardly aliased\\), consistent to [1-4](\.[0-9])? HU RMS" \
	'what was given, along each axis'
# noise of neighbours that a Gaussian made alike
ct-degrade -q -x 1 --noise 40 h.nii soft0.nii -f && ct-degrade -q -f -x 1 --sigma .6,.6,.6 soft0.nii soft.nii && tail -c 442368 soft.nii >soft.raw &&
	ct-convert -q --raw 48x48x48:f32:4 --orient RAS soft.raw soft.nii -f
exits 0 'correlated noise' ct-sr -Q draft -x 2 --sigma 1 soft.nii g1.nii
has err 'noise [0-9.]* HU correlated [(]measured' 'is told'
# the operator is given, the noise is not: it is measured
exits 0 'noise that nothing says' ct-sr -Q draft -x 2 --sigma .8493 loud.nii g2.nii
says "48x48x48 -> 96x96x96, 2x, blur 0.8493 voxels, sinc \\(given\\), noise [1-3][0-9.]+ HU \\(measured\\), solver tv [0-9]+ iterations \\(hardly aliased\\), consistent to $number HU RMS" \
	'is measured'
exits 0 'none' ct-sr -f -Q draft -x 2 --sigma .8493 --noise 0 loud.nii g2.nii
says "48x48x48 -> 96x96x96, .*, noise 0 HU \\(given\\), solver tv [0-9]+ iterations \\(hardly aliased\\), consistent to $number HU RMS" \
	'and --noise 0 is none'
exits 0 'in a folder' ct-sr -x 2 --keep k scan.nii up2.nii
exits 0 'again' ct-sr -x 2 --keep k --resume scan.nii up2.nii
grep -qE '^ct-sr: refined before, [0-9.]+ s$' err; ok $? 'what was done before is not said to be done'
ct-degrade -q -x 4 t.nii s4.nii
exits 0 'by way of projections' ct-sr --projections --views 4 --iterations 20 --gaussians 200 -x 4 -f s4.nii p.nii
says "12x12x8 -> 48x48x32, 4x, .* \\+ prior of slices \\+ residual of projections, consistent to $number HU RMS" 'all steps'
exits 0 'quiet' ct-sr -q -f -x 2 scan.nii up.nii
[ ! -s err ]; ok $? '-q says nothing'
exits 3 'what fails' ct-sr -f -x 2 err up.nii
! grep -q ' -> ' err; ok $? 'says no such line'
exits 2 'a step that fails' ct-sr -f -x 3 scan.nii up.nii
has err '^ct-restore: -x 3 contradicts scan.nii, which was reduced 2,2,2 times$' 'names the file that the user gave'
has err '^ct-sr: ct-restore failed; what it reads was made of scan.nii$' 'and ct-sr that which the user gave'
ct-phantom -q -f --size 20x20x20 ellipsoids five.nii && ct-degrade -q -f -x 5 five.nii five-lr.nii
exits 0 'a factor that no prior knows' ct-sr -f --keep five --report five.html five-lr.nii up.nii
has err '^ct-restore: warning: five-lr.nii: ' 'a warning names it' && has five/log.txt '^ct-restore: .*five-lr.nii: ' 'and so the log'
exits 2 'of a stream' sh -c 'ct-sr -f -x 3 - up.nii <scan.nii'
has err '^ct-restore: -x 3 contradicts standard input, which' 'is named'
has err '^ct-sr: ct-restore failed; what it reads was made of standard input$' 'too'
ct-info up.nii | grep -q -- --tell; [ $? -eq 1 ]; ok $? 'the history knows of no listener'
done_testing
