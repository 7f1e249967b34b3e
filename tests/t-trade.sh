#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# examples/trade.mk and trade.py: what was measured, what is on the front, what is made again; paper.mk: its tables.
. "${srcdir:?}/tests/tap.sh"
python_with matplotlib || { skip 'trade.py writes a table and a plot' 'no matplotlib'; done_testing; }
py=$srcdir/examples/trade.py
row() { printf '%s,P1,%s,%s,0,%s,%s,%s,%s,1,%s,%s\n' "$@"; }
{
	echo 'scan,case,run,cpu-s,seconds,peak-mib,psnr,ssim-r2,structures-false,structures-missed,deep-smooth-rmse-hu,edge-rise-test-mm'
	row a quick 1 10 30 .8 5 3 2; row b quick 3 30 32 .9 7 5 2
	row a worse 4 20 30 .85 6 4 2; row b worse 4 20 32 .85 6 4 2
	row a slow 9 20 33 .95 4 2 ''; row b slow 9 20 35 .95 4 2 ''
	row a same 2 20 30 .8 5 3 2; row b same 4 20 32 .9 7 5 2
} >t.csv
"$PY" "$py" t.csv t.svg >t.txt; ok $? 'trade.py writes a table and a plot'
[ "$(sed -n 1p t.txt)" = 'means of 2 scans' ]; ok $? 'the table of trade.py gives the number of scans'
grep -qE '^P1 +quick +2\.00 +30 +31\.000 +0\.8500 +6\.0 +1\.0 +4\.00 +2\.00 +\*$' t.txt
ok $? 'a row of trade.py has means over scans and the largest memory'
grep -qE '^P1 +worse .* 2\.00$' t.txt; ok $? 'a slower run that is no better is not on the front'
grep -qE '^P1 +slow .* - +\*$|^P1 +slow .* 2\.00 +- +\*$|^P1 +slow .*\*$' t.txt
ok $? 'a slower run that is better is on the front'
grep -qE '^P1 +same .* 2\.00$' t.txt; ok $? 'a slower run that is as good is not on the front'
grep -q '<svg' t.svg; ok $? 'the plot of trade.py is SVG'
"$PY" "$py" t.csv t2.svg >/dev/null; cmp -s t.svg t2.svg; ok $? 'trade.py draws the same bytes twice'
sed 1q t.csv >none.csv
! "$PY" "$py" none.csv x.svg 2>err && grep -q 'none.csv: no results' err
ok $? 'a CSV without results is refused with its name'

