/* Gaussians in PLY: bit-exact round trips, files of others, damaged and hostile files.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "formats/format.h"
#include "formats/io.h"
#include "tap.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct ct_env force = {.files = &(const struct ct_io_rule){.force = true}};
static char path[] = "/tmp/t-ply-XXXXXX";

static void fill(struct ct_gauss *g, size_t n)
{
	struct ct_err e = {0};

	*g = (struct ct_gauss){
		.activation = CT_PRELU, .gamma = 0.1, .step = 12345678901, .grid = {256, 200, 130}};
	if (ct_gauss_reserve(g, n + 1, &e))
		exit(99);
	g->n = n;
	for (int a = 0; a < 3; a++) {
		ct_rng_normals(n, g->pos[a], 1, (uint64_t)a, 0);
		ct_rng_normals(n, g->scale[a], 2, (uint64_t)a, 0);
		g->affine[a][a] = 1.0 / 3;
		g->affine[a][3] = -100.7 * a;
	}
	for (int a = 0; a < 4; a++)
		ct_rng_normals(n, g->rot[a], 3, (uint64_t)a, 0);
	ct_rng_normals(n, g->raw, 4, 0, 0);
	ct_meta_set(&g->meta, "window", "-1024:3071", &e);
	ct_meta_set(&g->meta, "history", "ct-nabgs 1 'a\\n b'\nct-x = \t y\xc3\xa4 ", &e);
	ct_meta_set(&g->meta, "step", "metadata of a name that is ours", &e);
	ct_meta_set(&g->meta, "k=v\\", "", &e);
}

static bool same(const struct ct_gauss *a, const struct ct_gauss *b)
{
	bool good = a->n == b->n && a->activation == b->activation && a->gamma == b->gamma &&
		    a->step == b->step && memcmp(a->grid, b->grid, sizeof a->grid) == 0 &&
		    memcmp(a->affine, b->affine, sizeof a->affine) == 0 &&
		    memcmp(a->raw, b->raw, a->n * sizeof *a->raw) == 0;

	for (int k = 0; good && k < 3; k++)
		good = memcmp(a->pos[k], b->pos[k], a->n * sizeof *a->raw) == 0 &&
		       memcmp(a->scale[k], b->scale[k], a->n * sizeof *a->raw) == 0;
	for (int k = 0; good && k < 4; k++)
		good = memcmp(a->rot[k], b->rot[k], a->n * sizeof *a->raw) == 0;
	return good;
}

static void save(const void *head, size_t m, const void *data, size_t n)
{
	FILE *f = fopen(path, "wb");

	if (!f || fwrite(head, 1, m, f) != m || (n && fwrite(data, 1, n, f) != n) || fclose(f) != 0)
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

static void test_round_trip(size_t n, enum ct_activation activation)
{
	struct ct_err e = {0};
	struct ct_gauss g, h;
	unsigned char *p, *q;
	size_t np, nq;

	fill(&g, n);
	g.activation = activation;
	if (n) {
		g.raw[0] = NAN;
		g.pos[1][0] = -0.0f;
	}
	OK(ct_gauss_write(path, &g, &force, &e) == 0, "%zu Gaussians are written %s", n, e.msg);
	OK(ct_gauss_read(path, &h, &e) == 0 && same(&g, &h), "and read to the bit %s", e.msg);
	for (size_t i = 0; i < g.meta.n; i++) {
		const char *v = ct_meta_get(&h.meta, g.meta.pair[i].key);

		OK(v && strcmp(v, g.meta.pair[i].value) == 0, "metadata '%s'", g.meta.pair[i].key);
	}
	OK(h.meta.n == g.meta.n + 1 && ct_meta_get(&h.meta, "input"), "and the hash of the input");
	p = load(&np);
	OK(ct_gauss_write(path, &h, &force, &e) == 0, "written again");
	q = load(&nq);
	OK(np == nq && memcmp(p, q, np) == 0, "the same bytes");
	free(p);
	free(q);
	ct_gauss_free(&g);
	ct_gauss_free(&h);
}

/* A header of another program: other order, types and elements, CR LF. */
static void test_foreign(void)
{
	static const char head[] =
		"ply\r\nformat binary_little_endian 1.0\r\n"
		"comment ct:activation=softplus\r\ncomment made by hand\r\nobj_info x\r\n"
		"element vertex 1\r\nproperty double density\r\nproperty int16 rot_0\r\n"
		"property char rot_1\r\nproperty uint8 rot_2\r\nproperty uint rot_3\r\n"
		"property float what\r\nproperty float32 z\r\nproperty float64 y\r\nproperty int "
		"x\r\n"
		"property ushort scale_0\r\nproperty float scale_1\r\nproperty float scale_2\r\n"
		"element face 3\r\nproperty list uchar int vertex_index\r\nend_header\r\n";
	unsigned char b[100] = {0};
	size_t n = 0;
	struct ct_err e = {0};
	struct ct_gauss g;

#define PUT(T, v)                                                                                  \
	do {                                                                                       \
		T x = (v);                                                                         \
		memcpy(b + n, &x, sizeof x);                                                       \
		n += sizeof x;                                                                     \
	} while (0)
	PUT(double, 0.125);
	PUT(int16_t, -300);
	PUT(int8_t, -3);
	PUT(uint8_t, 200);
	PUT(uint32_t, 4000000000u);
	PUT(float, 99);
	PUT(float, 3);
	PUT(double, 2);
	PUT(int32_t, -1);
	PUT(uint16_t, 60000);
	PUT(float, 5);
	PUT(float, 6);
	save(head, sizeof head - 1, b, n + 7);
	OK(ct_gauss_read(path, &g, &e) == 0, "a foreign header is read %s", e.msg);
	OK(g.n == 1 && g.pos[0][0] == -1 && g.pos[1][0] == 2 && g.pos[2][0] == 3, "position");
	OK(g.n == 1 && g.scale[0][0] == 60000 && g.scale[1][0] == 5 && g.scale[2][0] == 6, "scale");
	OK(g.n == 1 && g.rot[0][0] == -300 && g.rot[1][0] == -3 && g.rot[2][0] == 200 &&
			g.rot[3][0] == 4e9f,
		"rotation");
	OK(g.n == 1 && g.raw[0] == 0.125f && g.activation == CT_SOFTPLUS && g.grid[0] == 0,
		"density and activation");
	ct_gauss_free(&g);
}

