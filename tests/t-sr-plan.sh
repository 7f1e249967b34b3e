#!/bin/sh
# ct-sr --dry-run: the commands of every level of quality, of the published method, and of its options,
# with all their numbers.
. "$srcdir/tests/tap.sh"
: >lr.nii # a dry run does not read it
cp "$builddir/residual.safetensors" p.safetensors
plan() { # plan NAME ARGS...: the commands are those of standard input
	name=$1; shift
	sed 's/@/ T\//g' >want
	ct-sr --dry-run "$@" >out 2>err && sed "s|${TMPDIR:-/tmp}/ct-sr.XXXXXX/|T/|g; s|--prior=[^ ]*/prior|--prior=PRIOR|; s|--prior=[^ ]*/slices|--prior=SLICES|; s|--prior=[^ ]*/residual|--prior=RESIDUAL|" out >got
	cmp -s want got; ok $? "$name"
	cmp -s want got || diff want got | sed 's/^/# /'
}
plan 'draft' -Q draft lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii o.nii
EOF
mkdir scan
plan 'DICOM in and out' -Q draft --series 2 scan out/ <<'EOF'
ct-convert scan@lr.nii --series=2
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii@sr.nii
ct-convert --units=hu --template=scan --series=2@sr.nii out/
EOF
plan 'DICOM out' -Q draft lr.nii o.dcm <<'EOF'
ct-convert lr.nii@lr.nii
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii@sr.nii
ct-convert --units=hu@sr.nii o.dcm
EOF
mkdir other; mkdir ./-c
plan 'of a template' -Q draft --template other --series 2 --deid lr.nii out/ <<'EOF'
ct-convert lr.nii@lr.nii
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii@sr.nii
ct-convert --units=hu --template=other --series=2 --deid@sr.nii out/
EOF
plan 'other than IN' -Q draft --template=-c --series 2 scan out/ <<'EOF'
ct-convert scan@lr.nii --series=2
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii@sr.nii
ct-convert --units=hu --template=./-c@sr.nii out/
EOF
plan 'without what tells who' -Q draft --deid scan o.dcm <<'EOF'
ct-convert scan@lr.nii
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii@sr.nii
ct-convert --units=hu --template=scan --deid@sr.nii o.dcm
EOF
for o in --template=other --deid; do
	exits 2 "$o without DICOM" ct-sr --dry-run $o lr.nii o.nii
	has err "^ct-sr: ${o%%=*}: needs OUT to be DICOM" 'says so'
done
exits 3 'a template that is none' ct-sr --dry-run --template lr.nii lr.nii out/
has err 'lr.nii: is not DICOM' 'says so'
plan 'balanced, which is the default' lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-restore --prior=SLICES.safetensors -x4 --estimate --tolerance=0.1@lr.nii o.nii
EOF
plan 'the error to expect, and a page' --memory 2G --confidence c.nii --report r.html lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii --memory=2G
ct-restore --prior=SLICES.safetensors -x4 --memory=2G --estimate --tolerance=0.1 --std=c.nii@lr.nii o.nii
ct-report --memory=2G --std=c.nii --log=T/log.txt@lr.nii o.nii r.html
EOF
plan 'a page of DICOM' -Q draft --report r.html lr.nii o.dcm <<'EOF'
ct-convert lr.nii@lr.nii
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii@sr.nii
ct-convert --units=hu@sr.nii o.dcm
ct-report --log=T/log.txt@lr.nii@sr.nii r.html
EOF
plan 'factors of the axes' -x 1,1,4.5 lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-restore --prior=SLICES.safetensors -x1,1,4.5 --estimate --tolerance=0.1@lr.nii o.nii
EOF
plan 'voxels that are aimed at, a box, the operator, memory' -Q draft --spacing .5,.5,1 --crop auto --sigma 2 --decimate mean \
	--noise 3.5 --memory 2G lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii --memory=2G --crop=auto
