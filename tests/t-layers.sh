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
may src/kern 'core|kern|xray|recon|resolution|quality'
may src/net 'core|kern|net|xray|recon|resolution|quality|diffusion|unet'
may src/gs 'core|kern|gs|xray|recon|resolution|quality'
may src/cli 'core|cli'
may src/shim 'core|shim'
may formats 'core|formats'
bad=$(cd "$srcdir" && grep -nE '\b(printf|fprintf|puts|perror|exit|abort|getenv) *\(' src/core/*.c src/kern/*.c src/net/*.c src/gs/*.c formats/*.c src/shim/*.cc |
	grep -v 'fprintf(f,')
[ -z "$bad" ]; ok $? 'nothing prints, exits or reads the environment below the command line'
[ -z "$bad" ] || echo "$bad" | sed 's/^/# /'
done_testing