static void refused(const char *head, const char *words)
{
	static const unsigned char data[256];
	struct ct_err e = {0};
	struct ct_gauss g;
	int rc;

	save(head, strlen(head), data, sizeof data);
	rc = ct_gauss_read(path, &g, &e);
	OK(rc < 0 && e.code == CT_EINPUT && strstr(e.msg, path) && strstr(e.msg, words) && !g.raw,
		"refused: %s", e.msg);
}

#define LE "ply\nformat binary_little_endian 1.0\n"
#define POINT "property float x\nproperty float y\nproperty float z\n"
#define SHAPE                                                                                      \
	"property float scale_0\nproperty float scale_1\nproperty float scale_2\n"                 \
	"property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n"
#define ALL(n) "element vertex " n "\n" POINT SHAPE "property float density\nend_header\n"

static void test_hostile(void)
{
	refused("", "not a PLY");
	refused("plyformat", "not a PLY");
	refused("ply\nformat ascii 1.0\n", "format 'ascii 1.0'");
	refused("ply\nformat binary_big_endian 1.0\n", "format 'binary_big_endian");
	refused(LE "comment ct:activation=relu\n", "no end");
	refused("ply\n" ALL("1"), "no format");
	refused(LE "nonsense\033\nend_header\n", "header line 'nonsense?'");
	refused(LE "property float x\nend_header\n", "before any element");
	refused(LE "element vertex\nend_header\n", "element vertex");
	refused(LE "element vertex -1\nend_header\n", "count '-1'");
	refused(LE "element vertex 1e9\nend_header\n", "count '1e9'");
	refused(LE "element vertex 1\nelement vertex 1\nend_header\n", "two elements");
	refused(LE "element vertex 1\nproperty float y\nproperty float z\n" SHAPE
		   "property float density\nend_header\n",
		"property x");
	refused(LE "element vertex 1\n" POINT "end_header\n", "no vertex property scale_0");
	refused(LE "element vertex 1\n" POINT SHAPE "end_header\n", "of colours");
	refused(LE "element vertex 1\nproperty list uchar int x\nend_header\n", "lists");
	refused(LE "element vertex 1\nproperty half x\nend_header\n", "of type half");
	refused(LE ALL("1"), "no comment ct:activation");
	refused(LE "comment ct:activation=cubic\n" ALL("1"), "'cubic' is not one of prelu");
	refused(LE "comment ct:activation=prelu\n" ALL("1"), "ct:gamma");
	refused(LE "comment ct:activation=prelu\ncomment ct:gamma=-1\n" ALL("1"), "ct:gamma");
	refused(LE "comment ct:activation=relu\ncomment ct:units=inch\n" ALL("1"), "'inch'");
	refused(LE "comment ct:activation=relu\ncomment ct:grid=1,2\n" ALL("1"), "grid");
	refused(LE "comment ct:activation=relu\ncomment ct:grid=1,2,-3\n" ALL("1"), "grid");
	refused(LE "comment ct:activation=relu\ncomment ct:step=0.5\n" ALL("1"), "step");
	refused(LE "comment ct:activation=relu\n" ALL("6"), "do not fit");
	refused(LE "comment ct:activation=relu\n" ALL("9223372036854775807"), "do not fit");
	refused(LE "comment ct:activation=relu\n" ALL("18446744073709551615"), "count");
	refused(LE "comment ct:activation=relu\ncomment ct:step=9007199254740994\n" ALL("1"),
		"step");
	refused(LE "comment ct:activation=relu\ncomment ct:step=-1\n" ALL("1"), "step");
	refused(LE "comment ct:activation=relu\ncomment ct:gamma=0\n" ALL("1"), "ct:gamma");
	refused(LE "comment ct:activation=relu\ncomment ct:gamma=x\n" ALL("1"), "gamma");
	refused(LE "comment ct:activation=relu\ncomment ct:gamma=1,2\n" ALL("1"), "gamma");
	refused(LE "comment ct:activation=relu\ncomment ct:affine=1,2,3\n" ALL("1"), "affine");
	refused(LE "commentary\n" ALL("1"), "header line 'commentary'");
	refused(LE "element vertex 1 \nproperty float\nend_header\n", "'property float'");
	refused(LE "element vertex 9223372036854775808\nend_header\n", "count");
	refused(LE "element vertex 0\nelement a 1\nelement vertex 0\n", "two elements");
	refused(LE "element a 99\nproperty double f\n" ALL("1"), "before the vertices");
}

