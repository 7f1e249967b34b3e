/* Neural fields: values and gradients against plain ones in double, bytes at the levels of the
 * processor. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "field/field.h"
#include "formats/format.h"
#include "field-tensors.h"
#include "numbers.h"

#include <math.h>
#include <string.h>

/* A neural field in double, one number at a time: what src/field is held to. */
enum {
	PLAIN_MOST = 512,
	PLAIN_SEGMENT = 16
}; /* rows of anything, points of a segment times those */

static void plain_level(
	const struct ct_encoding *s, size_t l, const double **w, const double x[3], double *out)
{
	const double scale = (double)s->base * pow(s->growth, (double)l) - 1;
	const uint64_t side = (uint64_t)ceil(scale) + 2, all = side * side * side,
		       table = (uint64_t)1 << s->log2_table;
	const bool hashed = s->kind == CT_ENCODING_HASH && all > table;
	uint64_t node[3];
	double part[3];

	for (int a = 0; a < 3; a++) {
		const double p = x[a] * scale + 0.5;

		node[a] = (uint64_t)p;
		part[a] = p - (double)node[a];
	}
	memset(out, 0, CT_ENCODING_FEATURES * sizeof *out);
	for (int c = 0; c < 8; c++) {
		uint64_t k[3], at;
		double share = 1;

		for (int a = 0; a < 3; a++) {
			k[a] = node[a] + (c >> a & 1);
			share *= c >> a & 1 ? part[a] : 1 - part[a];
		}
		at = hashed ? (k[0] ^ k[1] * 19349663 ^ k[2] * 83492791) % table
			    : k[0] + side * (k[1] + side * k[2]);
		for (size_t f = 0; f < CT_ENCODING_FEATURES; f++)
			out[f] += share * (*w)[at * CT_ENCODING_FEATURES + f];
	}
	*w += (hashed ? table : all) * CT_ENCODING_FEATURES;
}

static void plain_encode(
	const struct ct_encoding *s, const double *w, const double x[3], double *code)
{
	if (s->kind != CT_ENCODING_FREQUENCIES) {
		for (size_t l = 0; l < s->levels; l++)
			plain_level(s, l, &w, x, code + l * CT_ENCODING_FEATURES);
		return;
	}
	for (int a = 0; a < 3; a++) {
		const double p = (2 * x[a] - 1) * acos(-1);

		code[a] = p;
		for (size_t k = 0; k < s->frequencies; k++) {
			code[3 + 6 * k + (size_t)a] = sin(ldexp(p, (int)k));
			code[6 + 6 * k + (size_t)a] = cos(ldexp(p, (int)k));
		}
	}
}

/* y = W x (+ b); *w goes on behind them. */
static void plain_linear(
	const double **w, size_t in, size_t out, bool bias, const double *x, double *y)
{
	const double *b = *w + in * out;

	for (size_t o = 0; o < out; o++) {
		y[o] = bias ? b[o] : 0;
		for (size_t i = 0; i < in; i++)
			y[o] += (*w)[o * in + i] * x[i];
	}
	*w = b + (bias ? out : 0);
}

static void plain_norm(
	const double *gain, const double *shift, size_t width, const double *x, double *y)
{
	double mean = 0, square = 0;

	for (size_t i = 0; i < width; i++)
		mean += x[i] / (double)width;
	for (size_t i = 0; i < width; i++)
		square += (x[i] - mean) * (x[i] - mean) / (double)width;
	for (size_t i = 0; i < width; i++)
		y[i] = gain[i] * (x[i] - mean) / sqrt(square + 1e-5) + shift[i];
}

/* out[heads * head] of place s. */
static void plain_head(const struct ct_attention *a, size_t s, size_t h, const double *p,
	double (*qkv)[PLAIN_MOST], double *out)
{
	const size_t c = a->heads * a->head, at = h * a->head;
	double w[PLAIN_SEGMENT], sum = 0;

	for (size_t t = 0; t < a->segment; t++) {
		double dot = 0;

		for (size_t k = at; k < at + a->head; k++)
			dot += qkv[s][k] * qkv[t][c + k];
		w[t] = exp(dot / sqrt((double)a->head) + p[(h * a->segment + s) * a->segment + t]);
		sum += w[t];
	}
	for (size_t k = at; k < at + a->head; k++) {
		out[k] = 0;
		for (size_t t = 0; t < a->segment; t++)
			out[k] += w[t] / sum * qkv[t][2 * c + k];
	}
}

