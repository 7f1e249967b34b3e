/* ssim-block-real.h: ssim-block.c for numbers that are REAL, float and double.
 *
 * It takes NAME(x) for its names, and VECTOR of LANES of REAL with LOAD, STORE, MIN, MAX and
 * LOAD_FLOATS. It undefines what it takes.
 * SPDX-License-Identifier: Apache-2.0
 */
#define WORK struct NAME(work)

/* The scratch of one call. */
WORK
{
	REAL *products; /* [MAPS][TZ + 2 R][pitch] */
	REAL *rows;     /* [MAPS][TZ][pitch] */
	REAL *chunk;    /* [TZ][MAPS][CY + 2 R][TX] */
	REAL *s;        /* [CY][TX] */
	REAL *weight;   /* [TX] */
	double count;   /* sum of it */
	size_t pitch;   /* PX, or TX if x is not filtered */
	REAL tap[R + 1], lo, hi, zero, scale, c1, c2, unbias;
};

CT_INLINE void NAME(lay_out)(WORK *w, const struct ct_ssim_block *b, REAL *scratch)
{
	double middle = 1;

	w->products = scratch;
	w->rows = w->products + CT_SSIM_PRODUCTS;
	w->chunk = w->rows + CT_SSIM_ROWS;
	w->s = w->chunk + CT_SSIM_CHUNK;
	w->weight = w->s + CT_SSIM_S;
	w->pitch = b->radius[0] ? PX : TX;
	for (size_t k = 0; k < b->rule->radius; k++) {
		w->tap[k] = (REAL)b->rule->tap[k];
		middle -= 2 * (double)w->tap[k];
	}
	w->tap[b->rule->radius] = (REAL)middle; /* so that rounded taps sum to one */
	w->lo = (REAL)b->map->lo;
	w->hi = (REAL)b->map->hi;
	w->zero = (REAL)b->map->zero;
	w->scale = (REAL)b->map->scale;
	w->c1 = (REAL)(2 * b->rule->c1);
	w->c2 = (REAL)(2 * b->rule->c2);
	w->unbias = (REAL)b->rule->unbias;
}

/* The vector of sum_k tap[k] in[k step + lane]; taps are symmetric. Without a radius: in itself. */
CT_INLINE VECTOR NAME(window)(const REAL *in, size_t step, const size_t radius, const REAL *tap)
{
	VECTOR sum;

	if (radius == 0)
		return LOAD(in);
	sum = tap[radius] * LOAD(in + radius * step);
#pragma GCC unroll 5
	for (size_t k = 0; k < radius; k++)
		sum += tap[k] * (LOAD(in + k * step) + LOAD(in + (2 * radius - k) * step));
	return sum;
}

CT_INLINE void NAME(weigh)(REAL *restrict out, const REAL *restrict in, size_t step, size_t n,
	const size_t radius, const REAL *restrict tap)
{
	for (size_t j = 0; j < n; j += LANES)
		STORE(out + j, NAME(window)(in + j, step, radius, tap));
}

/* out[j] = sum_k tap[k] in[j + k step], j < n, a multiple of LANES. With the length of a row as
 * step and many rows as n it filters across rows. The radius is a constant to the compiler, which
 * unrolls. */
CT_INLINE void NAME(filter)(REAL *restrict out, const REAL *restrict in, size_t step, size_t n,
	size_t radius, const REAL *restrict tap)
{
	if (radius == 5)
		NAME(weigh)(out, in, step, n, 5, tap);
	else
		NAME(weigh)(out, in, step, n, 3, tap);
}

/* u = x + y, v = y - x, u^2, v^2 of LANES pixels into four maps that are `apart`. */
CT_INLINE void NAME(multiply)(
	REAL *out, size_t apart, const float *ref, const float *test, const WORK *w)
{
	const VECTOR lo = (VECTOR){0} + w->lo, hi = (VECTOR){0} + w->hi;
	const VECTOR x = MIN(MAX(LOAD_FLOATS(ref), lo), hi) - w->zero;
	const VECTOR y = MIN(MAX(LOAD_FLOATS(test), lo), hi) - w->zero;
	const VECTOR u = (x + y) * w->scale, v = (y - x) * w->scale;

	STORE(out, u);
	STORE(out + apart, v);
	STORE(out + 2 * apart, u * u);
	STORE(out + 3 * apart, v * v);
}

/* The same of n < LANES pixels. */
static void NAME(multiply_few)(
	REAL *out, size_t apart, const float *ref, const float *test, size_t n, const WORK *w)
{
	float x[LANES] = {0}, y[LANES] = {0};
	REAL maps[MAPS * LANES];

	memcpy(x, ref, n * sizeof *x);
	memcpy(y, test, n * sizeof *y);
	NAME(multiply)(maps, LANES, x, y, w);
	for (size_t m = 0; m < MAPS; m++)
		memcpy(out + m * apart, maps + m * LANES, n * sizeof *out);
}

