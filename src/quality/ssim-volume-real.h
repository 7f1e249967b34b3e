/* ssim-volume-real.h: the inner part of ssim-volume.c, which includes it for REAL float and double.
 *
 * NAME(x) makes its names. Vectors are of one cache line, spelled out; loops over a constant count
 * with one result the compiler vectorises itself.
 */
#define LANES (64 / sizeof(REAL))
#define VECTOR NAME(vector)
#define WORK struct NAME(work)

typedef REAL VECTOR __attribute__((vector_size(64), aligned(sizeof(REAL)), may_alias));

/* The scratch of one worker. */
WORK
{
	REAL *products; /* [MAPS][TZ + 2 R][pitch] */
	REAL *rows;     /* [MAPS][TZ][pitch] */
	REAL *chunk;    /* [TZ][MAPS][CY + 2 R][TX] */
	REAL *mean;     /* [MAPS][CY][TX] */
	REAL *s;        /* [CY][TX] */
	REAL *weight;   /* [TX] */
	double count;   /* sum of it */
	size_t pitch;   /* PX, or TX if x is not filtered */
	REAL tap[R + 1], lo, hi, zero, scale, c1, c2, unbias;
};

static void NAME(lay_out)(WORK *w, const struct job *j, size_t worker)
{
	double middle = 1;

	w->products = (REAL *)j->scratch + worker * SCRATCH;
	w->rows = w->products + PRODUCTS;
	w->chunk = w->rows + ROWS;
	w->mean = w->chunk + CHUNK;
	w->s = w->mean + MAPS * TILE;
	w->weight = w->s + TILE;
	w->pitch = j->radius[0] ? PX : TX;
	for (size_t k = 0; k < j->rule->radius; k++) {
		w->tap[k] = (REAL)j->rule->tap[k];
		middle -= 2 * (double)w->tap[k];
	}
	w->tap[j->rule->radius] = (REAL)middle; /* so that rounded taps sum to one */
	w->lo = (REAL)j->map->lo;
	w->hi = (REAL)j->map->hi;
	w->zero = (REAL)j->map->zero;
	w->scale = (REAL)j->map->scale;
	w->c1 = (REAL)(2 * j->rule->c1);
	w->c2 = (REAL)(2 * j->rule->c2);
	w->unbias = (REAL)j->rule->unbias;
}

CT_LANES_INLINE void NAME(weigh)(REAL *restrict out, const REAL *restrict in, size_t step, size_t n,
	size_t radius, const REAL *restrict tap)
{
	const REAL *at[CT_SSIM_TAPS];
	REAL w[R + 1];

	for (size_t k = 0; k <= 2 * radius; k++)
		at[k] = in + k * step;
	for (size_t k = 0; k <= radius; k++)
		w[k] = tap[k];
	for (size_t j = 0; j < n; j += LANES) {
		VECTOR acc = w[radius] * *(const VECTOR *)(at[radius] + j);

#pragma GCC unroll 5
		for (size_t k = 0; k < radius; k++)
			acc += w[k] * (*(const VECTOR *)(at[k] + j) +
					      *(const VECTOR *)(at[2 * radius - k] + j));
		*(VECTOR *)(out + j) = acc;
	}
}

/* out[j] = sum_k tap[k] in[j + k step], j < n rounded up to LANES; taps are symmetric. With the
 * length of a row as step and many rows as n it filters across rows. */
CT_LANES_CLONES static void NAME(filter)(REAL *restrict out, const REAL *restrict in, size_t step,
	size_t n, size_t radius, const REAL *restrict tap)
{
	if (radius == 5) /* constants, so that the compiler unrolls */
		NAME(weigh)(out, in, step, n, 5, tap);
	else
		NAME(weigh)(out, in, step, n, 3, tap);
}

CT_LANES_INLINE void NAME(clip_some)(
	REAL *restrict out, const float *restrict v, size_t n, REAL lo, REAL hi, REAL zero)
{
	for (size_t i = 0; i < n; i++) {
		REAL a = (REAL)v[i];

		a = a > lo ? a : lo;
		a = a < hi ? a : hi;
		out[i] = a - zero;
	}
}

CT_LANES_CLONES static void NAME(clip)(
	REAL *restrict out, const float *restrict v, size_t n, REAL lo, REAL hi, REAL zero)
{
	size_t i = 0;

	for (; i + CT_LANES_BLOCK <= n; i += CT_LANES_BLOCK)
		NAME(clip_some)(out + i, v + i, CT_LANES_BLOCK, lo, hi, zero);
	NAME(clip_some)(out + i, v + i, n - i, lo, hi, zero);
}