/* The block, on the `segment` rows of x. */
static void plain_attention(
	const struct ct_attention *a, size_t width, const double **w, double (*x)[PLAIN_MOST])
{
	static double qkv[PLAIN_SEGMENT][PLAIN_MOST];
	const size_t c = a->heads * a->head, n = a->segment;
	const double *gain = *w, *place = gain + 2 * width + 3 * c * width, *after;
	double y[PLAIN_MOST], z[PLAIN_MOST];

	for (size_t s = 0; s < n; s++) {
		after = gain + 2 * width;
		plain_norm(gain, gain + width, width, x[s], y);
		plain_linear(&after, width, 3 * c, false, y, qkv[s]);
	}
	for (size_t s = 0; s < n; s++) {
		after = place + a->heads * n * n;
		for (size_t h = 0; h < a->heads; h++)
			plain_head(a, s, h, place, qkv, y);
		plain_linear(&after, c, width, true, y, z);
		for (size_t i = 0; i < width; i++)
			x[s][i] += z[i];
		plain_norm(after, after + width, width, x[s], y);
		after += 2 * width;
		plain_linear(&after, width, 4 * width, true, y, z);
		for (size_t i = 0; i < 4 * width; i++)
			z[i] *= 0.5 * (1 + tanh(sqrt(2 / acos(-1)) *
						   (z[i] + 0.044715 * z[i] * z[i] * z[i])));
		plain_linear(&after, 4 * width, width, true, z, y);
		for (size_t i = 0; i < width; i++)
			x[s][i] += y[i];
	}
	*w = after;
}

/* y[segment][outputs] of the points of one segment, w being the network's weights. */
static void plain_network(const struct ct_network *s, size_t in, const double *w,
	double (*code)[PLAIN_MOST], double *y)
{
	static double h[PLAIN_SEGMENT][PLAIN_MOST];
	const size_t n = s->attention.segment ? s->attention.segment : 1;

	for (size_t l = 0; l <= s->depth; l++) {
		const double *after = w;

		for (size_t i = 0; i < n; i++) {
			double x[PLAIN_MOST];
			size_t wide = 0;

			after = w;
			if (l == 0 || (l < s->depth && l == s->skip)) {
				memcpy(x, code[i], in * sizeof *x);
				wide = in;
			}
			if (l > 0) {
				memcpy(x + wide, h[i], s->width * sizeof *x);
				wide += s->width;
			}
			if (l == s->depth) {
				plain_linear(&after, wide, s->outputs, true, x, y + i * s->outputs);
				continue;
			}
			plain_linear(&after, wide, s->width, true, x, h[i]);
			for (size_t k = 0; k < s->width; k++)
				h[i][k] *= h[i][k] > 0 ? 1 : s->slope;
		}
		w = after;
		if (l == 0 && s->attention.segment)
			plain_attention(&s->attention, s->width, &w, h);
	}
	for (size_t i = s->outputs - 1; s->last == CT_NETWORK_SIGMOID && i < n * s->outputs;
		i += s->outputs)
		y[i] = 1 / (1 + exp(-y[i]));
}

/* y[n][outputs] of points x[n][3], w being all weights. */
__attribute__((unused)) static void plain_field(
	const struct ct_field_shape *s, const double *w, size_t n, const float *x, double *y)
{
	static double code[PLAIN_SEGMENT][PLAIN_MOST];
	const struct ct_network *net = &s->network;
	const size_t segment = net->attention.segment ? net->attention.segment : 1,
		     encoded = ct_encoding_offset(&s->encoding, ct_encoding_levels(&s->encoding));

	for (size_t i = 0; i < n; i += segment) {
		for (size_t k = 0; k < segment; k++) {
			const float *at = x + 3 * (i + k);
			const double p[3] = {(double)at[0], (double)at[1], (double)at[2]};

			plain_encode(&s->encoding, w, p, code[k]);
		}
		plain_network(net, ct_encoding_width(&s->encoding), w + encoded, code,
			y + i * net->outputs);
	}
}

