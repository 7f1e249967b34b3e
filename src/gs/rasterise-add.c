/* rasterise-add.c: Gaussians into pixels; see rasterise.h and rasterise-batch.h. */
#include "config.h"
#include "gs/rasterise-batch.h"

CT_INLINE void add_panel(float *p, size_t pitch, int nb, int32_t c, int32_t count,
	const struct piece *o, const struct ct_pixel_gaussian *d)
{
	const ct_f32 bend = ct_f32_set(d->bend), least = ct_f32_set(d->least);
	const ct_f32 amp = ct_f32_set(d->amp);
	struct walk k;

	walk_from(&k, nb, c, o, d);
	for (int32_t m = 0; m < count; m++, p += pitch)
#pragma GCC unroll 4
		for (int b = 0; b < nb; b++) {
			const ct_f32 e = where(k.e[b] >= least, k.e[b]);

			ct_f32_store(p + b * L, ct_f32_load(p + b * L) + amp * e);
			k.e[b] *= k.step[b];
			k.step[b] *= bend;
		}
}

CT_INLINE void add_gentle(float *p, size_t pitch, int32_t count, const struct piece *o,
	const struct ct_pixel_gaussian *d)
{
	for (int32_t c = o->lo; c <= o->hi; c += PANEL * L) {
		float *at = p + (d->col + c);
		int32_t left = o->hi - c;

		if (left < L)
			add_panel(at, pitch, 1, c, count, o, d);
		else if (left < 2 * L)
			add_panel(at, pitch, 2, c, count, o, d);
		else if (left < 3 * L)
			add_panel(at, pitch, 3, c, count, o, d);
		else
			add_panel(at, pitch, 4, c, count, o, d);
	}
}

CT_INLINE void add_steep(float *p, size_t pitch, size_t w, int32_t r, int32_t count,
	const struct ct_pixel_gaussian *d)
{
	struct batch o;

	rows_of(&o, w, r, count, d);
	for (size_t m = 0; m < o.n; m++, p += pitch)
		for (int32_t c = o.lo[m]; c <= o.hi[m]; c += L) {
			float *at = p + (d->col + c);
			ct_f32 x;

			ct_f32_store(at, d->amp * row_of(&x, &o, m, c, d) + ct_f32_load(at));
		}
}

CT_INLINE void add_batch(float *img, size_t pitch, size_t w, size_t r0, struct batch *o)
{
	close_batch(o, w);
	for (size_t i = 0; i < o->n; i++) {
		const struct piece p = {o->y[i], o->lo[i], o->hi[i]};
		float *at = img + ((size_t)o->r[i] - r0) * pitch;

		if (gentle(o->d[i]))
			add_gentle(at, pitch, o->count[i], &p, o->d[i]);
		else
			add_steep(at, pitch, w, o->r[i], o->count[i], o->d[i]);
	}
	o->n = 0;
}

void CT_SIMD_HERE(ct_rasterise_add)(float *img, size_t pitch, size_t w, size_t r0, size_t r1,
	size_t n, const uint32_t *item, const struct ct_pixel_gaussian *all)
{
	struct batch o;

	o.n = 0;
	for (size_t i = 0; i < n; i++) {
		const struct ct_pixel_gaussian *d = all + (item ? item[i] : i);
		int32_t r = d->first > (int32_t)r0 ? d->first : (int32_t)r0;
		int32_t end = d->end < (int32_t)r1 ? d->end : (int32_t)r1;

		while (r < end) {
			int32_t next = next_block(r, end);

			push(&o, r, next - r, d);
			r = next;
			if (o.n == BATCH)
				add_batch(img, pitch, w, r0, &o);
		}
		if (item && i + AHEAD < n)
			__builtin_prefetch(all + item[i + AHEAD]);
	}
	add_batch(img, pitch, w, r0, &o);
}
