#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What every option that is a number may be, and what it is where it is not given.
. "$srcdir/tests/tap.sh"
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
ct-ddnm samples 1 65535 1
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
ct-compose --floor g--gain s--spacing w--window --consistent --residual-out --units
ct-convert --series --tilt --gaps --skip-damaged --units --raw --orient --rescale --scanner
ct-convert --radiograph --pitch --reorient --crop --grid --iso --cube --type --compress --sidecar --template --template-other-patient --deid
ct-ddnm x--factor p--prior a--arch --class n--steps --sigma-y --sampler i--init
ct-ddnm k--samples --std r--resume --expert s--seed --json
ct-ddnm --dry-run
ct-degrade x--factor p--protocol --sigma --decimate --profile --slice-thickness --clip --noise s--seed --units
ct-fdk m--method --grid --filter --parker n--iterations --nonnegative --tv w--window --quantity --expert
ct-fdk --json --dry-run
ct-field --like --samples --encoding --network --loss b--budget x--factor --grid w--window --resume --expert s--seed --json --dry-run --units
ct-fuse --base-projections --uncertainty n--iterations w--window --residual-out --checkpoint-every --resume
ct-fuse --expert --json --dry-run --units
ct-info --series e--operator x--factor --json
ct-metrics w--window --range --mask --ssim --per-slice --harm --edges --structures x--factor
ct-metrics --tissues --uncertainty --consistency --map --min --max --csv --expert --json
ct-nabgs b--base --base-projections --uncertainty --lr w--window n--iterations g--gaussians
ct-nabgs a--activation m--mode x--factor --paper --checkpoint-every
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