#define HASH(l, t, b, g)                                                                           \
	{                                                                                          \
		.kind = CT_ENCODING_HASH, .levels = l, .log2_table = t, .base = b, .growth = g     \
	}
#define GRID(l, b, g)                                                                              \
	{                                                                                          \
		.kind = CT_ENCODING_GRID, .levels = l, .base = b, .growth = g                      \
	}
#define SINES(n)                                                                                   \
	{                                                                                          \
		.kind = CT_ENCODING_FREQUENCIES, .frequencies = n                                  \
	}

static const struct {
	const char *name;
	size_t points;
	struct ct_field_shape s;
} cases[] = {
	{"hash, as NAF", 37, {HASH(4, 6, 2, 2), {8, 3, 2, 1, 0.01, CT_NETWORK_SIGMOID, {0}}}},
	{"hash, 1.7 times finer", 20,
		{HASH(3, 4, 3, 1.7), {5, 2, 0, 1, 0, CT_NETWORK_LINEAR, {0}}}},
	{"hash, three times finer", 20,
		{HASH(2, 5, 2, 3), {7, 2, 1, 2, 0.1, CT_NETWORK_SIGMOID, {0}}}},
	{"grid", 33, {GRID(2, 2, 2), {6, 1, 0, 2, 0.01, CT_NETWORK_LINEAR, {0}}}},
	{"grid, half as fine again", 16,
		{GRID(2, 2, 1.5), {9, 2, 1, 1, 0, CT_NETWORK_SIGMOID, {0}}}},
	{"sines", 17, {SINES(4), {10, 2, 0, 1, 0, CT_NETWORK_LINEAR, {0}}}},
	{"sines, two outputs", 64, {SINES(11), {12, 3, 2, 2, 0, CT_NETWORK_SIGMOID, {0}}}},
	{"the position alone", 5, {SINES(0), {4, 5, 4, 1, 0.2, CT_NETWORK_SIGMOID, {0}}}},
	{"a wide network", 37, {SINES(11), {72, 2, 1, 2, 0, CT_NETWORK_SIGMOID, {0}}}},
	{"a wide network of a grid", 11,
		{GRID(36, 2, 1), {72, 2, 1, 1, 0, CT_NETWORK_LINEAR, {0}}}},
	{"attention, as SAX-NeRF", 34,
		{HASH(4, 5, 2, 2), {8, 2, 1, 1, 0.01, CT_NETWORK_SIGMOID, {2, 2, 3}}}},
	{"attention among three", 27,
		{GRID(2, 2, 2), {6, 3, 2, 2, 0.05, CT_NETWORK_SIGMOID, {3, 3, 2}}}},
	{"attention behind one layer", 32,
		{SINES(2), {6, 1, 0, 1, 0, CT_NETWORK_LINEAR, {4, 1, 4}}}},
};
enum { CASES = sizeof cases / sizeof *cases };

/* A field, points of it with the corners of the box among them, and weights of its outputs. */
struct trial {
	const struct ct_field_shape *s;
	struct ct_field *f;
	struct ct_field_work *w;
	size_t n, outputs, count, encoded, width;
	float *x, *y, *dy, *grad, *dcode;
};

static void begin(struct trial *t, const struct ct_field_shape *s, size_t n)
{
	float *w;

	*t = (struct trial){.s = s, .n = n, .outputs = s->network.outputs};
	must(ct_field_alloc(&t->f, s, 7, &err) || ct_field_work_alloc(&t->w, t->f, n, &err));
	t->count = t->f->count;
	t->encoded = t->f->encoded;
	t->width = t->f->width;
	must(ct_alloc0(&t->x, 3 * n, sizeof(float), &err) ||
		ct_alloc0(&t->y, n * t->outputs, sizeof(float), &err) ||
		ct_alloc0(&t->grad, t->count, sizeof(float), &err) ||
		ct_alloc0(&t->dcode, n * t->width, sizeof(float), &err));
	t->dy = normals(n * t->outputs, 3, 1, 1);
	for (size_t i = 0; i < 3 * n; i++)
		t->x[i] = i < 3   ? 0
			  : i < 6 ? 1
			  : i < 9 ? (float)(i % 2)
				  : (float)ct_rng_uniform(3, 2, i);
	w = t->f->weights;
	for (size_t i = 0; i < t->encoded; i++)
		w[i] *= 5000;
	/* norms and places that are not as they begin */
	for (size_t i = t->encoded; s->network.attention.segment && i < t->count; i++)
		w[i] += 0.1f * ct_rng_normal(3, 4, i);
}

