#!/bin/sh
# ct-sr --plan: the jobs of a run, which make or another program runs.
. "$srcdir/tests/tap.sh"
hash() { ct-info --json "$1" | sed -n 's/.*"hash": "\(.*\)".*/\1/p'; }
sets() { # sets FILE: every input is made by a job before, or there; no output is made twice; numbers are numbers
	python3 - "$1" <<'EOF'
import json, os, sys
plan = json.load(open(sys.argv[1]))
made = set()
assert set(plan) == {"made-by", "output", "jobs"} and plan["jobs"]
for j in plan["jobs"]:
    assert set(j) == {"name", "command", "inputs", "outputs", "threads", "seconds", "memory-bytes", "disk-bytes"}
    assert os.access(j["command"][0], os.X_OK) or "/" not in j["command"][0]
    for i in j["inputs"]:
        assert os.path.isabs(i) and (i in made or os.path.exists(i)), i
    for o in j["outputs"]:
        assert os.path.isabs(o) and o not in made and {o, "--std=" + o} & set(j["command"]), o
        made.add(o)
    assert j["threads"] == 1 and "--force" in j["command"] and "--threads=1" in j["command"]
    assert j["inputs"] and (made - set(j["outputs"]) or any(i.endswith("/lr.nii") for i in j["inputs"]))
    assert all(j[k] > 0 for k in ("seconds", "memory-bytes", "disk-bytes")), j
assert plan["output"] in made
assert len({j["name"] for j in plan["jobs"]}) == len(plan["jobs"])
print(" ".join(j["name"] for j in plan["jobs"]))
EOF
}
ct-phantom -q --size 32x40x96 ellipsoids hr.nii
ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean hr.nii thick.nii

exits 0 'a plan' ct-sr -v -t 1 -x 1,1,4 --plan p --jobs 3 thick.nii out.nii
has err '4 jobs: make -f .*/p/plan.mk$' 'says how many jobs'
[ "$(sets p/plan.json)" = 'ct-restore-1 ct-restore-2 ct-restore-3 ct-merge-1' ]; ok $? 'three slabs, and what joins them'
[ ! -e out.nii ] && [ ! -e p/slab-1.nii ] && [ -e p/lr.nii ]; ok $? 'the first step alone is done'
[ "$(sed -n 's/.*\(--iterations=[0-9]*\).*/\1/p' p/plan.mk | sort | uniq -c | awk '{print $1}')" = 3 ]
ok $? 'all slabs with as many iterations'
[ "$(grep -c '"--tolerance=0"' p/plan.json)" = 3 ] && ! grep -q 'tolerance=[^0]' p/plan.json; ok $? 'and no other end'
python3 -c '
import json
a, b, c, m = json.load(open("p/plan.json"))["jobs"]
assert a["disk-bytes"] == 32 * 40 * 32 * 4 and m["disk-bytes"] == 32 * 40 * 96 * 4
assert a["memory-bytes"] < b["memory-bytes"] and a["memory-bytes"] > 67108864
assert m["seconds"] > 0 and m["memory-bytes"] > 0'
ok $? 'the slab in the middle takes more about it'
mkdir away
exits 0 'make runs it, from elsewhere' sh -c 'cd away && make -s -j2 -f ../p/plan.mk'
for k in 1 2 3; do ct-restore -q -x 1,1,4 --estimate --brick $k/3 thick.nii s$k.nii; done
ct-merge -q s1.nii s2.nii s3.nii joined.nii
[ -n "$(hash out.nii)" ] && [ "$(hash out.nii)" = "$(hash joined.nii)" ]; ok $? 'the result is that of slabs by hand'
cp out.nii first.nii
exits 0 'run again' make -f p/plan.mk
has out 'Nothing to be done' 'there is nothing to do'

# killed, damaged, missing
rm -f out.nii p/slab-*.nii
setsid make -s -j2 -f p/plan.mk >log 2>&1 & pid=$! # and what it runs
n=0
while [ ! -e p/slab-1.nii ] && [ $n -lt 600 ]; do sleep 0.02; n=$((n + 1)); done
kill -9 -- -$pid; wait $pid 2>err
exits 0 'after a kill' make -s -f p/plan.mk
cmp -s out.nii first.nii; ok $? 'the same bytes'
was=$(od -An -tu1 -j 4000 -N 1 p/slab-2.nii)
printf "\\$(printf %o $(((was + 1) % 256)))" | dd of=p/slab-2.nii bs=1 seek=4000 conv=notrunc 2>err
exits 2 'a damaged slab' make -s -f p/plan.mk
has err '^ct-merge: .*/slab-2.nii: is damaged' 'is named'
cmp -s out.nii first.nii; ok $? 'and OUT is as it was'
rm p/slab-2.nii
exits 0 'made again when it is gone' make -s -f p/plan.mk
cmp -s out.nii first.nii; ok $? 'it is the same'

