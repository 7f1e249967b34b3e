/* What the error of a solver goes with: prints the table of src/estimate/expected.c.
 *
 *   make bench/fit-expected && bench/fit-expected [-t THREADS] SCAN...
 *
 * SCANs are volumes in HU, of patients that nothing is judged on. Of each a box about its body is
 * reduced in every way of the table, without noise and with some, and refined as ct-upsample does;
 * the squared errors there and the terms of expected.h are what is fitted: the k >= 0 under which
 * normal errors of the variance k . terms are most likely, by the multiplicative steps that lower
 * the same measure for Itakura and Saito's (Fevotte, Bertin, Durrieu, Neural Computation 2009).
 *
 * Where more than one axis is refined only scans count whose second differences along the third
 * axis are at least HALF of those along the others, in squares, in a box about the body: others
 * were interpolated along it, and lack nothing there. The thick axis of slices is the second one,
 * which was always sharp. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/simd.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "operator/crop.h"
#include "estimate/expected.h"
#include "inverse/upsample.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FACTORS = 4, STEPS = 2000 };
#define HALF 0.5
static const double factors[FACTORS] = {2, 3, 4, 8};
static const char *const names[CT_EXPECTED_KINDS] = {
	"WELL", "POINTS", "MEANS", "WELL_THICK", "POINTS_THICK", "MEANS_THICK"};

/* Voxels of one noise and about one G. */
struct bin {
	double n, g, square; /* how many, and the sums of these */
};

enum { NOISES = 4, OCTAVES = 32, PARTS = 8, BINS = OCTAVES * PARTS };
static const double noises[NOISES] = {0, 8, 15, 30};
static struct bin all[CT_EXPECTED_KINDS][FACTORS][NOISES][BINS];
static struct ct_env env;
static struct ct_err err;

static void must(int rc)
{
	if (rc == 0)
		return;
	fprintf(stderr, "%s\n", err.msg);
	exit(1);
}

/* Second differences along the third axis over those along the others. */
static double sharp(const struct ct_vol *v)
{
	const size_t stride[3] = {1, v->n[0], v->n[0] * v->n[1]};
	double sum[3] = {0};

	for (size_t k = 1; k + 1 < v->n[2]; k++)
		for (size_t j = 1; j + 1 < v->n[1]; j++)
			for (size_t i = 1; i + 1 < v->n[0]; i++)
				for (int a = 0; a < 3; a++) {
					const float *x =
						v->data + k * stride[2] + j * stride[1] + i;
					const double d = (double)x[stride[a]] - 2 * (double)*x +
							 (double)*(x - stride[a]);

					sum[a] += d * d;
				}
	return sum[0] + sum[1] > 0 ? 2 * sum[2] / (sum[0] + sum[1]) : 0;
}

static struct ct_degrade operator_of(int kind, double factor)
{
	struct ct_degrade d = {.factor = {1, factor, 1}};

	if (kind < CT_EXPECTED_WELL_THICK)
		d.factor[0] = d.factor[2] = factor;
	ct_degrade_protocol(&d, kind == CT_EXPECTED_WELL || kind == CT_EXPECTED_WELL_THICK ? 1 : 3);
	if (kind == CT_EXPECTED_MEANS || kind == CT_EXPECTED_MEANS_THICK) {
		d.decimate = CT_DECIMATE_MEAN;
		memset(d.sigma, 0, sizeof d.sigma);
	}
	return d;
}

/* The box of v, whole cells of d, about its body. */
static void cut(struct ct_vol *box, const struct ct_vol *v, const struct ct_degrade *d)
{
	ptrdiff_t start[3];
	double c[3];
	size_t n[3];

	ct_crop_body(c, v->data, v->n, -300);
	for (int a = 0; a < 3; a++) {
		const size_t want = 96, s = (size_t)d->factor[a];

		n[a] = (v->n[a] < want ? v->n[a] : want) / s * s;
		start[a] = ct_crop_start(v->n[a], n[a], c[a]);
	}
	must(ct_crop(box, v, n, start, 0, &err));
}

/* The bin of G: by its logarithm from 2^-8 on. */
static struct bin *bin_of(struct bin *to, double g)
{
	const double at = (log2(fmax(g, 1e-9)) + 8) * PARTS;

	return &to[(size_t)fmin(fmax(at, 0), BINS - 1)];
}

