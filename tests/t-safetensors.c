/* safetensors: every dtype, bit-exact round trips, damaged and hostile headers. */
#include "config.h"
#include "core/rng.h"
#include "formats/format.h"
#include "formats/half.h"
#include "tap.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct ct_env force = {.force = true};
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

static void test_half(void)
{
	size_t bad = 0;
	struct {
		float x;
		uint16_t h;
	} known[] = {{1, 0x3c00}, {-2, 0xc000}, {65504, 0x7bff}, {65519.996f, 0x7bff},
		{65520, 0x7c00}, {0x1p-24f, 1}, {0x1p-25f, 0}, {0x1.8p-25f, 1}, {-0.0f, 0x8000},
		{0x1.ff8p-15f, 0x03ff}, {0x1.ffcp-15f, 0x0400}, {1 + 0x1p-11f, 0x3c00},
		{1 + 0x1.8p-10f, 0x3c02}, {INFINITY, 0x7c00}, {0.333251953125f, 0x3555}};

	for (size_t i = 0; i < sizeof known / sizeof *known; i++)
		OK(ct_half_from_float(known[i].x) == known[i].h, "%a is %04x", (double)known[i].x,
			known[i].h);
	for (unsigned h = 0; h < 65536; h++) {
		float x = ct_half_to_float((uint16_t)h);

		bad += isnan(x) ? !isnan(ct_half_to_float(ct_half_from_float(x)))
				: ct_half_from_float(x) != h;
	}
	OK(bad == 0, "all 65536 halves come back");
	for (uint64_t i = 0; i < 20000; i++) { /* nearest: no neighbour is closer */
		float x = ct_rng_normal(1, 2, i) * (i % 2 ? 1 : 1e-4f), d;
		uint16_t h = ct_half_from_float(x);

		d = fabsf(ct_half_to_float(h) - x);
		bad += d > fabsf(ct_half_to_float((uint16_t)(h + 1)) - x);
		bad += (h & 0x7fff) && d > fabsf(ct_half_to_float((uint16_t)(h - 1)) - x);
	}
	OK(bad == 0, "rounding is to the nearest");
	OK(ct_half_from_bfloat(0xbf80) == -1 && ct_half_from_bfloat(0x4049) == 3.140625f,
		"bfloat16");
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
	struct ct_tensors w = {0}, v;
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
			worst += v.t[i].data[k] !=
				 ct_half_to_float(ct_half_from_float(w.t[i].data[k]));
	OK(worst == 0, "every value is the nearest half");
	ct_tensors_free(&v);
	ct_tensors_free(&w);
	free(p);
}

static void test_types(void)
{
	static const struct {
		double f64[2];
		int64_t i64[2];
		float f32[2];
		int32_t i32[2];
		uint16_t f16[2], bf16[2];
		int16_t i16[2];
		int8_t i8[2];
		uint8_t u8[2], truth[2];
	} data = {{0.5, -3}, {7, -9}, {1.25f, -2}, {70000, -70000}, {0x3c00, 0xc000},
		{0x3f80, 0xc040}, {300, -300}, {100, -100}, {200, 3}, {1, 0}};
	static const float want[10][2] = {{0.5f, -3}, {7, -9}, {1.25f, -2}, {70000, -70000},
		{1, -2}, {1, -3}, {300, -300}, {100, -100}, {200, 3}, {1, 0}};
	static const char *const names[] = {
		"F64", "I64", "F32", "I32", "F16", "BF16", "I16", "I8", "U8", "BOOL"};
	static const int bytes[] = {8, 8, 4, 4, 2, 2, 2, 1, 1, 1};
	struct ct_err e = {0};
	struct ct_tensors w;
	char header[2000] = "{";
	size_t at = 0, used = 1;

	for (int i = 9; i >= 0; i--) { /* the header in the opposite order of the data */
		at = 0;
		for (int k = 0; k < i; k++)
			at += 2 * (size_t)bytes[k];
		used += (size_t)snprintf(header + used, sizeof header - used,
			"\"%s\":{\"dtype\":\"%s\",\"shape\":[2],\"data_offsets\":[%zu,%zu]}%s",
			names[i], names[i], at, at + 2 * (size_t)bytes[i], i ? "," : "}  ");
	}
	save(header, &data, 2 * (8 + 8 + 4 + 4 + 2 + 2 + 2 + 1 + 1 + 1));
	OK(ct_tensors_read(path, &w, &e) == 0 && w.n == 10, "ten types %s", e.msg);
	for (size_t i = 0; i < 10 && w.n == 10; i++)
		OK(strcmp(w.t[i].name, names[i]) == 0 && w.t[i].data[0] == want[i][0] &&
				w.t[i].data[1] == want[i][1],
			"%s", names[i]);
	ct_tensors_free(&w);
}

static void refused(const char *header, size_t bytes, const char *words)
{
	static const unsigned char data[64];
	struct ct_err e = {0};
	struct ct_tensors w;
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
	struct ct_tensors w;
	uint64_t n = UINT64_MAX;
	FILE *f = fopen(path, "wb");

	if (!f || fwrite(&n, 1, 8, f) != 8 || fclose(f) != 0)
		exit(99);
	OK(ct_tensors_read(path, &w, &e) < 0 && e.code == CT_EINPUT, "a header of 2^64-1 bytes: %s",
		e.msg);
	refused("[1]", 0, "not a JSON object");
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
	refused(ONE("F32", "[1,1,1,1,1,1,1,1,1]", "[0,4]"), 4, "at most 8");
	refused(ONE("F32", "[4294967296,4294967296]", "[0,0]"), 4, "overflows");
	refused(ONE("F64", "[4611686018427387904]", "[0,0]"), 4, "overflows");
	refused(ONE("F32", "[1]", "[9223372036854775804,9223372036854775807]"), 4, "need 4 bytes");
	refused("{\"x\":{\"dtype\":\"F32\",\"shape\":[2],\"data_offsets\":[0,8]},"
		"\"y\":{\"dtype\":\"F32\",\"shape\":[1],\"data_offsets\":[4,8]}}",
		8, "overlaps");
	refused("{\"x\":{},\"x\":{}}", 8, "duplicate");
}

static void test_cut(void)
{
	struct ct_err e = {0};
	struct ct_tensors w = {0}, v;
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

/* "t-safetensors read FILE": NAME COUNT MEAN of every tensor, for t-safetensors.sh. */
static int print_means(const char *file)
{
	struct ct_err e = {0};
	struct ct_tensors w;

	if (ct_tensors_read(file, &w, &e)) {
		fprintf(stderr, "%s\n", e.msg);
		return (int)e.code;
	}
	for (size_t i = 0; i < w.n; i++) {
		size_t n = ct_tensor_count(&w.t[i]);
		double sum = 0;

		for (size_t k = 0; k < n; k++)
			sum += (double)w.t[i].data[k];
		printf("%s %zu %.9g\n", w.t[i].name, n, sum / (double)n);
	}
	ct_tensors_free(&w);
	return 0;
}

int main(int argc, char **argv)
{
	int fd;

	if (argc > 2)
		return print_means(argv[2]);
	fd = mkstemp(path);
	if (fd < 0)
		exit(99);
	close(fd);
	test_half();
	test_round_trip();
	test_types();
	test_hostile();
	test_cut();
	unlink(path);
	return tap_done();
}
