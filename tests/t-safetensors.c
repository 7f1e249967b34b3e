/* safetensors: every dtype, bit-exact round trips, damaged and hostile headers.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/voxels.h"
#include "formats/io.h"
#include "tap.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const struct ct_env force = {.files = &(const struct ct_io_rule){.force = true}};
static char path[] = "/tmp/t-safetensors-XXXXXX";

static void save(const char *header, const void *data, size_t bytes)
{
	const uint64_t n = strlen(header);
	FILE *f = fopen(path, "wb");

	if (!f || fwrite(&n, 1, 8, f) != 8 || fwrite(header, 1, n, f) != n ||
		(bytes && fwrite(data, 1, bytes, f) != bytes) || fclose(f) != 0)
		exit(99);
}

static unsigned char *load(size_t *n)
{
	unsigned char *p = malloc(1 << 20);
	FILE *f = fopen(path, "rb");

	if (!p || !f)
		exit(99);
	*n = fread(p, 1, 1 << 20, f);
	fclose(f);
	return p;
}

static float from_half(uint16_t h)
{
	float x;

	ct_voxels_float(1, &x, CT_V_F16, &h, 1, 0);
	return x;
}

static double half_value(unsigned h)
{
	const int exponent = (int)(h >> 10 & 31), rest = (int)(h & 1023);
	const double x = exponent == 31 ? rest ? (double)NAN : (double)INFINITY
			 : exponent     ? ldexp(1024 + rest, exponent - 25)
					: ldexp(rest, -24);

	return h & 0x8000 ? -x : x;
}

static void test_half(void)
{
	static uint16_t each[65536];
	static float value[65536];
	float brain[2];
	size_t bad = 0;
	struct {
		float x;
		uint16_t h;
	} known[] = {{1, 0x3c00}, {-2, 0xc000}, {65504, 0x7bff}, {65519.996f, 0x7bff},
		{65520, 0x7c00}, {0x1p-24f, 1}, {0x1p-25f, 0}, {0x1.8p-25f, 1}, {-0.0f, 0x8000},
		{0x1.ff8p-15f, 0x03ff}, {0x1.ffcp-15f, 0x0400}, {1 + 0x1p-11f, 0x3c00},
		{1 + 0x1.8p-10f, 0x3c02}, {INFINITY, 0x7c00}, {0.333251953125f, 0x3555}};

	for (size_t i = 0; i < sizeof known / sizeof *known; i++)
		OK(ct_voxel_half(known[i].x) == known[i].h, "%a is %04x", (double)known[i].x,
			known[i].h);
	for (unsigned h = 0; h < 65536; h++) {
		float x = from_half((uint16_t)h);

		bad += isnan(x) ? !isnan(from_half(ct_voxel_half(x))) : ct_voxel_half(x) != h;
	}
	OK(bad == 0, "all 65536 halves come back");
	for (unsigned h = 0; h < 65536; h++)
		each[h] = (uint16_t)h;
	ct_voxels_float(65536, value, CT_V_F16, each, 1, 0);
	for (unsigned h = 0; h < 65536; h++)
		bad += isnan(half_value(h)) ? !isnan(value[h]) : (double)value[h] != half_value(h);
	OK(bad == 0, "all 65536 halves have their values, infinity too");
	for (uint64_t i = 0; i < 20000; i++) { /* nearest: no neighbour is closer */
		float x = ct_rng_normal(1, 2, i) * (i % 2 ? 1 : 1e-4f), d;
		uint16_t h = ct_voxel_half(x);

		d = fabsf(from_half(h) - x);
		bad += d > fabsf(from_half((uint16_t)(h + 1)) - x);
		bad += (h & 0x7fff) && d > fabsf(from_half((uint16_t)(h - 1)) - x);
	}
	OK(bad == 0, "rounding is to the nearest");
	ct_voxels_float(2, brain, CT_V_BF16, (uint16_t[]){0xbf80, 0x4049}, 1, 0);
	OK(brain[0] == -1 && brain[1] == 3.140625f, "bfloat16");
}

