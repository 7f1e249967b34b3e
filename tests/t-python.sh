#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What programs use of the commands: what these say of themselves in JSON, and from it Boutiques and nipype; the form of
# 3D Slicer; what shells offer; the package for Python.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { skip 'what commands say of themselves' 'no python3'; done_testing; }
py() { PYTHONDONTWRITEBYTECODE=1 python3 "$srcdir/tests/describe.py" "$@"; }
for t in $CT_TOOLS; do
	exits 0 "$t --describe" py described "$t"
	exits 0 "$t --xml" py form "$t"
done
ct-sr --describe | python3 -c 'import json, sys
sys.exit([o["ends"] for o in json.load(sys.stdin)["options"] if o["name"] == "report"] != [[{"names": ["html"]}]])'
ok $? 'an output of one kind tells how its name ends'
ct-phantom -q --size 16x16x16 --spacing 2 ellipsoids hr.nii && ct-degrade -q -x 2 hr.nii lr.nii
ct-convert -q lr.nii lr.nrrd
slicer() { exits 0 "as Slicer runs $1" env SLICER_HOME=/ sh -c "$(py slicer "$@")"; }
slicer ct-sr quality=draft lr.nrrd o.nrrd
has out '^<filter-progress>1.000</filter-progress>$' 'ct-sr tells 3D Slicer its progress'
ct-sr -q -Q draft lr.nrrd plain.nrrd; exits 0 'ct-sr run by a 3D Slicer form gives the same CT' ct-metrics -q --min psnr=1000 plain.nrrd o.nrrd
slicer ct-upsample factor=2 lr.nrrd up.nii; [ -s up.nii ]; ok $? 'ct-upsample run by a 3D Slicer form makes OUT'
slicer ct-convert o.nrrd c.nii.gz; [ -s c.nii.gz ]; ok $? 'ct-convert run by a 3D Slicer form makes OUT'
slicer ct-degrade factor=2 o.nrrd d.nii; [ -s d.nii ]; ok $? 'ct-degrade run by a 3D Slicer form makes OUT'
SLICER_HOME=/ ct-sr -q -Q draft lr.nii - >stream.nii; exits 0 'a stream is not spoilt' ct-info stream.nii
SLICER_HOME=/ ct-project -q -f -n 4 hr.nii /dev/stdout | cat >again.exr; exits 0 'by another name, too' ct-info again.exr
exits 0 'a report is not spoilt under 3D Slicer' env SLICER_HOME=/ ct-metrics --json hr.nii o.nrrd; python3 -c 'import json; json.load(open("out"))'; ok $? 'a report stays JSON under 3D Slicer'
ct-sr -q -Q draft -f lr.nii o.nrrd >out; [ ! -s out ]; ok $? 'without Slicer nothing is printed'
lib=$(ls "$builddir"/libctsr.so.0 "$builddir"/.libs/libctsr.so.0 2>/dev/null | head -n 1)
NO_ET=1 NIPYPE_NO_ET=1 HOME=$PWD; export NO_ET NIPYPE_NO_ET HOME # nipype asks the network for news, and writes there
for PY in /usr/bin/python3 python3; do "$PY" -c 'import nipype' 2>/dev/null && break; done
py() { CTSR_LIBRARY=$lib PYTHONPATH=$srcdir/python PYTHONDONTWRITEBYTECODE=1 "$PY" "$srcdir/tests/describe.py" "$@"; }
if [ -n "$lib" ] && "$PY" -c 'import numpy' 2>/dev/null && ! sanitized ct-sr; then
	for t in $CT_TOOLS; do exits 0 "$t of Boutiques" py boutiques "$t"; done
	exits 0 'as Boutiques runs ct-sr' sh -c "$(py invocation ct-sr IN=lr.nii OUT=b.nii quality=draft quiet=yes threads=1 denoise=0)"
	exits 0 'ct-sr run by Boutiques gives the same CT' ct-metrics -q --min psnr=1000 o.nrrd b.nii
	exits 0 'as Boutiques runs ct-convert' sh -c "$(py invocation ct-convert IN=b.nii OUT=b.mha)"; [ -s b.mha ]; ok $? 'ct-convert run by Boutiques makes OUT'
	exits 0 'ctsr.boutiques prints a descriptor of ct-sr' env CTSR_LIBRARY="$lib" PYTHONPATH="$srcdir/python" PYTHONDONTWRITEBYTECODE=1 "$PY" -m ctsr.boutiques ct-sr; has out '"schema-version": "0.5"'
else
	skip 'Boutiques' 'no shared library, or no numpy'
