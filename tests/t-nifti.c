/* The NIfTI codec: types, byte orders, versions, geometry, extensions, hostile files.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/hash.h"
#include "formats/nifti.h"
#include "formats/io.h"
#include "nifti-make.h"
#include "tap.h"

#include <unistd.h>
#include <zlib.h>

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

static int parse_made(const struct made *m, struct ct_vol *v)
{
	return parse(m->p, m->n, v);
}

/* Refused with the code, saying the word, and nothing left behind. */
static int refused(const struct made *m, enum ct_code code, const char *word)
{
	struct ct_vol v = {0};
	int ok = parse_made(m, &v) != 0 && err.code == code && strstr(err.msg, word) &&
		 strncmp(err.msg, "x.nii: ", 7) == 0 && !v.data && !v.meta.pair;

	if (!ok)
		printf("# code %d: %s\n", (int)err.code, err.msg);
	ct_vol_free(&v);
	return ok;
}

static const struct type {
	const char *name;
	int code;
	size_t bytes;
	bool real;
	double lo, hi; /* exact in float */
} types[] = {
	{"uint8", 2, 1, false, 0, 255},
	{"int8", 256, 1, false, -128, 127},
	{"int16", 4, 2, false, -32768, 32767},
	{"uint16", 512, 2, false, 0, 65535},
	{"int32", 8, 4, false, -2147483648.0, 16777215},
	{"uint32", 768, 4, false, 0, 4294967040.0},
	{"int64", 1024, 8, false, -9223372036854775808.0, 1099511627776.0},
	{"uint64", 1280, 8, false, 0, 1099511627776.0},
	{"float32", 16, 4, true, -1234.5, 3.25e7},
	{"float64", 64, 8, true, -0.0009765625, 1e6},
};

static double sample(const struct type *t, size_t i)
{
	return i % 3 == 0 ? t->lo : i % 3 == 1 ? t->hi : (double)(i % 100);
}

static void test_types(void)
{
	for (size_t k = 0; k < sizeof types / sizeof types[0]; k++)
		for (int variant = 0; variant < 8; variant++) {
			const struct type *t = &types[k];
			const bool scaled = variant & 4;
			struct made m;
			struct ct_vol v = {0};
			size_t at = make(&m, 1 + (variant & 1), variant & 2, t->code, t->bytes,
				       small, 0),
			       bad = 0;

			for (size_t i = 0; i < 60; i++)
				if (t->real)
					put_real(&m, at + i * t->bytes, t->bytes, sample(t, i));
				else
					put_int(&m, at + i * t->bytes, t->bytes,
						(int64_t)sample(t, i));
			put_slope(&m, scaled ? 0.5 : 0, scaled ? -1024 : 7);
			if (parse_made(&m, &v))
				bad = 1;
			for (size_t i = 0; i < 60 && v.data; i++)
				bad += v.data[i] !=
				       (float)(scaled ? 0.5 * sample(t, i) - 1024 : sample(t, i));
			OK(bad == 0 && v.n[0] == 3 && v.n[1] == 4 && v.n[2] == 5,
				"%s, NIfTI-%d, %s endian%s", t->name, m.version,
				m.big ? "big" : "little", scaled ? ", scaled" : "");
			if (bad)
				printf("# %zu: %s\n", bad, err.msg);
			ct_vol_free(&v);
			free(m.p);
		}
}

