/* weights.h: what a fuzz target of a reader of weights does with a file. */
#ifndef CT_FUZZ_WEIGHTS_H
#define CT_FUZZ_WEIGHTS_H
#include "core/tensors.h"
#include "driver.h"

#include <stdio.h>
#include <stdlib.h>

typedef int weights_reader(FILE *f, const char *name, struct ct_tensors *w, struct ct_err *e);

/* Read f (NULL: nothing is done) and close it: all numbers, or an error and nothing. */
static void weights_look(FILE *f, weights_reader *read)
{
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	float sum = 0;

	if (!f)
		return;
	if (read(f, "fuzz", &w, &e) == 0) {
		for (size_t k = 0; k < w.n; k++)
			for (size_t i = 0, n = ct_tensor_count(&w.t[k]); i < n; i++)
				sum += w.t[k].data[i];
	} else if (w.t || w.meta.n || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += e.code == CT_OK && !(sum > 1e38f); /* so that the numbers are read */
	fclose(f);
	ct_tensors_free(&w);
}

#endif