/* Products of row y of slice z, columns from x0 - radius on; zero outside the volume. */
CT_INLINE void NAME(load)(const struct ct_ssim_block *b, const WORK *w, REAL *out, size_t apart,
	size_t x0, size_t y, size_t z)
{
	const size_t r = b->radius[0], from = x0 < r ? r - x0 : 0, pitch = w->pitch;
	const size_t end = b->n[0] + r - x0, to = end < pitch ? end : pitch, n = to - from;
	const size_t at = (z * b->n[1] + y) * b->n[0] + x0 + from - r;
	const float *ref = b->ref + at, *test = b->test + at;

	for (size_t m = 0; m < MAPS; m++) {
		memset(out + m * apart, 0, from * sizeof *out);
		memset(out + m * apart + to, 0, (pitch - to) * sizeof *out);
	}
	if (y + 1 < b->n[1]) /* the row that comes next is not where the machine expects it */
		for (size_t i = 0; i < n; i += 16) {
			__builtin_prefetch(ref + b->n[0] + i);
			__builtin_prefetch(test + b->n[0] + i);
		}
	out += from;
	if (n < LANES) {
		NAME(multiply_few)(out, apart, ref, test, n, w);
		return;
	}
	for (size_t i = 0; i + LANES < n; i += LANES)
		NAME(multiply)(out + i, apart, ref + i, test + i, w);
	NAME(multiply)(out + n - LANES, apart, ref + n - LANES, test + n - LANES, w);
}

/* Row y of the slices of the block, filtered along z and x, as row `row` of their chunks. */
CT_INLINE void NAME(fill)(
	const struct ct_ssim_block *b, WORK *w, const struct place *p, size_t row, size_t y)
{
	size_t rx = b->radius[0], rz = b->radius[2], deep = p->slices + 2 * rz;
	size_t apart = deep * w->pitch, layer = w->pitch;
	const REAL *rows = w->products;

	for (size_t k = 0; k < deep; k++) {
		size_t z = p->z0 + k - rz;

		if (p->z0 + k >= rz && z < b->n[2])
			NAME(load)(b, w, w->products + k * layer, apart, p->x0, y, z);
		else
			for (size_t m = 0; m < MAPS; m++)
				memset(w->products + m * apart + k * layer, 0,
					layer * sizeof *w->products);
	}
	if (rz > 0) {
		for (size_t m = 0; m < MAPS; m++)
			NAME(filter)
		(w->rows + m * p->slices * layer, w->products + m * apart, layer, p->slices * layer,
			rz, w->tap);
		rows = w->rows;
		apart = p->slices * layer;
	}
	for (size_t k = 0; k < p->slices * MAPS; k++) {
		REAL *out = w->chunk + k * LAYER + row * TX;
		const REAL *in = rows + k % MAPS * apart + k / MAPS * layer;

		if (rx > 0)
			NAME(filter)(out, in, 1, TX, rx, w->tap);
		else
			memcpy(out, in, TX * sizeof *out);
	}
}

/* Rows `row` .. end of the chunks, row k being y0 + k - radius. */
static void NAME(fill_rows)(
	const struct ct_ssim_block *b, WORK *w, const struct place *p, size_t row, size_t end)
{
	size_t ry = b->radius[1];

	for (; row < end; row++) {
		if (p->y0 + row >= ry && p->y0 + row - ry < b->n[1]) {
			NAME(fill)(b, w, p, row, p->y0 + row - ry);
			continue;
		}
		for (size_t k = 0; k < p->slices * MAPS; k++)
			memset(w->chunk + k * LAYER + row * TX, 0, TX * sizeof *w->chunk);
	}
}

/* What the TX voxels from column x0 on count: 0 or 1; and how many do. */
static void NAME(weights)(const struct ct_ssim_block *b, WORK *w, size_t x0, const float *mask)
{
	size_t c = b->crop[0], from = x0 < c ? c - x0 : 0, to = b->n[0] - x0;

	to = to > c ? to - c : 0;
	to = to < TX ? to : TX;
	memset(w->weight, 0, TX * sizeof *w->weight);
	w->count = 0;
	for (size_t i = from; i < to; i++) {
		w->weight[i] = mask && mask[i] == 0.0f ? 0 : 1;
		w->count += (double)w->weight[i];
	}
}

