#!/bin/sh
# examples/cluster/simulate.py, where the answer can be written down.
. "$srcdir/tests/tap.sh"
command -v python3 >/dev/null || { echo '1..0 # SKIP no python3'; exit 0; }
sim() { python3 "$srcdir/examples/cluster/simulate.py" "$@"; }
table() { # table LINE...: jobs.csv
	echo 'name,count,threads,seconds,memory,read,write,after' >jobs.csv
	for line; do echo "$line"; done >>jobs.csv
}
is() { # is KEY VALUE NAME ARGS...: of jobs.csv
	key=$1 want=$2 name=$3; shift 3
	sim "$@" jobs.csv >out 2>err
	awk -v k="$key" -v w="$want" '$1 == k {d = $2 - w; found = d * d <= 1e-12 * w * w} END {exit !found}' out; ok $? "$name"
	grep -q "^$key " out || sed 's/^/# /' err
}

table 'a,,1,10,1G,,,'
is makespan-s 10 'one job'
is makespan-s 10 'on many nodes' --nodes 7
is peak-memory-bytes 1073741824 'takes its memory'
table 'a,10,1,7,1G,,,'
is makespan-s 28 '10 equal jobs on 3 nodes take ceil(10/3) turns' --nodes 3 --cores 1
is cores-computing "$(echo 10 3 4 | awk '{print $1 / $2 / $3}')" 'and as much of the cores' --nodes 3 --cores 1
is makespan-s 14 'on 2 nodes of 3 cores 2 turns' --nodes 2 --cores 3
is makespan-s 70 'one core, all of them' --cores 1
is core-seconds 70 'which is the work' --nodes 5
is makespan-s 35 'half as many at once, each twice the cores' --nodes 1 --cores 2
table 'a,10,2,7,1G,,,'
is makespan-s 70 'as jobs of two threads take' --nodes 1 --cores 2
table 'a,5,1,4,1G,,,' 'b,,1,6,1G,,,a' 'c,2,1,3,1G,,,b'
is makespan-s 13 'a chain waits for all of what it is after' --nodes 9
is least-s-by-longest-chain 13 'and is the longest chain' --nodes 9
is makespan-s 32 'on one core it is a queue' --nodes 1 --cores 1
table 'a,,1,5,1G,,,' 'b,,1,2,1G,,,a'
is makespan-s 14 'copies do not wait for each other' --cores 2 --copies 4

# the file system
table 'a,8,1,0,1G,3e9,1e9,'
is makespan-s 32 'bound by what all share: bytes/bandwidth' --nodes 4 --cores 2 --bandwidth 1e9
is bandwidth-used 1 'and all of it is used' --nodes 4 --cores 2 --bandwidth 1e9
is bytes 32e9 'all bytes are counted' --nodes 4
is makespan-s 8 'bound by the link of a node' --nodes 4 --cores 2 --link 1e9
is makespan-s 16 'by both: 2 GB/s for 4 links of 1 GB/s' --nodes 4 --cores 2 --link 1e9 --bandwidth 2e9
table 'a,,1,5,1G,3e9,1e9,'
is makespan-s 9 'reads, computes and writes' --bandwidth 1e9
table 'a,3,1,0,1G,1e9,,' 'b,,3,0,1G,2e9,,'
# three transfers have the link of one node, b what they leave of 1.5 GB/s, until they end: then its own link
is makespan-s 3.5 'what one node cannot take another has' --nodes 2 --cores 3 --link 1e9 --bandwidth 1.5e9

table 'b,,3,0,1G,2e9,,' 'a,3,1,0,1G,1e9,,'
is makespan-s 3.5 'whichever it is' --nodes 2 --cores 3 --link 1e9 --bandwidth 1.5e9

# memory, order
table 'a,6,1,7,4G,,,'
is makespan-s 21 'as many at once as have their memory' --memory 10G
is peak-memory-bytes 8589934592 'and no more' --memory 10G
is makespan-s 42 'less than that if they ask for twice as much' --memory 10G --slack 2
is peak-memory-bytes 4294967296 'which they do not take' --memory 10G --slack 2
table 'a,,2,10,1G,,,' 'b,,2,10,1G,,,' 'c,,1,20,1G,,,'
is makespan-s 20 'what fits runs before what does not' --cores 3
sim --cores 3 --trace trace jobs.csv >out
printf 'job,node,start,end\r\na,1,0.0,10.0\r\nc,1,0.0,20.0\r\nb,1,10.0,20.0\r\n' | cmp -s trace -; ok $? 'in the order of the queue'

# the scheduler
table 'a,10,1,7,1G,,,'
is makespan-s 28 'no more than so many jobs at once' --most 3 --nodes 2
table 'a,,1,1,1G,,,' 'b,,1,1,1G,,,a' 'c,,1,1,1G,,,b'
is makespan-s 9 'a job starts late' --latency 2
is cores-held "$(echo 9 16 | awk '{print $1 / $2 / 9}')" 'and holds its core from then on' --latency 2
is makespan-s 21 'at times at which the scheduler looks' --interval 10
table 'a,4,1,1,1G,,,'
is makespan-s 31 'no more than a look starts' --interval 10 --starts 1
is makespan-s 11 'or these many' --interval 10 --starts 2
table 'a,4,1,100,1G,,,'
is makespan-s 130 'and it looks again when some are left' --interval 10 --starts 1