/* Rows x and y, `apart`, become u = x + y, v = y - x, u^2, v^2. */
CT_LANES_CLONES static void NAME(multiply)(REAL *restrict row, size_t apart, size_t n, REAL scale)
{
	for (size_t j = 0; j < n; j += LANES) {
		VECTOR x = *(const VECTOR *)(row + j), y = *(const VECTOR *)(row + apart + j);
		VECTOR u = (x + y) * scale, v = (y - x) * scale;

		*(VECTOR *)(row + j) = u;
		*(VECTOR *)(row + apart + j) = v;
		*(VECTOR *)(row + 2 * apart + j) = u * u;
		*(VECTOR *)(row + 3 * apart + j) = v * v;
	}
}

/* S of n pixels; the maps of the means are TILE apart. */
CT_LANES_CLONES static void NAME(similarity)(const WORK *w, size_t n)
{
	const REAL *restrict mean = w->mean;
	const REAL c1 = w->c1, c2 = w->c2, unbias = w->unbias;
	REAL *restrict s = w->s;

	for (size_t j = 0; j < n; j += LANES) {
		VECTOR mu = *(const VECTOR *)(mean + j), mv = *(const VECTOR *)(mean + TILE + j);
		VECTOR u2 = mu * mu, v2 = mv * mv;
		VECTOR su = unbias * (*(const VECTOR *)(mean + 2 * TILE + j) - u2);
		VECTOR sv = unbias * (*(const VECTOR *)(mean + 3 * TILE + j) - v2);

		*(VECTOR *)(s + j) =
			(u2 - v2 + c1) * (su - sv + c2) / ((u2 + v2 + c1) * (su + sv + c2));
	}
}

/* sum of weight s, lane by lane and then across. */
CT_LANES_CLONES static double NAME(add_up)(const REAL *restrict s, const REAL *restrict weight)
{
	double sum[32] = {0}, total = 0;

	for (size_t j = 0; j < TX; j += 32)
		for (size_t i = 0; i < 32; i++)
			sum[i] += (double)(weight[j + i] * s[j + i]);
	for (size_t i = 0; i < 32; i++)
		total += sum[i];
	return total;
}

CT_LANES_CLONES static void NAME(add_columns)(double *restrict sum, double *restrict count,
	const REAL *restrict s, const REAL *restrict weight)
{
	for (size_t i = 0; i < TX; i++)
		sum[i] += (double)(weight[i] * s[i]);
	for (size_t i = 0; i < TX; i++)
		count[i] += (double)weight[i];
}

/* Products of row y of slice z, columns from x0 - radius on; the maps are `apart`. */
static void NAME(load)(
	const struct job *j, const WORK *w, REAL *out, size_t apart, size_t x0, size_t y, size_t z)
{
	size_t r = j->radius[0], from = x0 < r ? r - x0 : 0, to = j->n[0] + r - x0;
	size_t at = (z * j->n[1] + y) * j->n[0] + x0 + from - r, pitch = w->pitch;

	to = to < pitch ? to : pitch;
	for (size_t m = 0; m < 2; m++) {
		memset(out + m * apart, 0, from * sizeof *out);
		memset(out + m * apart + to, 0, (pitch - to) * sizeof *out);
	}
	if (y + 1 < j->n[1]) /* the row that comes next is not where the machine expects it */
		for (size_t i = 0; i < to - from; i += 16) {
			__builtin_prefetch(j->ref + at + j->n[0] + i);
			__builtin_prefetch(j->test + at + j->n[0] + i);
		}
	NAME(clip)(out + from, j->ref + at, to - from, w->lo, w->hi, w->zero);
	NAME(clip)(out + apart + from, j->test + at, to - from, w->lo, w->hi, w->zero);
	NAME(multiply)(out, apart, pitch, w->scale);
}

/* Row y of the slices of the block, filtered along z and x, as row b of their chunks. */
static void NAME(fill)(const struct job *j, WORK *w, const struct place *p, size_t b, size_t y)
{
	size_t rx = j->radius[0], rz = j->radius[2], deep = p->slices + 2 * rz;
	size_t apart = deep * w->pitch, layer = w->pitch;
	const REAL *rows = w->products;

	for (size_t k = 0; k < deep; k++) {
		size_t z = p->z0 + k - rz;

		if (p->z0 + k >= rz && z < j->n[2])
			NAME(load)(j, w, w->products + k * layer, apart, p->x0, y, z);
		else
			for (size_t m = 0; m < MAPS; m++)
				memset(w->products + m * apart + k * layer, 0,
					layer * sizeof *w->products);
	}
	for (size_t m = 0; m < MAPS && rz > 0; m++)
		NAME(filter)
	(w->rows + m * p->slices * layer, w->products + m * apart, layer, p->slices * layer, rz,
		w->tap);
	if (rz > 0) {
		rows = w->rows;
		apart = p->slices * layer;
	}
	for (size_t z = 0; z < p->slices; z++)
		for (size_t m = 0; m < MAPS; m++) {
			REAL *out = w->chunk + (z * MAPS + m) * LAYER + b * TX;
			const REAL *in = rows + m * apart + z * layer;

			if (rx > 0)
				NAME(filter)(out, in, 1, TX, rx, w->tap);
			else
				memcpy(out, in, TX * sizeof *out);
		}
}

