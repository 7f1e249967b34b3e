/* metrics-harm.c: see metrics-harm.h. */
#include "config.h"
#include "tools/metrics-harm.h"
#include "cli/cli.h"
#include "quality/hfen.h"
#include "resolution/degrade.h"

#include <math.h>
#include <stdlib.h>

static int parse_sizes(struct metrics_harm *h, const char *text, struct ct_err *e)
{
	double v[METRICS_SIZES];

	h->sizes = 1;
	for (const char *c = text; *c; c++)
		h->sizes += *c == ',';
	if (h->sizes > METRICS_SIZES)
		return ct_fail(e, CT_EUSAGE, "--blob-sigma: '%s' is more than %d numbers", text,
			METRICS_SIZES);
	if (ct_cli_numbers("blob-sigma", text, ',', h->sizes, false, v, e))
		return -1;
	for (size_t i = 0; i < h->sizes; i++) {
		if (!(v[i] >= 0.3 && v[i] <= 100))
			return ct_fail(
				e, CT_EUSAGE, "--blob-sigma: %g is outside [0.3, 100]", v[i]);
		for (int a = 0; a < 3; a++)
			h->sigma[i][a] = v[i];
	}
	return 0;
}

static int factor_of(double factor[3], const char *text, const struct ct_meta *test, bool *known,
	struct ct_err *e)
{
	struct ct_degrade d;
	int rc;

	*known = text != NULL;
	if (text) {
		if (ct_cli_numbers("factor", text, ',', 3, true, factor, e))
			return -1;
		for (int a = 0; a < 3; a++)
			if (!(factor[a] >= 1 && factor[a] <= 1024))
				return ct_fail(e, CT_EUSAGE, "--factor: %g is outside [1, 1024]",
					factor[a]);
		return 0;
	}
	if (!ct_meta_get(test, CT_META_UPSAMPLE))
		return 0;
	rc = ct_degrade_get(test, &d, e);
	*known = rc == 0;
	for (int a = 0; a < 3 && *known; a++)
		factor[a] = d.factor[a];
	return rc < 0 ? -1 : 0;
}

int metrics_harm_sizes(struct metrics_harm *h, const char *text, const char *factor,
	const struct ct_meta *test, struct ct_err *e)
{
	static const double of_lr[] = {0.75, 1.5};
	double by[3];
	bool known;

	if (text)
		return parse_sizes(h, text, e);
	if (factor_of(by, factor, test, &known, e))
		return -1;
	if (!known)
		return parse_sizes(h, "1.5", e);
	h->sizes = sizeof of_lr / sizeof *of_lr;
	for (size_t i = 0; i < h->sizes; i++)
		for (int a = 0; a < 3; a++)
			h->sigma[i][a] = fmin(of_lr[i] * by[a], 100);
	return 0;
}

double metrics_harm_volumes(const struct metrics_harm *h)
{
	return h->structures ? 5.25
	       : h->hfen     ? 5
	       : h->tissues  ? 4.25
	       : h->fsc      ? 4
	       : h->flat     ? 3.25
			     : 0;
}

double metrics_harm_fixed(
	const struct metrics_harm *h, const size_t n[static 3], const struct ct_env *env)
{
	const double x = (double)n[0], z = (double)n[2], longest = fmax(x, fmax((double)n[1], z)),
		     lines = fmax(32 * x * z, 256 * longest);

	return h->fsc ? lines * (double)ct_par_threads(env->par) + 16 * longest * z : 0;
}

static int structures(struct metrics_figures *f, const struct metrics_harm *h,
	const struct ct_vol *ref, const struct ct_vol *test, const struct ct_vol *mask,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_structures s[METRICS_SIZES];

	for (size_t i = 0; i < h->sizes; i++)
		if (ct_structures(&s[i], ref, test, mask, h->sigma[i], h->contrast, env, e))
			return -1;
	metrics_figures_structures(f, s, h->sizes, (const double(*)[3])h->sigma, ref);
	return 0;
}

static int correlation(struct metrics_figures *f, const struct metrics_harm *h,
	const struct ct_vol *ref, const struct ct_vol *test, const struct ct_env *env,
	struct ct_err *e)
{
	struct ct_fsc c;
	int rc = ct_fsc(&c, ref, test, env, e);

	if (rc == 0) {
		metrics_figures_fsc(f, &c);
		rc = h->curve ? metrics_fsc(h->curve, &c, env, e) : 0;
	}
	ct_fsc_free(&c);
	return rc;
}

/* All that goes by tissues, the map of which is made once. */
static int by_tissue(struct metrics_figures *f, const struct metrics_harm *h,
	const struct ct_vol *ref, const struct ct_vol *test, const struct ct_vol *mask,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_tissue_errors errors;
	unsigned char *map;
	double share[2];
	size_t voxels;
	int rc = -1;

	if (ct_tissue_map(&map, ref, h->deep, env, e))
		return -1;
	if (h->flat) {
		if (ct_tissue_flat(&share[0], &voxels, map, ref, mask, h->flat_step, env, e) ||
			ct_tissue_flat(&share[1], &voxels, map, test, mask, h->flat_step, env, e))
			goto out;
		metrics_figures_flat(f, voxels, share);
	}
	if (h->tissues) {
		if (ct_tissue_errors(&errors, map, ref, test, mask, env, e))
			goto out;
		metrics_figures_tissues(f, &errors);
	}
	rc = 0;
out:
	free(map);
	return rc;
}

int metrics_harm(struct metrics_figures *f, const struct metrics_harm *h, const struct ct_vol *ref,
	const struct ct_vol *test, const struct ct_vol *mask, const struct ct_env *env,
	struct ct_err *e)
{
	double hfen;

	if (h->structures && structures(f, h, ref, test, mask, env, e))
		return -1;
	if (h->hfen) {
		if (ct_hfen(&hfen, ref, test, mask, env, e))
			return -1;
		metrics_figures_hfen(f, hfen);
	}
	if (h->fsc && correlation(f, h, ref, test, env, e))
		return -1;
	return (h->flat || h->tissues) && by_tissue(f, h, ref, test, mask, env, e) ? -1 : 0;
}