# what there is, and what is refused
exits 4 'OUT is there' ct-sr -x 1,1,4 --plan q thick.nii out.nii
exits 4 'another plan' ct-sr -x 1,1,4 --plan p thick.nii other.nii
has err '/p: holds an earlier plan; --force makes a new one$' 'is not written over'
exits 0 'but if it is forced' ct-sr -q -f -t 1 -x 1,1,4 -Q draft --plan p thick.nii other.nii
[ "$(sets p/plan.json)" = 'ct-upsample-1 ct-upsample-2 ct-upsample-3 ct-upsample-4 ct-merge-1' ]; ok $? 'four slabs where nothing says'
[ ! -e p/slab-1.nii ]; ok $? 'and none of the other plan is left'
exits 2 'a stream' ct-sr --plan q thick.nii -
exits 2 'beside --keep' ct-sr --plan q --keep k thick.nii x.nii
exits 2 'dry' ct-sr --plan q --dry-run thick.nii x.nii
exits 2 'a name that make cannot write' ct-sr --plan 'q;' -x 1,1,4 thick.nii x.nii
has err 'make has no way to write' 'in words'
exits 3 'no scan' ct-sr --plan q2 none.nii x.nii
mkdir used && : >used/commands.sh
exits 4 'a folder that holds a run' ct-sr --plan used thick.nii x.nii
[ ! -e q/plan.json ] && [ ! -e q2/plan.json ] && [ ! -e used/plan.json ] && [ ! -e x.nii ]; ok $? 'no plan of any of these'
exits 0 'more slabs than there are' ct-sr -t 1 -x 1,1,4 -Q draft --jobs 99 --plan r thick.nii x.nii
has err '^ct-sr: warning: 6 jobs refine: so many slabs there are, not 99$' 'is said'
ct-phantom -q --size 96x96x192 ellipsoids large.nii
ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean large.nii thicker.nii
exits 0 'memory' ct-sr -f -q -t 1 -x 1,1,4 -Q draft --memory 90M --plan r thicker.nii x.nii
python3 -c '
import json
jobs = json.load(open("r/plan.json"))["jobs"]
assert 2 < len(jobs) < 9, len(jobs)
assert all(j["memory-bytes"] <= 90 * 2**20 for j in jobs)
assert all("--memory=90M" in j["command"] for j in jobs[:-1])
assert all(j["disk-bytes"] < 4 * 96 * 96 * 192 for j in jobs[:-1])'
ok $? 'says how many slabs, which fit'
exits 0 'names that make reads otherwise' ct-sr -f -q -t 1 -x 1,1,4 -Q draft --jobs 2 --plan 'a b#$x:%=' thick.nii "it's \$1.nii"
exits 0 'are written so that it does not' make -s -f 'a b#$x:%=/plan.mk'
[ -s "it's \$1.nii" ]; ok $? 'and the result has its name'

# the error to expect, and a page, which tells what ct-sr and the jobs said
exits 0 'a page' ct-sr -q -t 1 -x 1,1,4 --slices "$builddir/slices.safetensors" --jobs 99 --plan w --confidence c.nii --report w.html thick.nii w.nii
sets w/plan.json >names; grep -qE '^(ct-restore-[1-6] ){6}ct-merge-1 ct-merge-2 ct-report-1$' names; ok $? 'is the last job, and the error is joined too'
cp w/log.txt log; exits 4 'planned again' ct-sr -t 1 -x 1,1,4 --plan w --report w.html thick.nii w.nii
cmp -s w/log.txt log; ok $? 'what was said is still there'
exits 0 'which make makes' make -s -j2 -f w/plan.mk
[ "$(grep -c '^ct-restore: took ' w.html)" = 6 ] && [ "$(grep -c '^ct-merge: took ' w.html)" = 2 ]; ok $? 'with what all jobs took'
has w.html '<li>ct-sr: 6 jobs refine: so many slabs there are, not 99</li>' 'and what ct-sr warned of'
[ -s c.nii ]; ok $? 'and the error is there'
exits 0 'run again' make -f w/plan.mk
has out 'Nothing to be done' 'there is nothing to do'

