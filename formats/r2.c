/* r2.c: see r2.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/gauss-scene.h"
#include "core/vec3.h"
#include "core/words.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/pickle.h"
#include "formats/r2.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIELDS = CT_GAUSS_COLUMNS, MOST = 1 << 28 };

/* The arrays, where their columns lie in struct ct_gauss. */
static const struct {
	const char *key;
	size_t column, columns;
} arrays[] = {{"xyz", 0, 3}, {"scale", 3, 3}, {"rotation", 6, 4}, {"density", 10, 1}};
enum { ARRAYS = sizeof arrays / sizeof *arrays, SCALE = 1 };

static const struct ct_pickle_value *get(const struct ct_pickle *p, const char *key)
{
	const struct ct_pickle_value *dict = &p->value[p->root], *found = NULL;

	for (size_t i = dict->first; i; i = p->pair[i].next)
		if (ct_pickle_is_text(&p->value[p->pair[i].key], key))
			found = &p->value[p->pair[i].value];
	return found;
}

/* A text of ours: numbers between commas. */
static bool numbers(const struct ct_pickle *p, const char *key, size_t n, double *out)
{
	const struct ct_pickle_value *x = get(p, key);
	char text[512];

	if (!x || x->kind != CT_PICKLE_TEXT || x->length >= sizeof text)
		return false;
	snprintf(text, sizeof text, "%.*s", (int)x->length, x->text);
	return ct_words_numbers(text, ',', n, false, out);
}

/* The n of xyz. */
static int size_of(size_t *n, const struct ct_pickle *p, struct ct_err *e)
{
	const struct ct_pickle_value *x;
	int64_t rows;

	if (p->value[p->root].kind != CT_PICKLE_DICT)
		return ct_fail(e, CT_EINPUT, "the pickle is no dictionary");
	for (size_t k = 0; k < ARRAYS; k++)
		if (!get(p, arrays[k].key))
			return ct_fail(e, CT_EINPUT,
				"key '%s' is missing: Gaussians of R2-Gaussian have xyz, density, scale, "
				"rotation and scale_bound",
				arrays[k].key);
	x = get(p, arrays[0].key);
	rows = x->kind == CT_PICKLE_ARRAY && x->n == 2 ? p->value[p->part[x->first]].number : -1;
	if (!(rows >= 0 && rows <= MOST))
		return ct_fail(e, CT_EINPUT, "key 'xyz': is no array of %d points at most", MOST);
	*n = (size_t)rows;
	return 0;
}

static int read_arrays(struct ct_gauss *g, const struct ct_pickle *p, size_t n, struct ct_err *e)
{
	char name[32];

	for (size_t k = 0; k < ARRAYS; k++) {
		const size_t columns = arrays[k].columns;
		float *x = NULL;
		size_t bad = 0;

		snprintf(name, sizeof name, "key '%s'", arrays[k].key);
		if (ct_pickle_array(&x, p, get(p, arrays[k].key), n, columns, e))
			return ct_blame(e, name);
		if (k == 0 && ct_gauss_reserve(g, n, e)) {
			free(x);
			return -1;
		}
		g->n = n;
		for (size_t i = 0; i < n * columns; i++) {
			bad = bad || isfinite(x[i]) ? bad : i + 1;
			g->column[arrays[k].column + i % columns][i / columns] = x[i];
		}
		free(x);
		if (bad)
			return ct_fail(e, CT_EINPUT, "%s: number %zu of Gaussian %zu is not finite",
				name, (bad - 1) % columns, (bad - 1) / columns);
	}
	return 0;
}

/* Raw scales to ln s. */
static int read_bound(struct ct_gauss *g, const struct ct_pickle *p, struct ct_err *e)
{
	const struct ct_pickle_value *bound = get(p, "scale_bound");
	float *x = NULL;
	double lo, hi;

	if (!bound || bound->kind == CT_PICKLE_PLAIN)
		return 0;
	if (ct_pickle_array(&x, p, bound, 2, 1, e))
		return ct_blame(e, "key 'scale_bound'");
	lo = (double)x[0];
	hi = (double)x[1];
	free(x);
	if (!(lo >= 0 && lo < hi && isfinite(hi)))
		return ct_fail(
			e, CT_EINPUT, "key 'scale_bound': %g and %g are not 0 <= LO < HI", lo, hi);
	for (int a = 0; a < 3; a++)
		for (size_t i = 0; i < g->n; i++) {
			const double raw = (double)g->scale[a][i];

			g->scale[a][i] = (float)log(fmax(lo + (hi - lo) / (1 + exp(-raw)), 1e-30));
		}
	return 0;
}

static int read_own(struct ct_gauss *g, const struct ct_pickle *p, struct ct_err *e)
{
	const struct ct_pickle_value *word = get(p, "activation");
	double n[3], affine[12], a[3][4];
	size_t grid[3];
	char text[20] = "";
	int is = CT_SOFTPLUS;

	if (word && word->kind == CT_PICKLE_TEXT && word->length < sizeof text)
		snprintf(text, sizeof text, "%.*s", (int)word->length, word->text);
	if (word && ct_words_take(&is, CT_WORDS(CT_ACTIVATION_LIST), "key 'activation':", text, e))
		return -1;
	g->activation = (enum ct_activation)is;
	g->gamma = 1;
	if (g->activation == CT_PRELU && (!numbers(p, "gamma", 1, &g->gamma) || !(g->gamma > 0)))
		return ct_fail(e, CT_EINPUT, "key 'gamma' is not a positive number");
	memset(g->affine, 0, sizeof g->affine);
	for (int k = 0; k < 3; k++)
		g->affine[k][k] = 1;
	if (!numbers(p, "grid", 3, n) || !numbers(p, "affine", 12, affine))
		return 0;
	memcpy(a, affine, sizeof a);
	for (int k = 0; k < 3; k++) {
		if (!(n[k] >= 1 && n[k] < 1e6) || n[k] != floor(n[k]) ||
			!(hypot(hypot(a[0][k], a[1][k]), a[2][k]) > 0))
			return ct_fail(e, CT_EINPUT, "key 'grid' or 'affine': is no grid");
		grid[k] = (size_t)n[k];
	}
	ct_gauss_place(g, grid, a);
	return 0;
}