static bool same(const struct ct_tensors *a, const struct ct_tensors *b)
{
	bool good = a->n == b->n;

	for (size_t i = 0; good && i < a->n; i++) {
		const struct ct_tensor *p = &a->t[i], *q = &b->t[i];

		good = strcmp(p->name, q->name) == 0 && p->rank == q->rank &&
		       memcmp(p->dim, q->dim, p->rank * sizeof *p->dim) == 0 &&
		       memcmp(p->data, q->data, ct_tensor_count(p) * sizeof *p->data) == 0;
	}
	return good;
}

static void add(struct ct_tensors *w, const char *name, size_t rank, const size_t *dim)
{
	struct ct_tensor *t;
	struct ct_err e;

	if (ct_tensors_add(w, name, rank, dim, &t, &e))
		exit(99);
	ct_rng_normals(ct_tensor_count(t), t->data, 5, w->n, 0);
}

static void test_round_trip(void)
{
	struct ct_err e = {0};
	struct ct_tensors w = {0}, v = {0};
	unsigned char *p, *q;
	size_t n, m, worst = 0;
	uint64_t header;

	add(&w, "input_blocks.0.0.weight", 4, (size_t[]){3, 5, 1, 7});
	add(&w, "empty", 2, (size_t[]){0, 4});
	add(&w, "scalar", 0, NULL);
	add(&w, "a \"name\"\n\xc3\xa4", 1, (size_t[]){9000});
	w.t[0].data[3] = -0.0f;
	w.t[0].data[4] = INFINITY;
	ct_meta_set(&w.meta, "arch", "{\"channels\": 64}", &e);
	ct_meta_set(&w.meta, "history", "one\ntwo \xff", &e);
	ct_meta_set(&w.meta, "input", "x", &e);
	OK(ct_tensors_write(path, &w, false, &force, &e) == 0, "written %s", e.msg);
	OK(ct_tensors_read(path, &v, &e) == 0 && same(&w, &v), "and read to the bit %s", e.msg);
	ct_tensors_free(&v);
	v.together = true;
	OK(ct_tensors_read(path, &v, &e) == 0 && same(&w, &v) && v.t[0].lent && v.spare == 0,
		"read together they are the same, in one block that they fill");
	OK(v.meta.n == 3 && strcmp(ct_meta_get(&v.meta, "arch"), "{\"channels\": 64}") == 0 &&
			strcmp(ct_meta_get(&v.meta, "history"), "one\ntwo ?") == 0,
		"with its metadata, made UTF-8");
	OK(strstr(ct_meta_get(&v.meta, "input"), " xxh3:") != NULL, "and a hash");
	p = load(&n);
	memcpy(&header, p, 8);
	OK(header % 8 == 0 && p[8] == '{', "data begin at a multiple of eight");
	OK(ct_tensors_write(path, &v, false, &force, &e) == 0, "written again");
	q = load(&m);
	ct_tensors_free(&v);
	ct_meta_set(&w.meta, "history", "one\ntwo ?", &e);
	OK(n == m && memcmp(p, q, n) == 0, "the same bytes");
	free(q);
	OK(ct_tensors_write(path, &w, true, &force, &e) == 0 && ct_tensors_read(path, &v, &e) == 0,
		"in half precision");
	for (size_t i = 0; i < w.n; i++)
		for (size_t k = 0; k < ct_tensor_count(&w.t[i]); k++)
			worst += v.t[i].data[k] != from_half(ct_voxel_half(w.t[i].data[k]));
	OK(worst == 0, "every value is the nearest half");
	ct_tensors_free(&v);
	ct_tensors_free(&w);
	free(p);
}