# trade.mk
ct-phantom -q --size 40x40x40 --spacing 1.5 --window=-512:3071 ellipsoids v.nii || exit 99
trade() { make -s -f "$srcdir/examples/trade.mk" PYTHON="$PY" VOLUMES=v.nii CUBE=32 CASES='P3n thick' RUNS="$1" OUT=o; }
exits 0 'trade.mk measures a scan with two cases and methods' trade 'cubic htv:iterations=5:tolerance=0'
[ "$(grep -c . o/trade.csv)" = 5 ] && [ "$(cut -d, -f1-3 o/trade.csv | tail -n +2 | tr '\n' ' ')" = 'v,P3n,cubic v,P3n,htv:iterations=5:tolerance=0 v,thick,cubic v,thick,htv:iterations=5:tolerance=0 ' ]
ok $? 'trade.csv has a line for each case and method'
ct-metrics --ssim none -w -1024:3071 o/v/hr.nii o/v/P3n/cubic.nii | awk '$1 == "psnr" {print $2}' >want
awk -F, 'NR == 1 {for (i = 1; i <= NF; i++) if ($i == "psnr") at = i} $2 == "P3n" && $3 == "cubic" {print $at}' o/trade.csv | cmp -s - want
ok $? 'trade.csv has the PSNR of ct-metrics'
ct-info o/v/P3n/lr.nii | grep -qE '^ *noise +15$' && ct-info o/v/thick/lr.nii | grep -qE '^ *factor +1,1,4$'
ok $? 'the cases of trade.mk are P3n with noise and thick slices'
ct-info o/v/P3n/htv_iterations-5_tolerance-0.nii | grep -q 'iterations'
ok $? 'trade.mk passes the options of a run to the method'
touch -r o/v/P3n/cubic.nii stamp
exits 0 'trade.mk runs again with one more method' trade 'cubic htv:iterations=5:tolerance=0 dc'
[ "$(grep -c . o/trade.csv)" = 7 ] && [ ! o/v/P3n/cubic.nii -nt stamp ]
ok $? 'a second run of trade.mk makes the new method alone'
exits 2 'an unknown method is refused by trade.mk' trade 'none'
mkdir bin && printf '#!/bin/sh\necho "$CT_THREADS $*" >>"%s/said"\nexec "%s" "$@"\n' "$PWD" "$(command -v ct-ddnm)" >bin/ct-ddnm && chmod +x bin/ct-ddnm
grid() { PATH=$PWD/bin:$PATH make -s -f "$srcdir/examples/trade.mk" PYTHON="$PY" VOLUMES=v.nii CUBE=32 CASES=P3 RUNS=cubic PROJECTIONS='3:2:50:4 2:1:60:3' THREADS="$1" OUT=g; }
exits 0 'trade.mk accepts settings of views, steps, Gaussians and iterations' grid ''
[ "$(cut -d, -f3 g/trade.csv | tail -n +2 | tr '\n' ' ')" = 'cubic paper:views=3:steps=2:gaussians=50:iterations=4 paper:views=2:steps=1:gaussians=60:iterations=3 ' ]
ok $? 'trade.csv has a line for each setting'
[ "$(sed 's/.*\(--steps=[0-9]*\).*/\1/' said | tr '\n' ' ')" = '--steps=2 --steps=1 ' ]
ok $? 'trade.mk passes the steps of each setting to ct-ddnm'
ct-info g/v/P3/paper_views-2_steps-1_gaussians-60_iterations-3.nii >info; grep -q ct-compose info && [ ! -e g/v/P3/paper_views-2_steps-1_gaussians-60_iterations-3.nii.work ]
ok $? 'each setting runs to its last step and leaves no working folder'
rm said; exits 0 'trade.mk accepts several numbers of threads' grid '1 2'
[ "$(grep -c . g/trade.csv)" = 7 ] && [ "$(cut -d' ' -f1 said | tr '\n' ' ')" = '1 2 1 2 ' ]
ok $? 'each setting is measured with each number of threads'

# paper.mk
paper() {
	make -s -f "$srcdir/examples/paper.mk" VOLUMES=v.nii CUBE=16 FACTORS=4 VIEWS=4 STEPS=2 ITERATIONS=4 GAUSSIANS=50 BUDGET=2 \
		NETWORK=1x8 BIRD=2 OUT=p
}
exits 0 'paper.mk makes the results of the published tables' paper
paper >tables
figures='[0-9.]+ +-?[01]\.[0-9]+ +[0-9.]+ +[1-9][0-9]*'
[ "$(grep -c '^table [123], 4x' tables)" = 3 ] && grep -qE "^paper +$figures +25\.42 +\.8957$" tables
ok $? 'paper.mk prints three tables beside the published figures'
grep -qE "^ctsr +$figures +- +-$" tables; ok $? 'the row of ctsr has no published figures'
for m in nerf cunerf arssr rdn omni bird naf sax-nerf; do
	grep -qE "^$m +$figures +[0-9.]+ +\.[0-9]+$" tables
	ok $? "the row of $m has published figures"
done
ct-metrics -w -512:3071 --ssim wang p/v/hr.nii p/v/4x/fdk.nii | awk '$1 == "psnr" {p = $2} /^ssim/ {printf "fdk %.2f %.4f\n", p, $2}' >want
awk '$1 == "fdk" {printf "fdk %.2f %.4f\n", $2, $3}' tables | cmp -s - want
ok $? 'the row of fdk has the figures of ct-metrics'
done_testing
