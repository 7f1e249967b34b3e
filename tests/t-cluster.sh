#!/bin/sh
# examples/cluster on this machine: the Snakefile, and slurm.py with an sbatch that runs an array at once; see
# tests/long/cluster.sh for a real one.
. "$srcdir/tests/tap.sh"
hash() { ct-info --json "$1" | sed -n 's/.*"hash": "\(.*\)".*/\1/p'; }
mkdir scans
for n in a b.c; do
	ct-phantom -q -f -s 3 --size 24x24x48 --spacing 3 ellipsoids truth.nii
	ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean truth.nii scans/$n.nii || exit 99
done
gzip scans/b.c.nii
plan() { ct-sr -q -f -t 1 -x 1,1,4 --slices "$builddir/slices.safetensors" --jobs "$1" --plan p --confidence c.nii --report r.html scans/a.nii o.nii; }

mkdir bin && cat >bin/sbatch <<'END'
#!/bin/sh
echo "$*" >>said
n=${*#*--array=0-} n=${n%% *}
while [ $# -gt 0 ]; do case $1 in -*) shift ;; *) break ;; esac; done
for i in $(seq 0 "$n"); do SLURM_ARRAY_TASK_ID=$i "$@" >>ran 2>&1 || exit; done
wc -l <said
END
chmod +x bin/sbatch
array() { PATH=$PWD/bin:$PATH "$srcdir/examples/cluster/slurm.py" p/plan.json "$@"; }
exits 0 'a plan of two slabs, with the error to expect and a page' plan 2
exits 0 'as arrays of Slurm' array --partition=long
[ "$(sed 's/.*--array=\([^ ]*\).*/\1/' said | tr '\n' ' ')" = '0-1 0-1 0-0 ' ]; ok $? 'both slabs, both joins, the page'
[ "$(grep -c -- '--partition=long' said)" = 3 ] && sed 1d said | grep -c -- '--dependency=afterok:[12] ' >n && [ "$(cat n)" = 2 ]; ok $? 'each after the one before'
[ -s o.nii ] && [ -s c.nii ] && grep -q '^ct-restore: took ' r.html; ok $? 'makes all three'
touch -r r.html stamp; cp o.nii first.nii
array >out; [ ! r.html -nt stamp ]; ok $? 'again: nothing'
rm c.nii r.html; array >out
[ -s c.nii ] && [ -s r.html ] && cmp -s o.nii first.nii; ok $? 'and what is gone again'

command -v snakemake >/dev/null || { skip 'a folder of scans' 'no snakemake'; done_testing; }
work() { # work KEY=VALUE...: as README.md has it
	XDG_CACHE_HOME=$PWD/cache timeout 900 snakemake -s "$srcdir/examples/cluster/Snakefile" --profile "$srcdir/examples/cluster/local" \
		--config scans=scans options="-x 1,1,4 --slices $builddir/slices.safetensors" "$@"
}
exits 0 'a folder of scans' work out=fine jobs=2 confidence=yes report=yes
for n in a b.c; do [ -s fine/$n.nii.gz ] && [ -s fine/$n.std.nii.gz ] && [ -s fine/$n.html ]; ok $? "$n: the result, the error to expect, a page"; done
[ -n "$(hash o.nii)" ] && [ "$(hash fine/a.nii.gz)" = "$(hash o.nii)" ] && [ "$(hash fine/a.std.nii.gz)" = "$(hash c.nii)" ]; ok $? 'those of the arrays'
exits 0 'again' work out=fine jobs=2 confidence=yes report=yes
cat out err | grep -q 'Nothing to be done'; ok $? 'there is nothing to do'
exits 0 'one slab each, which makes both' work out=one jobs=1 confidence=yes
[ -s one/a.nii.gz ] && [ -s one/b.c.std.nii.gz ] && [ ! -e one/a.html ]; ok $? 'no page that was not asked for'
exits 0 'the result alone' work out=bare jobs=2
[ "$(cd bare && echo *)" = 'a.nii.gz a.plan b.c.nii.gz b.c.plan' ]; ok $? 'is all there is'
done_testing