static void test_types(void)
{
	enum { TYPES = 13 };
	static const struct __attribute__((packed)) {
		double f64[2];
		int64_t i64[2];
		float f32[2];
		int32_t i32[2];
		uint16_t f16[2], bf16[2];
		int16_t i16[2];
		int8_t i8[2];
		uint8_t u8[2], truth[2];
		uint16_t u16[2];
		uint32_t u32[2];
		uint64_t u64[2];
	} data = {{0.5, -3}, {7, -9}, {1.25f, -2}, {70000, -70000}, {0x3c00, 0xc000},
		{0x3f80, 0xc040}, {300, -300}, {100, -100}, {200, 3}, {2, 0}, {65535, 3},
		{UINT32_C(4294967040), 4}, {UINT64_C(1) << 63, 5}};
	static const float want[TYPES][2] = {{0.5f, -3}, {7, -9}, {1.25f, -2}, {70000, -70000},
		{1, -2}, {1, -3}, {300, -300}, {100, -100}, {200, 3}, {1, 0}, {65535, 3},
		{4294967040.0f, 4}, {0x1p63f, 5}};
	static const char *const names[] = {"F64", "I64", "F32", "I32", "F16", "BF16", "I16", "I8",
		"U8", "BOOL", "U16", "U32", "U64"};
	static const int bytes[] = {8, 8, 4, 4, 2, 2, 2, 1, 1, 1, 2, 4, 8};
	struct ct_err e = {0};
	struct ct_tensors w = {0};
	char header[2000] = "{";
	size_t at = 0, used = 1;

	for (int i = TYPES - 1; i >= 0; i--) { /* the header in the opposite order of the data */
		at = 0;
		for (int k = 0; k < i; k++)
			at += 2 * (size_t)bytes[k];
		used += (size_t)snprintf(header + used, sizeof header - used,
			"\"%s\":{\"dtype\":\"%s\",\"shape\":[2],\"data_offsets\":[%zu,%zu]}%s",
			names[i], names[i], at, at + 2 * (size_t)bytes[i], i ? "," : "}  ");
	}
	save(header, &data, sizeof data);
	OK(ct_tensors_read(path, &w, &e) == 0 && w.n == TYPES, "all types %s", e.msg);
	for (size_t i = 0; i < TYPES && w.n == TYPES; i++)
		OK(strcmp(w.t[i].name, names[i]) == 0 && w.t[i].data[0] == want[i][0] &&
				w.t[i].data[1] == want[i][1],
			"%s", names[i]);
	ct_tensors_free(&w);
}

static void refused(const char *header, size_t bytes, const char *words)
{
	static const unsigned char data[64];
	struct ct_err e = {0};
	struct ct_tensors w = {0};
	int rc;

	save(header, data, bytes);
	rc = ct_tensors_read(path, &w, &e);
	OK(rc < 0 && e.code == CT_EINPUT && strstr(e.msg, path) && strstr(e.msg, words) && !w.t,
		"refused: %s", e.msg);
}

#define ONE(type, shape, at)                                                                       \
	"{\"x\":{\"dtype\":\"" type "\",\"shape\":" shape ",\"data_offsets\":" at "}}"

