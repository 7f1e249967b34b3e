/* The parts of the NIfTI codec at their limits: extensions, text, affines, headers, gzip members.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/io.h"
#include "formats/nifti.h"
#include "nifti-make.h"
#include "tap.h"

#include <unistd.h>

static const struct ct_env force = {
	.tool = "ct-test", .files = &(const struct ct_io_rule){.force = true}};
static const int small[3] = {3, 4, 5};

static int parse(const void *p, size_t n, struct ct_vol *v)
{
	struct ct_any a = {0};
	int rc;

	err = (struct ct_err){0};
	rc = ct_format_read_bytes(&ct_format_nifti, p, n, "x.nii", &a, &err);
	*v = a.vol;
	return rc;
}

static int refused(const struct made *m, enum ct_code code, const char *words)
{
	struct ct_vol v = {0};
	int ok = parse(m->p, m->n, &v) == -1 && err.code == code && strstr(err.msg, words) &&
		 !v.data && !v.meta.pair;

	ct_vol_free(&v);
	return ok;
}

/* Does the key hold the value? NULL: it is not there. */
static int kept(const struct made *m, const char *key, const char *value)
{
	struct ct_vol v = {0};
	const char *got;
	int ok;

	if (parse(m->p, m->n, &v))
		return 0;
	got = ct_meta_get(&v.meta, key);
	ok = got && value ? strcmp(got, value) == 0 : !got && !value;
	ct_vol_free(&v);
	return ok;
}

static void make_volume(struct ct_vol *v, size_t nx, size_t ny, size_t nz)
{
	const size_t n[3] = {nx, ny, nz};

	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, n, &err));
	memset(v->data, 0, ct_vol_count(v) * sizeof *v->data);
	for (int i = 0; i < 3; i++)
		v->affine[i][i] = 1;
}

/* One extension of this text and code. */
static void with_ext(struct made *m, int code, const char *text, size_t bytes)
{
	char *copy = calloc(bytes + 1, 1);

	if (!copy)
		exit(99);
	memcpy(copy, text, bytes < strlen(text) ? bytes : strlen(text));
	make(m, 1, false, 2, 1, small, 8 + bytes);
	put_ext(m, 352, (int)bytes + 8, code, copy);
	free(copy);
}

static void test_base64(void)
{
	static const struct {
		const char *text, *want;
	} c[] = {{"", "4 "}, {"f", "4 Zg=="}, {"fo", "4 Zm8="}, {"foo", "4 Zm9v"},
		{"foob", "4 Zm9vYg=="}, {"fooba", "4 Zm9vYmE="}, {"foobar", "4 Zm9vYmFy"},
		{"\xff\xef\xbf\xfb", "4 /++/+w=="}};
	struct made m;

	for (size_t i = 0; i < sizeof c / sizeof *c; i++) { /* of RFC 4648 */
		with_ext(&m, 4, c[i].text, strlen(c[i].text));
		OK(kept(&m, "nifti.ext.0", c[i].want), "base64 of %zu bytes", strlen(c[i].text));
		free(m.p);
	}
	with_ext(&m, -2147483647, "foo", 3);
	OK(kept(&m, "nifti.ext.0", "-2147483647 Zm9v"), "a long code");
	free(m.p);
}