static void try(struct bin *to, const struct ct_vol *truth, const struct ct_degrade *d,
	double noise, uint64_t seed)
{
	const struct ct_upsample_rule rule = {.method = CT_UPSAMPLE_AUTO,
		.known = true,
		.by = *d,
		.noise = noise,
		.iterations = 300,
		.tolerance = 0.1};
	struct ct_upsample_report did;
	struct ct_separable plan = {0};
	struct ct_vol lo = {0}, x = {0};
	const size_t n = ct_vol_count(truth);
	size_t m[3];
	double mm[3];
	float *g;

	for (int a = 0; a < 3; a++)
		m[a] = ct_degrade_size(truth->n[a], d->factor[a]);
	must(ct_vol_alloc(&lo, m, &err));
	must(ct_degrade_plan(&plan, d, truth->n, env.par, &err));
	ct_separable_apply(&plan, lo.data, truth->data, env.par);
	ct_separable_free(&plan);
	ct_degrade_affine(lo.affine, truth->affine, truth->n, d);
	if (noise > 0)
		ct_degrade_noise(lo.data, ct_vol_count(&lo), noise, seed, env.par);
	must(ct_upsample(&x, &lo, &rule, &did, &env, &err));
	must(ct_alloc(&g, n, sizeof *g, &err));
	ct_vol_spacing(&x, mm);
	must(ct_expected_gradient(g, x.data, x.n, mm, d, &env, &err));
	for (size_t i = 0; i < n; i++) {
		const double off = (double)x.data[i] - (double)truth->data[i];

		struct bin *bin = bin_of(to, (double)g[i]);

		bin->n++;
		bin->g += (double)g[i];
		bin->square += off * off + 1; /* values are whole HU */
	}
	free(g);
	ct_vol_free(&lo);
	ct_vol_free(&x);
}

static void look(const char *path, uint64_t seed)
{
	const struct ct_degrade eight = operator_of(CT_EXPECTED_WELL, 8);
	struct ct_vol v = {0}, middle = {0};
	double z;

	must(ct_vol_read_hu(path, &v, &env, &err));
	cut(&middle, &v, &eight);
	z = sharp(&middle);
	ct_vol_free(&middle);
	fprintf(stderr, "%s: %.2f\n", path, z);
	for (int kind = z < HALF ? CT_EXPECTED_WELL_THICK : 0; kind < CT_EXPECTED_KINDS; kind++)
		for (int f = 0; f < FACTORS; f++) {
			const struct ct_degrade d = operator_of(kind, factors[f]);
			struct ct_vol truth = {0};

			cut(&truth, &v, &d);
			for (int q = 0; q < 2; q++) {
				const size_t which =
					q ? 1 + (seed + (uint64_t)f) % (NOISES - 1) : 0;

				try(all[kind][f][which], &truth, &d, noises[which], seed);
			}
			ct_vol_free(&truth);
		}
	ct_vol_free(&v);
}

/* One step; returns the mean of what it lowers, before it. */
static double step(double k[CT_EXPECTED_TERMS], struct bin x[NOISES][BINS])
{
	double up[CT_EXPECTED_TERMS] = {0}, down[CT_EXPECTED_TERMS] = {0}, cost = 0, n = 0;

	for (int i = 0; i < NOISES * BINS; i++) {
		const struct bin *b = &x[i / BINS][i % BINS];
		double t[CT_EXPECTED_TERMS], variance = 0;

		if (b->n == 0)
			continue;
		ct_expected_terms(t, b->g / b->n, noises[i / BINS]);
		for (int q = 0; q < CT_EXPECTED_TERMS; q++)
			variance += k[q] * t[q];
		variance = fmax(variance, 1);
		cost += 0.5 * b->n * log(variance) + 0.5 * b->square / variance;
		n += b->n;
		for (int q = 0; q < CT_EXPECTED_TERMS; q++) {
			up[q] += b->square / (variance * variance) * t[q];
			down[q] += b->n * t[q] / variance;
		}
	}
	for (int q = 0; q < CT_EXPECTED_TERMS; q++)
		k[q] *= down[q] > 0 ? sqrt(up[q] / down[q]) : 0;
	return n > 0 ? cost / n : 0;
}

static void fit(const char *name, struct bin x[NOISES][BINS], const char *end)
{
	double k[CT_EXPECTED_TERMS] = {50, 0.1, 0.05, 5, 1}, cost = 0;

	for (int i = 0; i < STEPS; i++)
		cost = step(k, x);
	fprintf(stderr, "%s: %.4f\n", name, cost);
	for (int q = 0; q < CT_EXPECTED_TERMS; q++)
		printf("%s%.3g", q ? ", " : "{{",
			k[q] > 1e-6 ? k[q] : 0); /* they end at 0 slowly */
	printf("}}%s", end);
}

int main(int argc, char **argv)
{
	size_t threads = 1;
	int first = 1;

	if (argc > 2 && strcmp(argv[1], "-t") == 0) {
		threads = (size_t)atoi(argv[2]);
		first = 3;
	}
	must(ct_simd_use(getenv("CTSR_CPU"), &err));
	must(ct_par_alloc(&env.par, threads ? threads : 1, &err));
	for (int s = first; s < argc; s++)
		look(argv[s], (uint64_t)(s - first));
	for (int kind = 0; kind < CT_EXPECTED_KINDS; kind++) {
		printf("\t[CT_EXPECTED_%s] = {", names[kind]);
		for (int f = 0; f < FACTORS; f++)
			fit(names[kind], all[kind][f], f + 1 < FACTORS ? ",\n\t\t" : "},\n");
	}
	ct_par_free(env.par);
	return 0;
}
