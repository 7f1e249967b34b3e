#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# libctsr in a program whose numbers have a comma: it reads and writes numbers with a point, the program keeps its comma.
unset CTSR_CPU
. "$srcdir/tests/tap.sh"
! sanitized ct-sr || { echo '1..0 # SKIP sanitizers are not of this program'; exit 0; }
command -v localedef >/dev/null || { echo '1..0 # SKIP no localedef'; exit 0; }
mkdir locale
localedef -i de_DE -f UTF-8 ./locale/de_DE.UTF-8 >made 2>&1
[ -e locale/de_DE.UTF-8/LC_NUMERIC ] || { # without the definitions: the numbers alone
	cat >german <<-'END'
	comment_char %
	escape_char /
	LC_NUMERIC
	decimal_point ","
	thousands_sep "."
	grouping 3;3
	END LC_NUMERIC
	END
	localedef -c -i ./german -f UTF-8 ./locale/de_DE.UTF-8 >made 2>&1
}
[ -e locale/de_DE.UTF-8/LC_NUMERIC ] || { echo '1..0 # SKIP localedef makes no German locale'; exit 0; }
LOCPATH=$PWD/locale; export LOCPATH
lib=$(ls "$builddir"/libctsr.so.0 "$builddir"/.libs/libctsr.so.0 2>/dev/null | head -n 1)
[ -n "$lib" ] || { echo '1..0 # SKIP no shared library'; exit 0; }
value() { sed -n "s/^$1 = //p" "$builddir/Makefile"; }
cat >in.c <<'END'
/* in LOCALE FOLDER: all that has numbers in text, written and read again. */
#include <ctsr.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static ctsr_error e;
static char point;

static void must(int rc)
{
	if (rc)
		printf("failed: %s\n", e.message);
}

static int comma(void)
{
	char s[20];

	snprintf(s, sizeof s, "%.1f", 0.5);
	return s[1] == point;
}

static int look(void *user, const char *what, size_t done, size_t total)
{
	(void)what, (void)done, (void)total;
	*(int *)user += comma() ? 1 : 1000000;
	return 0;
}

int main(int argc, char **argv)
{
	const double affine[3][4] = {{0.75, 0, 0, 12.5}, {0, 1.25, 0, -33.25}, {0, 0, 2.5, 0.1}};
	const size_t n[3] = {16, 16, 16};
	static const char *const ends[] = {"nii", "mha", "nrrd", "mhd", "nhdr"};
	ctsr_volume *v = NULL, *lo = NULL, *back = NULL, *hi = NULL;
	ctsr_projections *p = NULL, *q = NULL;
	ctsr_operator o = {sizeof o}, read = {sizeof read};
	ctsr_geometry g;
	ctsr_view a, b;
	int calls = 0;
	ctsr_context c = {sizeof c};
	char path[300];
	size_t size[3];
	double at[3][4];

	if (argc != 3 || !setlocale(LC_ALL, argv[1]))
		return 77;
	snprintf(path, sizeof path, "%.1f", 0.5);
	point = path[1];
	printf("point %c\n", point);
	c.progress = look;
	c.user = &calls;
	c.threads = 3;
	must(ctsr_volume_new(&v, n, affine, NULL, &e));
	for (int i = 0; i < 4096; i++)
		ctsr_volume_data(v, size, at)[i] = (float)(i % 37) * 1.5F;
	o.factor[0] = o.factor[1] = 1;
	o.factor[2] = 2.5;
	o.sigma[2] = 1.125;
	o.noise = 3.5;
	o.decimate = CTSR_MEAN;
	must(ctsr_degrade(&lo, v, &o, &c, &e));
	for (int i = 0; i < 5; i++) {
		const ctsr_format *f = i == 0 ? ctsr_nifti() : i % 2 ? ctsr_metaimage() : ctsr_nrrd();

		snprintf(path, sizeof path, "%s/v%d.%s", argv[2], i, ends[i]);
		must(ctsr_volume_write(lo, path, f, &c, &e));
		must(ctsr_volume_read(&back, path, ctsr_formats_all(), &e));
		ctsr_volume_data(back, size, at);
		must(ctsr_operator_get(&read, back, &e));
		printf("%s %d\n", ends[i],
			fabs(at[0][0] - 0.75) < 1e-6 && fabs(at[1][3] + 33.25) < 1e-6 && read.factor[2] == 2.5 &&
				read.sigma[2] == 1.125 && read.noise == 3.5);
		ctsr_volume_free(back);
	}
	must(ctsr_geometry_init(&g, sizeof g, v, &e));
	g.views = 3;
	g.start = 0.5;
	g.columns = g.rows = 8;
	must(ctsr_project(&p, v, &g, &c, &e));
	snprintf(path, sizeof path, "%s/p.exr", argv[2]);
	must(ctsr_projections_write(p, path, &c, &e));
	must(ctsr_projections_read(&q, path, &e));
	must(ctsr_projections_view(&a, p, 1, &e));
	must(ctsr_projections_view(&b, q, 1, &e));
	printf("exr %d\n", memcmp(&a, &b, sizeof a) == 0);
	printf("refused %d\n", ctsr_volume_from_int16(&hi, n, affine, (const int16_t[4096]){0}, NAN, 0.5, &e) &&
			strstr(e.message, "intercept 0.5 ") != NULL);
	printf("calls %d\n", calls > 0 && calls < 1000000);
	printf("after %d\n", comma());
	ctsr_volume_free(v);
	ctsr_volume_free(lo);
	ctsr_projections_free(p);
	ctsr_projections_free(q);
	return 0;
}
END
# shellcheck disable=SC2046
$(value CC) -std=c17 -I"$srcdir/src/ctsr" in.c -o in "$lib" -lm 2>err; ok $? 'a program that sets its locale'
sed 's/^/# /' err
LD_LIBRARY_PATH=$(dirname "$lib"):$LD_LIBRARY_PATH; export LD_LIBRARY_PATH
unset LC_ALL
mkdir c de
exits 0 'in the plain locale' ./in C c; cp out plain
exits 0 'in the German one' ./in de_DE.UTF-8 de
has out 'point ,' 'which has a comma'
for what in nii mha nrrd mhd nhdr exr; do has out "^$what 1" "$what: numbers are read as they were written"; done
has out 'refused 1' 'a message has a point'
has out 'calls 1' 'callbacks run in the locale of the program'
has out 'after 1' 'which it has again afterwards'
! grep -q failed out; ok $? 'no call of the library fails in a locale'
sed -n 's/^failed/# &/p' out
for f in v0.nii v1.mha v2.nrrd v3.mhd v4.nhdr p.exr; do
	cmp -s c/$f de/$f; ok $? "$f: the same bytes in either locale"
