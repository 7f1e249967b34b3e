/* as-hu.c: see as-hu.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "refine/as-hu.h"
#include "core/meta.h"
#include "inverse/upsample.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

bool ct_as_hu_maps(const struct ct_as_hu *s)
{
	return s->times != 1 || s->plus != 0;
}

struct ct_as_hu ct_as_hu_of(const struct ct_vol *v)
{
	const char *quantity = ct_meta_get(&v->meta, CT_META_QUANTITY);
	struct ct_as_hu s = {.times = 1};
	double spread, least = (double)INFINITY;

	if (!quantity || strcmp(quantity, CT_QUANTITY_OTHER) != 0)
		return s;
	spread = ct_upsample_spread(v);
	if (!(spread > 0))
		return s;
	for (size_t i = 0; i < ct_vol_count(v); i++)
		least = fmin(least, (double)v->data[i]);
	s.times = exp2(round(log2(CT_AS_HU_SPREAD / spread)));
	s.plus = round(CT_AS_HU_LEAST - s.times * least);
	return s;
}

static int scale_noise(struct ct_meta *m, double times, struct ct_err *e)
{
	double noise;
	const int none = ct_meta_numbers(m, CT_META_NOISE, 1, &noise, e);

	return none < 0 ? -1 : none ? 0 : ct_meta_setf(m, e, CT_META_NOISE, "%.9g", times * noise);
}

int ct_as_hu(struct ct_vol *own, const struct ct_vol **use, const struct ct_as_hu *s,
	const struct ct_vol *v, struct ct_err *e)
{
	*use = v;
	if (!ct_as_hu_maps(s))
		return 0;
	*use = own;
	if (ct_vol_like(own, v, e) || ct_meta_copy(&own->meta, &v->meta, e) ||
		scale_noise(&own->meta, s->times, e))
		return -1;
	for (size_t i = 0; i < ct_vol_count(v); i++)
		own->data[i] = (float)(s->times * (double)v->data[i] + s->plus);
	return 0;
}

int ct_as_hu_back(struct ct_vol *v, const struct ct_as_hu *s, struct ct_err *e)
{
	if (!ct_as_hu_maps(s))
		return 0;
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = (float)(((double)v->data[i] - s->plus) / s->times);
	return scale_noise(&v->meta, 1 / s->times, e);
}

void ct_as_hu_words(char *to, size_t room, const struct ct_as_hu *s)
{
	const size_t n = strlen(to);

	if (ct_as_hu_maps(s))
		snprintf(to + n, room - n,
			"%sthe unit of the values is not known: 1 counts as %g HU", *to ? "; " : "",
			s->times);
}