static void test_geometry(void)
{
	/* a quarter turn about z, offset, and its mirror image */
	static const double quarter[6] = {0, 0, 0.70710678118654752, 10, 20, 30};
	static const double rows[12] = {0, -2, 0, 5, 1, 0, 0, 6, 0, 0, 4, 7};
	struct made m;
	struct ct_vol v = {0};

	for (int version = 1; version <= 2; version++) {
		make(&m, version, version == 2, 2, 1, small, 0);
		OK(parse_made(&m, &v) == 0 && v.affine[0][0] == 1 && v.affine[1][1] == 2 &&
				v.affine[2][2] == 3 && v.affine[0][3] == 0,
			"pixdim alone, NIfTI-%d", version);
		ct_vol_free(&v);
		put_quaternion(&m, quarter);
		put_codes(&m, 1, 0);
		parse_made(&m, &v);
		NEAR(v.affine[1][0], 1, 1e-6, "qform: i runs along +y");
		NEAR(v.affine[0][1], -2, 1e-6, "qform: j runs along -x");
		NEAR(v.affine[2][2], 3, 1e-6, "qform: k runs along +z");
		NEAR(v.affine[1][3], 20, 1e-6, "qform: offset");
		ct_vol_free(&v);
		put_pixdim(&m, 0, -1);
		parse_made(&m, &v);
		NEAR(v.affine[2][2], -3, 1e-6, "qfac -1 turns k");
		ct_vol_free(&v);
		put_srow(&m, rows);
		put_codes(&m, 1, 4);
		OK(parse_made(&m, &v) != 0, "a qform that mirrors the sform is refused");
		put_pixdim(&m, 0, 1);
		parse_made(&m, &v);
		OK(memcmp(v.affine, rows, sizeof rows) == 0, "the sform is preferred");
		OK(ct_meta_get(&v.meta, "nifti.code") &&
				strcmp(ct_meta_get(&v.meta, "nifti.code"), "4") == 0,
			"its code is kept");
		ct_vol_free(&v);
		put_units(&m, 3 | 8);
		parse_made(&m, &v);
		NEAR(v.affine[0][1], -0.002, 1e-9, "micrometres");
		ct_vol_free(&v);
		put_units(&m, 1);
		parse_made(&m, &v);
		NEAR(v.affine[2][3], 7000, 1e-9, "metres");
		ct_vol_free(&v);
		free(m.p);
	}
}

