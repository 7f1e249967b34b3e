#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Options: which go together, what contradicts a file, how large a number may be.
. "$srcdir/tests/tap.sh"

# An option that the chosen mode does not use is an error, before anything is read; help and man page
# say which modes take it.
: >tried
no() { # no TOOL OPTION ARGS...: the option is refused by name
	tool=$1 opt=$2; shift
	case $opt in
	@*) shift; set -- --expert "${opt#@}" "$@"; opt="--expert ${opt#@}" ;; # a key of --expert
	--*=*) echo "$tool $opt" >>tried ;;
	*) echo "$tool $opt" >>tried; shift; set -- "$opt" "$@" ;;
	esac
	case $tool in
	ct-phantom) set -- "$@" ellipsoids none ;;
	ct-fuse) set -- "$@" none none none none ;;
	ct-metrics|ct-info) set -- "$@" none ;;
	ct-view) set -- "$@" none none.png ;;
	ct-report) set -- "$@" none none none.html ;;
	ct-train) set -- "$@" none none ;;
	*) set -- "$@" none none ;;
	esac
	exits 2 "$tool $*" "$tool" "$@"
	has err "^$tool: ${opt%%=*}: \(needs\|not with\) " "$tool names $opt in its refusal"
}
no ct-view --error-window=0:1; no ct-view --error-map=signed; no ct-view --names=a; no ct-view --thickness=5; no ct-view --slices=2 --slice 0.5,0.6
no ct-convert --series=1 --raw 8x8x8:i16:1
no ct-convert --tilt=shear --raw 8x8x8:i16:1
no ct-convert --gaps=fill --raw 8x8x8:i16:1
no ct-convert --skip-damaged --skip-damaged --scanner s.json
no ct-convert --units=hu --scanner s.json
for o in --flat=f.exr --dark=d.exr --rings=9 --water=1 --find-centre --views=1:2 --mu-water=.02; do no ct-convert $o; done
no ct-convert --projections=auto --radiograph intensity
no ct-convert --pitch=1
no ct-convert --rescale=2
no ct-convert --orient=LPS
no ct-convert --reorient=RAS --scanner s.json
no ct-convert --iso=1 --scanner s.json
no ct-convert --cube=8 --scanner s.json
no ct-convert --grid=v.nii --scanner s.json
no ct-convert --type=i16 --scanner s.json
no ct-convert --template=none --scanner s.json
no ct-convert --template-other-patient --template-other-patient
no ct-convert --deid --deid --scanner s.json
no ct-convert --compress --compress --scanner s.json
no ct-convert --sidecar=x.json --scanner s.json
no ct-convert --radiograph=integral --scanner s.json
for o in --units=hu --reorient=RAS --iso=1 --cube=8 --crop=auto --template=none --deid --type=i16 --sidecar=x.json --series=1 --tilt=shear --gaps=fill --skip-damaged; do no ct-convert $o --radiograph intensity; done
for o in --views=3 --arc=90 @start=3 @dso=500 @dsd=900 @pitch=2 @offset=1,2 --det=8 --sampling=2 --paper \
	--scanner=s.json --like=none --beam=fan; do
	[ $o = --like=none ] || no ct-project $o --like none
done
no ct-phantom @oversample=1 --like none
no ct-phantom @density=0.5
no ct-project --det=8 --sampling 1
no ct-project --paper --scanner s.json
no ct-project --pixel=mean
no ct-project --pixel=mean --coarsen 1
no ct-project @electronic=3
no ct-project @mu-water=0.02
no ct-upsample --estimate --sigma 1
no ct-upsample --trust
no ct-sr --trust --sigma 1
for m in linear cubic bspline lanczos sinc; do
	no ct-upsample --start=none -m $m
	for o in --denoise=1 --noise=3 --iterations=9 --tolerance=1; do no ct-upsample $o -m $m; done
done
for o in --noise=3 --iterations=9 --tolerance=1; do no ct-upsample $o -m dc; done
for m in linear cubic bspline lanczos sinc dc tv htv; do no ct-upsample --std=s.nii -m $m; done
for m in auto fdk fbp; do
	for o in --iterations=3 @projector=joseph @tolerance=0.1 --nonnegative --tv=10; do
		no ct-fdk $o -m $m
	done
done
for m in sirt cgls tv; do
	for o in --filter=hann @cutoff=0.5 --parker; do no ct-fdk $o -m $m; done