/* Which text is ours. */
static void test_ours(void)
{
	static const struct {
		int code;
		const char *text;
		bool ours;
	} c[] = {{6, "{\"ct:window\":\"a\"}", true}, {4, "{\"ct:window\":\"a\"}", false},
		{6, "{\"ct:window\":1}", false}, {6, "{\"ct:window\":\"a\",\"b\":\"c\"}", false},
		{6, "{\"b\":\"c\",\"ct:window\":\"a\"}", false},
		{6, "{\"ct:window\":\"a\",\"ct:\":\"c\"}", false}, {6, "{}", false}, {6, "", false},
		{6, "[\"ct:window\"]", false}, {6, " {\"ct:window\":\"a\"}", false},
		{6, "{\"ct:window\":\"a\"", false}};
	struct made m;

	for (size_t i = 0; i < sizeof c / sizeof *c; i++)
		for (size_t pad = 0; pad < 3; pad++) {
			struct ct_vol v = {0};

			with_ext(&m, c[i].code, c[i].text, strlen(c[i].text) + pad);
			OK(kept(&m, "window", c[i].ours ? "a" : NULL), "%s of code %d is %sours",
				c[i].text, c[i].code, c[i].ours ? "" : "not ");
			OK(parse(m.p, m.n, &v) == 0 &&
					!ct_meta_get(&v.meta, "nifti.ext.0") == c[i].ours,
				"and kept as it is else");
			ct_vol_free(&v);
			free(m.p);
		}
}

/* So many pairs in two extensions. */
static int pairs(int first, int second)
{
	const int count[2] = {first, second};
	char *text[2] = {NULL, NULL};
	struct made m;
	struct ct_vol v = {0};
	size_t n[2], bad;

	for (int k = 0; k < 2; k++) {
		FILE *f = open_memstream(&text[k], &n[k]);

		for (int i = 0; i < count[k]; i++)
			fprintf(f, "%c\"ct:%d.%d\":\"\"", i ? ',' : '{', k, i);
		fprintf(f, "}");
		fclose(f);
	}
	make(&m, 1, false, 2, 1, small, 16 + n[0] + n[1]);
	put_ext(&m, 352, (int)n[0] + 8, 6, text[0]);
	put_ext(&m, 360 + n[0], (int)n[1] + 8, 6, text[1]);
	bad = parse(m.p, m.n, &v) != 0 ? 0 : v.meta.n;
	ct_vol_free(&v);
	free(m.p);
	free(text[0]);
	free(text[1]);
	return (int)bad;
}

static void test_sizes(void)
{
	struct made m;

	OK(pairs(4000, 96) == 4098, "4096 pairs, the hash, and that there is no code");
	OK(pairs(4000, 97) == 0 && strstr(err.msg, "more than 4096 pairs up to extension 1"),
		"not one more");
	make(&m, 1, false, 2, 1, small, 64);
	put_ext(&m, 352, 0, 6, "{\"ct:window\":\"a\"}");
	OK(kept(&m, "window", NULL) && kept(&m, "nifti.ext.0", NULL), "a size of 0 ends them");
	put_ext(&m, 352, 7, 4, "");
	OK(refused(&m, CT_EINPUT, "extension 0: esize 7 is wrong"), "7 bytes are too few");
	put_ext(&m, 352, 65, 4, "");
	OK(refused(&m, CT_EINPUT, "extension 0: esize 65 is wrong"), "one too many");
	put_ext(&m, 352, 64, 4, "f");
	OK(kept(&m, "nifti.ext.1", NULL), "all there are");
	put_ext(&m, 352, 60, 4, "f");
	OK(kept(&m, "nifti.ext.1", NULL), "with less than a head behind");
	put_ext(&m, 352, 56, 4, "f");
	put_ext(&m, 408, 8, 5, "");
	OK(kept(&m, "nifti.ext.1", "5 "), "and with no more than a head");
	m.p[348] = 0;
	OK(kept(&m, "nifti.ext.0", NULL), "none if the header says so");
	free(m.p);
	for (int big = 0; big < 2; big++) { /* either end of a size may be 0 */
		make(&m, 1, big, 2, 1, small, 256 + 8);
		put_ext(&m, 352, 256, 4, "");
		put_ext(&m, 352 + 256, 8, 5, "");
		OK(kept(&m, "nifti.ext.1", "5 "), "a second one");
		free(m.p);
	}
	for (int count = 1024; count <= 1025; count++) {
		make(&m, 1, false, 2, 1, small, (size_t)count * 8);
		for (int k = 0; k < count; k++)
			put_ext(&m, 352 + 8 * (size_t)k, 8, 4, "");
		OK(count == 1024 ? kept(&m, "nifti.ext.1023", "4 ")
				 : refused(&m, CT_EINPUT, "extension 1024"),
			"%d extensions", count);
		free(m.p);
	}
}