static int read_gauss(
	const unsigned char *data, size_t n, const char *name, struct ct_any *a, struct ct_err *e)
{
	struct ct_pickle p = {.arrays = true};
	struct ct_gauss *g = &a->gauss;
	size_t count = 0;
	int rc = -1;

	if (ct_pickle_read(&p, data, n, e) == 0 && size_of(&count, &p, e) == 0 &&
		read_arrays(g, &p, count, e) == 0 && read_bound(g, &p, e) == 0 &&
		read_own(g, &p, e) == 0)
		rc = ct_gauss_sign(g, name, e);
	ct_pickle_free(&p);
	return rc;
}

const struct ct_format ct_format_r2 = {
	.name = "R2-Gaussian", .kind = CT_KIND_GAUSS, .read_bytes = read_gauss};

/* The instructions of an array of n x columns float32, which follows; its end is "tb". */
static void put_array(FILE *f, const char *key, size_t n, size_t columns)
{
	const uint32_t rows = (uint32_t)n, bytes = (uint32_t)(n * columns * sizeof(float));

	fprintf(f, "X%c%c%c%c%s", (int)strlen(key), 0, 0, 0, key);
	fputs("cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK", f);
	fwrite("\0\x85"
	       "C\1b\x87R(K\1J",
		1, 11, f);
	for (int i = 0; i < 4; i++)
		fputc((int)(rows >> 8 * i & 255), f);
	fprintf(f, "K%c\x86", (int)columns);
	fputs("cnumpy\ndtype\n", f);
	fwrite("X\2\0\0\0f4\x89\x88\x87R(K\3X\1\0\0\0<NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\0tb\x89"
	       "B",
		1, 39, f);
	for (int i = 0; i < 4; i++)
		fputc((int)(bytes >> 8 * i & 255), f);
}

static void put_text(FILE *f, const char *key, const char *text)
{
	fprintf(f, "X%c%c%c%c%s", (int)strlen(key), 0, 0, 0, key);
	fprintf(f, "X%c%c%c%c%s", (int)(strlen(text) & 255), (int)(strlen(text) >> 8), 0, 0, text);
}

static void put_own(FILE *f, const struct ct_gauss *g)
{
	char text[512];
	int at = 0;

	put_text(f, "activation", CT_WORD(CT_ACTIVATION_LIST, g->activation));
	snprintf(text, sizeof text, "%.17g", g->gamma);
	put_text(f, "gamma", text);
	snprintf(text, sizeof text, "%zu,%zu,%zu", g->grid[0], g->grid[1], g->grid[2]);
	put_text(f, "grid", text);
	for (int i = 0; i < 12; i++)
		at += snprintf(text + at, sizeof text - (size_t)at, "%s%.17g", i ? "," : "",
			g->affine[i / 4][i % 4]);
	put_text(f, "affine", text);
	fprintf(f, "X%c%c%c%cscale_boundNu.", 11, 0, 0, 0);
}

int ct_r2_write(
	const char *path, const struct ct_gauss *g, const struct ct_env *env, struct ct_err *e)
{
	struct ct_gauss own = {.activation = g->activation, .gamma = g->gamma};
	double affine[3][4];
	struct ct_out out = {0};
	struct ct_gauss_scene s;
	char *text = NULL;
	size_t length = 0;
	FILE *f;
	int rc = -1;

	if (g->grid[0] == 0 || g->n > INT32_MAX / 16)
		return ct_fail(e, CT_EINPUT,
			"%s: Gaussians without a grid, or too many, make no pickle", path);
	memcpy(affine, g->affine, sizeof affine);
	s = ct_gauss_scene_of(g->grid, affine);
	if (ct_gauss_reserve(&own, g->n + 1, e))
		return -1;
	own.n = g->n;
	for (size_t k = 0; k < FIELDS; k++)
		memcpy(own.column[k], g->column[k], g->n * sizeof **g->column);
	for (size_t i = 0; i < g->n; i++)
		ct_gauss_move(&own, i, &s, true);
	f = open_memstream(&text, &length);
	if (!f) {
		ct_gauss_free(&own);
		return ct_fail(e, CT_ENOMEM, "%s: no memory for a pickle", path);
	}
	fputs("\x80\3}(", f);
	for (size_t k = 0; k < ARRAYS; k++) {
		put_array(f, arrays[k].key, g->n, arrays[k].columns);
		for (size_t i = 0; i < g->n * arrays[k].columns; i++)
			fwrite(&own.column[arrays[k].column + i % arrays[k].columns]
					  [i / arrays[k].columns],
				sizeof(float), 1, f);
		fputs("tb", f);
	}
	put_own(f, g);
	if (fclose(f))
		ct_fail(e, CT_ENOMEM, "%s: no memory for a pickle", path);
	else if (ct_out_open(&out, path, env, e) == 0 && ct_put(&out, text, length, e) == 0)
		rc = ct_out_commit(&out, e);
	ct_out_abandon(&out);
	free(text);
	ct_gauss_free(&own);
	return rc;
}
