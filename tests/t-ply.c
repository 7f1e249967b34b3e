/* Gaussians in PLY: bit-exact round trips, files of others, damaged and hostile files. */
#include "config.h"
#include "core/rng.h"
#include "formats/format.h"
#include "tap.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct ct_env force = {.force = true};
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
		"element camera 2\r\nproperty uchar id\r\nproperty double f\r\n"
		"element vertex 1\r\nproperty double density\r\nproperty int16 rot_0\r\n"
		"property char rot_1\r\nproperty uint8 rot_2\r\nproperty uint rot_3\r\n"
		"property float what\r\nproperty float32 z\r\nproperty float64 y\r\nproperty int "
		"x\r\n"
		"property ushort scale_0\r\nproperty float scale_1\r\nproperty float scale_2\r\n"
		"element face 3\r\nproperty list uchar int vertex_index\r\nend_header\r\n";
	unsigned char b[100] = {0};
	size_t n = 18; /* two cameras */
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
	refused(LE "element a 9223372036854775807\nproperty double f\n" ALL("1"), "overflow");
	refused(LE "element a 99\nproperty double f\n" ALL("1"), "do not fit");
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

	if (argc > 1) { /* a file for t-ply.sh */
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
	test_hostile();
	test_cut();
	unlink(path);
	return tap_done();
}
