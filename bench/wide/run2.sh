#!/bin/sh
# on the device: run2.sh SECONDS
cd A; cp -r none . 2>/dev/null
python3 dev_unpack.py $1 work/v; while [ ! -e A/done ]; do sleep .3; done
mkdir -p work/ex4 work/ext work/ex2; ls -S work/v/*.nii > work/vols; date +%T; wc -l < work/vols
( for c in 0 1 2 3 4 5 6 7 8 9; do
  while read v; do echo "$v $((c*8)) 8 work/ex4 96 0 4"; done < work/vols
  [ $c -lt 6 ] && while read v; do echo "$v $((c*8)) 8 work/ext 96 1 4"; echo "$v $((c*8)) 8 work/ex2 96 0 2"; done < work/vols
done ) > work/jobs
(nice -n 5 xargs -P 13 -L 1 A/gen4 < work/jobs > work/gen.log 2>&1; date +%T > work/gen.done; wc -c work/ex*/*.bin | tail -1 >> work/gen.done) &
OMP_NUM_THREADS=2 PYTHONUNBUFFERED=1 WIDTH=96 BLOCKS=8 SECONDS_=$2 PLAN=work/ex4:2:0:4,work/ext:1:1:4,work/ex2:1:0:2 python3 train.py
cat work/gen.done; head -c 600 work/gen.log