static void test_hostile(void)
{
	struct ct_err e = {0};
	struct ct_tensors w = {0};
	uint64_t n = UINT64_MAX;
	FILE *f = fopen(path, "wb");

	if (!f || fwrite(&n, 1, 8, f) != 8 || fclose(f) != 0)
		exit(99);
	OK(ct_tensors_read(path, &w, &e) < 0 && e.code == CT_EINPUT, "a header of 2^64-1 bytes: %s",
		e.msg);
	refused("[1]", 0, "not a safetensors");
	refused("{ ", 0, "not a JSON object");
	refused("{\"x\":1}", 0, "dtype");
	refused("{\"__metadata__\":{\"a\":1}}", 0, "not a string");
	refused("{\"__metadata__\":[]}", 0, "__metadata__");
	refused(ONE("Q4", "[1]", "[0,4]"), 4, "dtype Q4");
	refused(ONE("F32", "[1]", "[0,4]"), 3, "ends at byte");
	refused(ONE("F32", "[2]", "[0,4]"), 4, "need 8 bytes");
	refused(ONE("F32", "[-1]", "[0,4]"), 4, "not a size");
	refused(ONE("F32", "[1.5]", "[0,4]"), 4, "not a size");
	refused(ONE("F32", "[1]", "[4,0]"), 4, "data_offsets");
	refused(ONE("F32", "[1]", "[-4,0]"), 4, "data_offsets");
	refused(ONE("F32", "[1]", "[0]"), 4, "data_offsets");
	refused(ONE("F32", "[0]", "[0,\"0\"]"), 4, "data_offsets");
	refused(ONE("F32", "[0]", "[\"0\",0]"), 4, "data_offsets");
	refused(ONE("F32", "[1]", "[0,4,8]"), 4, "data_offsets");
	refused(ONE("F32", "1", "[0,4]"), 4, "shape");
	refused(ONE("F32", "[1,1,1,1,1,1,1,1,1]", "[0,4]"), 4, "at most 8");
	refused(ONE("F32", "[4294967296,4294967296]", "[0,0]"), 4, "overflows");
	refused(ONE("F64", "[4611686018427387904]", "[0,0]"), 4, "overflows");
	refused(ONE("F32", "[1]", "[9223372036854775804,9223372036854775807]"), 4, "need 4 bytes");
	refused("{\"x\":{\"dtype\":\"F32\",\"shape\":[2],\"data_offsets\":[0,8]},"
		"\"y\":{\"dtype\":\"F32\",\"shape\":[1],\"data_offsets\":[4,8]}}",
		8, "tensor 'y': does not begin where");
	refused(ONE("F32", "[1]", "[4,8]"), 8, "does not begin where");
	refused("{\"x\":{},\"x\":{}}", 8, "duplicate");
}

static int read_stream(FILE *f, struct ct_tensors *w, struct ct_err *e)
{
	struct ct_any a = {0};
	int rc = ct_format_read_stream(&ct_format_safetensors, f, "x", &a, e);

	*w = a.tensors;
	return rc;
}

/* Tensors in any order; from a file and from a stream. */
static void test_order(void)
{
	static const char header[] =
		"{\"late\":{\"dtype\":\"F32\",\"shape\":[2],\"data_offsets\":[5,13]},"
		"\"first\":{\"dtype\":\"U8\",\"shape\":[3],\"data_offsets\":[0,3]},"
		"\"none\":{\"dtype\":\"F32\",\"shape\":[0],\"data_offsets\":[0,0]},"
		"\"also\":{\"dtype\":\"F32\",\"shape\":[4,0],\"data_offsets\":[0,0]},"
		"\"cube\":{\"dtype\":\"U8\",\"shape\":[1,1,1,1,1,1,1,2],\"data_offsets\":[3,5]}}";
	static const char *const names[] = {"none", "also", "first", "cube", "late"};
	unsigned char data[13] = {1, 2, 3, 4, 5};
	struct ct_err e = {0};
	struct ct_tensors w = {0};
	size_t n, bad = 0;
	unsigned char *p;
	char cat[100];
	FILE *f;
	int rc;

	memcpy(data + 5, &(float[2]){6, 7}, 8);
	save(header, data, sizeof data);
	p = load(&n);
	snprintf(cat, sizeof cat, "cat %s", path);
	for (int stream = 0; stream < 3; stream++) {
		w = (struct ct_tensors){0};
		f = stream < 2 ? fmemopen(p, n, "rb") : popen(cat, "r");
		rc = stream ? read_stream(f, &w, &e) : ct_tensors_read(path, &w, &e);
		OK(rc == 0 && w.n == 5, "five tensors %s", e.msg);
		for (size_t i = 0; i < w.n; i++)
			bad += strcmp(w.t[i].name, names[i]) != 0;
		OK(bad == 0, "in the order of their bytes");
		OK(w.n == 5 && w.t[2].data[0] == 1 && w.t[2].data[2] == 3 && w.t[3].data[1] == 5 &&
				w.t[4].data[0] == 6 && w.t[4].data[1] == 7,
			"wherever they are");
		OK(w.n == 5 && w.t[3].rank == 8 && w.t[3].dim[7] == 2 && w.t[1].dim[0] == 4,
			"their shapes");
		ct_tensors_free(&w);
		if (stream < 2)
			fclose(f);
		else
			pclose(f);
	}
	for (size_t cut = 0; cut < 3; cut++) {
		static const size_t lost[] = {1, 9, 12};
		static const char *const words[] = {"x: tensor 'late': the file ends inside",
			"x: tensor 'cube': the file ends inside",
			"x: tensor 'first': the file ends inside"};

		f = fmemopen(p, n - lost[cut], "rb");
		OK(read_stream(f, &w, &e) == -1 && e.code == CT_EINPUT &&
				strstr(e.msg, words[cut]) && !w.t,
			"a stream without the last %zu bytes: %s", lost[cut], e.msg);
		fclose(f);
	}
	free(p);
}