static void end(struct trial *t)
{
	ct_field_free(t->f);
	ct_field_work_free(t->w);
	free(t->x);
	free(t->y);
	free(t->dy);
	free(t->grad);
	free(t->dcode);
}

/* y and grad. */
static void run(struct trial *t)
{
	const struct ct_encoding *s = &t->s->encoding;

	memset(t->grad, 0, t->count * sizeof *t->grad);
	must(ct_field_forward(t->f, t->w, t->n, t->x, t->y, &err) ||
		ct_field_backward(t->f, t->w, t->n, t->dy, t->grad + t->encoded,
			t->encoded ? t->dcode : NULL, t->n, &err));
	for (size_t l = 0; l < ct_encoding_levels(s); l++)
		ct_encoding_back(
			s, l, t->n, t->x, t->dcode, t->n, t->grad + ct_encoding_offset(s, l));
}

static double loss(const struct trial *t, const double *w, double *y)
{
	double sum = 0;

	plain_field(t->s, w, t->n, t->x, y);
	for (size_t i = 0; i < t->n * t->outputs; i++)
		sum += y[i] * (double)t->dy[i];
	return sum;
}

/* Values, and derivatives by central differences. */
static void against_plain(struct trial *t, const char *name)
{
	const double h = 1e-6;
	double *w = malloc(t->count * sizeof *w), *y = malloc(t->n * t->outputs * sizeof *y);
	double worst = 0, most = 0, off[2] = {0}, size[2] = {0};

	if (!w || !y)
		exit(99);
	for (size_t i = 0; i < t->count; i++)
		w[i] = (double)t->f->weights[i];
	plain_field(t->s, w, t->n, t->x, y);
	for (size_t i = 0; i < t->n * t->outputs; i++) {
		worst = fmax(worst, fabs(y[i] - (double)t->y[i]));
		most = fmax(most, fabs(y[i]));
	}
	OK(worst <= 1e-5 * most, "%s: values, off by %.2g", name, worst / most);
	/* of many weights some */
	for (size_t i = 0; i < t->count; i += 1 + t->count / 1500) {
		const int part = i >= t->encoded;
		const double was = w[i];
		double d;

		w[i] = was + h;
		d = loss(t, w, y);
		w[i] = was - h;
		d = (d - loss(t, w, y)) / (2 * h);
		w[i] = was;
		off[part] = fmax(off[part], fabs(d - (double)t->grad[i]));
		size[part] = fmax(size[part], fabs(d));
	}
	if (t->encoded)
		OK(off[0] <= 1e-5 * size[0], "%s: gradient of the encoding, off by %.2g", name,
			off[0] / size[0]);
	OK(off[1] <= 1e-5 * size[1], "%s: gradient of the network, off by %.2g", name,
		off[1] / size[1]);
	free(w);
	free(y);
}

static float *copy(const float *x, size_t n)
{
	float *y = malloc(n * sizeof *y);

	if (!y)
		exit(99);
	memcpy(y, x, n * sizeof *y);
	return y;
}

/* The encoding has the same bytes at every level. */
static void encoding_levels(struct trial *t, const char *name)
{
	const struct ct_encoding *s = &t->s->encoding;
	const size_t codes = t->n * t->width;
	float *code[2], *grad[2];
	bool same = true;

	for (int k = 0; k < 2; k++)
		must(ct_alloc0(&code[k], codes, sizeof(float), &err) ||
			ct_alloc0(&grad[k], t->count, sizeof(float), &err));
	for (int i = 0; i < 4; i++) {
		struct ct_err e;

		if (ct_simd_use(((const char *[]){NULL, "v2", "v3", "v4"})[i], &e))
			continue;
		memset(grad[i > 0], 0, t->count * sizeof(float));
		ct_encoding_forward(s, t->f->weights, t->n, t->x, code[i > 0], t->n);
		for (size_t l = 0; l < ct_encoding_levels(s); l++)
			ct_encoding_back(s, l, t->n, t->x, t->dcode, t->n,
				grad[i > 0] + ct_encoding_offset(s, l));
		if (i)
			same = same && !memcmp(code[0], code[1], codes * sizeof(float)) &&
			       !memcmp(grad[0], grad[1], t->count * sizeof(float));
	}
	OK(same, "%s: the encoding has the same bytes at every level", name);
	must(ct_simd_use(getenv("CTSR_CPU"), &err));
	for (int k = 0; k < 2; k++) {
		free(code[k]);
		free(grad[k]);
	}
}