/* Text in, text of the file out. */
static void test_utf8(void)
{
#define BAD "\xef\xbf\xbd"
	static const struct {
		const char *in, *out;
	} c[] = {{"\x7f", "\x7f"}, {"\x80", BAD}, {"\xc2\x80", "\xc2\x80"}, {"\xc1\xbf", BAD BAD},
		{"\xdf\xbf", "\xdf\xbf"}, {"\xc3", BAD}, {"\xc3z", BAD "z"}, {"\xc3\xc0", BAD BAD},
		{"\xe0\xa0\x80", "\xe0\xa0\x80"}, {"\xe0\x9f\xbf", BAD BAD BAD},
		{"\xed\x9f\xbf", "\xed\x9f\xbf"}, {"\xed\xa0\x80", BAD BAD BAD},
		{"\xed\xbf\xbf", BAD BAD BAD}, {"\xee\x80\x80", "\xee\x80\x80"},
		{"\xef\xbf\xbf", "\xef\xbf\xbf"}, {"\xe1\x80", BAD BAD}, {"\xe1\x80z", BAD BAD "z"},
		{"\xf0\x90\x80\x80", "\xf0\x90\x80\x80"}, {"\xf0\x8f\xbf\xbf", BAD BAD BAD BAD},
		{"\xf4\x8f\xbf\xbf", "\xf4\x8f\xbf\xbf"}, {"\xf4\x90\x80\x80", BAD BAD BAD BAD},
		{"\xf8\x88\x80\x80\x80", BAD BAD BAD BAD BAD}, {"\xff\xfe", BAD BAD},
		{"\xf1\x80\x80", BAD BAD BAD}, {"a\xf1\x80\x80\x80z", "a\xf1\x80\x80\x80z"}};

	for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
		struct ct_vol v, w = {0};
		const char *got;

		make_volume(&v, 2, 2, 2);
		must(ct_meta_set(&v.meta, "history", c[i].in, &err) ||
			ct_meta_set(&v.meta, c[i].in, "as a key", &err));
		OK(ct_vol_write("u.nii", &v, &force, &err) == 0 &&
				ct_vol_read("u.nii", &w, &err) == 0 &&
				(got = ct_meta_get(&w.meta, "history")) &&
				strcmp(got, c[i].out) == 0 && ct_meta_get(&w.meta, c[i].out),
			"UTF-8, case %zu: %s", i, err.msg);
		ct_vol_free(&v);
		ct_vol_free(&w);
	}
	unlink("u.nii");
}

static unsigned char *load(const char *path, size_t *n)
{
	FILE *f = fopen(path, "rb");
	unsigned char *p = malloc(1 << 22);

	if (!f || !p)
		exit(99);
	*n = fread(p, 1, 1 << 22, f);
	fclose(f);
	return p;
}

static double number(const unsigned char *p, size_t at, size_t bytes, bool real)
{
	uint32_t u = 0;
	float f;

	for (size_t i = bytes; i > 0; i--)
		u = u << 8 | p[at + i - 1];
	memcpy(&f, &u, sizeof f);
	return real ? (double)f : (double)u;
}

/* Is the byte of a field that is written? */
static bool known(size_t i)
{
	return i < 4 || i == 38 || (i >= 40 && i < 56) || (i >= 70 && i < 74) ||
	       (i >= 76 && i < 116) || i == 123 || (i >= 148 && i < 228) || (i >= 252 && i < 328) ||
	       i >= 344;
}