done
no ct-fdk @cutoff=0.5 --filter none --quantity density
no ct-fdk --nonnegative -m cgls
no ct-fdk --tv=3 -m sirt
no ct-ddnm --sigma-y=0.1 --sampler ddnm
for o in @guidance=9 @iterations=9 @rate=1 @gradient=chain; do no ct-ddnm $o; no ct-ddnm $o --sampler ddim; done
no ct-ddnm @guidance=9 --sampler bird
for o in @iterations=9 @rate=1 @gradient=chain; do no ct-ddnm $o --sampler gdp; done
for o in ddpm dpm-solver++ gdp bird none; do no ct-ddnm @eta=0.5 --sampler $o; no ct-ddnm --sigma-y=0.1 --sampler $o; done
for o in --prior=p.x --steps=9 @operator=mean @t-start=9 @travel=2,2 --samples=2 @norm=1 \
	@channel-reduce=first @range=view; do
	no ct-ddnm $o --sampler none --init none
done
no ct-ddnm --arch=num_heads=1
no ct-ddnm --class=1
no ct-ddnm --init=none --sampler once
no ct-ddnm @norm=1 --expert range=bytes
for o in --uncertainty=p.exr --paper @r2-compat=yes; do no ct-nabgs $o --release; done; no ct-nabgs --release --mode full
no ct-ddnm --steps=9 --sampler once
no ct-ddnm --std=sd.exr
for o in --prior=p.x --preset=fast; do for m in auto linear tv; do no ct-upsample $o -m $m; done; done
for o in --factor=3 --bytes=0:1 --with=none --cache=none; do
	no ct-train $o
done
no ct-train --arch=model_channels=8 --kind slices
no ct-train @cubes=8 --kind superres
no ct-train --patience=3
echo ct-train --checkpoint-every >>tried
exits 2 'ct-train to a stream' ct-train --checkpoint-every=3 - none
has err '^ct-train: --checkpoint-every: needs OUT to be a file' 'the error of ct-train to a stream names --checkpoint-every'
no ct-nabgs --base-projections=/nonexistent -b none -m full
no ct-nabgs --lr=none -b none -m full
no ct-nabgs @lambda-lr=0.2 -b none
for t in 'ct-nabgs -b none' ct-fuse; do
	echo "${t%% *} --checkpoint-every" >>tried
	case $t in ct-fuse) in='none none none' ;; *) in=none ;; esac
	# shellcheck disable=SC2086
	exits 2 "$t to a stream" $t --checkpoint-every=5 $in -
	has err 'checkpoint-every: needs OUT to be a file' "the error of $t to a stream names --checkpoint-every"
done
for o in --window=0:1 --range=1 --mask=none --ssim=r2 --per-slice=s.csv --edges --harm --structures --tissues --surface=1 --uncertainty=none; do
	no ct-metrics $o --consistency none
done
no ct-metrics --factor=4
no ct-metrics --map=m.nii
no ct-info --factor=2
for p in --paper --release; do for o in --quality=fast --sigma=1 --denoise=1 --noise=2 --decimate=mean --profile=box --slice-thickness=5; do no ct-sr $o $p; done; done
for p in --paper --release; do for o in --spacing=1 --trust --confidence=c.nii --sidecar=c.json; do no ct-sr $o $p; done; done
no ct-sr --paper --release
no ct-sr --keep=k
no ct-sr --spacing=1 -x 2
no ct-sr --prior=none -Q draft
for o in --paper --release; do no ct-sr --confidence=c.nii $o; done
echo ct-sr --report >>tried
exits 2 'a page of a stream' ct-sr --report=r.html none -
has err '^ct-sr: --report: needs OUT to be a file' 'has nothing to read'
for o in --spacing=1 --memory=1G; do for p in --paper --release; do no ct-sr $o $p; done; done
for o in --sigma=1 --decimate=mean --noise=1; do for p in --paper --release; do no ct-sr $o $p; done; done
no ct-sr --spacing=1 -x 2
for t in ct-ddnm ct-fdk ct-project ct-train ct-upsample; do no $t --json; done
no ct-upsample --spacing=1 -x 2
no ct-field --factor=2 --grid none
no ct-convert --crop=auto --scanner none
echo ct-sr --release >>tried # the error names one of the two

