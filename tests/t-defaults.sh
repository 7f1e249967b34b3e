#!/bin/sh
# What an option is if it is not given, of every command: scripts count on it, so that it is changed here
# as well or not at all.
. "$srcdir/tests/tap.sh"
defaults() { # of TOOL, from its help
	"$1" --help | awk -v t="$1" '
		/^  (-.,|   ) --[a-z]/ {match($0, /--[a-z0-9-]+/); o = substr($0, RSTART, RLENGTH); text = ""}
		{text = text " " $0; gsub(/ +/, " ", text)}
		o != "" && match(text, /\(default [^)]*\)/) {print t, o, substr(text, RSTART + 9, RLENGTH - 10); o = ""}'
}
cat >all <<'EOF'
ct-compose --gain 1
ct-convert --slope 1
ct-convert --intercept 0
ct-convert --orient LPS
ct-convert --cube 0
ct-convert --type auto
ct-ddnm --scale 0
ct-ddnm --steps 50
ct-ddnm --eta 0.99
ct-ddnm --operator file
ct-ddnm --sampler ddnm+
ct-ddnm --t-start -1
ct-ddnm --samples 1
ct-ddnm --norm 0
ct-ddnm --channel-reduce mean
ct-ddnm --seed 0
ct-degrade --protocol P1
ct-degrade --noise 0
ct-degrade --seed 0
ct-fdk --method auto
ct-fdk --filter ram-lak
ct-fdk --cutoff 0
ct-fdk --iterations 0
ct-fdk --projector siddon
ct-fdk --tolerance 0
ct-fdk --tv 10
ct-fdk --quantity hu
ct-fuse --lambda-projections 0
ct-fuse --iterations 15
ct-fuse --checkpoint-every 0
ct-info --factor 4
ct-metrics --window -512:3071
ct-metrics --range 0
ct-metrics --edge-step 300
ct-nabgs --iterations 5000
ct-nabgs --tolerance 0
ct-nabgs --gaussians 50000
ct-nabgs --max-gaussians 500000
ct-nabgs --densify-until 0
ct-nabgs --activation prelu
ct-nabgs --mode residual
ct-nabgs --scale 0
ct-nabgs --lambda-tv 0.05
ct-nabgs --lambda-lr 0.1
ct-nabgs --init auto
ct-nabgs --refit 0
ct-nabgs --checkpoint-every 1000
ct-nabgs --seed 0
ct-phantom --size 128x128x128
ct-phantom --spacing 2
ct-phantom --oversample 3
ct-phantom --density 0.25
ct-phantom --views 0
ct-phantom --seed 0
ct-project --views 0
ct-project --quantity file
ct-project --method siddon
ct-project --coarsen 1
ct-project --pixel point
ct-project --photons 0
ct-project --electronic 0
ct-project --mu-water 0.02
ct-project --seed 0
ct-restore --weight 1
ct-restore --axes xyz
ct-sr --scale 4
ct-sr --quality fast
ct-sr --views 0
ct-sr --iterations 0
ct-sr --gaussians 0
ct-sr --seed 0
ct-train --factor 4
ct-train --cubes 8
ct-train --cube 96
ct-train --noise 30
ct-train --depth 3
ct-train --components 160
ct-train --width 512
ct-train --patch 0
ct-train --scales 1
ct-train --batch 0
ct-train --steps 10000
ct-train --minutes 0
ct-train --warmup 0
ct-train --clip 0
ct-train --validate-every 500
ct-train --validate-pieces 64
ct-train --checkpoint-every 1000
ct-train --log-every 50
ct-train --seed 0
ct-upsample --method auto
ct-upsample --iterations 300
ct-upsample --tolerance 0.1
ct-view --plane all
ct-view --slice 0.5
ct-view --views 12
ct-view --window -200:300 for HU, 0:1 for density, else the range of what is shown
ct-view --zoom 1
ct-view --error-window 0 to a quarter of the window
EOF
for t in $CT_TOOLS; do
	{ grep "^$t " all; printf "$t %s\n" '--threads 0' '--expand 100'; } >want
	defaults "$t" >got; cmp -s want got; ok $? "$t"
	diff want got | sed 's/^/# /'
done
done_testing
