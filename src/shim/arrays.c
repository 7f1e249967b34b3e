/* arrays.c: see arrays.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "shim/arrays.h"
#include "shim/reader.h"

#include <stdlib.h>
#include <string.h>

void ct_arrays_free(struct ct_arrays *a)
{
	for (size_t i = 0; i < a->n; i++)
		free(a->a[i].data);
	free(a->a);
	*a = (struct ct_arrays){0};
}

struct ct_array *ct_arrays_add(struct ct_arrays *a, const char *name, struct ct_err *e)
{
	struct ct_array *x;

	if (a->n == CT_ARRAYS) {
		ct_fail(e, CT_EINPUT, "more than %d arrays", CT_ARRAYS);
		return NULL;
	}
	if (ct_grow(&a->a, &a->room, a->n + 1, sizeof *a->a, e))
		return NULL;
	x = &a->a[a->n++];
	*x = (struct ct_array){0};
	strncpy(x->name, name, sizeof x->name - 1);
	return x;
}

int ct_array_alloc(struct ct_array *x, struct ct_err *e)
{
	size_t n = 1;

	for (size_t i = 0; i < x->dims; i++)
		if (ct_size_mul(&n, n, x->n[i], x->name, e))
			return -1;
	if (n == 0)
		return ct_fail(e, CT_EINPUT, "%s: has no numbers", x->name);
	x->count = n;
	return ct_alloc(&x->data, n, sizeof *x->data, e);
}

/* One array after the other, till one has no name. */
static int take(FILE *f, void *ctx, struct ct_err *e)
{
	struct ct_arrays *a = ctx;
	struct ct_array in, *x;

	while (fread(&in, sizeof in, 1, f) == 1) {
		in.name[sizeof in.name - 1] = in.text[sizeof in.text - 1] = '\0';
		in.data = NULL;
		if (!*in.name)
			return 0;
		x = ct_arrays_add(a, in.name, e);
		if (!x || in.dims > CT_ARRAY_DIMS)
			return x ? 1 : -1;
		*x = in;
		if (in.count && (ct_array_alloc(x, e) || x->count != in.count))
			return -1;
		if (in.count && fread(x->data, sizeof *x->data, in.count, f) != in.count)
			return 1;
	}
	return 1;
}

int ct_arrays_read(struct ct_arrays *a, const char *path, struct ct_err *e)
{
	static const struct ct_reader reader = {
		"ct-arrays", "file", "files of MATLAB and HDF5", "ctsr-scans", "--with-hdf5"};

	struct ct_reading s = {0};
	int rc = ct_reading_next(&s, &reader, path, take, a, e);

	ct_reading_end(&s);
	if (rc)
		ct_arrays_free(a);
	return rc;
}

struct ct_array *ct_arrays_find(const struct ct_arrays *a, const char *name)
{
	const size_t n = strlen(name);

	for (size_t i = 0; i < a->n; i++) {
		const size_t all = strlen(a->a[i].name);

		if (all >= n && strcmp(a->a[i].name + all - n, name) == 0 &&
			(all == n || a->a[i].name[all - n - 1] == '.'))
			return &a->a[i];
	}
	return NULL;
}