# every option that help says belongs to some modes was tried
for t in $CT_TOOLS; do
	"$t" --help | awk -v t="$t" '/^  (-[a-zA-Z],|   ) --/ {match($0, /--[a-z0-9-]+/); o = substr($0, RSTART, RLENGTH)}
		/^ +\[(needs|not with) / {print t, o}' | sort -u
done >limited
sed 's/=.*//' tried | sort -u >done
[ "$(wc -l <limited)" -gt 60 ]; ok $? 'help says which modes take an option'
bad=$(sort limited | comm -23 - done)
[ -z "$bad" ]; ok $? 'and each of them is tried here'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
ct-fdk --help >out; has out '\[needs --method=sirt|tv\]' 'words of a choice'
ct-fdk --mdoc-options >out; has out 'Needs \\-\\-method=sirt|tv\.' 'in the man page too'
[ ! -e none ]; ok $? 'options of another mode make no output'

# what a mode is only the files say
ct-phantom -q --size 16x16x16 --spacing 4 ellipsoids v.nii
ct-project -q -n 2 --coarsen 4 --pixel mean v.nii mean.exr
exits 2 'noise, where the operator is not known' ct-upsample -x 2 --noise 5 v.nii no.nii
has err 'v.nii: --noise does nothing, as the file holds no operator .*: pass --sigma or --estimate' '--noise without its method is refused by name'
for o in --decimate=mean --profile=box --slice-thickness=5; do for m in auto linear; do
	exits 2 "$o alone is refused by $m where the blur is not known" ct-upsample -m $m -x 2 $o v.nii no.nii
	has err 'v.nii: the sampling, or the profile of one axis .*: pass --sigma or --estimate' "the error of $o alone, with $m, says what else to pass"
done; done
for o in --profile=box --slice-thickness=5; do exits 0 "$o of one axis is all there is to say of its blur" ct-upsample -f -x 1,1,2 $o v.nii one.nii; done
exits 2 'a seed is refused for a phantom that is always the same' ct-phantom -s 1 cube no.nii; has err '^ct-phantom: --seed: needs KIND=ellipsoids|shells' 'the error of a seed of a cube names the kinds'
exits 2 'a seed is refused without a sampler that draws' ct-ddnm -s 1 --sampler none mean.exr no.exr; has err '^ct-ddnm: --seed: not with --sampler=once|none' 'the error of a seed without a sampler names the samplers'
exits 2 'a series of a file that is not DICOM' ct-info --series 1 v.nii; has err '^ct-info: --series: v.nii is not DICOM' 'the error of a series of NIfTI names the file'
exits 2 'a key of --expert without a value is refused' ct-sr --paper --expert views v.nii no.nii; has err "^ct-sr: --expert: 'views' has no value: views=N" 'the error of a key without a value shows how it is given'
exits 2 'colours of a grey prior' ct-ddnm --expert channel-reduce=mean mean.exr no.exr
has err 'channel-reduce: .* has no colours' 'colours of a grey prior are refused by name'
if command -v ct-view >/dev/null; then
	exits 2 'a slice of projections' ct-view --slice 0.5 mean.exr no.png
	exits 2 'views of a volume' ct-view --views 3 v.nii no.png
	has err '^ct-view: --views' 'ct-view refuses --views by name'
fi
exits 2 'a protocol of which nothing is left' ct-degrade -x 2 -p P1 --sigma 1 --decimate mean v.nii no.nii
exits 2 'JSON beside a map' sh -c 'ct-metrics --json --consistency v.nii --map - v.nii v.nii >none'
[ ! -e no.exr ] && [ ! -e no.png ] && [ ! -e no.nii ]; ok $? 'options that were refused make no output'

# every command of README and of the man pages is one that the command line takes; its files are not here
mkdir docs && cd docs || exit 99
for p in "$srcdir"/README.md "$srcdir"/man/*.in "$srcdir"/man/*.7; do
	sed 's/\\e$/\\/; s/ *#.*//' "$p" | sed -e ':a' -e '/\\$/N; s/ *\\\n */ /; ta' |
		sed -n 's/^\.Dl //; s/^    \(ct-\)/\1/; s/\\-/-/g; /^ct-[a-z]* /p'
done | tr '|' '\n' | sed 's/&&/\n/g' | sed 's/^ *//; s/ >.*//' | grep '^ct-' | sort -u >../examples
command -v ct-view >/dev/null || { grep -v '^ct-view' ../examples >../some; mv ../some ../examples; }
[ "$(wc -l <../examples)" -gt 70 ]; ok $? 'the documents have examples'
while read -r line; do
	timeout 20 sh -c "$line" </dev/null >/dev/null 2>../err
	[ $? -ne 2 ] || { echo "$line"; head -n 1 ../err; }
done <../examples >../wrong
[ ! -s ../wrong ]; ok $? 'that are command lines as they should be'
sed 's/^/# /' ../wrong
cd ..

# What a file says of itself holds: an option that says otherwise is an error that names both, in
# every command, and nothing is written.
part contradictions
ct-phantom -q ellipsoids --size 32x32x32 --spacing 4 hr.nii
ct-degrade -q -x 4 --noise 5 hr.nii lr.nii
ct-upsample -q -m cubic lr.nii up.nii
ct-project -q -n 12 hr.nii p.exr
for p in point mean sinc; do ct-project -q -n 4 --coarsen 4 --pixel $p up.nii $p.exr; done
ct-fdk -q --quantity density p.exr density.nii 2>/dev/null
ct-nabgs -q -b up.nii -n 10 -g 100 p.exr r.ply
[ -s r.ply ] && [ -s density.nii ] && [ -s sinc.exr ]; ok $? 'files that say what they are'

against() { # against STATUS FILE WORD TOOL ARGS...: the error names the file and the word
	want=$1 file=$2 word=$3; shift 3
	exits "$want" "$*" "$@"
	grep -q -- "$file" err && grep -q -- "$word" err; ok $? "names $file and $word"
	[ ! -e no.nii ] && [ ! -e no.exr ] && [ ! -e no.ply ]; ok $? 'a contradiction with the file writes nothing'
}
against 2 lr.nii 'factor 2,2,2' ct-upsample -x 2 lr.nii no.nii
against 2 lr.nii 'sigma 1' ct-upsample --sigma 1 lr.nii no.nii
against 2 lr.nii 'sampling mean' ct-upsample --decimate mean lr.nii no.nii
against 2 lr.nii 'noise 9' ct-upsample --noise 9 lr.nii no.nii
against 2 lr.nii 'factor 2,2,2' ct-sr -x 2 lr.nii no.nii
against 2 '--factor: 0.9' '\[1, 1024\]' ct-sr -x 0.9 lr.nii no.nii
against 2 '--factor: 1025' '\[1, 1024\]' ct-sr -x 1025 lr.nii no.nii
against 2 OUT 'name is empty' ct-sr hr.nii ''
against 2 hr.nii '--window' ct-project -w -512:3071 hr.nii no.exr
against 2 density.nii '--quantity' ct-project --quantity hu density.nii no.exr
against 2 p.exr '--window' ct-fdk -w -512:3071 p.exr no.nii
against 2 sinc.exr '--factor 2' ct-ddnm -x 2 sinc.exr no.exr
against 2 sinc.exr '--expert operator: mean' ct-ddnm --expert operator=mean sinc.exr no.exr
against 2 mean.exr '--expert operator: matched' ct-ddnm --expert operator=matched mean.exr no.exr
against 2 up.nii '--factor 8' ct-nabgs -x 8 -b up.nii p.exr no.ply
against 2 up.nii '--window' ct-nabgs -w -512:3071 -b up.nii p.exr no.ply
against 2 up.nii '--window' ct-fuse -w -512:3071 up.nii lr.nii p.exr no.nii
against 2 r.ply '--window' ct-compose -w -512:3071 up.nii r.ply no.nii
against 2 r.ply '--expert gamma' ct-compose --expert gamma=.5 up.nii r.ply no.nii
against 2 hr.nii '--expert gamma' ct-compose --expert gamma=.5 up.nii hr.nii no.nii
against 2 p.exr '--pitch' ct-convert --projections auto --pitch 9 p.exr no.exr
against 3 density.nii density ct-metrics hr.nii density.nii
against 3 hr.nii 'a predicted error is above 0 HU' ct-metrics --uncertainty hr.nii hr.nii up.nii

# what the file says is what is done
operator() { ct-ddnm -q --steps 1 "$@" - | ct-info - | awk '$1 == "operator" {print $2}'; }
[ "$(operator sinc.exr)" = matched ]; ok $? 'pixels that are cut at the Nyquist frequency are taken for that'
[ "$(operator mean.exr)" = mean ]; ok $? 'an operator of means is noted as mean'
[ "$(operator point.exr)" = mean ]; ok $? 'rays for means, as published'
[ "$(operator --expert operator=matched point.exr)" = matched ]; ok $? 'or for what is asked'
exits 0 'the same again is no contradiction' ct-ddnm -q -x 4 --steps 1 --expert operator=matched sinc.exr a.exr
exits 0 'nor of the factor' ct-nabgs -q -x 4 -b up.nii -n 5 -g 50 p.exr a.ply
exits 0 'nor of the noise' ct-upsample -q -x 4 --noise 5 --iterations 3 lr.nii a.nii

# What every option that is a number may be, and what it is where it is not given.
part limits
cat >limits <<'EOF'
ct-compose floor -1000000 1000000 -
ct-compose gain -1000 1000 1
ct-compose spacing 0.001 1000000 -
ct-convert iso 0.0001 1000 -
ct-convert cube 0 4096 0
ct-ddnm factor 2 64 -
ct-ddnm class -1 65535 -1
ct-ddnm steps 1 1000 -
ct-ddnm sigma-y 0 1 -
ct-ddnm samples 1 65535 -
ct-degrade noise 0 1000000 -
ct-fdk iterations 0 1000000 0
ct-fdk tv 0 1000000 10
ct-fuse iterations 1 10000000 15
ct-fuse checkpoint-every 0 10000000 0
ct-metrics range 0 1000000000 0
ct-nabgs iterations 1 10000000 5000
ct-nabgs gaussians 1 16000000 50000
ct-nabgs factor 0 1024 0
ct-nabgs checkpoint-every 0 10000000 1000
ct-project coarsen 1 4096 1
ct-project photons 0 1e15 0
ct-sr noise 0 1000000 -
ct-train factor 2 8 4
ct-train patch 4 4096 -
ct-train steps 0 2000000000 10000
ct-train minutes 0 1000000 0
ct-train patience 0 1000000 0
ct-train checkpoint-every 1 2000000000 1000
ct-upsample noise 0 1000000 -
ct-upsample iterations 1 100000 300
ct-upsample tolerance 0 1000000 0.1
ct-view thickness 0.001 1000000 -
ct-view slices 1 1000 1
ct-view views 1 10000 12
ct-view zoom 0.015625 64 1
ct-project views 0 65535 0
ct-project arc -1000000 1000000 -
ct-project sampling 0.01 100 -
EOF
command -v ct-view >/dev/null || { grep -v '^ct-view' limits >some; mv some limits; }

# Just beyond, the error names both ends.
awk '$4 != "any" {x = $4 < 1e10 && $4 == int($4) ? $4 + 1 : 1.5 * $4
	printf "%s %s %.12g %s: --%s: %g is outside [%g, %g]\n", $1, $2, x, $1, $2, x, $3, $4}' limits >beyond
