/* superres.c: refine a CT with libctsr.
 *
 *     cc superres.c -o superres $(pkg-config --cflags --libs ctsr)
 *     ./superres low.nii high.nii 4
 *
 * Without a prior file (4th argument) total variation inverts blur and sampling; with one, such as
 * slices.safetensors, a network adds the detail that it predicts.
 * SPDX-License-Identifier: Apache-2.0
 */
#include <ctsr.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static int progress(void *user, const char *what, size_t done, size_t total)
{
	(void)user;
	fprintf(stderr, "\r%s: %zu of %zu  ", what, done, total);
	return 0; /* 1 cancels */
}

int main(int argc, char **argv)
{
	char *end = "";
	double factor = 0;
	ctsr_volume *in = NULL, *out = NULL;
	ctsr_superres_report report = {.size = sizeof report};
	ctsr_superres_options o;
	ctsr_context c = {.size = sizeof c};
	ctsr_error e;
	int rc;

	if (argc > 3)
		factor = strtod(argv[3], &end);
	if (argc < 4 || argc > 5 || *end || !(factor > 0)) {
		fprintf(stderr, "usage: superres IN OUT FACTOR [PRIOR]\n");
		return CTSR_USAGE;
	}
	if (access(argv[2], F_OK) == 0) { /* said now, not when all is done */
		fprintf(stderr, "%s: exists\n", argv[2]);
		return CTSR_OUTPUT;
	}
	c.progress = progress;
	ctsr_superres_options_init(&o, sizeof o);
	o.factor[0] = o.factor[1] = o.factor[2] = factor;
	o.method = argc > 4 ? CTSR_PRIOR : CTSR_TV;
	o.prior_file = argc > 4 ? argv[4] : NULL;
	rc = ctsr_volume_read(&in, argv[1], ctsr_formats_all(), &e) ||
	     ctsr_superres(&out, NULL, &report, in, &o, &c, &e) ||
	     ctsr_volume_write(out, argv[2], ctsr_nifti(), &c, &e);
	fprintf(stderr, "\n%s\n", rc ? e.message : "done");
	if (!rc)
		printf("residual %.4g HU\n", report.residual);
	ctsr_volume_free(in);
	ctsr_volume_free(out);
	return rc ? e.code : 0;
}
