/* backproject-calls.c: back-projection (recon/backproject.h) of views of 512x512 pixels onto
 * n^3 voxels of a cube of 256 mm in GUPS: 1e9 updates of a voxel by a view, a second of CPU time
 * with one thread, of the clock with more. Beside it, in turn in one process,
 *
 *   one tile   our kernel on one tile of voxels and two views again and again, so that nothing
 *              comes from memory: what the instructions alone take, of one thread
 *   RabbitCT   `lolaAsmBackprojection` of the shared objects that are named (b-kernels.sh), on the
 *              same pixels and matrices, and the largest difference of the volumes
 *
 * Usage: backproject-calls N VIEWS THREADS ROUNDS [NAME=OBJECT...].
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bench/bench.h"
#include "recon/backproject.h"
#include "core/mem.h"

#include <dlfcn.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { SIDE = 512, PEERS = 4, WORDS = 5, MOST_ROUNDS = 15, TILE_PART = 16 };

/* RabbitCT's src/rabbitCt.h. */
struct projection {
	int id;
	double *matrix; /* 12, of columns */
	float *image;   /* rows of columns */
};

struct rabbit {
	uint32_t size, width, height;
	float voxel, origin;
	float *volume;
	uint32_t views;
	double *geometry;
	struct projection *view;
	char *clip;
};

struct peer {
	const char *name;
	int (*run)(struct rabbit *r);
	struct rabbit data;
	char clip[4096]; /* a file of its own */
};

static struct {
	struct ct_backprojector b;
	float *volume, *pixels, *blend;
	float (*acc)[CT_BP_TILE][CT_BP_SEGMENT];
	struct ct_par *par;
	size_t n, views, threads, rounds, updates;
} our;

/* A cone beam about axis 2: source at 750 mm, detector at 1200, pixels of 1.05 mm: the shadow of
 * the cube is larger than the detector, as RabbitCT takes for granted. */
static void matrix_of(double m[3][4], size_t view, double mm, double first)
{
	const double a = 2 * M_PI * (double)view / (double)our.views, c = cos(a), s = sin(a),
		     far = 750, f = 1200 / 1.05 / far, mid = (SIDE - 1) / 2.0;
	const double world[3][4] = {{mid * -s / far + f * c, mid * c / far + f * s, 0, mid},
		{mid * -s / far, mid * c / far, f, mid}, {-s / far, c / far, 0, 1}};

	for (int r = 0; r < 3; r++)
		for (int i = 0; i < 4; i++)
			m[r][i] = i < 3 ? mm * world[r][i]
					: world[r][3] +
						  first * (world[r][0] + world[r][1] + world[r][2]);
}

static double pixel(size_t view, size_t row, size_t col)
{
	return 1 + sin(0.031 * (double)row + (double)view) * cos(0.017 * (double)col);
}

static void ours(void *arg)
{
	(void)arg;
	ct_backproject(&our.b, 0, our.views, our.volume, our.pixels, our.par);
}

static void tile(void *arg)
{
	const size_t n = our.b.n[0] / 2, side = CT_BP_TILE;
	const size_t most = CT_BP_SEGMENT < our.b.n[2] ? CT_BP_SEGMENT : our.b.n[2];
	const struct ct_bp_tile t = {
		&our.b, {2, 0, 1}, {most, side, side}, {(double)n, (double)n, 0}};

	(void)arg;
	for (size_t done = 0; done < our.updates / TILE_PART;
		done += most * side * side * CT_BP_GROUP)
		CT_SIMD(ct_backproject_line_tile)
	(our.acc, &t, 0, CT_BP_GROUP, our.pixels, our.blend + CT_BP_SLACK);
}

static void theirs(void *arg)
{
	struct peer *p = arg;

	p->run(&p->data);
}

static int open_peer(struct peer *p, char *word, double mm, double first)
{
	const size_t n = our.n;
	int (*prepare)(struct rabbit *);
	char *file = strchr(word, '=');
	void *so;
	struct ct_err e;

	if (!file || !(so = dlopen(file + 1, RTLD_NOW | RTLD_LOCAL))) {
		fprintf(stderr, "%s: not NAME=OBJECT, or it does not open\n", word);
		return -1;
	}
	*file = 0;
	p->name = word;
	*(void **)&prepare = dlsym(so, "lolaAsmPrepare");
	*(void **)&p->run = dlsym(so, "lolaAsmBackprojection");
	p->data = (struct rabbit){(uint32_t)n, SIDE, SIDE, (float)mm, (float)first,
		.views = (uint32_t)our.views, .clip = p->clip};
	snprintf(p->clip, sizeof p->clip, "%s.%zu.%zu", file + 1, n, our.views);
	p->data.volume = aligned_alloc(/* it stores whole registers */
		64, n * n * n * sizeof(float) / 64 * 64 + 64);
	if (!prepare || !p->run || !p->data.volume ||
		ct_alloc0(&p->data.geometry, 12 * our.views, sizeof(double), &e) ||
		ct_alloc0(&p->data.view, our.views, sizeof *p->data.view, &e))
		return -1;
	memset(p->data.volume, 0, n * n * n * sizeof(float));
	for (size_t v = 0; v < our.views; v++) {
		struct projection *view = &p->data.view[v];
		double m[3][4];

		matrix_of(m, v, 1, 0);
		*view = (struct projection){(int)v + 1, p->data.geometry + 12 * v, NULL};
		for (size_t i = 0; i < 12; i++)
			view->matrix[i] = m[i % 3][i / 3];
		if (ct_alloc(&view->image, (size_t)SIDE * SIDE, sizeof(float), &e))
			return -1;
		for (size_t i = 0; i < (size_t)SIDE * SIDE; i++)
			view->image[i] = (float)pixel(v, i / SIDE, i % SIDE);
	}
	return prepare(&p->data);
}

