/* The hash encoding of NAF (field/encoding.h) at random points and along rays, forward and
 * backward, against bare reads of, and additions to, the same entries of the same tables at places
 * that are known beforehand; and the whole field of NAF without the scatter of its gradient,
 * against the encoding alone. CPU seconds of one thread. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bench/bench.h"
#include "core/rng.h"
#include "field/field.h"

#include <math.h>
#include <string.h>

enum { POINTS = 1 << 16, LEVELS = 16, CORNERS = 8, PIECE = 512, AHEAD = 128 };

struct side {
	struct ct_field_shape s;
	struct ct_field *f;
	struct ct_field_work *work;
	float *x, *code, *grad, *dnet, *y;
	uint32_t *place; /* [LEVELS][POINTS][CORNERS] */
	double sum;
};

static void forward(void *arg)
{
	struct side *s = arg;

	ct_encoding_forward(&s->s.encoding, s->f->weights, POINTS, s->x, s->code, POINTS);
}

static void back(void *arg)
{
	struct side *s = arg;

	for (size_t l = 0; l < LEVELS; l++)
		ct_encoding_back(&s->s.encoding, l, POINTS, s->x, s->code, POINTS,
			s->grad + ct_encoding_offset(&s->s.encoding, l));
}

typedef float two_floats __attribute__((vector_size(8)));

static void reads(void *arg)
{
	struct side *s = arg;
	const float *w = s->f->weights;
	two_floats sum[CORNERS] = {{0}}, v; /* so that no addition waits for another */

	for (size_t i = 0; i < (size_t)LEVELS * POINTS * CORNERS; i += CORNERS)
		for (size_t c = 0; c < CORNERS; c++) {
			__builtin_prefetch(w + s->place[i + c + AHEAD]);
			memcpy(&v, w + s->place[i + c], sizeof v);
			sum[c] += v;
		}
	for (size_t c = 0; c < CORNERS; c++)
		s->sum += (double)(sum[c][0] + sum[c][1]);
}

static void adds(void *arg)
{
	struct side *s = arg;
	const two_floats some = {1, 2};
	two_floats v;

	for (size_t i = 0; i < (size_t)LEVELS * POINTS * CORNERS; i++) {
		__builtin_prefetch(s->grad + s->place[i + AHEAD]);
		memcpy(&v, s->grad + s->place[i], sizeof v);
		v += some;
		memcpy(s->grad + s->place[i], &v, sizeof v);
	}
}

/* Where the corners are, as encoding.h says. */
static void find(struct side *s)
{
	const struct ct_encoding *e = &s->s.encoding;

	for (size_t l = 0; l < LEVELS; l++) {
		const double scale = (double)e->base * pow(e->growth, (double)l) - 1;
		const uint64_t side = (uint64_t)ceil(scale) + 2, all = side * side * side,
			       table = (uint64_t)1 << e->log2_table;
		const size_t offset = ct_encoding_offset(e, l);

		for (size_t i = 0; i < POINTS; i++)
			for (size_t c = 0; c < CORNERS; c++) {
				uint64_t k[3];

				for (size_t a = 0; a < 3; a++)
					k[a] = (uint64_t)((double)s->x[3 * i + a] * scale + 0.5) +
					       (c >> a & 1);
				s->place[(l * POINTS + i) * CORNERS + c] =
					(uint32_t)(offset +
						   2 * (all > table ? (k[0] ^ k[1] * 19349663 ^
									      k[2] * 83492791) %
									       table
								    : k[0] + side * (k[1] + side * k[2])));
			}
	}
}

static void network(void *arg)
{
	struct side *s = arg;
	struct ct_err e;

	for (size_t i = 0; i < POINTS; i += PIECE)
		if (ct_field_forward(s->f, s->work, PIECE, s->x + 3 * i, s->y + i, &e) ||
			ct_field_backward(
				s->f, s->work, PIECE, s->y + i, s->dnet, s->code + i, POINTS, &e))
			exit(1);
}

/* 512 points of a ray in steps, or each anywhere. */
static void points(struct side *s, int rays)
{
	for (size_t i = 0; i < POINTS; i++)
		for (size_t a = 0; a < 3; a++) {
			const double u = ct_rng_uniform(1, a, rays ? i / 512 : i),
				     v = ct_rng_uniform(2, a, i / 512), t = (double)(i % 512) / 512;

			s->x[3 * i + a] = (float)(rays ? u + t * (v - u) : u);
		}
	find(s);
}

static void *floats(size_t n)
{
	float *p = calloc(n, sizeof *p);

	if (!p)
		exit(1);
	for (size_t i = 0; i < n; i++)
		p[i] = 1e-3f * (float)(i % 7);
	return p;
}

int main(void)
{
	struct side s = {.s = {{.kind = CT_ENCODING_HASH,
				       .levels = LEVELS,
				       .log2_table = 19,
				       .base = 16,
				       .growth = 2},
				 {32, 3, 2, 1, 0.01, CT_NETWORK_SIGMOID, {0}}}};
	struct ct_err e;

	if (ct_field_alloc(&s.f, &s.s, 1, &e) || ct_field_work_alloc(&s.work, s.f, PIECE, &e))
		return 1;
	s.x = floats(3 * (size_t)POINTS);
	s.y = floats(POINTS);
	s.code = floats((size_t)POINTS * 2 * LEVELS);
	s.grad = floats(s.f->encoded);
	s.dnet = floats(s.f->net);
	s.place = floats((size_t)LEVELS * POINTS * CORNERS + AHEAD);
	for (int rays = 0; rays < 2; rays++) {
		const char *const name[2][3] = {
			{"hash at random, forward", "hash at random, backward",
				"NAF's field at random, both"},
			{"hash along rays, forward", "hash along rays, backward",
				"NAF's field along rays, both"}};

		points(&s, rays);
		bench_against(name[rays][0], forward, &s, "bare reads", reads, &s,
			CLOCK_PROCESS_CPUTIME_ID, 1e9 / POINTS, "ns a point");
		bench_against(name[rays][1], back, &s, "bare additions", adds, &s,
			CLOCK_PROCESS_CPUTIME_ID, 1e9 / POINTS, "ns a point");
		bench_against(name[rays][2], network, &s, "encoding's forward", forward, &s,
			CLOCK_PROCESS_CPUTIME_ID, 1e9 / POINTS, "ns a point");
	}
	return s.sum > 0 ? 0 : 1;
}