/* Comments of others: what they say, and what is no comment of ours. */
static void test_comments(void)
{
	static const char text[] = LE
		"comment ct:activation=relu\ncomment ct:plain=v=w\ncomment ct:a\\x3db=1\n"
		"comment ct:line=a\\nb\\\\n\ncomment ct:hex=\\x41\\x7a\\xe4\ncomment ct:cut=\\x4\n"
		"comment ct:end=\\\ncomment ct:odd=\\q\ncomment ct:=no key\ncomment ct:no value\n"
		"comment ct:\\x00=nothing\ncomment\ncomment other\ncomment ct-x=1\nobj_info\n"
		"comment ct:grid=3,4,5\ncomment ct:affine=1,2,3,4,5,6,7,8,9,10,11,12\n"
		"comment ct:step=9007199254740992\ncomment ct:gamma=0.25\ncomment ct:units=mm\n" ALL(
			"5");
	static const char *const want[][2] = {{"plain", "v=w"}, {"a=b", "1"}, {"line", "a\nb\\n"},
		{"hex", "Az\xe4"}, {"cut", "\\x4"}, {"end", "\\"}, {"odd", "\\q"}};
	static const unsigned char data[5 * 44];
	struct ct_err e = {0};
	struct ct_gauss g;
	size_t bad = 0;

	save(text, sizeof text - 1, data, sizeof data);
	OK(ct_gauss_read(path, &g, &e) == 0 && g.n == 5, "five that just fit %s", e.msg);
	for (size_t i = 0; i < sizeof want / sizeof *want; i++) {
		const char *v = ct_meta_get(&g.meta, want[i][0]);

		OK(v && strcmp(v, want[i][1]) == 0, "comment ct:%s", want[i][0]);
	}
	OK(g.meta.n == 8, "no more than these and the hash");
	for (int i = 0; i < 12; i++)
		bad += g.affine[i / 4][i % 4] != i + 1;
	OK(bad == 0 && g.grid[0] == 3 && g.grid[1] == 4 && g.grid[2] == 5, "grid");
	OK(g.step == (size_t)1 << 53 && g.gamma == 0.25 && g.activation == CT_RELU, "step, gamma");
	ct_gauss_free(&g);
}

