/* Numbers of any type and byte order to float and back, voxels without a header, numpy's arrays.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "formats/raw.h"
#include "nifti-make.h"
#include "tap.h"

#include <unistd.h>

static const struct type {
	const char *raw, *npy;
	enum ct_voxel type;
	size_t bytes;
	bool real;
	double lo, hi; /* exact in float */
} types[] = {
	{"u8", "u1", CT_V_U8, 1, false, 0, 255},
	{"i8", "i1", CT_V_I8, 1, false, -128, 127},
	{"u16", "u2", CT_V_U16, 2, false, 0, 65535},
	{"i16", "i2", CT_V_I16, 2, false, -32768, 32767},
	{"u32", "u4", CT_V_U32, 4, false, 0, 4294967040.0},
	{"i32", "i4", CT_V_I32, 4, false, -2147483648.0, 16777215},
	{"f32", "f4", CT_V_F32, 4, true, -1234.5, 3.25e7},
	{"f64", "f8", CT_V_F64, 8, true, -0.0009765625, 1e6},
	{NULL, "u8", CT_V_U64, 8, false, 0, 1099511627776.0},
	{NULL, "i8", CT_V_I64, 8, false, -9223372036854775808.0, 1099511627776.0},
};
static char path[] = "/tmp/t-raw-XXXXXX";

static double sample(const struct type *t, size_t i)
{
	return i % 5 == 0 ? t->lo : i % 5 == 1 ? t->hi : (double)(i % 100);
}

/* The file: a text, then n numbers. */
static void save(const char *head, size_t size, const struct type *t, bool big, size_t n)
{
	struct made m = {1, big, calloc(n + 1, t->bytes), n * t->bytes};
	FILE *f = fopen(path, "wb");

	if (!f || !m.p)
		exit(99);
	for (size_t i = 0; i < n; i++)
		if (t->real)
			put_real(&m, i * t->bytes, t->bytes, sample(t, i));
		else
			put_int(&m, i * t->bytes, t->bytes, (int64_t)sample(t, i));
	if (fwrite(head, 1, size, f) != size || fwrite(m.p, 1, m.n, f) != m.n || fclose(f) != 0)
		exit(99);
	free(m.p);
}

static bool says(int rc, enum ct_code code, const char *words)
{
	const bool good = rc == -1 && err.code == code && strstr(err.msg, words);

	if (!good)
		printf("# %d, code %d: %s\n", rc, (int)err.code, err.msg);
	err = (struct ct_err){0};
	return good;
}

static void test_types(void)
{
	enum ct_voxel type;
	bool big = true;

	for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
		const struct type *t = &types[i];
		char word[16];

		OK(ct_voxel_bytes((int)t->type) == t->bytes, "%zu bytes of %s", t->bytes, t->npy);
		if (!t->raw)
			continue;
		for (int k = 0; k < 3; k++) {
			static const char *const ends[] = {"", ":le", ":be"};

			snprintf(word, sizeof word, "%s%s", t->raw, ends[k]);
			OK(ct_raw_type(word, &type, &big, &err) == 0 && type == t->type &&
					big == (k == 2),
				"%s", word);
		}
	}
	OK(ct_voxel_bytes(0) == 0 && ct_voxel_bytes(1) == 0 && ct_voxel_bytes(32) == 0, "no other");
	for (size_t i = 0; i < 8; i++) {
		static const char *const bad[] = {
			"", "u", "u88", "u16:", "u16:b", "u16:bee", ":be", "i24"};

		OK(says(ct_raw_type(bad[i], &type, &big, &err), CT_EUSAGE, bad[i]), "'%s' is none",
			bad[i]);
	}
}

/* All words of three letters: those that name each pair once, the first of it being +. */
static void test_axes(void)
{
	static const char letters[] = "RLAPSIX";
	size_t bad = 0, good = 0;

	for (int i = 0; i < 7 * 7 * 7; i++) {
		const int at[3] = {i % 7, i / 7 % 7, i / 49};
		const char word[4] = {letters[at[0]], letters[at[1]], letters[at[2]], 0};
		bool fine = true;
		int world[3], sign[3], rc = ct_raw_axes("orient", word, world, sign, &err);

		for (int d = 0; d < 3; d++)
			fine &= at[d] != 6 && at[d] / 2 != at[(d + 1) % 3] / 2;
		bad += (rc == 0) != fine;
		good += fine;
		for (int d = 0; d < 3 && fine; d++)
			bad += world[d] != at[d] / 2 || sign[d] != (at[d] % 2 ? -1 : 1);
	}
	OK(bad == 0 && good == 48, "%zu words of axes", good);
	for (size_t i = 0; i < 4; i++) {
		static const char *const no[] = {"", "RA", "RASX", "RASR"};
		int world[3], sign[3];

		OK(says(ct_raw_axes("orient", no[i], world, sign, &err), CT_EUSAGE, "--orient: '"),
			"'%s' is none", no[i]);
	}
}

