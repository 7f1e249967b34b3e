/* The paper on a CT: paper IN OUT.nii [FACTOR [PRIOR [VIEWS STEPS GAUSSIANS ITERATIONS]]]
 *
 * The low-resolution CT is projected, a diffusion prior makes its projections FACTOR times finer,
 * Gaussians are fitted to what these have beyond the projections of the upsampled CT, and are added
 * to it. As ct-project, ct-ddnm, ct-upsample, ct-nabgs and ct-compose one after the other.
 *
 *     cc paper.c $(pkg-config --cflags --libs ctsr) SPDX-License-Identifier: Apache-2.0 */
#include <ctsr.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct run {
	ctsr_volume *in, *base, *out;
	ctsr_projections *low, *high;
	ctsr_gaussians *added;
	ctsr_error e;
};

/* Word i of the command line as a number, or what stands for it. */
static size_t number(int argc, char **argv, int i, size_t unless)
{
	return i < argc ? strtoul(argv[i], NULL, 10) : unless;
}

/* Are IN and OUT there, and numbers where numbers stand? */
static int well_put(int argc, char **argv)
{
	for (int i = 3; i < argc; i++)
		if (i != 4 && (!*argv[i] || argv[i][strspn(argv[i], "0123456789")]))
			return 0;
	return argc >= 3 && argc <= 9 && (argc < 4 || number(argc, argv, 3, 0) > 0);
}

static int progress(void *user, const char *what, size_t done, size_t total)
{
	(void)user;
	fprintf(stderr, "\r%-20s %zu of %zu ", what, done, total);
	return 0;
}

static int paper(struct run *r, int argc, char **argv)
{
	const ctsr_context c = {.size = sizeof c, .progress = progress};
	const size_t factor = number(argc, argv, 3, 4);
	ctsr_geometry scan;
	ctsr_ddnm_options ddnm;
	ctsr_superres_options up;
	ctsr_fit_options fit = {.size = sizeof fit,
		.gaussians = number(argc, argv, 7, 0),
		.iterations = number(argc, argv, 8, 0)};

	if (ctsr_volume_read(&r->in, argv[1], ctsr_formats_all(), &r->e) ||
		ctsr_geometry_init(&scan, sizeof scan, r->in, &r->e))
		return -1;
	scan.views = number(argc, argv, 5, scan.views);
	ctsr_ddnm_options_init(&ddnm, sizeof ddnm);
	ddnm.factor = factor;
	ddnm.prior_file = argc > 4 && *argv[4] ? argv[4] : NULL;
	ddnm.steps = number(argc, argv, 6, 0);
	ctsr_upsample_options_init(&up, sizeof up);
	up.method = CTSR_LINEAR;
	up.factor[0] = up.factor[1] = up.factor[2] = (double)factor;
	if (ctsr_project(&r->low, r->in, &scan, &c, &r->e) ||
		ctsr_ddnm(&r->high, NULL, r->low, &ddnm, &c, &r->e) ||
		ctsr_upsample(&r->base, NULL, NULL, r->in, &up, &c, &r->e) ||
		ctsr_gaussians_fit(&r->added, r->high, r->base, &fit, &c, &r->e))
		return -1;
	return ctsr_compose(&r->out, NULL, r->base, r->added, NULL, &c, &r->e) ||
	       ctsr_volume_write(r->out, argv[2], ctsr_nifti(), NULL, &r->e);
}

int main(int argc, char **argv)
{
	struct run r = {.in = NULL};
	int rc;

	if (!well_put(argc, argv)) {
		fprintf(stderr,
			"usage: paper IN OUT.nii [FACTOR [PRIOR [VIEWS STEPS GAUSSIANS ITERATIONS]]]\n");
		return CTSR_USAGE;
	}
	if (access(argv[2], F_OK) == 0) { /* said now, not when all is done */
		fprintf(stderr, "%s: exists\n", argv[2]);
		return CTSR_OUTPUT;
	}
	rc = paper(&r, argc, argv);
	if (rc)
		fprintf(stderr, "\n%s\n", r.e.message);
	ctsr_volume_free(r.in);
	ctsr_volume_free(r.base);
	ctsr_volume_free(r.out);
	ctsr_projections_free(r.low);
	ctsr_projections_free(r.high);
	ctsr_gaussians_free(r.added);
	return rc ? r.e.code : 0;
}