/* The same bytes again, and at every level that has fused multiplications. */
static void levels(struct trial *t, const char *name)
{
	const char *const level[] = {NULL, "v3", "v4", "v2"};
	const bool wide = t->s->network.width > 64;
	float *y, *grad;

	must(ct_simd_use(NULL, &err));
	run(t);
	y = copy(t->y, t->n * t->outputs);
	grad = copy(t->grad, t->count);
	for (int i = 0; i < 4; i++) {
		struct ct_err e;

		if (ct_simd_use(level[i], &e))
			continue;
		run(t);
		if (i < 3 && !(wide && i))
			OK(!memcmp(y, t->y, t->n * t->outputs * sizeof *y) &&
					!memcmp(grad, t->grad, t->count * sizeof *grad),
				"%s: the same bytes, %s", name, level[i] ? level[i] : "again");
		else
			OK(apart(t->n * t->outputs, t->y, y) < 1e-5 &&
					apart(t->count, t->grad, grad) < 1e-5,
				"%s: nearly the same, %s", name, level[i]);
	}
	must(ct_simd_use(getenv("CTSR_CPU"), &err));
	run(t);
	free(y);
	free(grad);
}

/* Points in two calls are what they are in one, and gradients add up. */
static void pieces(struct trial *t, const char *name)
{
	const size_t segment = t->f->segment, first = t->n / segment / 2 * segment;
	float *y = copy(t->y, t->n * t->outputs), *grad = copy(t->grad, t->count);
	const struct ct_encoding *s = &t->s->encoding;

	memset(t->grad, 0, t->count * sizeof *t->grad);
	for (size_t at = 0; at < t->n; at += at ? t->n : first) {
		const size_t n = at ? t->n - first : first;

		must(ct_field_forward(t->f, t->w, n, t->x + 3 * at, t->y + at * t->outputs, &err) ||
			ct_field_backward(t->f, t->w, n, t->dy + at * t->outputs,
				t->grad + t->encoded, t->dcode + at, t->n, &err));
	}
	for (size_t l = 0; l < ct_encoding_levels(s); l++)
		ct_encoding_back(
			s, l, t->n, t->x, t->dcode, t->n, t->grad + ct_encoding_offset(s, l));
	OK(t->s->network.width > 64 ? apart(t->n * t->outputs, t->y, y) < 1e-6
				    : !memcmp(y, t->y, t->n * t->outputs * sizeof *y),
		"%s: a point is the same in another call", name);
	OK(apart(t->count, t->grad, grad) < 1e-5, "%s: gradients add up", name);
	free(y);
	free(grad);
}

/* Node 0 of an axis counts half at 0; at 1 the last two count half each. */
static void borders(void)
{
	const struct ct_encoding s = GRID(1, 4, 2);
	float w[250] = {0}, code[8];
	const float x[12] = {0, 0, 0, 1, 1, 1, -3, NAN, 0.5f / 3, 2, 0.5f, 0.5f};

	w[0] = w[1] = 8;
	w[248] = 16;
	w[50] = 4; /* (0,0,1) */
	w[2 * (4 + 5 * 2 + 25 * 2)] = 32;
	ct_encoding_forward(&s, w, 4, x, code, 4);
	NEAR((double)code[0], 1.5, 0, "the corner 0");
	NEAR((double)code[1], 2, 0, "the corner 1");
	NEAR((double)code[2], 1, 1e-6, "beyond 0, and NaN, are 0");
	NEAR((double)code[3], 16, 1e-6, "beyond 1 is 1");
	NEAR((double)code[4], 1, 0, "the other feature");
}