fi
if [ -n "$lib" ] && "$PY" -c 'import nipype' 2>/dev/null && ! sanitized ct-sr; then
	for t in $CT_TOOLS; do exits 0 "$t of nipype" py nipype "$t"; done
	exits 0 'as nipype runs them' py run_nipype
	exits 0 'ct-sr run by nipype gives the same CT' ct-metrics -q --min psnr=1000 o.nrrd n.nii
else
	skip 'nipype' 'no nipype, or no shared library'
fi

# What the shells offer behind a command when a tab is pressed, as make wrote it from the option tables.
part complete
made=$builddir/complete
mkdir sub; : >a.nii; : >b.nii.gz; : >C.NII; : >notes.txt; : >'two words.nii'; : >p.exr

# offers LINE: into got, the words that the shell puts in place of the last one
bash_offers() { timeout 100 python3 "$srcdir/tests/terminal.py" offered bash ". '$made/bash/${1%% *}'" "$1" >got; }
lazy_offers() { # as installed, bash-completion finds the file
	timeout 100 env XDG_DATA_DIRS="$PWD/share" python3 "$srcdir/tests/terminal.py" offered bash ". $loader" "$1" >got
}
zsh_offers() {
	timeout 100 python3 "$srcdir/tests/terminal.py" offered zsh \
		"fpath=('$made/zsh' \$fpath); autoload -U compinit; compinit -u -C -d '$PWD/zsh-dump'" "$1" >got
}
fish_offers() {
	# as fish 4 reads a question mark
	HOME=$PWD timeout 100 fish --features qmark-noglob -c "source '$made/fish/${1%% *}.fish'; complete -C '$1'" | cut -f 1 >got
}
there() { # there WORD...: each is offered
	for w in "$@"; do grep -qx -- "$w" got || { echo "# no $w in:"; sed 's/^/# /' got; return 1; }; done
}
not_there() { for w in "$@"; do ! grep -qx -- "$w" got || { echo "# $w is there"; return 1; }; done; }

# What all three offer; $2 is what stands behind a long name that takes a value, $3 behind a folder.
all_offer() {
	shell=$1 value=$2 folder=$3
	"${shell}_offers" 'ct-degrade --dec'
	there "--decimate$value" && not_there '--memory.*' '--factor.*'; ok $? "$shell: a long name"
	"${shell}_offers" 'ct-degrade --decimate '; there sinc point mean; ok $? "$shell: the words of a choice"
	"${shell}_offers" 'ct-degrade --decimate=p'
	grep -qE '^(--decimate=)?point$' got && not_there '.*sinc' '.*mean'; ok $? "$shell: a word behind ="
	"${shell}_offers" 'ct-sr --expert=vi'
	grep -qE '^(--expert=)?views=?$' got; ok $? "$shell: a key of --expert behind ="
	"${shell}_offers" 'ct-degrade -p '; there P1 P2 P3; ok $? "$shell: the words of a short option"
	"${shell}_offers" 'ct-degrade -'
	there "--sigma$value" "--factor$value" --force; ok $? "$shell: all long names"
	"${shell}_offers" 'ct-phantom '; there ellipsoids shepp-logan marks; ok $? "$shell: an operand that is a word"
	"${shell}_offers" 'ct-degrade '; there a.nii notes.txt p.exr; ok $? "$shell: any file that is read"
	"${shell}_offers" 'ct-degrade -x 2 --decimate sinc --noise=3 -fq notes.txt '
	there a.nii b.nii.gz C.NII "sub$folder" && not_there p.exr; ok $? "$shell: of what is written the ends"
	! grep -qx notes.txt got || [ "$(grep -cx notes.txt got)" -eq 1 ]; ok $? "$shell: no other"
	"${shell}_offers" 'ct-view a.nii b.nii.gz '
	there a.nii C.NII notes.txt; ok $? "$shell: any number of files, and any of them"
	"${shell}_offers" 'ct-upsample --std '
	there a.nii "sub$folder" && not_there p.exr notes.txt; ok $? "$shell: those of an option"
	"${shell}_offers" 'ct-sr --keep '; there "sub$folder" && not_there a.nii; ok $? "$shell: a folder"
	"${shell}_offers" 'ct-sr --re'; there --release "--report$value"; ok $? "$shell: what may be said"
	"${shell}_offers" 'ct-sr --paper --re'
	there "--report$value" && not_there --release; ok $? "$shell: not what another option excludes"
	"${shell}_offers" 'ct-sr --spacing=1 --s'
	there "--seed$value" && not_there "--scale$value"; ok $? "$shell: nor what excludes another"
}