static int open_ours(double mm, double first)
{
	const size_t n = our.n;
	struct ct_err e;

	our.b = (struct ct_backprojector){{n, n, n}, our.views, SIDE, SIDE,
		(CT_BP_PAD + SIDE + 1 + 15 + 15) / 16 * 16, NULL, 2};
	our.updates = n * n * n * our.views;
	if (ct_alloc0(&our.b.map, our.views, sizeof *our.b.map, &e) ||
		ct_alloc0(&our.volume, n * n * n, sizeof(float), &e) ||
		ct_alloc0(&our.pixels, our.views * ct_backprojector_size(&our.b), sizeof(float),
			&e) ||
		ct_alloc0(&our.blend, CT_BP_BLEND + 2 * CT_BP_SLACK, sizeof(float), &e) ||
		ct_alloc0(&our.acc, CT_BP_TILE, sizeof *our.acc, &e) ||
		ct_par_alloc(&our.par, our.threads, &e))
		return -1;
	for (size_t v = 0; v < our.views; v++) {
		float *view = our.pixels + v * ct_backprojector_size(&our.b);

		matrix_of(our.b.map[v], v, mm, first);
		for (size_t c = 0; c < SIDE; c++)
			for (size_t r = 0; r < SIDE; r++)
				view[(c + 1) * our.b.pitch + CT_BP_PAD + r] = (float)pixel(v, r, c);
		ct_backproject_frame(&our.b, view);
	}
	return 0;
}

/* Does every view see voxel i? */
static bool is_seen(size_t i, size_t n)
{
	const double at[4] = {(double)(i % n), (double)(i / n % n), (double)(i / n / n), 1};

	for (size_t v = 0; v < our.views; v++) {
		double p[3] = {0};

		for (int r = 0; r < 3; r++)
			for (int c = 0; c < 4; c++)
				p[r] += our.b.map[v][r][c] * at[c];
		if (fabs(p[0] / p[2] - (SIDE - 1) / 2.) > SIDE / 2 - 2 ||
			fabs(p[1] / p[2] - (SIDE - 1) / 2.) > SIDE / 2 - 2)
			return false;
	}
	return true;
}

/* Of RabbitCT's volume from ours where every view sees it, as a part of the largest. */
static double apart(const float *a, size_t n)
{
	double worst = 0, most = 0;

	for (size_t i = 0; i < n * n * n; i++)
		if (is_seen(i, n)) {
			worst = fmax(worst, fabs((double)a[i] - (double)our.volume[i]));
			most = fmax(most, fabs((double)our.volume[i]));
		}
	return worst / most;
}

/* The median GUPS, and of the time by ours median, least and most. */
static void tell(const char *name, double *t, const double *by)
{
	double ratio[MOST_ROUNDS];

	for (size_t i = 0; i < our.rounds; i++)
		ratio[i] = t[i] / by[i];
	qsort(ratio, our.rounds, sizeof *ratio, bench_order);
	printf("  %.3g GUPS %s, time by ours %.3g [%.3g..%.3g]\n",
		(double)our.updates / 1e9 / bench_median(t, our.rounds), name,
		ratio[our.rounds / 2], ratio[0], ratio[our.rounds - 1]);
}

static bool read_words(int argc, char **argv)
{
	size_t *to[] = {&our.n, &our.views, &our.threads, &our.rounds};

	for (int i = 0; i < WORDS - 1 && i + 1 < argc; i++)
		*to[i] = strtoul(argv[i + 1], NULL, 10);
	return argc >= WORDS && argc <= WORDS + PEERS && our.n >= 16 && our.n <= 1024 &&
	       our.views >= 2 && our.views <= 4096 && our.threads >= 1 && our.rounds >= 1 &&
	       our.rounds <= MOST_ROUNDS;
}

int main(int argc, char **argv)
{
	static struct peer peer[PEERS];
	static double t[PEERS + 2][MOST_ROUNDS];
	double ours_in_turn[MOST_ROUNDS];

	if (!read_words(argc, argv)) {
		fprintf(stderr, "backproject-calls N VIEWS THREADS ROUNDS [NAME=OBJECT...]\n");
		return 2;
	}
	const double mm = 256.0 / (double)our.n, first = -0.5 * mm * ((double)our.n - 1);
	const clockid_t clock = our.threads > 1 ? CLOCK_MONOTONIC : CLOCK_PROCESS_CPUTIME_ID;
	const size_t peers = (size_t)(argc - WORDS), sides = peers + 2;

	if (open_ours(mm, first))
		return 1;
	for (size_t p = 0; p < peers; p++)
		if (open_peer(peer + p, argv[p + WORDS], mm, first) < 0)
			return 1;
	for (size_t round = 0; round <= our.rounds; round++) /* the first counts not */
		for (size_t s = 0; s < sides; s++)
			t[s][round ? round - 1 : 0] = bench_time(clock,
				s == 0   ? ours
				: s == 1 ? tile
					 : theirs,
				s < 2 ? NULL : peer + s - 2);
	memcpy(ours_in_turn, t[0], sizeof ours_in_turn);
	for (size_t i = 0; i < our.rounds; i++)
		t[1][i] *= TILE_PART;
	printf("%zu^3, %zu views, %zu threads, v%d: %.3g GUPS ct_backproject\n", our.n, our.views,
		our.threads, ct_simd_level(),
		(double)our.updates / 1e9 / bench_median(t[0], our.rounds));
	tell("one tile", t[1], ours_in_turn);
	for (size_t p = 0; p < peers; p++) {
		tell(peer[p].name, t[p + 2], ours_in_turn);
		printf("  difference of volumes %.2g of the largest\n",
			apart(peer[p].data.volume, our.n));
	}
	return 0;
}