/* Every field of a header, and where extensions lie. */
static void test_header(void)
{
	struct ct_vol v;
	unsigned char *p;
	size_t n, ext = 0;

	make_volume(&v, 6, 5, 4);
	v.affine[0][0] = -2;
	v.affine[1][1] = 3;
	v.affine[2][2] = 0.5;
	v.affine[1][3] = 7;
	must(ct_vol_write("h.nii", &v, &force, &err));
	p = load("h.nii", &n);
	for (size_t i = 0; i < 352; i++)
		ext += !known(i) && p[i] != 0;
	OK(ext == 0, "what is no field is 0");
	OK(n == 352 + 240 && number(p, 108, 4, true) == 352 && p[348] == 0,
		"no more than is needed");
	OK(number(p, 0, 4, false) == 348 && p[38] == 'r' && memcmp(p + 344, "n+1", 4) == 0, "head");
	OK(number(p, 40, 2, false) == 3 && number(p, 42, 2, false) == 6 &&
			number(p, 44, 2, false) == 5 && number(p, 46, 2, false) == 4 &&
			number(p, 48, 2, false) == 1 && number(p, 54, 2, false) == 1,
		"dimensions");
	OK(number(p, 70, 2, false) == 4 && number(p, 72, 2, false) == 16, "type");
	OK(number(p, 76, 4, true) == -1 && number(p, 80, 4, true) == 2 &&
			number(p, 84, 4, true) == 3 && number(p, 88, 4, true) == 0.5 &&
			number(p, 92, 4, true) == 0 && number(p, 104, 4, true) == 0,
		"voxel sizes");
	OK(number(p, 112, 4, true) == 1 && number(p, 116, 4, true) == 0 && p[123] == 2,
		"scale, mm");
	OK(strncmp((char *)p + 148, "ct-test ", 8) == 0, "which tool");
	OK(number(p, 252, 2, false) == 1 && number(p, 254, 2, false) == 1, "codes");
	OK(number(p, 272, 4, true) == 7 && number(p, 280, 4, true) == -2 &&
			number(p, 308, 4, true) == 7,
		"offsets");
	free(p);
	for (size_t len = 0; len < 40; len++) {
		char value[41] = {0};
		size_t size;

		memset(value, 'v', len);
		must(ct_meta_set(&v.meta, "k", value, &err) ||
			ct_meta_set(&v.meta, "input", "of another", &err) ||
			ct_meta_set(&v.meta, "nifti.code", "9", &err) ||
			ct_vol_write("h.nii", &v, &force, &err));
		p = load("h.nii", &n);
		size = (size_t)number(p, 352, 4, false);
		/* {"ct:k":"..."} and the head of 8, rounded up to 16 */
		ext += !(size % 16 == 0 && size >= len + 19 && size < len + 19 + 16 &&
			 p[348] == 1 && number(p, 356, 4, false) == 6 && n == 352 + 240 + size &&
			 number(p, 108, 4, true) == (double)(352 + size));
		free(p);
	}
	OK(ext == 0, "an extension is padded to 16 bytes, no more");
	ct_vol_free(&v);
	unlink("h.nii");
}

static void test_codes(void)
{
	static const struct {
		const char *kept;
		double want;
	} c[] = {{"0", 1}, {"1", 1}, {"2", 2}, {"5", 5}, {"6", 1}, {"-1", 1}, {"x", 1}};
	struct ct_vol v;
	struct made m;
	unsigned char *p;
	size_t n;

	make_volume(&v, 2, 2, 2);
	for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
		must(ct_meta_set(&v.meta, "nifti.code", c[i].kept, &err) ||
			ct_vol_write("k.nii", &v, &force, &err));
		p = load("k.nii", &n);
		OK(number(p, 252, 2, false) == c[i].want && number(p, 254, 2, false) == c[i].want,
			"code %s is written as %g", c[i].kept, c[i].want);
		free(p);
	}
	ct_vol_free(&v);
	unlink("k.nii");
	make(&m, 1, false, 2, 1, small, 0);
	OK(kept(&m, "nifti.code", "0"), "no code is none");
	put_codes(&m, 3, 0);
	OK(kept(&m, "nifti.code", "3"), "that of the qform");
	put_codes(&m, 1, 0);
	OK(kept(&m, "nifti.code", NULL), "1 is not kept");
	put_srow(&m, (const double[12]){1, [5] = 1, [10] = 1});
	put_codes(&m, 3, 1);
	OK(kept(&m, "nifti.code", NULL), "nor what stands behind it");
	free(m.p);
}