done
if python_with numpy; then
	cat >in.py <<-'END'
	import locale, os, sys
	import numpy as np
	locale.setlocale(locale.LC_ALL, sys.argv[1])
	import ctsr
	v = ctsr.Image(np.arange(4096, dtype=np.float32).reshape(16, 16, 16) % 41, np.diag([.75, 1.25, 2.5, 1]))
	lo = ctsr.degrade(v, (1, 1, 2.5), sigma=(0, 0, 1.125), decimate='mean', noise=3.5, threads=2)
	for i, end in enumerate(('nii', 'nii.gz', 'mha', 'mhd', 'nrrd', 'nhdr')):
	    path = os.path.join(sys.argv[2], 'py%d.%s' % (i, end))
	    ctsr.write(lo, path)
	    x = ctsr.read(path)
	    assert x.meta['factor'] == '1,1,2.5' and x.meta['sigma'] == '0,0,1.125', x.meta
	    assert np.allclose(x.affine, lo.affine) and np.array_equal(x.data, lo.data), end
	p = ctsr.project(v, views=3, columns=8, rows=8, start=.5)
	ctsr.write_projections(p, os.path.join(sys.argv[2], 'py.exr'))
	q = ctsr.read_projections(os.path.join(sys.argv[2], 'py.exr'))
	assert all(np.array_equal(a[k], b[k]) for a, b in zip(p.views, q.views) for k in a)
	assert locale.localeconv()['decimal_point'] == sys.argv[3]
	END
	CTSR_LIBRARY=$lib PYTHONDONTWRITEBYTECODE=1; export CTSR_LIBRARY PYTHONDONTWRITEBYTECODE
	exits 0 'Python runs in the C locale' env PYTHONPATH="$srcdir/python" "$PY" in.py C c .
	exits 0 'Python runs in a German locale' env PYTHONPATH="$srcdir/python" "$PY" in.py de_DE.UTF-8 de ,
	for f in py2.mha py4.nrrd py.exr; do cmp -s c/$f de/$f; ok $? "$f: the same bytes"; done
else
	skip 'Python' 'no numpy'
fi
ct-phantom -q --size 8x8x8 --spacing 0.5 cube g.nii
exits 0 'a command in German' env LC_ALL=de_DE.UTF-8 ct-convert g.nii g.nrrd
has g.nrrd '(0.5,0,0)\|(-0.5,0,0)' 'numbers of NRRD have points in a locale'
# the makefiles, whose awk may know of locales
ct-phantom -q --size 24x24x24 shepp-logan head.nii
tables() { (unset MAKEFLAGS MFLAGS MAKELEVEL; make -s -f "$srcdir/examples/accuracy.mk" VOLUMES=head.nii CUBE=16 FACTORS=2 PROTOCOLS=P1 METHODS='cubic dc' OUT="$1" 2>err) | sed 's, *[0-9.]* *[0-9]*$,,'; } # but seconds and MiB
if command -v mawk >/dev/null; then
	mkdir bin; ln -s "$(command -v mawk)" bin/awk
	tables in-c >want; PATH=$PWD/bin:$PATH LC_ALL=de_DE.UTF-8 tables in-german >got
	[ -s want ] && cmp -s want got; ok $? 'accuracy.mk makes the same table in a German locale'; sed 's/^/# /' want got err
else skip 'accuracy.mk in a German locale' 'no mawk'; fi
done_testing