static void test_voxels(void)
{
	float in[131], out[1];
	int16_t back[131];
	const int64_t odd = INT64_C(0x4000004000000001); /* not to be rounded twice */
	size_t bad = 0;

	for (double x = -33000; x < 33000; x += 0.25 * 131) {
		bool whole = true, fit = true, rounded, exact;

		for (int i = 0; i < 131; i++) {
			in[i] = (float)(x + 0.25 * i);
			whole &= in[i] == floorf(in[i]);
			fit &= rintf(in[i]) >= -32768 && rintf(in[i]) <= 32767;
		}
		rounded = ct_voxels_i16(131, back, in, false);
		for (int i = 0; i < 131 && fit; i++)
			bad += (float)back[i] != rintf(in[i]);
		exact = ct_voxels_i16(131, back, in, true);
		bad += rounded != fit || exact != (fit && whole);
		for (int i = 0; i < 131; i++) {
			const bool may = rintf(in[i]) >= -32768 && rintf(in[i]) <= 32767;

			bad += ct_voxels_i16(1, back, in + i, false) != may;
			bad += ct_voxels_i16(1, back, in + i, true) !=
			       (may && in[i] == floorf(in[i]));
		}
	}
	for (int i = 0; i < 131; i++)
		in[i] = (float)(0.1 * i);
	bad += !ct_voxels_i16(131, back, in, false) || ct_voxels_i16(131, back, in, true);
	for (int i = 0; i < 131; i++)
		bad += (float)back[i] != rintf(in[i]);
	OK(bad == 0, "numbers to int16");
	ct_voxels_float(1, out, CT_V_I64, &odd, 1, 0);
	OK(out[0] == 0x1.000002p62f, "int64 is rounded once");
	ct_voxels_float(1, out, CT_V_I64, &(int64_t){3}, 1, 0.5);
	OK(out[0] == 3.5f, "an offset alone");
	ct_voxels_float(1, out, CT_V_U8, &(uint8_t){3}, -2, 0);
	OK(out[0] == -6, "a slope alone");
}

/* More than one block, and less; either byte order; scaled. */
static void test_raw(void)
{
	static const size_t sizes[][3] = {{7, 5, 3}, {64, 64, 70}, {1, 1, 1}};

	for (size_t i = 0; i < 8; i++)
		for (int variant = 0; variant < 6; variant++) {
			const struct type *t = &types[i];
			struct ct_raw how = {.type = t->type,
				.big = variant & 1,
				.spacing = {0.5, 2, 3},
				.slope = 1,
				.world = {1, 2, 0},
				.sign = {1, -1, 1}};
			struct ct_vol v = {0};
			size_t bad = 0, n;

			memcpy(how.n, sizes[variant / 2], sizeof how.n);
			n = how.n[0] * how.n[1] * how.n[2];
			if (variant & 1) {
				how.slope = 0.5;
				how.inter = -1024;
			}
			save("", 0, t, how.big, n);
			must(ct_raw_read(path, &how, &v, &err));
			for (size_t k = 0; k < n; k++)
				bad += v.data[k] != (float)(how.slope * sample(t, k) + how.inter);
			OK(bad == 0 && memcmp(v.n, how.n, sizeof v.n) == 0, "%zu voxels of %s%s", n,
				t->raw, how.big ? ", big-endian" : "");
			for (int a = 0; a < 3; a++)
				for (int d = 0; d < 3; d++)
					bad += v.affine[a][d] !=
					       (how.world[d] == a ? how.sign[d] * how.spacing[d]
								  : 0);
			for (int d = 0; d < 3; d++) /* half the grid from the centre */
				bad += fabs(v.affine[how.world[d]][3] +
					       how.sign[d] * how.spacing[d] *
						       ((double)how.n[d] - 1) / 2) > 1e-9;
			OK(bad == 0, "in their place");
			ct_vol_free(&v);
			save("", 0, t, false, n - 1);
			OK(says(ct_raw_read(path, &how, &v, &err), CT_EINPUT, ": truncated") &&
					!v.data,
				"too few");
			save("x", 1, t, false, n);
			OK(says(ct_raw_read(path, &how, &v, &err), CT_EINPUT, ": longer") &&
					!v.data,
				"too many");
		}
}

