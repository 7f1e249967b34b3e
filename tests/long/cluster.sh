#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# cluster.sh [COUNT]: COUNT (4) thick scans on a Slurm of two nodes, both on this machine, by
# examples/cluster/Snakefile, while a node and a job are killed; the results against those of one machine,
# byte for byte. It starts its own munged, slurmctld and slurmd, and needs root.
. "$(dirname "$0")/lib.sh"
count=${1:-4}
row 'without another machine'
PATH=$PATH:/usr/sbin:/sbin
for c in munged slurmctld slurmd sbatch; do
	command -v $c >/dev/null || { echo "# cluster: skipped: no $c (scripts/install-deps.sh cluster)"; finish; }
done
[ "$(id -u)" -eq 0 ] || { echo '# cluster: skipped: slurmd needs root'; finish; }
port=$((27000 + $$ % 2000 * 5))
export SLURM_CONF="$work/slurm.conf"
mkdir state spool-n1 spool-n2
chmod 755 "$work"
dd if=/dev/urandom of=key bs=128 count=1 2>/dev/null && chmod 400 key
cat >slurm.conf <<EOF
ClusterName=test
SlurmctldHost=$(hostname)(127.0.0.1)
SlurmctldPort=$port
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool-%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/%n.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
MpiDefault=none
SwitchType=switch/none
ReturnToService=2
SlurmdTimeout=10
KillWait=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName=n1 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=2 RealMemory=8000
NodeName=n2 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=2 RealMemory=8000
PartitionName=all Nodes=n[1-2] Default=YES MaxTime=INFINITE State=UP
EOF
: >cgroup.conf
munged --foreground --force --key-file="$work/key" --socket="$work/munge.socket" --pid-file="$work/munged.pid" \
	--log-file="$work/munged.log" --seed-file="$work/seed" >munged.out 2>&1 & munged=$!
slurmctld=
begin_node() { slurmd -D -N "$1" >"$1.out" 2>&1 & eval "$1=$!"; }
end() {
	# shellcheck disable=SC2154
	kill $n1 $n2 $slurmctld $munged 2>/dev/null
	wait 2>/dev/null
	rm -rf "$work"
}
trap end EXIT
sleep 1
slurmctld -D -i >slurmctld.out 2>&1 & slurmctld=$!
begin_node n1
begin_node n2
n=0
while [ "$(sinfo -hNo %t 2>err | grep -c idle)" -lt 2 ] && [ $n -lt 60 ]; do sleep 0.5; n=$((n + 1)); done
[ "$(sinfo -hNo %t 2>err | grep -c idle)" -eq 2 ] || {
	tally 1 'Slurm does not start'
	tail -n 3 slurmctld.log n1.log munged.log 2>/dev/null | sed 's/^/#   /'
	finish
}

mkdir scans one
i=1
while [ $i -le "$count" ]; do
	ct-phantom -q -s $i --size 192x192x384 ellipsoids hr.nii -f
	ct-degrade -q -x 1,1,4 --sigma 0 --decimate mean hr.nii scans/scan$i.nii
	ct-sr -q -t 1 --memory 4096M -x 1,1,4 -Q draft scans/scan$i.nii one/scan$i.nii.gz; tally $? 'one machine'
	i=$((i + 1))
done
same() { cmp -s "one/$1.nii.gz" "$2/$1.nii.gz"; }
command -v snakemake >/dev/null || { echo '# cluster: no snakemake'; finish; }
row 'a folder, a node and a job killed'
snake() {
	timeout 500 snakemake -s "$srcdir/examples/cluster/Snakefile" --profile "$srcdir/examples/cluster/slurm" --latency-wait 5 \
		--config scans=scans out=many options='-x 1,1,4 -Q draft' >>snake.log 2>&1
}
# The commands of jobs on node $1: what a process is for stands in its environment.
on_node() {
	for p in $(pgrep -f "^[^ ]*/ct-sr .*$work/many"); do
		tr '\0' '\n' <"/proc/$p/environ" 2>/dev/null | grep -q "^SLURMD_NODENAME=$1\$" && echo "$p"
	done
}
snake & snake=$!
n=0
until [ -n "$(on_node n2)" ] || [ $n -ge 600 ]; do sleep 0.05; n=$((n + 1)); done
one=$(on_node n1 | head -n 1) two=$(on_node n2)
# shellcheck disable=SC2086
kill -9 $n2 $one $two
[ -n "$two" ]; tally $? 'a node is killed while it works'
while [ -z "$one" ] && [ $n -lt 600 ]; do sleep 0.05; n=$((n + 1)); one=$(on_node n1 | head -n 1); [ -z "$one" ] || kill -9 "$one"; done
[ -n "$one" ]; tally $? 'a job is killed on the other'
echo "# cluster: killed node n2 with $(echo $two | wc -w) jobs, and $(echo $one | wc -w) job of n1"
sleep 15
begin_node n2
wait $snake; tally $? 'Snakemake ends'
for s in scans/*.nii; do s=$(basename "$s" .nii); same "$s" many; tally $? "$s is the same"; done
[ $bad_ -eq 0 ] || tail -n 30 snake.log | sed 's/^/#   /'
finish