while read -r tool opt x want; do
	got=$("$tool" --"$opt"="$x" 2>&1)
	case $got in "$want"*) ;; *) printf '%s\n' "$got" | head -n 1 ;; esac
done <beyond >wrong
[ ! -s wrong ]; ok $? 'a number beyond its limits is refused'
sed 's/^/# /' wrong

awk '$4 == "any" {print $1, $2}' limits | while read -r tool opt; do
	for x in -1e12 0.4 1e12; do "$tool" --"$opt"=$x; done
done 2>&1 | grep outside; [ $? -eq 1 ]; ok $? 'one without limits has none'

# what help says that an option is by default, and the options that are no numbers
cat >words <<'EOF'
ct-convert orient LPS
ct-convert gaps resample
ct-convert tilt rectify
ct-convert type auto
ct-convert rescale 1
ct-convert radiograph no
ct-convert units auto
ct-compose units auto
ct-degrade units auto
ct-fuse units auto
ct-nabgs units auto
ct-report units auto
ct-sr units auto
ct-upsample units auto
ct-ddnm sampler ddnm+
ct-degrade protocol P1
ct-degrade decimate -
ct-fdk method auto
ct-fdk filter ram-lak
ct-fdk quantity hu
ct-field like auto
ct-field samples auto
ct-field encoding auto
ct-metrics ssim -
ct-nabgs activation prelu
ct-nabgs mode residual
ct-phantom size 128x128x128
ct-phantom spacing 2
ct-project quantity file
ct-project method siddon
ct-project pixel point
ct-sr quality balanced
ct-train kind pictures
ct-upsample method auto
ct-upsample preset balanced
ct-upsample decimate -
ct-view plane all
ct-view mip none
ct-view error-map hot
ct-view slice 0.5
EOF
command -v ct-view >/dev/null || { grep -v '^ct-view' words >some; mv some words; }
{ cat words; awk '{print $1, $2, $5}' limits; } | sort >want
for t in $CT_TOOLS; do
	"$t" --help >"help-$t"
	awk -v t="$t" 'function tell() {if (o) print t, o, d}
		/^  (-[a-zA-Z],|   ) --/ {tell(); match($0, /--[a-z0-9-]+/); o = substr($0, RSTART + 2, RLENGTH - 2); d = "-"}
		match($0, /\(default [^ )]*\)$/) {d = substr($0, RSTART + 9, RLENGTH - 10)}
		/^Exit/ {tell()}' "help-$t"