/* Foreign extensions that were kept. */
static void test_foreign(void)
{
	static const struct {
		const char *kept;
		int code; /* that is written */
		const char *text;
	} c[] = {{"4 Zm9vYmFy", 4, "foobar"}, {"-5 Zm8=", -5, "fo"}, {"0 Zg", 0, "f"},
		{"2147483647 ", INT32_MAX, ""},
		{"-2147483648 /++/+w==", INT32_MIN, "\xff\xef\xbf\xfb"}};
	static const char *const bad[] = {"4Zm9v", "x Zm9v", "2147483648 Zm9v", "-2147483649 Zm9v",
		"99999999999999999999 Zm9v", "4 Zm9vY", "4 Zm-v", "4", "4\tZm9v", "4 Zm9\xc3"};
	struct ct_vol v;
	unsigned char *p;
	size_t n;

	make_volume(&v, 2, 2, 2);
	for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
		const size_t len = strlen(c[i].text);
		unsigned char want[16] = {0};

		memcpy(want, c[i].text, len);
		must(ct_meta_set(&v.meta, "nifti.ext.3", c[i].kept, &err) ||
			ct_vol_write("f.nii", &v, &force, &err));
		p = load("f.nii", &n);
		OK(number(p, 352, 4, false) == 16 &&
				(int32_t)(uint32_t)number(p, 356, 4, false) == c[i].code &&
				memcmp(p + 360, want, 8) == 0 && n == 352 + 16 + 16,
			"extension %s", c[i].kept);
		free(p);
	}
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		must(ct_meta_set(&v.meta, "nifti.ext.3", bad[i], &err));
		err = (struct ct_err){0};
		OK(ct_vol_write("g.nii", &v, &force, &err) == -1 && err.code == CT_EINPUT &&
				strstr(err.msg, "g.nii: metadata nifti.ext.3 is not"),
			"'%s' is none: %s", bad[i], err.msg);
	}
	ct_vol_free(&v);
	unlink("f.nii");
}

static void test_rotation(void)
{
	/* half turns, of a quaternion a little too long: R = 2 u u' - I */
	static const double turn[][3] = {
		{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.6, 0.8, 0}, {0, 0.6, -0.8}, {-0.48, 0.6, 0.64}};
	struct made m;
	double worst = 0;

	make(&m, 2, false, 2, 1, small, 0);
	put_codes(&m, 1, 0);
	for (int a = 1; a <= 3; a++)
		put_pixdim(&m, (size_t)a, 1);
	for (size_t k = 0; k < sizeof turn / sizeof *turn; k++) {
		const double *u = turn[k], more = 1.001,
			     q[6] = {more * u[0], more * u[1], more * u[2], 0, 0, 0};
		struct ct_vol v = {0};

		put_quaternion(&m, q);
		must(parse(m.p, m.n, &v));
		for (int i = 0; i < 3; i++)
			for (int j = 0; j < 3; j++)
				worst = fmax(
					worst, fabs(v.affine[i][j] - 2 * u[i] * u[j] + (i == j)));
		ct_vol_free(&v);
	}
	NEAR(worst, 0, 1e-12, "half a turn is a rotation, its quaternion a little too long");
	put_quaternion(&m, (const double[6]){0, 0.8, 0.8});
	OK(refused(&m, CT_EGEOM, "quatern_b, _c and _d are a vector 1.13137 long"),
		"a quaternion that is no rotation is refused");
	free(m.p);
}

