#!/bin/sh
# examples/trade.mk and trade.py: what was measured, what is on the front, what is made again; paper.mk: its tables.
. "${srcdir:?}/tests/tap.sh"
python_with matplotlib || { skip 'what time buys' 'no matplotlib'; done_testing; }
py=$srcdir/examples/trade.py
row() { printf '%s,P1,%s,%s,0,%s,%s,%s,%s,1,%s,%s\n' "$@"; }
{
	echo 'scan,case,run,cpu-s,seconds,peak-mib,psnr,ssim-r2,structures-false,structures-missed,deep-smooth-rmse-hu,edge-rise-test-mm'
	row a quick 1 10 30 .8 5 3 2; row b quick 3 30 32 .9 7 5 2
	row a worse 4 20 30 .85 6 4 2; row b worse 4 20 32 .85 6 4 2
	row a slow 9 20 33 .95 4 2 ''; row b slow 9 20 35 .95 4 2 ''
	row a same 2 20 30 .8 5 3 2; row b same 4 20 32 .9 7 5 2
} >t.csv
"$PY" "$py" t.csv t.svg >t.txt; ok $? 'a table and a plot'
[ "$(sed -n 1p t.txt)" = 'means of 2 scans' ]; ok $? 'of so many scans'
grep -qE '^P1 +quick +2\.00 +30 +31\.000 +0\.8500 +6\.0 +1\.0 +4\.00 +2\.00 +\*$' t.txt; ok $? 'means, the most of memory'
grep -qE '^P1 +worse .* 2\.00$' t.txt; ok $? 'slower and no better: not on the front'
grep -qE '^P1 +slow .* - +\*$|^P1 +slow .* 2\.00 +- +\*$|^P1 +slow .*\*$' t.txt; ok $? 'slower and better: on it'
grep -qE '^P1 +same .* 2\.00$' t.txt; ok $? 'nor what is as good, and slower'
grep -q '<svg' t.svg; ok $? 'drawn'
"$PY" "$py" t.csv t2.svg >/dev/null; cmp -s t.svg t2.svg; ok $? 'the same bytes twice'
sed 1q t.csv >none.csv; ! "$PY" "$py" none.csv x.svg 2>err && grep -q 'none.csv: no results' err; ok $? 'nothing measured'

ct-phantom -q --size 40x40x40 --spacing 1.5 --window=-512:3071 ellipsoids v.nii || exit 99
trade() { make -s -f "$srcdir/examples/trade.mk" PYTHON="$PY" VOLUMES=v.nii CUBE=32 CASES='P3n thick' RUNS="$1" OUT=o; }
exits 0 'a scan' trade 'cubic htv:iterations=5:tolerance=0'
[ "$(grep -c . o/trade.csv)" = 5 ] && [ "$(cut -d, -f1-3 o/trade.csv | tail -n +2 | tr '\n' ' ')" = 'v,P3n,cubic v,P3n,htv:iterations=5:tolerance=0 v,thick,cubic v,thick,htv:iterations=5:tolerance=0 ' ]
ok $? 'a line a result'
ct-metrics --ssim none -w -1024:3071 o/v/hr.nii o/v/P3n/cubic.nii | awk '$1 == "psnr" {print $2}' >want
awk -F, 'NR == 1 {for (i = 1; i <= NF; i++) if ($i == "psnr") at = i} $2 == "P3n" && $3 == "cubic" {print $at}' o/trade.csv | cmp -s - want
ok $? 'with what ct-metrics says'
ct-info o/v/P3n/lr.nii | grep -qE '^ *noise +15$' && ct-info o/v/thick/lr.nii | grep -qE '^ *factor +1,1,4$'; ok $? 'cases'
ct-info o/v/P3n/htv_iterations-5_tolerance-0.nii | grep -q 'iterations'; ok $? 'options'
touch -r o/v/P3n/cubic.nii stamp
exits 0 'one more run' trade 'cubic htv:iterations=5:tolerance=0 dc'
[ "$(grep -c . o/trade.csv)" = 7 ] && [ ! o/v/P3n/cubic.nii -nt stamp ]; ok $? 'makes that alone'
exits 2 'what is no method' trade 'none'
mkdir bin && printf '#!/bin/sh\necho "$CT_THREADS $*" >>"%s/said"\nexec "%s" "$@"\n' "$PWD" "$(command -v ct-ddnm)" >bin/ct-ddnm && chmod +x bin/ct-ddnm
grid() { PATH=$PWD/bin:$PATH make -s -f "$srcdir/examples/trade.mk" PYTHON="$PY" VOLUMES=v.nii CUBE=32 CASES=P3 RUNS=cubic PROJECTIONS='3:2:50:4 2:1:60:3' THREADS="$1" OUT=g; }
exits 0 'by views, steps, Gaussians, iterations' grid ''
[ "$(cut -d, -f3 g/trade.csv | tail -n +2 | tr '\n' ' ')" = 'cubic paper:views=3:steps=2:gaussians=50:iterations=4 paper:views=2:steps=1:gaussians=60:iterations=3 ' ]
ok $? 'a line each'
[ "$(sed 's/.*\(--steps=[0-9]*\).*/\1/' said | tr '\n' ' ')" = '--steps=2 --steps=1 ' ]; ok $? 'with these steps'
ct-info g/v/P3/paper_views-2_steps-1_gaussians-60_iterations-3.nii >info; grep -q ct-compose info && [ ! -e g/v/P3/paper_views-2_steps-1_gaussians-60_iterations-3.nii.work ]
ok $? 'to the end'
rm said; exits 0 'and threads' grid '1 2'
[ "$(grep -c . g/trade.csv)" = 7 ] && [ "$(cut -d' ' -f1 said | tr '\n' ' ')" = '1 2 1 2 ' ]; ok $? 'each with each'

paper() {
	make -s -f "$srcdir/examples/paper.mk" VOLUMES=v.nii CUBE=16 FACTORS=4 VIEWS=4 STEPS=2 ITERATIONS=4 GAUSSIANS=50 BUDGET=2 \
		NETWORK=1x8 BIRD=2 OUT=p
}
exits 0 'the published tables' paper
paper >tables
figures='[0-9.]+ +-?[01]\.[0-9]+ +[0-9.]+ +[1-9][0-9]*'
[ "$(grep -c '^table [123], 4x' tables)" = 3 ] && grep -qE "^paper +$figures +25\.42 +\.8957$" tables; ok $? 'beside the published figures'
grep -qE "^ctsr +$figures +- +-$" tables; ok $? 'ours has none'
for m in nerf cunerf arssr rdn omni bird naf sax-nerf; do grep -qE "^$m +$figures +[0-9.]+ +\.[0-9]+$" tables; ok $? "$m has its own"; done
ct-metrics -w -512:3071 --ssim wang p/v/hr.nii p/v/4x/fdk.nii | awk '$1 == "psnr" {p = $2} /^ssim/ {printf "fdk %.2f %.4f\n", p, $2}' >want
awk '$1 == "fdk" {printf "fdk %.2f %.4f\n", $2, $3}' tables | cmp -s - want; ok $? 'a row is what it says'
done_testing