# a scan that cannot be cut; views
ct-phantom -q --size 24x24x24 --spacing 4 ellipsoids cube.nii
ct-degrade -q -x 4 cube.nii sinc.nii
exits 0 'a scan sampled by sinc' ct-sr -t 1 --projections --views 5 --iterations 20 --gaussians 100 --jobs 2 --plan s sinc.nii sr.nii
has err '^ct-sr: warning: one job refines: every voxel depends on all others' 'is one job, and why'
[ "$(sets s/plan.json)" = 'ct-restore-1 ct-project-1 ct-project-2 ct-ddnm-1 ct-ddnm-2 ct-merge-1 ct-nabgs-1 ct-compose-1' ]
ok $? 'with the views in two'
exits 0 'which make runs' make -s -j2 -f s/plan.mk
ct-sr -q -t 1 --projections --views 5 --iterations 20 --gaussians 100 --keep k sinc.nii direct.nii
[ -n "$(hash s/sr-proj.exr)" ] && [ "$(hash s/sr-proj.exr)" = "$(hash k/sr-proj.exr)" ]; ok $? 'the projections of one run'
[ "$(hash sr.nii)" = "$(hash direct.nii)" ]; ok $? 'and its result'
told() { # told PLAN JOB KEY
	python3 -c 'import json, sys
print(*(j[sys.argv[3]] for j in json.load(open(sys.argv[1]))["jobs"] if j["name"] == sys.argv[2]))' "$@"
}
is() { # is NAME EXPRESSION: awk says so
	awk "BEGIN {exit !($2)}"; ok $? "$1 ($(echo "$2" | tr -s "\n\t " " "))"
}
is 'no Gaussians where the prior adds nothing' "$(told s/plan.json ct-nabgs-1 disk-bytes) < 10000"
is 'nor a network' "$(told s/plan.json ct-ddnm-1 seconds) < .02"
ct-degrade -q -x 4 -p P3 cube.nii points.nii
ct-sr -q -t 1 --projections --views 5 --iterations 20 --gaussians 100 --jobs 2 --plan v points.nii no.nii
is 'a part of the views takes its part' "$(told v/plan.json ct-ddnm-2 seconds) > 1.3 * $(told v/plan.json ct-ddnm-1 seconds)"

# what is told of projections before there are any, and what it comes to
ct-degrade -q -x 4 -p P3 cube.nii point.nii
for n in 200 400; do
	exits 0 "$n views" ct-sr -q -t 1 -Q draft --projections --views $n --iterations 700 --gaussians 100 --jobs 1 \
		--plan v$n --report v$n.html point.nii v$n.nii
	[ "$(sets v$n/plan.json)" = 'ct-upsample-1 ct-project-1 ct-project-2 ct-ddnm-1 ct-nabgs-1 ct-compose-1 ct-report-1' ]
	ok $? 'of all jobs'
done
half=$(told v200/plan.json ct-ddnm-1 seconds) all=$(told v400/plan.json ct-ddnm-1 seconds)
is 'twice the views take twice the time' "$all > 1.6 * $half && $all < 2.4 * $half"
for job in ct-project-1 ct-ddnm-1; do
	is "$job: and the disk" "$(told v400/plan.json $job disk-bytes) == 2 * $(told v200/plan.json $job disk-bytes)"
done
is 'Gaussians that may come' "$(told v200/plan.json ct-nabgs-1 disk-bytes) == 2 * 100 * (44 + 144)"
[ "$(ls -A | grep -c '^ct-sr')" = 0 ]; ok $? 'what stood in is gone'
! grep -qv '^ct-convert\|^ct-sr' v200/log.txt; ok $? 'and the page will not tell of it'
exits 0 'make makes it' make -s -f v200/plan.mk
took() { sed -n "s/^$1: took .* \([0-9.]*\) s of CPU time, \([0-9]*\) MiB\$/\\$2/p" v200/log.txt | head -n 1; }
is 'the network takes what was told' "$(took ct-ddnm 1) > .6 * $half && $(took ct-ddnm 1) < 1.6 * $half"
for tool in ct-project ct-ddnm ct-nabgs ct-compose ct-report; do
	is "$tool holds it" "$(told v200/plan.json $tool-1 memory-bytes) > .7 * 2 ^ 20 * ($(took $tool 2) - 1) &&
		$(told v200/plan.json $tool-1 memory-bytes) < 1.7 * 2 ^ 20 * ($(took $tool 2) + 1)"
done
ct-phantom -q -w -512:3071 --size 24x24x24 --spacing 4 ellipsoids dense.nii
ct-degrade -q -x 4 -p P2 --clip -512:3071 dense.nii clipped.nii
exits 0 'the published method' ct-sr -q -t 1 --paper --views 2 --jobs 2 --plan pp clipped.nii pp.nii
[ "$(sets pp/plan.json)" = 'ct-upsample-1 ct-project-1 ct-project-2 ct-ddnm-1 ct-ddnm-2 ct-merge-1 ct-nabgs-1 ct-compose-1' ]
ok $? 'tells of all, too'
exits 0 'DICOM out' ct-sr -q -t 1 -x 1,1,4 -Q draft --jobs 2 --plan d thick.nii d.dcm
[ "$(sets d/plan.json)" = 'ct-upsample-1 ct-upsample-2 ct-merge-1 ct-convert-1' ]; ok $? 'is a job more'
done_testing