/* A grid of which axis `far` is long, sheared by s: its rotation turns by s/2, so corners move by
 * s/2 of the longer side. */
static int sheared(int i, int j, int far, double s, const double mm[3])
{
	size_t n[3] = {2, 2, 2};
	struct ct_vol v;
	int rc;

	n[far] = 150;
	make_volume(&v, n[0], n[1], n[2]);
	for (int a = 0; a < 3; a++)
		v.affine[a][a] = mm[a];
	v.affine[i][j] = s * mm[j];
	err = (struct ct_err){0};
	rc = ct_vol_write("s.nii", &v, &force, &err);
	ct_vol_free(&v);
	unlink("s.nii");
	return rc == -1 && err.code == CT_EGEOM && strstr(err.msg, "corners would move");
}

static void test_shear(void)
{
	static const double sizes[][3] = {{1, 1, 1}, {2, 1, 3}, {1, 3, 2}, {3, 2, 1}};
	int bad = 0;

	for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++)
		for (int i = 0; i < 3; i++)
			for (int j = 0; j < 3; j++)
				for (int far = 0; far < 3; far++) {
					const double *mm = sizes[k];
					const double least = fmin(fmin(mm[0], mm[1]), mm[2]);
					const double s = 0.1 * least / (150 * mm[far]);

					if (i != j && (far == i || far == j))
						bad += !sheared(i, j, far, 1.01 * s, mm) ||
						       sheared(i, j, far, -0.99 * s, mm);
				}
	OK(bad == 0, "a grid is refused when its corners would move by 0.05 voxels, not before");
}

static void test_fields(void)
{
	static const double rows[12] = {0, -2, 0, 5, 1, 0, 0, 6, 0, 0, 4, 7};
	struct ct_vol v = {0};
	struct made m;

	for (int version = 1; version <= 2; version++) {
		make(&m, version, true, 2, 1, small, 0);
		put_dim(&m, 0, 1);
		OK(parse(m.p, m.n, &v) == 0 && v.n[0] == 3 && v.n[1] == 1 && v.n[2] == 1,
			"one row");
		ct_vol_free(&v);
		put_dim(&m, 0, 7);
		for (size_t a = 4; a < 8; a++)
			put_dim(&m, a, 1);
		OK(parse(m.p, m.n, &v) == 0 && v.n[0] == 3 && v.n[1] == 4 && v.n[2] == 5, "seven");
		ct_vol_free(&v);
		put_dim(&m, 7, 2);
		OK(refused(&m, CT_EINPUT, "dim[7] is 2: only one 3-D volume"),
			"but no two volumes");
		put_dim(&m, 0, 3);
		put_dim(&m, 1, 0);
		OK(refused(&m, CT_EINPUT, "dim[1] is 0"), "no width");
		put_dim(&m, 0, 0);
		OK(refused(&m, CT_EINPUT, "dim[0] is 0"), "no dimensions");
		put_dim(&m, 0, 3);
		put_dim(&m, 1, 3);
		put_start(&m, 0);
		OK(parse(m.p, m.n, &v) == 0, "no vox_offset is the least");
		ct_vol_free(&v);
		m.n--;
		OK(refused(&m, CT_EINPUT, "voxels need 60 bytes"), "a byte too few is seen before");
		m.n++;
		put_pixdim(&m, 1, -1);
		OK(refused(&m, CT_EGEOM, "pixdim[1] is -1"), "a negative size");
		put_pixdim(&m, 3, (double)INFINITY);
		put_pixdim(&m, 1, 1);
		OK(refused(&m, CT_EGEOM, "pixdim[3] is inf"), "an infinite one");
		put_srow(&m, rows);
		put_codes(&m, 0, 1);
		put_units(&m, 1 | 8);
		OK(parse(m.p, m.n, &v) == 0 && v.affine[0][1] == -2000 && v.affine[2][3] == 7000,
			"are nothing to an sform, in metres and seconds");
		ct_vol_free(&v);
		put_units(&m, 0);
		put_slope(&m, (double)INFINITY, 5);
		OK(refused(&m, CT_EINPUT, "scl_slope is inf and scl_inter 5"),
			"a slope of infinity");
		put_slope(&m, (double)NAN, 5);
		OK(parse(m.p, m.n, &v) == 0 && v.data[0] == 0,
			"a slope that is none has no intercept");
		ct_vol_free(&v);
		put_slope(&m, 2, (double)NAN);
		OK(parse(m.p, m.n, &v) == 0 && v.data[0] == 0 && v.affine[0][1] == -2,
			"nor is NaN one");
		ct_vol_free(&v);
		put_slope(&m, 1, 5);
		OK(parse(m.p, m.n, &v) == 0 && v.data[0] == 5, "5 is");
		ct_vol_free(&v);
		memcpy(m.p + (version == 1 ? 344 : 4), version == 1 ? "ni1" : "ni2", 3);
		OK(refused(&m, CT_EINPUT, "pair"), "a pair, NIfTI-%d", version);
		memset(m.p + (version == 1 ? 344 : 4), 0, 4);
		OK(refused(&m, CT_EINPUT, version == 1 ? "Analyze" : "magic"), "no magic");
		free(m.p);
	}
	make(&m, 1, false, 2, 1, small, 0);
	put_real(&m, 108, 4, 352.5);
	OK(refused(&m, CT_EINPUT, "vox_offset 352.5 is wrong"), "half a byte");
	free(m.p);
}

