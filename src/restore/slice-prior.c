/* slice-prior.c: the networks of a prior, read; see restore.h. */
#include "config.h"
#include "restore/restore.h"

#include <stdio.h>

int ct_slice_prior_alloc(struct ct_slice_prior *p, const struct ct_tensors *w, struct ct_err *e)
{
	static const char *const kinds[] = {"", "thick-", "again-", "again-thick-"};
	char name[40], tensor[64];

	for (size_t s = 2; s <= CT_PATCH_CELL; s++)
		for (size_t k = 0; k < 4 && p->n < CT_SLICE_PRIOR_MOST; k++) {
			struct ct_slice_network *r = &p->r[p->n];

			snprintf(name, sizeof name, "%s%zu", kinds[k], s);
			snprintf(tensor, sizeof tensor, "%s.shape", name);
			if (!ct_tensors_find(w, tensor))
				continue;
			p->again[p->n++] = k >= 2;
			if (ct_slice_network_get(r, w, name, e))
				return -1;
			if (r->shape.cell != s || r->shape.swap != (k % 2 == 0))
				return ct_fail(
					e, CT_EINPUT, "tensor \"%s\" is of other slices", tensor);
		}
	if (p->n == 0)
		return ct_fail(e, CT_EINPUT, "no prior of slices: no tensor \"4.shape\"");
	return ct_volume_network_get(&p->volume, w, "volume-4", e);
}

void ct_slice_prior_free(struct ct_slice_prior *p)
{
	for (size_t i = 0; i < p->n; i++)
		ct_slice_network_free(&p->r[i]);
	ct_volume_network_free(&p->volume);
	p->n = 0;
}