ct-upsample --spacing=.5,.5,1 --memory=2G --sigma=2 --decimate=mean --noise=3.5 --tolerance=0.1@lr.nii o.nii
EOF
plan 'fast: slices across one axis' -Q fast lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-restore --prior=SLICES.safetensors --axes=one -x4 --estimate --tolerance=0.1@lr.nii o.nii
EOF
plan 'best: twice' -Q best lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-restore --prior=SLICES.safetensors --passes=2 -x4 --estimate --tolerance=0.1@lr.nii o.nii
EOF
plan 'and with the prior' --spacing 1 --sigma 2 lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-restore --prior=SLICES.safetensors --spacing=1 --sigma=2 --tolerance=0.1@lr.nii o.nii
EOF
for x in 0.5 17 1,1,17 2,2 a; do exits 2 "-x $x" ct-sr --dry-run -x $x lr.nii o.nii; done
exits 2 'nothing to refine' ct-sr --dry-run -x 1 lr.nii o.nii
has err 'scale: 1 refines nothing' 'in words'
for q in '--projections' --paper; do for x in 2.5 1,1,4; do
	exits 2 "$q with factors that projections do not take" ct-sr --dry-run $q -x $x lr.nii o.nii
	has err "scale: projections take one whole number for all axes, not $x" 'in words'
done; done
exits 3 'a prior of pictures has no slices' ct-sr --dry-run --slices "$builddir/prior.safetensors" lr.nii o.nii
has err 'prior.safetensors: .*no prior of slices' 'in words'
plan 'projections' --projections lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-restore --prior=SLICES.safetensors -x4 --estimate --tolerance=0.1@lr.nii@up.nii
ct-project --views=64 --sampling=1.375@up.nii@up-proj.exr
ct-project --views=64 --sampling=1.375 --coarsen=4 --pixel=sinc@up.nii@lr-proj.exr
ct-ddnm --prior=RESIDUAL.safetensors --base-projections=T/up-proj.exr --samples=2@lr-proj.exr@sr-proj.exr
ct-nabgs --base=T/up.nii --base-projections=T/up-proj.exr --iterations=1500 --gaussians=50000 --rate=1 --lambda-tv=0.2@sr-proj.exr@residual.ply
ct-compose --consistent=T/lr.nii@up.nii@residual.ply o.nii
EOF
plan 'of a draft, with numbers and a seed' -Q draft --projections --views 9 --iterations 8 --gaussians 7 -s 7 lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii@up.nii
ct-project --views=9 --sampling=1.375@up.nii@up-proj.exr
ct-project --views=9 --sampling=1.375 --coarsen=4 --pixel=sinc@up.nii@lr-proj.exr
ct-ddnm --prior=RESIDUAL.safetensors --seed=7 --base-projections=T/up-proj.exr --samples=2@lr-proj.exr@sr-proj.exr
ct-nabgs --base=T/up.nii --base-projections=T/up-proj.exr --iterations=8 --gaussians=7 --rate=1 --lambda-tv=0.2 --seed=7@sr-proj.exr@residual.ply
ct-compose --consistent=T/lr.nii@up.nii@residual.ply o.nii
EOF
plan 'a factor whose projections it does not know' --projections -x 2 lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-restore --prior=SLICES.safetensors -x2 --estimate --tolerance=0.1@lr.nii o.nii
EOF
has err 'residual.safetensors knows scans 4 times coarser, not 2: there are no projections' 'which is said'
exits 2 'a prior that is not conditional' ct-sr --dry-run --projections --prior "$builddir/prior.safetensors" lr.nii o.nii
has err 'prior.safetensors: is not conditional, as --projections wants it' 'is refused by name'
plan 'the paper' --paper lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-upsample -x4 --method=cubic@lr.nii@up.nii
ct-project --views=100 --window=-512:3071 --overshoot@up.nii@up-proj.exr
ct-project --views=100 --window=-512:3071 --overshoot@lr.nii@lr-proj.exr
ct-ddnm --prior=PRIOR.safetensors -x4 --steps=50 --sigma-y=0.0015@lr-proj.exr@sr-proj.exr
ct-nabgs --base=T/up.nii --base-projections=T/up-proj.exr --iterations=5000 --gaussians=50000 --scale=4 --paper@sr-proj.exr@residual.ply
ct-compose@up.nii@residual.ply o.nii
EOF
plan 'the release, between its factors' --release -x 5 -s 3 lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-upsample -x5 --method=cubic@lr.nii@up.nii
ct-project --views=100 --window=-512:3071 --overshoot@up.nii@up-proj.exr
ct-project --views=100 --window=-512:3071 --overshoot@lr.nii@lr-proj.exr
ct-ddnm --prior=PRIOR.safetensors --seed=3 -x5 --steps=50 --sigma-y=0.0025@lr-proj.exr@sr-proj.exr
ct-nabgs --base=T/up.nii --base-projections=T/up-proj.exr --iterations=5000 --gaussians=50000 --scale=5 --r2-compat --seed=3@sr-proj.exr@residual.ply
ct-compose@up.nii@residual.ply o.nii
EOF
ct-sr --release --dry-run lr.nii o.nii >out; has out ' -x4 --steps=50 --sigma-y=0.001 ' 'and at 4-fold'
plan 'what is given holds' -Q best --projections --window=-9:99 --views=3 --iterations=4 --gaussians=6 \
	--prior=p.safetensors --keep=T --expand=7 lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii --expand=7
