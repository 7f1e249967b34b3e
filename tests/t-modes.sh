#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# An option that the chosen mode does not use is an error, before anything is read; help and man page
# say which modes take it.
. "$srcdir/tests/tap.sh"
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
no ct-convert --raw=8x8x8:i16 --scanner s.json
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
	@channel-reduce=first; do
	no ct-ddnm $o --sampler none --init none
done
no ct-ddnm --arch=num_heads=1
no ct-ddnm --class=1
no ct-ddnm --init=none --sampler once
no ct-ddnm --steps=9 --sampler once
no ct-ddnm @t-start=9
no ct-ddnm --std=sd.exr
no ct-ddnm --std=sd.exr --samples 1
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
for o in --window=0:1 --range=1 --mask=none --ssim=r2 --per-slice=s.csv --edges --harm --structures --tissues --uncertainty=none; do
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
has err 'v.nii: --noise: needs --method=' '--noise without its method is refused by name'
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
done_testing