/* Voxels in a stream that begins elsewhere. */
static void test_offset(void)
{
	struct made m;
	struct ct_any in = {0};
	unsigned char *p;
	FILE *f;
	int rc;

	make(&m, 1, false, 2, 1, small, 0);
	p = calloc(m.n + 100, 1);
	if (!p)
		exit(99);
	memcpy(p + 100, m.p, m.n);
	for (size_t cut = 0; cut < 2; cut++) {
		f = fmemopen(p, m.n + 100 - cut, "rb");
		if (!f || fseek(f, 100, SEEK_SET))
			exit(99);
		rc = ct_format_read_stream(&ct_format_nifti, f, "x", &in, &err);
		OK(cut ? rc == -1 && strstr(err.msg, "voxels need") : rc == 0 && in.vol.n[2] == 5,
			"a stream from byte 100, less %zu", cut);
		ct_any_free(&in);
		fclose(f);
	}
	free(p);
	free(m.p);
}

/* The hash is of sizes, geometry and each voxel. */
static void test_hash(void)
{
	struct made m;
	struct ct_vol v = {0};
	char before[80];
	size_t same = 0, at = make(&m, 1, false, 16, 4, small, 0);
	const size_t changes[] = {at, at + 4 * 59, 80, 84, 88};

	must(parse(m.p, m.n, &v));
	snprintf(before, sizeof before, "%s", ct_meta_get(&v.meta, "input"));
	ct_vol_free(&v);
	for (size_t i = 0; i < sizeof changes / sizeof *changes; i++) {
		const double was = number(m.p, changes[i], 4, true);

		put_real(&m, changes[i], 4, 9);
		must(parse(m.p, m.n, &v));
		same += strcmp(ct_meta_get(&v.meta, "input"), before) == 0;
		ct_vol_free(&v);
		put_real(&m, changes[i], 4, was);
	}
	for (size_t a = 1; a < 3; a++) { /* two sizes in each other's place */
		put_dim(&m, a, small[a]);
		put_dim(&m, a + 1, small[a - 1]);
		must(parse(m.p, m.n, &v));
		same += strcmp(ct_meta_get(&v.meta, "input"), before) == 0;
		ct_vol_free(&v);
		put_dim(&m, a, small[a - 1]);
		put_dim(&m, a + 1, small[a]);
	}
	OK(same == 0, "each voxel and each size of one changes the hash");
	free(m.p);
}

