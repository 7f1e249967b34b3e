#!/bin/sh
# Which folder may include which (CONTRIBUTING, "Layers").
. "$srcdir/tests/tap.sh"
may() { # may FOLDER ALLOWED-REGEX
	bad=$(cd "$srcdir" && grep -rnE '^#[ \t]*include "[a-z0-9]+/' --include='*.[ch]' --include='*.cc' "$1" |
		grep -vE "#[ \t]*include \"($2)/")
	[ -z "$bad" ]; ok $? "$1 includes only $2"
	[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
}
may src/core 'core'
may src/solve 'core|solve'
may src/xray 'core|xray'
may src/resolution 'core|solve|resolution'
may src/quality 'core|resolution|quality'
may src/recon 'core|solve|xray|resolution|recon'
may src/unet 'core|unet'
may src/diffusion 'core|solve|unet|diffusion'
may src/restore 'core|solve|resolution|unet|diffusion|restore'
may src/arssr 'core|solve|unet|resolution|arssr'
may src/refine 'core|solve|resolution|restore|unet|diffusion|arssr|refine'
may src/gs 'core|solve|xray|resolution|recon|quality|gs'
may src/field 'core|solve|xray|resolution|recon|unet|field'
may src/cli 'core|formats|cli'
may src/series 'core|resolution|series'
may src/picture 'core|picture'
may src/report 'core|formats|resolution|quality|picture|report'
may src/train 'core|formats|resolution|unet|diffusion|restore|arssr|shim|train'
may src/shim 'core|series|shim'
may formats 'core|formats'
may src/ctsr 'core|formats|xray|resolution|recon|quality|restore|refine|gs|ctsr'
bad=$(cd "$srcdir" && grep -nE '\b(printf|fprintf|puts|perror|exit|abort|getenv) *\(' src/core/*.c src/solve/*.c src/xray/*.c src/resolution/*.c src/quality/*.c src/recon/*.c src/unet/*.c \
	src/diffusion/*.c src/restore/*.c src/series/*.c src/picture/*.c src/report/*.c src/train/*.c src/gs/*.c src/field/*.c formats/*.c src/shim/*.cc src/refine/*.c src/arssr/*.c src/ctsr/*.c |
	grep -v 'fprintf(f,')
[ -z "$bad" ]; ok $? 'nothing prints, exits or reads the environment below the command line'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
done_testing