done | sort >says
while read -r line; do
	grep -qxF -- "$line" says || echo "$line"
done <want >wrong
[ ! -s wrong ]; ok $? 'what is not given is what help says'
sed 's/^/# /' wrong
# all options and their letters, in order; those of every command come last
cat >options <<'EOF'
ct-compose --floor g--gain s--spacing w--window --consistent --residual-out --expert --units
ct-convert --series --tilt --gaps --skip-damaged --units --raw --orient --rescale --projections --scanner
ct-convert --flat --dark --rings --water --find-centre --views --mu-water --radiograph --pitch --reorient --crop --grid --iso --cube --type --compress --sidecar --template --template-other-patient --deid
ct-ddnm x--factor p--prior a--arch --class n--steps --sigma-y --sampler i--init
ct-ddnm k--samples --std r--resume --expert s--seed --json
ct-ddnm --dry-run
ct-degrade x--factor p--protocol --sigma --decimate --profile --slice-thickness --clip --noise s--seed --units
ct-fdk m--method --grid --filter --parker --find-centre n--iterations --nonnegative --tv w--window --quantity --expert
ct-fdk --json --dry-run
ct-field --like --samples --encoding --network --loss b--budget x--factor --grid w--window --resume --expert s--seed --json --dry-run --units
ct-fuse --base-projections --uncertainty n--iterations w--window --residual-out --checkpoint-every --resume
ct-fuse --expert --json --dry-run --units
ct-info --series e--operator x--factor --json
ct-metrics w--window --range --mask --ssim --per-slice --harm --edges --structures x--factor
ct-metrics --tissues --surface --uncertainty --consistency --map --min --max --csv --expert --json
ct-nabgs b--base --base-projections --uncertainty --lr w--window n--iterations g--gaussians
ct-nabgs a--activation m--mode x--factor --paper --release --checkpoint-every
ct-nabgs --resume --expert s--seed --json --dry-run --units
ct-phantom --size --spacing w--window --like --expert s--seed
ct-profile --units
ct-project --beam n--views --arc --det --sampling --paper --scanner --like w--window
ct-project --overshoot --quantity m--method --coarsen --pixel --photons --expert s--seed --json --dry-run
ct-report --uncertainty --truth --log --units
ct-sr x--factor --spacing --sigma --decimate --profile --slice-thickness --denoise --trust --noise Q--quality --series --deid --report
ct-sr --confidence --sidecar --memory --prior --paper --release k--keep --expert s--seed --json
ct-sr --dry-run --units
ct-train k--kind x--factor a--arch p--patch n--steps m--minutes --validate
ct-train --patience r--resume --checkpoint-every --half --licence --bytes --with --cache --expert s--seed
ct-train --json --dry-run
ct-upsample m--method x--factor --spacing --sigma --decimate --profile --slice-thickness --denoise --trust --noise --estimate --start --iterations
ct-upsample --tolerance --std --memory p--prior Q--preset --expert --json --dry-run --units
ct-view o--output p--plane --slice --slices --mip --thickness --views w--window z--zoom e--error
ct-view --error-map --error-window l--labels --names
EOF
command -v ct-view >/dev/null || { grep -v '^ct-view' options >some; mv some options; }
awk '{for (i = 2; i <= NF; i++) print $1, $i}' options >want
for t in $CT_TOOLS; do
	sed -n "s/^  -\([^-]\), --\([a-z0-9-]*\).*/$t \1--\2/p; s/^  ....--\([a-z0-9-]*\).*/$t --\1/p" "help-$t" |
		sed '/ t--threads$/,$d'
done | sort -s -k1,1 >says
cmp -s want says; ok $? 'options and their letters'
diff want says | sed 's/^/# /'
done_testing