static void test_refusals(void)
{
	static const struct {
		int code;
		const char *word;
	} odd[] = {{1, "bits"}, {32, "complex64"}, {128, "RGB"}, {2304, "RGBA"},
		{1792, "complex128"}, {1536, "float128"}, {7, "unknown"}};
	static const double sheared[12] = {1, 0.1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
	static const double flat[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0};
	struct made m;
	struct ct_vol v = {0};

	for (size_t i = 0; i < sizeof odd / sizeof odd[0]; i++) {
		make(&m, 1, false, odd[i].code, 1, small, 0);
		OK(refused(&m, CT_EINPUT, odd[i].word), "datatype %d is refused by name",
			odd[i].code);
		free(m.p);
	}
	make(&m, 1, false, 2, 1, small, 0);
	put_int(&m, 72, 2, 16);
	OK(refused(&m, CT_EINPUT, "bitpix is 16"), "a width that is not the type's is refused");
	put_int(&m, 72, 2, 0);
	OK(parse_made(&m, &v) == 0, "none is fine");
	ct_vol_free(&v);
	put_int(&m, 72, 2, 8);
	memcpy(m.p + 344, "ni1", 4);
	OK(refused(&m, CT_EINPUT, ".hdr/.img"), "a pair is refused");
	memset(m.p + 344, 0, 4);
	OK(refused(&m, CT_EINPUT, "Analyze"), "Analyze is refused");
	memcpy(m.p + 344, "n+3", 4);
	OK(refused(&m, CT_EINPUT, "magic"), "a wrong magic is refused");
	memcpy(m.p + 344, "n+1", 4);
	put_pixdim(&m, 2, 0);
	OK(refused(&m, CT_EGEOM, "pixdim[2]"), "a voxel size of zero is refused");
	put_pixdim(&m, 2, (double)NAN);
	OK(refused(&m, CT_EGEOM, "pixdim[2]"), "NaN too");
	put_pixdim(&m, 2, 2);
	put_codes(&m, 0, 1);
	put_srow(&m, sheared);
	OK(refused(&m, CT_EGEOM, "sheared"), "a sheared sform is refused");
	put_srow(&m, flat);
	OK(refused(&m, CT_EGEOM, "voxel size"), "a flat sform is refused");
	put_codes(&m, 0, 0);
	put_dim(&m, 0, 4);
	put_dim(&m, 4, 1);
	OK(parse_made(&m, &v) == 0, "a fourth dimension of one is fine");
	ct_vol_free(&v);
	put_dim(&m, 4, 2);
	OK(refused(&m, CT_EINPUT, "3-D"), "of two it is refused");
	put_dim(&m, 0, 8);
	OK(refused(&m, CT_EINPUT, "dim[0]"), "eight dimensions are refused");
	put_dim(&m, 0, 3);
	put_dim(&m, 3, -5);
	OK(refused(&m, CT_EINPUT, "dim[3]"), "a negative dimension is refused");
	put_dim(&m, 3, 32767);
	OK(refused(&m, CT_EINPUT, "truncated"), "a file too short for its dimensions is refused");
	put_dim(&m, 3, 5);
	put_start(&m, 348);
	OK(refused(&m, CT_EINPUT, "vox_offset"), "voxels inside the header");
	put_start(&m, 1 << 30);
	OK(refused(&m, CT_EINPUT, "vox_offset"), "voxels past the end");
	put_start(&m, 400);
	OK(refused(&m, CT_EINPUT, "truncated"), "voxels that run past the end");
	put_real(&m, 108, 4, (double)NAN);
	OK(refused(&m, CT_EINPUT, "vox_offset"), "vox_offset NaN");
	free(m.p);
}

static void test_huge(void)
{
	static const int64_t edge[] = {1 << 30, INT32_MAX, (int64_t)1 << 32, (int64_t)1 << 40,
		(int64_t)1 << 62, INT64_MAX, INT64_MIN, -1, 0};
	size_t bad = 0;

	for (size_t i = 0; i < sizeof edge / sizeof edge[0]; i++)
		for (size_t axis = 1; axis <= 3; axis++)
			for (int all = 0; all < 2; all++) {
				struct made m;

				make(&m, 2, false, 64, 8, small, 0);
				put_dim(&m, axis, edge[i]);
				for (size_t a = 1; a <= 3 && all; a++)
					put_dim(&m, a, edge[i]);
				bad += !refused(&m, CT_EINPUT, "");
				put_dim(&m, axis, 3);
				put_start(&m, edge[i] ? edge[i] : 1);
				bad += !refused(&m, CT_EINPUT, "");
				free(m.p);
			}
	OK(bad == 0, "dimensions and offsets up to 2^63 are refused");
}

static void test_truncation(void)
{
	struct made m;
	struct ct_vol v = {0};
	unsigned char gz[2048];
	uLongf size = sizeof gz;
	z_stream z = {0};
	size_t full, bad = 0;

	make(&m, 1, true, 4, 2, small, 32);
	put_ext(&m, 352, 32, 6, "{\"ct:window\":\"-5:5\"}");
	full = m.n;
	for (m.n = 1; m.n < full; m.n++)
		bad += !refused(&m, CT_EINPUT, "");
	OK(bad == 0, "every prefix of a file is refused");
	m.n = full;
	deflateInit2(&z, 6, Z_DEFLATED, 31, 8, 0);
	z.next_in = m.p;
	z.avail_in = (uInt)m.n;
	z.next_out = gz;
	z.avail_out = (uInt)size;
	deflate(&z, Z_FINISH);
	size = z.total_out;
	deflateEnd(&z);
	for (size_t n = 1; n < size; n++)
		bad += parse(gz, n, &v) == 0 || err.code != CT_EINPUT;
	OK(bad == 0, "every prefix of a gzip file is refused");
	OK(parse(gz, size, &v) == 0 && strcmp(ct_meta_get(&v.meta, "window"), "-5:5") == 0,
		"the whole is read, whatever its name");
	ct_vol_free(&v);
	gz[size - 6] ^= 1;
	OK(parse(gz, size, &v) && strstr(err.msg, "compressed"), "a wrong check sum is refused");
	gz[1] ^= 1;
	OK(parse(gz, size, &v) && err.code == CT_EINPUT && strstr(err.msg, "not a NIfTI file"),
		"what only begins like gzip is none: %s", err.msg);
	free(m.p);
}

static void test_extensions(void)
{
	static const char *names[] = {"e.nii", "e.nii.gz"};
	const struct ct_env env = {
		.tool = "ct-test", .files = &(const struct ct_io_rule){.force = true}};
	struct made m;
	struct ct_vol v = {0}, w = {0};
	const char *kept;

	make(&m, 1, false, 2, 1, small, 32 + 48 + 16);
	put_ext(&m, 352, 32, 6, "{\"ct:window\":\"-1:2\"}");
	put_ext(&m, 384, 48, 4, "<xml>\x01\xff</xml>");
	put_ext(&m, 432, 16, 6, "{\"a\":\"b\"}"); /* a comment that is not ours; no NUL */
	OK(parse_made(&m, &v) == 0, "a file with three extensions");
	OK(ct_meta_get(&v.meta, "window") && strcmp(ct_meta_get(&v.meta, "window"), "-1:2") == 0,
		"ours is metadata");
	kept = ct_meta_get(&v.meta, "nifti.ext.1");
	OK(kept && strncmp(kept, "4 PHhtbD4B/zwv", 14) == 0, "a foreign one is kept as base64");
	ct_meta_set(&v.meta, "history", "ct-x \"a\\b\"\nline two \xc3\xa9 \xff.", &err);
	for (int i = 0; i < 2; i++) {
		OK(ct_vol_write(names[i], &v, &env, &err) == 0 &&
				ct_vol_read(names[i], &w, &err) == 0,
			"%s is written and read", names[i]);
		kept = ct_meta_get(&w.meta, "history");
		OK(kept && strcmp(kept, "ct-x \"a\\b\"\nline two \xc3\xa9 \xef\xbf\xbd.") == 0,
			"text survives, bytes that are not UTF-8 are marked");
		for (size_t k = 1; k < 3; k++) {
			char key[20];

			snprintf(key, sizeof key, "nifti.ext.%zu", k);
			kept = ct_meta_get(&w.meta, key);
			OK(kept && strcmp(kept, ct_meta_get(&v.meta, key)) == 0,
				"foreign extension %zu survives", k);
		}
		OK(memcmp(ct_meta_get(&v.meta, "input") + 6,
			   ct_meta_get(&w.meta, "input") + strlen(names[i]) + 1, 30) == 0,
			"the hash is of the content, not of the bytes");
		ct_vol_free(&w);
		unlink(names[i]);
	}
	put_int(&m, 352, 4, 1 << 20);
	OK(refused(&m, CT_EINPUT, "extension 0"), "an extension longer than the header is refused");
	put_int(&m, 352, 4, -32);
	OK(refused(&m, CT_EINPUT, "extension 0"), "a negative size too");
	ct_meta_set(&v.meta, "nifti.ext.1", "4 ab!c", &err);
	OK(ct_vol_write("e.nii", &v, &env, &err) && access("e.nii", F_OK) != 0,
		"a damaged kept extension leaves no file");
	ct_vol_free(&v);
	free(m.p);
}

/* A random rotation of a right- or left-handed grid, written and read. */
static int agrees(const double q[4], double flip, double *qform_off)
{
	const struct ct_env env = {
		.tool = "ct-test", .files = &(const struct ct_io_rule){.force = true}};
	const double mm[3] = {0.7, 0.8 * flip, 1.25},
		     n2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
	const size_t n[3] = {40, 30, 20};
	struct ct_vol v = {0}, w = {0};
	unsigned char head[352];
	FILE *f;
	int ok;

	if (ct_vol_alloc(&v, n, &err))
		exit(99);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (float)i / 2;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++) { /* R = I + 2 (s K + K K)/|q|^2, K the cross product */
			const int k = 3 - i - j;
			const double kij = i == j ? 0 : (j == (i + 1) % 3 ? -1 : 1) * q[k + 1];
			const double kk = q[i + 1] * q[j + 1] - (i == j ? n2 - q[0] * q[0] : 0);

			v.affine[i][j] = ((i == j) + 2 * (q[0] * kij + kk) / n2) * mm[j];
		}
	v.affine[0][3] = -100;
	v.affine[2][3] = 55.5;
	ok = ct_vol_write("g.nii", &v, &env, &err) == 0 && ct_vol_read("g.nii", &w, &err) == 0 &&
	     ct_vol_same_grid(&v, &w, &err) == 0 &&
	     memcmp(v.data, w.data, ct_vol_count(&v) * sizeof *v.data) == 0;
	ct_vol_free(&w);
	f = fopen("g.nii", "r+b"); /* once more through the qform alone */
	if (!f || fread(head, 1, sizeof head, f) != sizeof head)
		exit(99);
	head[254] = 0;
	rewind(f);
	fwrite(head, 1, sizeof head, f);
	fclose(f);
	ok = ok && ct_vol_read("g.nii", &w, &err) == 0;
	*qform_off = 0;
	for (unsigned c = 0; c < 8 && ok; c++) {
		const double ijk[3] = {c & 1 ? 39 : 0, c & 2 ? 29 : 0, c & 4 ? 19 : 0};
		double a[3], b[3];

		ct_vol_world(&v, ijk, a);
		ct_vol_world(&w, ijk, b);
		for (int d = 0; d < 3; d++)
			*qform_off = fmax(*qform_off, fabs(a[d] - b[d]));
	}
	ct_vol_free(&v);
	ct_vol_free(&w);
	unlink("g.nii");
	return ok;
}