/* The header that is written, to the letter. */
static void test_header(void)
{
	char left[100];
	static const char want[] =
		"{\"__metadata__\":{\"k\":\"v\"},\"x\":{\"dtype\":\"F32\",\"shape\":[3,1],"
		"\"data_offsets\":[0,12]},\"y\":{\"dtype\":\"F32\",\"shape\":[],"
		"\"data_offsets\":[12,16]}}";
	struct ct_err e = {0};
	struct ct_tensors w = {0};
	size_t n, bad = 0;

	add(&w, "x", 2, (size_t[]){3, 1});
	add(&w, "y", 0, NULL);
	ct_meta_set(&w.meta, "input", "of another", &e);
	for (size_t len = 0; len < 9; len++) {
		char value[10] = {0}, text[200];
		unsigned char *p;
		size_t size;

		memset(value, 'v', len + 1);
		ct_meta_set(&w.meta, "k", value, &e);
		snprintf(text, sizeof text, "%.22s%s%s", want, value, strchr(want, 'v') + 1);
		size = (strlen(text) + 7) / 8 * 8;
		bad += ct_tensors_write(path, &w, false, &force, &e) != 0;
		p = load(&n);
		bad += n != 8 + size + 16 || p[0] != size || p[1] != 0 ||
		       memcmp(p + 8, text, strlen(text)) != 0;
		for (size_t i = 8 + strlen(text); i < 8 + size && n > 8 + size; i++)
			bad += p[i] != ' ';
		free(p);
	}
	OK(bad == 0, "the header of a file");
	ct_meta_free(&w.meta);
	OK(ct_tensors_write(path, &w, true, &force, &e) == 0, "without metadata, as halves");
	free(load(&n));
	OK(n == 8 + 112 + 8, "%zu bytes", n);
	ct_tensors_free(&w);
	add(&w, "not \xff UTF-8", 1, (size_t[]){1});
	OK(ct_tensors_write(path, &w, false, &force, &e) == -1 && e.code == CT_EOUTPUT &&
			strstr(e.msg, "not UTF-8"),
		"a name that is no text: %s", e.msg);
	snprintf(left, sizeof left, "! ls -d .ctsr-* %s.ct-* 2>/dev/null", path);
	OK(system(left) == 0, "leaves no file");
	ct_tensors_free(&w);
}

/* The metadata alone; so many keys and no more. */
static void test_meta(void)
{
	struct ct_err e = {0};
	struct ct_tensors w = {0};
	struct ct_meta m;

	save("{\"__metadata__\":{\"a\":\"1\",\"\":\"no key\",\"b\":\"2\"}}", NULL, 0);
	OK(ct_tensors_read_meta(path, &m, &e) == 0 && m.n == 2 &&
			strcmp(ct_meta_get(&m, "b"), "2") == 0,
		"metadata alone %s", e.msg);
	ct_meta_free(&m);
	OK(ct_tensors_read(path, &w, &e) == 0 && w.n == 0 && w.meta.n == 3, "or with no tensors");
	ct_tensors_free(&w);
	save("{\"__metadata__\":{\"a\":\"1\",\"b\":2}}", NULL, 0);
	OK(ct_tensors_read_meta(path, &m, &e) == -1 && e.code == CT_EINPUT && m.n == 0, "%s",
		e.msg);
	save("{}", NULL, 0);
	OK(ct_tensors_read_meta(path, &m, &e) == 0 && m.n == 0, "none");
	save("{", NULL, 0);
	OK(ct_tensors_read_meta(path, &m, &e) == -1 && strstr(e.msg, "header of 1 bytes"), "less");
	OK(ct_tensors_read_meta("/no/such", &m, &e) == -1 && e.code == CT_EINPUT, "no file");
	for (int count = 4096; count <= 4097; count++) {
		char *text = NULL;
		size_t n;
		FILE *f = open_memstream(&text, &n);

		for (int i = 0; i < count; i++)
			fprintf(f, "%s\"%d\":\"\"", i ? "," : "{\"__metadata__\":{", i);
		fprintf(f, "}}");
		fclose(f);
		save(text, NULL, 0);
		free(text);
		OK(ct_tensors_read_meta(path, &m, &e) == (count == 4096 ? 0 : -1), "%d keys",
			count);
		ct_meta_free(&m);
	}
}