/* The hash is of the geometry and each voxel. */
static void test_hash(void)
{
	struct ct_raw how = {.n = {3, 3, 3},
		.type = CT_V_U8,
		.slope = 1,
		.spacing = {1, 1, 1},
		.world = {0, 1, 2},
		.sign = {1, 1, 1}};
	struct ct_vol v = {0};
	char hash[2][100], text[28];
	size_t same = 0;

	for (int i = 0; i <= 30; i++) {
		memset(text, 'a', sizeof text);
		if (i && i <= 27)
			text[i - 1] = 'b';
		if (i > 27)
			how.spacing[i - 28] = 1.5;
		save(text, 27, &types[0], false, 0);
		must(ct_raw_read(path, &how, &v, &err));
		snprintf(hash[i > 0], sizeof hash[0], "%s", ct_meta_get(&v.meta, "input"));
		same += i && strcmp(hash[0], hash[1]) == 0;
		ct_vol_free(&v);
		if (i > 27)
			how.spacing[i - 28] = 1;
	}
	OK(same == 0, "each voxel and size changes the hash");
	how.spacing[1] = 0;
	OK(says(ct_raw_read(path, &how, &v, &err), CT_EGEOM, path) && !v.data, "a size of 0");
	OK(says(ct_raw_read("/no/such", &how, &v, &err), CT_EINPUT, "/no/such"), "no file");
}

/* A file of numpy's: head of a version with this dict, padded to `pad` bytes, and n numbers. */
static void save_npy(
	int version, const char *dict, size_t pad, const struct type *t, bool big, size_t n)
{
	char *head = calloc(pad + strlen(dict) + 20, 1);
	const size_t lead = version > 1 ? 12 : 10, size = pad > strlen(dict) ? pad : strlen(dict);

	if (!head)
		exit(99);
	memcpy(head, "\x93NUMPY", 6);
	head[6] = (char)version;
	for (size_t i = 8; i < lead; i++)
		head[i] = (char)(size >> 8 * (i - 8));
	memset(head + lead, ' ', size);
	memcpy(head + lead, dict, strlen(dict));
	save(head, lead + size, t, big, n);
	free(head);
}

static void test_npy_types(void)
{
	static const char orders[] = "<>|=";
	float *data;

	for (size_t i = 0; i < sizeof types / sizeof *types; i++)
		for (int k = 0; k < 16; k++) {
			const struct type *t = &types[i];
			const char quote = k & 4 ? '"' : '\'';
			const int version = 1 + k % 3;
			const size_t count = k & 8 ? 3 : 20000;
			size_t n[3] = {0}, bad = 0;
			char dict[200];

			snprintf(dict, sizeof dict,
				"{'descr': %c%c%s%c, 'fortran_order': False, 'shape': (2, %zu, 3), }",
				quote, orders[k % 4], t->npy, quote, count);
			save_npy(version, dict, k & 1 ? version > 1 ? 65536 : 777 : 0, t,
				k % 4 == 1, count * 6);
			must(ct_raw_npy(path, k & 2 ? 0.5 : 1, k & 2 ? 3 : 0, n, &data, &err));
			for (size_t j = 0; j < count * 6; j++)
				bad += data[j] !=
				       (float)(k & 2 ? 0.5 * sample(t, j) + 3 : sample(t, j));
			OK(bad == 0 && n[0] == 2 && n[1] == count && n[2] == 3,
				"%zu of type %c%s, version %d", count * 6, orders[k % 4], t->npy,
				version);
			free(data);
		}
}

#define DICT(type, order, shape)                                                                   \
	"{'descr': " type ", 'fortran_order': " order ", 'shape': " shape ", }"