/* Every type. */
static void test_types(void)
{
	static const struct {
		const char *name, *alias;
		size_t bytes;
		unsigned char is[8]; /* 3 */
	} c[] = {{"char", "int8", 1, {3}}, {"uchar", "uint8", 1, {3}}, {"short", "int16", 2, {3}},
		{"ushort", "uint16", 2, {3}}, {"int", "int32", 4, {3}}, {"uint", "uint32", 4, {3}},
		{"float", "float32", 4, {0, 0, 0x40, 0x40}},
		{"double", "float64", 8, {0, 0, 0, 0, 0, 0, 8, 0x40}}};
	struct ct_err e = {0};

	for (size_t i = 0; i < 2 * sizeof c / sizeof *c; i++) {
		const char *type = i % 2 ? c[i / 2].alias : c[i / 2].name;
		const size_t bytes = c[i / 2].bytes;
		unsigned char data[200] = {0};
		char head[900];
		struct ct_gauss g;

		snprintf(head, sizeof head,
			LE
			"comment ct:activation=sine\nelement vertex 2\nproperty %s x\nproperty float y\n"
			"property float z\n" SHAPE "property %s density\nend_header\n",
			type, type);
		for (size_t k = 0; k < 2; k++) {
			unsigned char *at = data + k * (2 * bytes + 36);

			memcpy(at, c[i / 2].is, bytes);
			memcpy(at + bytes + 36, c[i / 2].is, bytes);
		}
		save(head, strlen(head), data, 2 * (2 * bytes + 36));
		OK(ct_gauss_read(path, &g, &e) == 0 && g.n == 2 && g.pos[0][0] == 3 &&
				g.pos[0][1] == 3 && g.raw[0] == 3 && g.raw[1] == 3 &&
				g.pos[1][1] == 0 && g.rot[3][1] == 0,
			"type %s %s", type, e.msg);
		ct_gauss_free(&g);
		save(head, strlen(head), data, 2 * (2 * bytes + 36) - 1);
		OK(ct_gauss_read(path, &g, &e) == -1 && strstr(e.msg, "do not fit"), "a byte less");
	}
}

/* So many comments of ours and properties, none of them needed. */
static int many(int comments, int properties)
{
	char *text = NULL;
	size_t n;
	FILE *f = open_memstream(&text, &n);
	struct ct_err e = {0};
	struct ct_gauss g;
	int rc;

	fprintf(f, LE "comment ct:activation=relu\n");
	for (int i = 1; i < comments; i++)
		fprintf(f, "comment ct:k=v\n");
	fprintf(f, "element vertex 0\n" POINT SHAPE "property float density\n");
	for (int i = 11; i < properties; i++)
		fprintf(f, "property char what\n");
	fprintf(f, "end_header\n");
	fclose(f);
	save(text, n, NULL, 0);
	free(text);
	rc = ct_gauss_read(path, &g, &e);
	if (rc)
		return strstr(e.msg, "more than 4096") ? -1 : 1;
	ct_gauss_free(&g);
	return 0;
}

/* What the header of a file says, and what viewers see. */
static void test_written(enum ct_activation activation)
{
	static const float z[] = {40, -2, -0.5f, 0, 0.001f, 0.75f, 2, 31, -40};
	enum { N = sizeof z / sizeof *z };
	struct ct_err e = {0};
	struct ct_gauss g;
	double rho[N], most = 0, worst = 0;
	unsigned char *p, *at;
	float row[18];
	size_t n;

	fill(&g, N);
	g.activation = activation;
	g.grid[0] = activation == CT_RELU ? 0 : 7;
	for (int i = 0; i < N; i++) {
		const double x = (double)z[i];

		g.raw[i] = z[i];
		rho[i] = activation == CT_SOFTPLUS ? log(1 + exp(x))
			 : activation == CT_RELU   ? fmax(x, 0)
			 : activation == CT_SINE   ? sin(x)
			 : x > 0                   ? x
						   : 0.1 * x;
		most = fmax(most, fabs(rho[i]));
	}
	ct_meta_set(&g.meta, "input", "of another file", &e);
	ct_meta_set(&g.meta, "\x1f=\x7f~", "= \x1f\x7f~", &e);
	if (ct_gauss_write(path, &g, &force, &e))
		exit(99);
	p = load(&n);
	at = p + n - N * sizeof row;
	p[n - N * sizeof row - 1] = '\0';
	OK(strstr((char *)p, "comment ct:\\x1f\\x3d\\x7f~== \\x1f\\x7f~\n") != NULL, "escapes");
	OK(strstr((char *)p, "comment ct:\\x73tep=metadata") != NULL, "a name that is ours");
	OK(!strstr((char *)p, "of another file"), "no hash of another file");
	OK(!strstr((char *)p, "comment ct:grid=") == (activation == CT_RELU) &&
			!strstr((char *)p, "comment ct:affine=") == (activation == CT_RELU),
		"a grid if there is one");
	OK(strstr((char *)p, "\nelement vertex 9\nproperty float x\n") != NULL, "so many");
	for (int i = 0; i < N; i++) {
		const double s = fmin(fmax(fabs(rho[i]) / most, 0.001), 0.999);

		memcpy(row, at + (size_t)i * sizeof row, sizeof row);
		worst = fmax(worst, fabs((double)row[9] - log(s / (1 - s))));
		for (int k = 0; k < 3; k++) {
			const double warm[] = {0.98, 0.62, 0.25}, cold[] = {0.25, 0.55, 0.98};

			worst = fmax(worst, fabs((double)row[6 + k] * 0.28209479177 + 0.5 -
						    (rho[i] < 0 ? cold : warm)[k]));
			worst = fmax(worst, fabs((double)row[3 + k]));
		}
	}
	NEAR(worst, 0, 1e-3, "opacity and colours");
	free(p);
	memset(g.raw, 0, N * sizeof *g.raw);
	g.activation = CT_RELU;
	if (ct_gauss_write(path, &g, &force, &e))
		exit(99);
	p = load(&n);
	memcpy(row, p + n - sizeof row, sizeof row);
	NEAR((double)row[9], log(0.001 / 0.999), 1e-4, "nothing is hardly seen");
	free(p);
	ct_gauss_free(&g);
}

