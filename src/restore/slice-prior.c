/* slice-prior.c: the networks of a prior, read; see restore.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "restore/restore.h"

#include <math.h>
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
	for (size_t k = 0; k < CT_SLICE_PRIOR_VOLUMES; k++) {
		if (ct_volume_network_get(&p->volume[p->volumes], w, 2 + k / 2, k % 2, e))
			return -1;
		p->volumes += p->volume[p->volumes].blocks > 0;
	}
	return 0;
}

void ct_slice_prior_free(struct ct_slice_prior *p)
{
	for (size_t i = 0; i < p->n; i++)
		ct_slice_network_free(&p->r[i]);
	for (size_t i = 0; i < p->volumes; i++)
		ct_volume_network_free(&p->volume[i]);
	p->n = p->volumes = 0;
}

double ct_slice_prior_bytes(const struct ct_slice_prior *p)
{
	double n = 0;

	for (size_t i = 0; i < p->n; i++)
		n += (double)p->r[i].at[CT_PARTS] +
		     (double)(1 + p->r[i].components) * (double)ct_patch_count(&p->r[i].shape);
	n *= sizeof(float);
	for (size_t i = 0; i < p->volumes; i++)
		n += ct_volume_network_held(&p->volume[i]);
	return n;
}

double ct_slice_prior_work(
	const struct ct_slice_prior *p, const struct ct_degrade *d, bool again, size_t threads)
{
	bool axes[3];
	const size_t cell = ct_slice_prior_knows(axes, p, d, again);
	double most = 0;

	for (size_t i = 0; i < p->n; i++)
		if (p->again[i] == again && p->r[i].shape.cell == cell)
			most = fmax(most, ct_predict_bytes(&p->r[i], threads));
	return most;
}

const struct ct_volume_network *ct_slice_prior_volume(
	const struct ct_slice_prior *p, const struct ct_degrade *d)
{
	bool axes[3], coarse[3];
	size_t cell, least = CT_PATCH_CELL;

	for (int a = 0; a < 3; a++) {
		coarse[a] = d->factor[a] > 1;
		if (coarse[a] && d->factor[a] < (double)least)
			least = (size_t)d->factor[a];
	}
	cell = ct_slice_prior_knows(axes, p, d, false);
	for (size_t i = 0; i < p->volumes; i++)
		if (p->volume[i].factor == cell && cell <= least &&
			ct_volume_network_fits(&p->volume[i], coarse))
			return &p->volume[i];
	return NULL;
}

int ct_slice_prior_passes(const struct ct_slice_prior *p, const struct ct_degrade *d)
{
	bool axes[3];

	return 1 + (ct_slice_prior_knows(axes, p, d, true) > 0) +
	       (ct_slice_prior_volume(p, d) != NULL);
}