static void test_writing(void)
{
	static const double special[][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1},
		{1, 1, 1, 1}, {1, 1, 0, 0}, {0, 1, 1, 0}, {1, -1, 1, -1}};
	float z[4 * 40];
	double worst = 0, off;
	size_t bad = 0;

	ct_rng_normals(4 * 40, z, 1, 2, 0);
	for (size_t i = 0; i < 56; i++) {
		double q[4];

		for (size_t k = 0; k < 4; k++)
			q[k] = i < 16 ? special[i / 2][k] : (double)z[4 * (i - 16) + k];
		bad += !agrees(q, i % 2 ? 1 : -1, &off);
		worst = fmax(worst, off);
	}
	OK(bad == 0, "any orientation survives");
	NEAR(worst, 0, 2e-3, "qform and sform agree at the corners, mm");
}

static void test_choice(void)
{
	const struct ct_env env = {
		.tool = "ct-test", .files = &(const struct ct_io_rule){.force = true}};
	const size_t n[3] = {33000, 1, 2}, few[3] = {2, 2, 2};
	static const struct {
		float x;
		enum ct_nifti_type type;
		int want, back; /* datatype written, 0 for refused; value read, if it is an int */
	} cases[] = {{-1024, CT_NIFTI_AUTO, 4, -1024}, {32767, CT_NIFTI_AUTO, 4, 32767},
		{32768, CT_NIFTI_AUTO, 16, 32768}, {-32768, CT_NIFTI_AUTO, 4, -32768},
		{-32769, CT_NIFTI_AUTO, 16, -32769}, {0.5f, CT_NIFTI_AUTO, 16, 0},
		{2.5f, CT_NIFTI_I16, 4, 2}, {-3.75f, CT_NIFTI_I16, 4, -4}, {5, CT_NIFTI_F32, 16, 5},
		{40000, CT_NIFTI_I16, 0, 0}, {NAN, CT_NIFTI_I16, 0, 0}, {NAN, CT_NIFTI_AUTO, 16, 0},
		{INFINITY, CT_NIFTI_AUTO, 16, 0}};
	struct ct_vol v = {0}, w = {0};
	unsigned char head[72] = {0};
	FILE *f;

	if (ct_vol_alloc(&v, few, &err))
		exit(99);
	for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
		int got = 0;

		for (size_t i = 0; i < 8; i++)
			v.data[i] = i == 5 ? cases[c].x : 7;
		if (ct_nifti_write("c.nii", &v, cases[c].type, false, &env, &err) == 0) {
			f = fopen("c.nii", "rb");
			if (!f || fread(head, 1, sizeof head, f) != sizeof head)
				exit(99);
			fclose(f);
			got = head[70];
			ct_vol_read("c.nii", &w, &err);
			if (cases[c].back && w.data[5] != (float)cases[c].back)
				got = -1;
			ct_vol_free(&w);
		}
		OK(got == cases[c].want, "%g as type %d is stored as %d", (double)cases[c].x,
			(int)cases[c].type, cases[c].want);
		unlink("c.nii");
	}
	ct_vol_free(&v);
	if (ct_vol_alloc(&v, (const size_t[3]){2, 400, 2}, &err))
		exit(99);
	memset(v.data, 0, ct_vol_count(&v) * sizeof *v.data);
	v.affine[0][1] = 0.0009;
	OK(ct_vol_write("c.nii", &v, &env, &err) && err.code == CT_EGEOM &&
			access("c.nii", F_OK) != 0,
		"shear is refused on output");
	ct_vol_free(&v);
	if (ct_vol_alloc(&v, n, &err))
		exit(99);
	for (size_t i = 0; i < ct_vol_count(&v); i++)
		v.data[i] = (float)(i % 1000);
	OK(ct_vol_write("c.nii", &v, &env, &err) == 0 && ct_vol_read("c.nii", &w, &err) == 0 &&
			w.n[0] == 33000 && w.data[65999] == 999,
		"a dimension above 32767 is written and read");
	f = fopen("c.nii", "rb");
	if (!f || fread(head, 1, 8, f) != 8)
		exit(99);
	fclose(f);
	OK(head[0] == 28 && head[1] == 2 && memcmp(head + 4, "n+2", 4) == 0, "as NIfTI-2");
	unlink("c.nii");
	ct_vol_free(&v);
	ct_vol_free(&w);
}