static void test_hash(void)
{
	struct ct_err e = {0};
	struct ct_gauss g, h;
	char hash[2][100];
	size_t same_hash = 0;

	fill(&g, 3);
	for (int i = 0; i <= 35; i++) {
		float *x = NULL, was = 0;

		if (i && i <= 33) {
			const int k = (i - 1) / 3;

			x = (k < 3           ? g.pos[k]
				    : k < 6  ? g.scale[k - 3]
				    : k < 10 ? g.rot[k - 6]
					     : g.raw) +
			    (i - 1) % 3;
			was = *x;
			*x = was + 1;
		}
		if (i == 34)
			g.gamma = 0.2;
		if (i == 35)
			g.activation = CT_SINE;
		if (ct_gauss_write(path, &g, &force, &e) || ct_gauss_read(path, &h, &e))
			exit(99);
		snprintf(hash[i > 0], sizeof hash[0], "%s", ct_meta_get(&h.meta, "input"));
		same_hash += i && strcmp(hash[0], hash[1]) == 0;
		ct_gauss_free(&h);
		if (x)
			*x = was;
		if (i == 34)
			g.gamma = 0.1;
	}
	OK(same_hash == 0, "each number changes the hash");
	ct_gauss_free(&g);
}

static void test_cut(void)
{
	struct ct_err e = {0};
	struct ct_gauss g, h;
	unsigned char *p;
	size_t n, read = 0;

	fill(&g, 3);
	if (ct_gauss_write(path, &g, &force, &e))
		exit(99);
	p = load(&n);
	for (size_t cut = 0; cut < n; cut++) {
		save(p, cut, NULL, 0);
		e = (struct ct_err){0};
		read += ct_gauss_read(path, &h, &e) == 0 || e.code != CT_EINPUT ||
			!strstr(e.msg, path);
	}
	OK(read == 0, "cut at any of %zu bytes it is refused", n);
	free(p);
	ct_gauss_free(&g);
}

int main(int argc, char **argv)
{
	struct ct_err e = {0};
	struct ct_gauss g;
	int fd;

	if (argc > 1) { /* a file for t-formats.sh and others */
		fill(&g, 500);
		ct_gauss_write(argv[1], &g, &force, &e);
		ct_gauss_free(&g);
		return (int)e.code;
	}
	fd = mkstemp(path);
	if (fd < 0)
		exit(99);
	close(fd);
	test_round_trip(0, CT_PRELU);
	test_round_trip(1, CT_SINE);
	test_round_trip(2500, CT_SOFTPLUS);
	test_foreign();
	test_comments();
	test_types();
	OK(many(4096, 11) == 0 && many(4097, 11) == -1, "4096 comments");
	OK(many(1, 4096) == 0 && many(1, 4097) == -1, "4096 properties");
	for (int a = CT_PRELU; a <= CT_SINE; a++)
		test_written((enum ct_activation)a);
	test_hash();
	test_hostile();
	test_cut();
	unlink(path);
	return tap_done();
}