/* For its owner alone, over what is there. */
static void test_private(void)
{
	struct ct_err e = {0};
	struct ct_tensors w = {0}, v = {0};
	struct stat st;

	add(&w, "x", 1, (size_t[]){3});
	chmod(path, 0644);
	OK(ct_tensors_write_private(path, &w, &e) == 0 && stat(path, &st) == 0 &&
			(st.st_mode & 0777) == 0600,
		"a private file");
	OK(ct_tensors_read(path, &v, &e) == 0 && same(&w, &v), "holds them, too");
	ct_tensors_free(&v);
	ct_tensors_free(&w);
}

/* The hash is of names, shapes and each number. */
static void test_hash(void)
{
	struct ct_err e = {0};
	struct ct_tensors w = {0}, v = {0};
	char hash[2][100];
	size_t alike = 0;

	add(&w, "ab", 2, (size_t[]){2, 3});
	add(&w, "c", 1, (size_t[]){1});
	for (int i = 0; i <= 9; i++) {
		float *x = i && i <= 6 ? w.t[0].data + i - 1 : i == 7 ? w.t[1].data : NULL;
		const float was = x ? *x : 0;

		if (x)
			*x = was + 1;
		if (i == 8)
			w.t[0].dim[0] = 3, w.t[0].dim[1] = 2;
		if (i == 9)
			w.t[1].name[0] = 'd';
		if (ct_tensors_write(path, &w, false, &force, &e) || ct_tensors_read(path, &v, &e))
			exit(99);
		snprintf(hash[i > 0], sizeof hash[0], "%s", ct_meta_get(&v.meta, "input"));
		alike += i && strcmp(hash[0], hash[1]) == 0;
		ct_tensors_free(&v);
		if (x)
			*x = was;
		if (i == 8)
			w.t[0].dim[0] = 2, w.t[0].dim[1] = 3;
	}
	OK(alike == 0, "each name, shape and number changes the hash");
	ct_tensors_free(&w);
}

static void test_cut(void)
{
	struct ct_err e = {0};
	struct ct_tensors w = {0}, v = {0};
	unsigned char *p;
	size_t n, read = 0;

	add(&w, "x", 1, (size_t[]){3});
	add(&w, "y", 1, (size_t[]){2});
	if (ct_tensors_write(path, &w, false, &force, &e))
		exit(99);
	p = load(&n);
	for (size_t cut = 0; cut < n; cut++) {
		FILE *f = fopen(path, "wb");

		if (!f || fwrite(p, 1, cut, f) != cut || fclose(f) != 0)
			exit(99);
		e = (struct ct_err){0};
		read += ct_tensors_read(path, &v, &e) == 0 || e.code != CT_EINPUT ||
			!strstr(e.msg, path);
	}
	OK(read == 0, "cut at any of %zu bytes it is refused", n);
	free(p);
	ct_tensors_free(&w);
}

int main(void)
{
	int fd;

	fd = mkstemp(path);
	if (fd < 0)
		exit(99);
	close(fd);
	test_half();
	test_round_trip();
	test_types();
	test_order();
	test_header();
	test_meta();
	test_private();
	test_hash();
	test_hostile();
	test_cut();
	unlink(path);
	return tap_done();
}