static void test_npy(void)
{
	static const struct {
		const char *dict;
		size_t n[3];
	} good[] = {{DICT("'|u1'", "False", "(4, 6)"), {4, 1, 6}},
		{DICT("'|u1'", "False", "(4,6)"), {4, 1, 6}},
		{DICT("'|u1'", "False", "(1, 24, 1)"), {1, 24, 1}},
		{DICT("'|u1'", "False", "(24, 1, )"), {24, 1, 1}},
		{"{\"shape\":(2,3,4),\"fortran_order\":False,\"descr\":\"<u1\"}", {2, 3, 4}},
		{"{ 'shape' : (2, 3, 4) , 'fortran_order' : False, 'descr' : '<u1' }", {2, 3, 4}}};
	static const struct {
		const char *dict, *words;
	} bad[] = {{DICT("'|u1'", "False", "(24,)"), "two or three"},
		{DICT("'|u1'", "False", "()"), "two or three"},
		{DICT("'|u1'", "False", "(2, 3, 4, 1)"), "two or three"},
		{DICT("'|u1'", "False", "(2, 3, 4"), "two or three"},
		{DICT("'|u1'", "False", "(2, -3, 4)"), "two or three"},
		{DICT("'|u1'", "False", "(2, 0, 4)"), "shape (2, 0, 4) has a length that is none"},
		{DICT("'|u1'", "False", "(2, 2147483648)"), "shape (2, 2147483648) has"},
		{DICT("'|u1'", "False", "(1, 99999999999999999999)"),
			"shape (1, 99999999999999999999) has"},
		{DICT("'|u1'", "True", "(2, 3, 4)"), "fortran_order is not False"},
		{DICT("'|u1'", "False", "(2, 3, 5)"), "truncated file: shorter"},
		{DICT("'|u1'", "False", "(2, 3, 3)"), "longer than its shape"},
		{DICT("'|b1'", "False", "(2, 3, 4)"), "descr '|b1'"},
		{DICT("'|u1\"", "False", "(2, 3, 4)"), "descr '|u1"},
		{DICT("'|u12'", "False", "(2, 3, 4)"), "descr '|u12'"},
		{DICT("'u1'", "False", "(2, 3, 4)"), "descr 'u1'"},
		{DICT("'<f8 and more of it'", "False", "(2, 3, 4)"),
			"descr '<f8 and more of it' is"},
		{DICT("[u1]", "False", "(2, 3, 4)"), "descr [u1]"},
		{"{'fortran_order': False, 'shape': (2, 3, 4)}", "without descr"},
		{"{'descr': '|u1', 'shape': (2, 3, 4)}", "without descr"},
		{"{'descr': '|u1', 'fortran_order': False}", "without descr"},
		{"{'descr' '|u1', 'fortran_order': False, 'shape': (2, 3, 4)}", "without descr"}};
	size_t n[3], cut;
	float *data;

	for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
		save_npy(1, good[i].dict, 118, &types[0], false, 24);
		must(ct_raw_npy(path, 1, 0, n, &data, &err));
		OK(memcmp(n, good[i].n, sizeof n) == 0, "%s", good[i].dict);
		free(data);
	}
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		save_npy(1, bad[i].dict, 118, &types[0], false, 24);
		OK(says(ct_raw_npy(path, 1, 0, n, &data, &err), CT_EINPUT, bad[i].words), "no %s",
			bad[i].dict);
	}
	for (int version = 0; version < 5; version++) {
		save_npy(version, good[0].dict, 118, &types[0], false, 24);
		OK(version % 4 ? ct_raw_npy(path, 1, 0, n, &data, &err) == 0
			       : says(ct_raw_npy(path, 1, 0, n, &data, &err), CT_EINPUT, "version"),
			"version %d", version);
		if (version % 4)
			free(data);
	}
	save("NUMPY, or is it not?", 20, &types[0], false, 24);
	OK(says(ct_raw_npy(path, 1, 0, n, &data, &err), CT_EINPUT,
		   "not a numpy array, nor MATLAB, HDF5, EXR or a picture"),
		"a text");
	save_npy(2, good[0].dict, 65537, &types[0], false, 24);
	OK(says(ct_raw_npy(path, 1, 0, n, &data, &err), CT_EINPUT, "header of 65537"), "too long");
	for (size_t lost = 0, version = 1; version < 3; version++) {
		save_npy((int)version, good[0].dict, 0, &types[0], false, 24);
		for (cut = strlen(good[0].dict) + 8 + 2 * version + 23; cut > 0; cut--) {
			err = (struct ct_err){0};
			lost += truncate(path, (off_t)cut - 1) != 0 ||
				ct_raw_npy(path, 1, 0, n, &data, &err) != -1 ||
				strncmp(err.msg, path, strlen(path)) != 0 ||
				!(strstr(err.msg, ": truncated") || strstr(err.msg, ": not a"));
		}
		OK(lost == 0, "cut anywhere it is refused, version %zu", version);
	}
}

int main(void)
{
	const int fd = mkstemp(path);

	if (fd < 0)
		exit(99);
	close(fd);
	test_types();
	test_axes();
	test_voxels();
	test_raw();
	test_hash();
	test_npy_types();
	test_npy();
	unlink(path);
	return tap_done();
}