/* S of n pixels, from the maps of one slice, filtered along y. */
CT_INLINE void NAME(similarity)(
	const WORK *w, const REAL *restrict chunk, size_t n, const size_t radius)
{
	const VECTOR c1 = (VECTOR){0} + w->c1, c2 = (VECTOR){0} + w->c2;
	const REAL *restrict tap = w->tap;
	REAL *restrict s = w->s;

	for (size_t j = 0; j < n; j += LANES) {
		const REAL *in = chunk + j;
		const VECTOR mu = NAME(window)(in, TX, radius, tap);
		const VECTOR mv = NAME(window)(in + LAYER, TX, radius, tap);
		const VECTOR u2 = mu * mu, v2 = mv * mv;
		const VECTOR eu = NAME(window)(in + 2 * LAYER, TX, radius, tap);
		const VECTOR ev = NAME(window)(in + 3 * LAYER, TX, radius, tap);
		const VECTOR su = w->unbias * (eu - u2), sv = w->unbias * (ev - v2);

		STORE(s + j, (u2 - v2 + c1) * (su - sv + c2) / ((u2 + v2 + c1) * (su + sv + c2)));
	}
}

static void NAME(compare)(
	const struct ct_ssim_block *b, const WORK *w, const struct place *p, size_t slice)
{
	const REAL *chunk = w->chunk + slice * MAPS * LAYER;
	const size_t n = p->rows * TX, ry = b->radius[1];

	if (ry == 5)
		NAME(similarity)(w, chunk, n, 5);
	else if (ry == 3)
		NAME(similarity)(w, chunk, n, 3);
	else
		NAME(similarity)(w, chunk, n, 0);
}

/* sum of weight s, TERMS partial sums and then across. */
CT_INLINE double NAME(add_up)(const REAL *restrict s, const REAL *restrict weight)
{
	enum { PARTS = TERMS / CT_F64_LANES };
	ct_f64 part[PARTS] = {{0}};
	double all[TERMS], total = 0;

	for (size_t j = 0; j < TX; j += TERMS)
#pragma GCC unroll 16
		for (size_t i = 0; i < PARTS; i++)
			part[i] += NAME(terms)(
				weight + j + i * CT_F64_LANES, s + j + i * CT_F64_LANES);
	memcpy(all, part, sizeof all);
	for (size_t i = 0; i < TERMS; i++)
		total += all[i];
	return total;
}

CT_INLINE void NAME(add_columns)(double *restrict sum, double *restrict count,
	const REAL *restrict s, const REAL *restrict weight)
{
	for (size_t i = 0; i < TX; i++)
		sum[i] += (double)(weight[i] * s[i]);
	for (size_t i = 0; i < TX; i++)
		count[i] += (double)weight[i];
}

/* Add the S of one row to the sums of its slice, or slices. */
CT_INLINE void NAME(collect)(const struct ct_ssim_block *b, WORK *w, const struct place *p,
	size_t row, size_t slice, double *sum, double *count)
{
	size_t y = p->y0 + row, z = p->z0 + slice, at = b->axis == 1 ? y : z;
	const REAL *s = w->s + row * TX;

	if (y < b->crop[1] || y + b->crop[1] >= b->n[1])
		return;
	if (b->mask)
		NAME(weights)(b, w, p->x0, b->mask + (z * b->n[1] + y) * b->n[0] + p->x0);
	if (b->axis == 0) {
		NAME(add_columns)(sum + p->x0, count + p->x0, s, w->weight);
		return;
	}
	sum[at] += NAME(add_up)(s, w->weight);
	count[at] += w->count;
}

/* A chunk of rows: what the one before has left, the new rows, and their S. */
static void NAME(chunk)(
	const struct ct_ssim_block *b, WORK *w, const struct place *p, double *sum, double *count)
{
	const size_t carry = 2 * b->radius[1];

	for (size_t k = 0; k < p->slices * MAPS && p->y0 > 0; k++)
		memcpy(w->chunk + k * LAYER, w->chunk + k * LAYER + CY * TX,
			carry * TX * sizeof *w->chunk);
	NAME(fill_rows)(b, w, p, p->y0 > 0 ? carry : 0, p->rows + carry);
	for (size_t z = 0; z < p->slices; z++) {
		if (p->z0 + z < b->crop[2] || p->z0 + z + b->crop[2] >= b->n[2])
			continue;
		NAME(compare)(b, w, p, z);
		for (size_t y = 0; y < p->rows; y++)
			NAME(collect)(b, w, p, y, z, sum, count);
	}
}

void CT_SIMD_HERE(BLOCK)(const struct ct_ssim_block *b, size_t z0, size_t slices, REAL *scratch,
	double *sum, double *count)
{
	struct place p = {.z0 = z0, .slices = slices};
	WORK w;

	NAME(lay_out)(&w, b, scratch);
	for (p.x0 = 0; p.x0 < b->n[0]; p.x0 += TX) {
		NAME(weights)(b, &w, p.x0, NULL);
		for (p.y0 = 0; p.y0 < b->n[1]; p.y0 += CY) {
			p.rows = b->n[1] - p.y0 < CY ? b->n[1] - p.y0 : CY;
			NAME(chunk)(b, &w, &p, sum, count);
		}
	}
}

#undef REAL
#undef NAME
#undef VECTOR
#undef LANES
#undef LOAD
#undef STORE
#undef LOAD_FLOATS
#undef MIN
#undef MAX
#undef BLOCK
#undef WORK