static void refused(void)
{
	const struct ct_network net = {4, 1, 0, 1, 0, CT_NETWORK_LINEAR, {0}};
	const struct ct_field_shape bad[] = {{HASH(40, 6, 2, 2), net}, {HASH(30, 6, 2, 2), net},
		{GRID(1, 1024, 2), net}, {SINES(1), {0, 1, 0, 1, 0, 0, {0}}},
		{SINES(1), {4, 0, 0, 1, 0, 0, {0}}}, {SINES(1), {2000, 1, 0, 1, 0, 0, {0}}}};
	struct ct_field_shape good = {SINES(1), {4, 1, 0, 1, 0, 0, {2, 1, 4}}};
	struct ct_field_work *w;
	struct ct_field *f;
	struct ct_err e;
	float x[6] = {0}, y[2];

	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		OK(ct_field_alloc(&f, &bad[i], 1, &e) && e.code == CT_EINPUT && !f, "no field: %s",
			e.msg);
	must(ct_field_alloc(&f, &good, 1, &err));
	OK(ct_field_work_alloc(&w, f, 3, &e) && e.code == CT_EINPUT, "half a segment");
	must(ct_field_work_alloc(&w, f, 2, &err));
	f->weights[f->count - 1] = INFINITY;
	OK(ct_field_forward(f, w, 2, x, y, &e) && e.code == CT_ENUMERIC, "infinity: %s", e.msg);
	ct_field_work_free(w);
	ct_field_free(f);
}

/* Fields of the sizes of the papers, what they make of points, and their gradients: for
 * field-torch.py. */
static void dump(const char *folder)
{
	static const struct {
		size_t points;
		struct ct_field_shape s;
	} big[] = {
		{200, {HASH(16, 10, 4, 2), {32, 3, 2, 1, 0.01, CT_NETWORK_SIGMOID, {0}}}},
		{16, {SINES(11), {128, 3, 2, 2, 0, CT_NETWORK_SIGMOID, {0}}}},
		{64, {HASH(8, 12, 16, 1.5), {32, 2, 1, 1, 0.01, CT_NETWORK_SIGMOID, {2, 8, 4}}}},
		{50, {GRID(3, 3, 2), {48, 2, 0, 2, 0, CT_NETWORK_LINEAR, {0}}}},
	};

	const struct ct_env env = {0};

	for (size_t i = 0; i < sizeof big / sizeof *big; i++) {
		struct ct_tensors w = {0}, g = {0};
		char path[2][4096];
		struct trial t;

		begin(&t, &big[i].s, big[i].points);
		run(&t);
		snprintf(path[0], sizeof path[0], "%s/%zu.safetensors", folder, i);
		snprintf(path[1], sizeof path[1], "%s/%zu-gradient.safetensors", folder, i);
		must(field_put(t.f, t.s, &w, &err) ||
			ct_tensors_put(&w, "x", 2, (size_t[]){t.n, 3}, t.x, &err) ||
			ct_tensors_put(&w, "y", 2, (size_t[]){t.n, t.outputs}, t.y, &err) ||
			ct_tensors_put(&w, "dy", 2, (size_t[]){t.n, t.outputs}, t.dy, &err) ||
			ct_tensors_write(path[0], &w, false, &env, &err));
		memcpy(t.f->weights, t.grad, t.count * sizeof *t.grad);
		must(field_put(t.f, t.s, &g, &err) ||
			ct_tensors_write(path[1], &g, false, &env, &err));
		ct_tensors_free(&w);
		ct_tensors_free(&g);
		end(&t);
	}
}

int main(int argc, char **argv)
{
	if (argc == 3 && !strcmp(argv[1], "dump")) {
		dump(argv[2]);
		return 0;
	}
	for (size_t i = 0; i < CASES; i++) {
		struct trial t;

		begin(&t, &cases[i].s, cases[i].points);
		run(&t);
		against_plain(&t, cases[i].name);
		encoding_levels(&t, cases[i].name);
		levels(&t, cases[i].name);
		pieces(&t, cases[i].name);
		end(&t);
	}
	borders();
	refused();
	return tap_done();
}