for t in $CT_TOOLS; do
	[ -s "$made/bash/$t" ] && [ -s "$made/zsh/_$t" ] && [ -s "$made/fish/$t.fish" ]; ok $? "$t has its files"
	bad=
	for s in bash:bash/$t zsh:zsh/_$t fish:fish/$t.fish; do
		! command -v "${s%%:*}" >/dev/null || "${s%%:*}" -n "$made/${s#*:}" || bad="$bad $s"
	done
	[ -z "$bad" ]; ok $? "$t: the shells can read them$bad"
	"$t" --complete - >all
	for o in $("$t" --help | sed -n 's/^  [-, a-zA-Z0-9]\{3\} --\([a-z0-9-]*\).*/\1/p'); do
		grep -q "^--$o=\{0,1\}	" all || bad="$bad --$o"
	done
	[ -z "$bad" ]; ok $? "$t: all options are told$bad"
	[ "$("$t" --complete --expert= | sed -n 's/=	.*//p')" = "$("$t" --help | sed '1,/^Keys of/d' | sed -n 's/^      \([a-z0-9-]*\)=.*/\1/p')" ]
	ok $? "$t: all keys of --expert are told"
	! grep -qE '(;|\. )' all; ok $? "$t: a description ends at its first remark"
done
exits 2 'an unknown shell is an unknown option' ct-degrade --complete=csh
if ! terminal; then
	skip 'bash' 'no python3, or no terminal'; skip 'zsh' 'likewise'
else
	all_offer bash = ''
	bash_offers 'ct-degrade -x 2 a.nii tw'; there 'two words.nii'; ok $? 'bash: a name with a blank'
	bash_offers 'ct-degrade --noise 5 --no'; not_there '--noise='; ok $? 'bash: an option once'
	loader=/usr/share/bash-completion/bash_completion
	if [ -r $loader ]; then
		mkdir -p share/bash-completion/completions
		cp "$made"/bash/* share/bash-completion/completions
		lazy_offers 'ct-degrade --decimate=p'; there '--decimate=point'; ok $? 'bash-completion finds the file'
	else
		skip 'bash-completion' 'not installed'
	fi
	if command -v zsh >/dev/null; then
		all_offer zsh '' ''
	else
		skip 'zsh' 'not installed'
	fi
fi
if command -v fish >/dev/null; then
	all_offer fish '' /
	fish_offers 'ct-degrade -x 2 a.nii tw'; there 'two words.nii'; ok $? 'fish: a name with a blank'
else
	skip 'fish' 'not installed'
fi

# The package for Python, against the commands.
part package
unset CTSR_CPU
lib=$(ls "$builddir"/libctsr.so.0 "$builddir"/.libs/libctsr.so.0 2>/dev/null | head -n 1)
if [ -z "$lib" ] || ! python_with numpy; then skip 'the package for Python' 'no shared library, or no numpy'; done_testing; fi
! sanitized ct-sr || { skip 'the package for Python' 'sanitizers are not of Python'; done_testing; }
for PY in /usr/bin/python3 python3; do "$PY" -c 'import numpy, nibabel' 2>/dev/null && break; done
CTSR_LIBRARY=$lib PYTHONDONTWRITEBYTECODE=1; export CTSR_LIBRARY PYTHONDONTWRITEBYTECODE
exits 0 'every test of the Python package passes' env PYTHONPATH="$srcdir/python" "$PY" "$srcdir/tests/t-python.py" "$srcdir/src/ctsr/ctsr.h" "$builddir/slices.safetensors"
sed 's/^\(not \)*ok [0-9]* -/# \1ok/; /^1\.\./d' out
if "$PY" -c 'import setuptools, wheel, pip' 2>/dev/null; then
	cp -r "$srcdir/python" package && chmod -R u+w package
	exits 0 'pip installs the package without a network' "$PY" -m pip install -q --no-index --no-build-isolation --no-deps --target installed ./package
	exits 0 'Python imports the installed package' sh -c "cd / && PYTHONPATH=$PWD/installed $PY -c 'import ctsr, sys; sys.exit(\"$PWD\" not in ctsr.__file__)'"
	[ -e installed/ctsr/py.typed ]; ok $? 'the installed package has its types'
else
	skip 'pip installs the package without a network' 'no pip, setuptools or wheel'
fi
ct-phantom -q --size 24x24x32 ellipsoids fine.nii && ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean fine.nii thick.nii
if "$PY" -c 'import matplotlib' 2>/dev/null; then
	exits 0 'examples/superres.py refines a scan' env PYTHONPATH="$srcdir/python" "$PY" "$srcdir/examples/superres.py" thick.nii thin.nii.gz look.png "$builddir/slices.safetensors"
	exits 0 'the output of examples/superres.py is a CT' ct-info thin.nii.gz
	[ -s look.png ]
	ok $? 'examples/superres.py writes a picture'
	exits 1 'examples/superres.py refuses a picture that exists' env PYTHONPATH="$srcdir/python" "$PY" "$srcdir/examples/superres.py" thick.nii new.nii.gz look.png
else
	skip 'examples/superres.py refines a scan' 'no matplotlib'
fi
done_testing
