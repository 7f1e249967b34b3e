/* fourier.c: see fourier.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/fourier.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>

int ct_fourier_plan(struct ct_fourier *f, size_t n, struct ct_err *e)
{
	size_t left = n;

	*f = (struct ct_fourier){.n = n};
	if (ct_alloc(&f->root, 2 * n, sizeof *f->root, e))
		return -1;
	for (size_t k = 0; k < n; k++) {
		const double angle = 2 * M_PI * (double)k / (double)n;

		f->root[k] = cos(angle);
		f->root[n + k] = -sin(angle);
	}
	while (left % 4 == 0) {
		f->factor[f->factors++] = 4;
		left /= 4;
	}
	for (size_t p = 2; left > 1; p++) {
		if (p * p > left)
			p = left;
		for (; left % p == 0; left /= p)
			f->factor[f->factors++] = p;
	}
	return 0;
}

void ct_fourier_free(struct ct_fourier *f)
{
	free(f->root);
	*f = (struct ct_fourier){0};
}