ct-restore --prior=SLICES.safetensors --passes=2 -x4 --estimate --tolerance=0.1@lr.nii@up.nii
ct-project --views=3 --sampling=1.375 --window=-9:99@up.nii@up-proj.exr
ct-project --views=3 --sampling=1.375 --window=-9:99 --coarsen=4 --pixel=sinc@up.nii@lr-proj.exr
ct-ddnm --prior=p.safetensors --base-projections=T/up-proj.exr --samples=2@lr-proj.exr@sr-proj.exr
ct-nabgs --base=T/up.nii --base-projections=T/up-proj.exr --iterations=4 --gaussians=6 --rate=1 --lambda-tv=0.2@sr-proj.exr@residual.ply
ct-compose --consistent=T/lr.nii@up.nii@residual.ply o.nii
EOF
plan 'of the paper too' --paper --window=-9:99 --prior=p.safetensors lr.nii o.nii <<'EOF'
ct-convert lr.nii@lr.nii
ct-upsample -x4 --method=cubic@lr.nii@up.nii
ct-project --views=100 --window=-9:99 --overshoot@up.nii@up-proj.exr
ct-project --views=100 --window=-9:99 --overshoot@lr.nii@lr-proj.exr
ct-ddnm --prior=p.safetensors -x4 --steps=50 --sigma-y=0.0015@lr-proj.exr@sr-proj.exr
ct-nabgs --base=T/up.nii --base-projections=T/up-proj.exr --iterations=5000 --gaussians=50000 --scale=4 --paper@sr-proj.exr@residual.ply
ct-compose@up.nii@residual.ply o.nii
EOF

# names that would be taken for options, streams, and files of the folder between the steps
plan 'a stream is a stream' -Q draft - - <<'EOF'
ct-convert -@lr.nii
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii -
EOF
: >-a.nii
plan 'a dash before a name' -Q draft -- -a.nii -o.nii <<'EOF'
ct-convert ./-a.nii@lr.nii
ct-upsample -x4 --estimate --tolerance=0.1@lr.nii ./-o.nii
EOF
mkdir k
for f in lr.nii up.nii; do
	exits 4 "OUT is k/$f" ct-sr -Q draft --keep=k lr.nii "k/$f"
	has err "k/$f: is written between IN and OUT" 'which is of the steps'
done
for f in up-proj.exr lr-proj.exr sr-proj.exr residual.ply; do
	: >"k/$f"
	ln -s "$f" k/link.nii
	exits 4 "OUT is k/$f" ct-sr -f -Q draft --keep=k lr.nii k/link.nii
	has err "k/$f: is written between IN and OUT" 'which is of the steps, by whatever name'
	rm k/link.nii "k/$f"
done
: >k/up.nii
exits 4 'as is IN' ct-sr -Q draft --keep=k k/up.nii o.nii
has err 'k/up.nii: is written between IN and OUT' 'and that is said'
exits 4 'standard input may be one of them' ct-sr -Q draft --keep=k - o.nii <k/up.nii
has err 'k/up.nii: is written between IN and OUT' 'and that is said'
ct-sr -Q draft --keep=k lr.nii - >>k/up.nii 2>err; [ $? -eq 4 ]; ok $? 'or standard output'
has err 'k/up.nii: is written between IN and OUT' 'and that is said'

# the prior is looked for beside the command, and in share beside its bin
mkdir -p x/bin x/share/ctsr; cp "$(command -v ct-sr)" x/bin
where() { x/bin/ct-sr --dry-run --paper lr.nii o.nii 2>err | sed -n 's/^ct-ddnm --prior=\([^ ]*\) .*/\1/p'; }
at=$(cd x/bin && pwd -P)
if [ -z "$(where)" ]; then
	has err '^ct-sr: no prior is installed at /.*prior.safetensors; --prior names one$' 'no prior'
else
	skip 'no prior' 'one is installed'
fi
: >x/share/ctsr/prior.safetensors
[ "$(where)" = "$at/../share/ctsr/prior.safetensors" ]; ok $? 'a prior in share'
: >x/bin/prior.safetensors
[ "$(where)" = "$at/prior.safetensors" ]; ok $? 'one beside the command comes first'
done_testing