static void test_names(void)
{
	static const struct {
		const char *path, *name;
	} c[] = {{"a/b.nii", "b.nii xxh3:"}, {"scan/", "scan xxh3:"}, {"/x/scan//", "scan xxh3:"},
		{"-", "- xxh3:"}, {"plain", "plain xxh3:"}};
	struct ct_meta m = {0};

	for (size_t i = 0; i < sizeof c / sizeof c[0]; i++)
		OK(ct_meta_input(&m, c[i].path, 0, NULL, &err) == 0 &&
				strncmp(ct_meta_get(&m, "input"), c[i].name, strlen(c[i].name)) ==
					0,
			"%s is called by its last part", c[i].path);
	/* the XXH3-128 of nothing, as its authors give it */
	OK(strcmp(ct_meta_get(&m, "input"), "plain xxh3:99aa06d3014798d86001c324468d497f") == 0,
		"known hash");
	ct_meta_free(&m);
}

int main(void)
{
	char dir[] = "/tmp/t-nifti.XXXXXX";

	if (!mkdtemp(dir) || chdir(dir) != 0)
		return 99;
	test_names();
	test_types();
	test_geometry();
	test_refusals();
	test_huge();
	test_truncation();
	test_extensions();
	test_writing();
	test_choice();
	if (chdir("/") != 0 || rmdir(dir) != 0)
		OK(0, "%s is left empty", dir);
	return tap_done();
}