static int same_files(const char *a, const char *b)
{
	unsigned char *p, *q = NULL;
	size_t n, m = 0;
	int same;

	must(ct_slurp(a, &p, &n, &err) || ct_slurp(b, &q, &m, &err));
	same = n == m && memcmp(p, q, n) == 0;
	free(p);
	free(q);
	return same;
}

/* Plane by plane, with metadata that are known in the end, it is the same file. */
static void test_planes(void)
{
	static const enum ct_nifti_type types[] = {CT_NIFTI_AUTO, CT_NIFTI_I16, CT_NIFTI_F32};
	struct ct_nifti_planes *w;
	struct ct_vol v;
	int rc = 0;

	make_volume(&v, 3, 4, 5);
	for (size_t i = 0; i < 60; i++)
		v.data[i] = (float)i - 30;
	for (size_t t = 0; t < 3; t++) {
		must(ct_meta_set(&v.meta, "key", "before", &err) ||
			ct_nifti_create(&w, "p.nii", &v, types[t], false, &force, &err));
		for (size_t k = 0; k < 5; k++)
			must(ct_nifti_put(w, 12, v.data + 12 * k, &err));
		must(ct_meta_set(&v.meta, "key", "behind", &err) ||
			ct_nifti_close(w, &v, 0, &force, &err) ||
			ct_nifti_write("v.nii", &v, types[t], false, &force, &err));
		OK(same_files("p.nii", "v.nii"), "%s, plane by plane",
			CT_WORD(CT_NIFTI_LIST, types[t]));
		must(unlink("p.nii") || unlink("v.nii"));
	}
	v.data[30] = 0.5f;
	for (size_t t = 0; t < 3; t++) {
		must(ct_nifti_create(&w, "p.nii", &v, types[t], false, &force, &err));
		err = (struct ct_err){0};
		rc = ct_nifti_put(w, 60, v.data, &err);
		OK(types[t] == CT_NIFTI_AUTO ? rc && err.code == CT_ENUMERIC : rc == 0,
			"a half as %s", CT_WORD(CT_NIFTI_LIST, types[t]));
		OK(ct_nifti_close(w, &v, -1, &force, &err) == -1 && access("p.nii", F_OK) != 0,
			"is dropped");
	}
	v.data[30] = 40000;
	must(ct_nifti_create(&w, "p.nii", &v, CT_NIFTI_I16, false, &force, &err));
	rc = ct_nifti_put(w, 60, v.data, &err);
	OK(rc && err.code == CT_ENUMERIC && strstr(err.msg, "p.nii: a voxel does not fit int16"),
		"%s", err.msg);
	ct_nifti_close(w, &v, -1, &force, &err);
	must(ct_nifti_create(&w, "p.nii.gz", &v, CT_NIFTI_F32, false, &force, &err) ||
		ct_nifti_put(w, 60, v.data, &err) || ct_meta_set(&v.meta, "key", "beyond", &err));
	OK(ct_nifti_close(w, &v, 0, &force, &err) == -1 && err.code == CT_EOUTPUT &&
			access("p.nii.gz", F_OK) != 0,
		"not where it is compressed: %s", err.msg);
	ct_vol_free(&v);
}

int main(void)
{
	char dir[] = "/tmp/t-nifti-parts.XXXXXX";

	if (!mkdtemp(dir) || chdir(dir) != 0)
		return 99;
	test_base64();
	test_ours();
	test_sizes();
	test_utf8();
	test_header();
	test_codes();
	test_foreign();
	test_rotation();
	test_shear();
	test_fields();
	test_offset();
	test_hash();
	test_planes();
	if (chdir("/") != 0 || rmdir(dir) != 0)
		OK(0, "%s is left empty", dir);
	return tap_done();
}