/* Rows b .. end of the chunks, row b being y0 + b - radius. */
static void NAME(fill_rows)(
	const struct job *j, WORK *w, const struct place *p, size_t b, size_t end)
{
	size_t ry = j->radius[1];

	for (; b < end; b++) {
		if (p->y0 + b >= ry && p->y0 + b - ry < j->n[1]) {
			NAME(fill)(j, w, p, b, p->y0 + b - ry);
			continue;
		}
		for (size_t k = 0; k < p->slices * MAPS; k++)
			memset(w->chunk + k * LAYER + b * TX, 0, TX * sizeof *w->chunk);
	}
}

/* What the TX voxels from column x0 on count: 0 or 1; and how many do. */
static void NAME(weights)(const struct job *j, WORK *w, size_t x0, const float *mask)
{
	size_t c = j->crop[0], from = x0 < c ? c - x0 : 0, to = j->n[0] - x0;

	to = to > c ? to - c : 0;
	to = to < TX ? to : TX;
	memset(w->weight, 0, TX * sizeof *w->weight);
	w->count = 0;
	for (size_t i = from; i < to; i++) {
		w->weight[i] = mask && mask[i] == 0.0f ? 0 : 1;
		w->count += (double)w->weight[i];
	}
}

/* S of the rows of one slice, from its chunk. */
static void NAME(compare)(const struct job *j, WORK *w, const struct place *p, size_t slice)
{
	size_t n = p->rows * TX, ry = j->radius[1];

	for (size_t m = 0; m < MAPS; m++) {
		const REAL *in = w->chunk + (slice * MAPS + m) * LAYER;

		if (ry > 0)
			NAME(filter)(w->mean + m * TILE, in, TX, n, ry, w->tap);
		else
			memcpy(w->mean + m * TILE, in, n * sizeof *in);
	}
	NAME(similarity)(w, n);
}

/* Add the S of one row to the sums of its slice, or slices. */
static void NAME(collect)(
	const struct job *j, WORK *w, const struct place *p, size_t row, size_t slice, double *part)
{
	size_t y = p->y0 + row, z = p->z0 + slice;
	const REAL *s = w->s + row * TX;

	if (y < j->crop[1] || y + j->crop[1] >= j->n[1])
		return;
	if (j->mask)
		NAME(weights)(j, w, p->x0, j->mask + (z * j->n[1] + y) * j->n[0] + p->x0);
	if (j->axis == 0) {
		NAME(add_columns)(part + p->x0, part + j->len + p->x0, s, w->weight);
		return;
	}
	part[j->axis == 1 ? y : z] += NAME(add_up)(s, w->weight);
	part[j->len + (j->axis == 1 ? y : z)] += w->count;
}

static void NAME(block)(void *arg, size_t task, size_t worker)
{
	const struct job *j = arg;
	size_t carry = 2 * j->radius[1];
	double *part = j->part + (j->axis == 2 ? 0 : task * 2 * j->len);
	struct place p = {.z0 = task * j->block};
	WORK w;

	if (ct_stopping(j->env))
		return;
	NAME(lay_out)(&w, j, worker);
	p.slices = j->n[2] - p.z0 < j->block ? j->n[2] - p.z0 : j->block;
	for (p.x0 = 0; p.x0 < j->n[0]; p.x0 += TX) {
		NAME(weights)(j, &w, p.x0, NULL);
		for (p.y0 = 0; p.y0 < j->n[1]; p.y0 += CY) {
			p.rows = j->n[1] - p.y0 < CY ? j->n[1] - p.y0 : CY;
			for (size_t k = 0; k < p.slices * MAPS && p.y0 > 0; k++)
				memcpy(w.chunk + k * LAYER, w.chunk + k * LAYER + CY * TX,
					carry * TX * sizeof *w.chunk);
			NAME(fill_rows)(j, &w, &p, p.y0 > 0 ? carry : 0, p.rows + carry);
			for (size_t z = 0; z < p.slices; z++) {
				if (p.z0 + z < j->crop[2] || p.z0 + z + j->crop[2] >= j->n[2])
					continue;
				NAME(compare)(j, &w, &p, z);
				for (size_t y = 0; y < p.rows; y++)
					NAME(collect)(j, &w, &p, y, z, part);
			}
		}
	}
}

#undef LANES
#undef VECTOR
#undef WORK