# nodes that die
table 'a,4,1,10,1G,,,'
is makespan-s 40 'the rest does the work of a node that died' --nodes 2 --cores 1 --kill 2@5
is requeued 1 'what it ran is queued again' --nodes 2 --cores 1 --kill 2@5
is lost-core-seconds 5 'from its beginning' --nodes 2 --cores 1 --kill 2@5
is makespan-s 27 'less if it is back' --nodes 2 --cores 1 --kill 2@5:7
table 'a,40,1,10,1G,,,'
is requeued 8 'no more than what ran is queued again' --nodes 2 --cores 8 --kill 1@15:16
table 'a,,1,1,1G,4e9,,'
is bytes 7e9 'bytes that were read in vain are counted' --nodes 2 --cores 1 --bandwidth 1e9 --kill 1@3
exits 1 'no node is left' sim --kill 1@.5 jobs.csv
has err '^simulate.py: 1 jobs are left, and no node$' 'in words'

# chance
table 'a,4000,1,10,1G,,,'
chance() { PYTHONHASHSEED=$1 sim --nodes 8 --spread .3 --mtbf 500 --repair 100 --seed "$2" --json jobs.csv; }
chance 1 5 >one && chance 2 5 >two && cmp -s one two; ok $? 'the same twice'
chance 1 6 >two && ! cmp -s one two; ok $? 'another by another seed'
python3 -c '
import json
r = json.load(open("one"))[0]
assert abs(r["core-seconds"] / 40000 - 1) < .02, r
assert 16 <= r["requeued"] and r["requeued"] * 10 < 40000, r
assert r["makespan-s"] > 40000 / 128, r'
ok $? 'seconds are as told in the mean, and nodes die'

# files
table 'a,3,1,2,1G,1e9,,' 'b,,1,5,2G,,3e9,a'
sim --nodes 1,2 --bandwidth 1e9,2e9 jobs.csv >out
[ "$(grep -c '^| [12] | [12] | ' out)" = 4 ]; ok $? 'several nodes, several file systems: a table'
table 'a,,1,,1G,,,'
exits 1 'nobody tells the seconds' sim jobs.csv
has err '^simulate.py: a: nobody tells its seconds' 'in words'
is makespan-s 3 'unless somebody does' --unknown 3
echo 'a 4' >took
is makespan-s 4 'or it was measured' --took took
is makespan-s 4 'which comes first' --took took --unknown 3
table 'a,,17,1,1G,,,'
exits 1 'a job for which there is no node' sim jobs.csv
has err '^simulate.py: a: no node has 17 cores' 'in words'
table 'a,,1,1,1G,,,b'
exits 1 'after what nobody names' sim jobs.csv
has err "^simulate.py: jobs.csv: a: after 'b'" 'in words'
echo '{"jobs": [{"name": "a"}]}' >no.json
for f in no.json none.json none.csv took; do exits 1 "$f is no plan" sim "$f"; has err "^simulate.py: $f: is neither a plan" 'in words'; done
for n in 0 -1 a 1,; do exits 2 "--nodes $n" sim --nodes $n jobs.csv; done
ct-phantom -q --size 32x40x96 ellipsoids hr.nii
ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean hr.nii thick.nii
ct-sr -q -t 1 -x 1,1,4 -Q draft --plan p --jobs 3 thick.nii out.nii
sim --took /dev/null --unknown 60 --json p/plan.json >out && python3 -c '
import json, os
r, p = json.load(open("out"))[0], json.load(open("p/plan.json"))["jobs"]
lr, hr = os.path.getsize("p/lr.nii"), 32 * 40 * 96 * 4
assert r["jobs"] == 4 and r["bytes"] == 3 * lr + 3 * hr, r
assert r["core-seconds"] == sum(60 if j["seconds"] is None else j["seconds"] for j in p), r
assert r["peak-memory-bytes"] == [sum(j["memory-bytes"] for j in p[:3])], r'
ok $? 'a plan: its seconds, its memory, its bytes'
python3 -c 'import json
p = json.load(open("p/plan.json"))
p["jobs"][3]["seconds"] = None
json.dump(p, open("p/plan.json", "w"))'
sim --rate 983040 --json p/plan.json >out && python3 -c '
import json
work = sum(j["seconds"] for j in json.load(open("p/plan.json"))["jobs"][:3])
assert json.load(open("out"))[0]["core-seconds"] == work + 1'
ok $? 'a rate of ct-merge'
printf 'p/ct-upsample-%d 10\n' 1 2 3 >took; echo p/ct-merge-1 7 >>took
[ "$(sim --took took p/plan.json | awk '$1 == "makespan-s" {print $2}')" = 17 ]; ok $? 'with the seconds that its jobs took'
done_testing
