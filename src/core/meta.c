/* meta.c: see meta.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "core/meta.h"
#include "core/env.h"
#include "core/mem.h"
#include "core/stream.h"
#include "core/words.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

void ct_meta_free(struct ct_meta *m)
{
	for (size_t i = 0; i < m->n; i++) {
		free(m->pair[i].key);
		free(m->pair[i].value);
	}
	free(m->pair);
	*m = (struct ct_meta){0};
}

static struct ct_pair *find(const struct ct_meta *m, const char *key)
{
	for (size_t i = 0; i < m->n; i++)
		if (strcmp(m->pair[i].key, key) == 0)
			return &m->pair[i];
	return NULL;
}

const char *ct_meta_get(const struct ct_meta *m, const char *key)
{
	const struct ct_pair *p = find(m, key);

	return p ? p->value : NULL;
}

int ct_meta_set(struct ct_meta *m, const char *key, const char *value, struct ct_err *e)
{
	struct ct_pair *p = find(m, key);
	char *k, *v;

	if (!*key)
		return ct_fail(e, CT_EINPUT, "metadata with an empty key");
	v = strdup(value);
	if (p && v) {
		free(p->value);
		p->value = v;
		return 0;
	}
	k = strdup(key);
	if (!k || !v) {
		free(k);
		free(v);
		return ct_fail(e, CT_ENOMEM, "no memory for metadata");
	}
	if (ct_grow(&m->pair, &m->cap, m->n + 1, sizeof *m->pair, e)) {
		free(k);
		free(v);
		return -1;
	}
	m->pair[m->n++] = (struct ct_pair){k, v};
	return 0;
}

int ct_meta_setf(struct ct_meta *m, struct ct_err *e, const char *key, const char *fmt, ...)
{
	char *s = NULL;
	va_list ap;
	int n, rc;

	va_start(ap, fmt);
	n = vasprintf(&s, fmt, ap);
	va_end(ap);
	if (n < 0)
		return ct_fail(e, CT_ENOMEM, "no memory for metadata");
	rc = ct_meta_set(m, key, s, e);
	free(s);
	return rc;
}

void ct_meta_drop(struct ct_meta *m, const char *key)
{
	struct ct_pair *p = find(m, key);

	if (!p)
		return;
	free(p->key);
	free(p->value);
	memmove(p, p + 1, (size_t)(m->pair + m->n - (p + 1)) * sizeof *p);
	m->n--;
}

int ct_meta_numbers(const struct ct_meta *m, const char *key, size_t n, double *v, struct ct_err *e)
{
	const char *s = ct_meta_get(m, key);

	if (!s)
		return 1;
	return ct_words_numbers(s, ',', n, true, v)
		       ? 0
		       : ct_fail(e, CT_EINPUT, "metadata %s: '%.60s' is not %zu numbers", key, s,
				 n);
}

enum { NOISIEST = 10000 }; /* HU: the range of a CT is 4096 */

int ct_meta_noise(const struct ct_meta *m, double *hu, struct ct_err *e)
{
	const int rc = ct_meta_numbers(m, CT_META_NOISE, 1, hu, e);

	if (rc || (*hu >= 0 && *hu <= NOISIEST))
		return rc;
	return ct_fail(e, CT_EINPUT, "metadata noise: %g HU: expected 0 to %d", *hu, NOISIEST);
}

int ct_meta_need_hu(const struct ct_meta *m, bool other, struct ct_err *e)
{
	const char *quantity = ct_meta_get(m, CT_META_QUANTITY);

	if (!quantity || strcasecmp(quantity, CT_QUANTITY_HU) == 0 ||
		(other && strcmp(quantity, CT_QUANTITY_OTHER) == 0))
		return 0;
	return ct_fail(
		e, CT_EINPUT, "metadata quantity: the values are '%.40s': expected HU", quantity);
}

int ct_meta_put_scalars(struct ct_meta *m, size_t n, double *const *v, struct ct_err *e)
{
	char text[16 * 32];
	int at = 0;

	for (size_t k = 0; k < n; k++)
		at += snprintf(text + at, sizeof text - (size_t)at, "%a ", *v[k]);
	return ct_meta_set(m, CT_META_SCALARS, text, e);
}

int ct_meta_get_scalars(const struct ct_meta *m, size_t n, double *const *v, struct ct_err *e)
{
	const char *text = ct_meta_get(m, CT_META_SCALARS);
	for (size_t k = 0; k < n; k++) {
		if (!text || !ct_number_exact(v[k], text, &text))
			return ct_fail(e, CT_EINPUT, "scalar %zu of the state is not a number", k);
	}
	return 0;
}

int ct_meta_add(struct ct_meta *dst, const struct ct_meta *src, struct ct_err *e)
{
	for (size_t i = 0; i < src->n; i++)
		if (ct_meta_set(dst, src->pair[i].key, src->pair[i].value, e))
			return -1;
	return 0;
}

int ct_meta_copy(struct ct_meta *dst, const struct ct_meta *src, struct ct_err *e)
{
	ct_meta_free(dst);
	return ct_meta_add(dst, src, e);
}

/* What is one line of a history stays one, whatever characters the name of a file has. */
static void put_line(FILE *f, const char *text)
{
	for (const char *c = text; *c; c++)
		if (*c == '\n')
			fputs("\\n", f);
		else if ((unsigned char)*c < ' ')
			fprintf(f, "\\x%02x", (unsigned)*c);
		else
			fputc(*c, f);
}

int ct_meta_step(struct ct_meta *dst, const struct ct_env *env, size_t n,
	const struct ct_meta *const *in, struct ct_err *e)
{
	const char *old = ct_meta_get(dst, CT_META_HISTORY);
	const char *before = " # ";
	char *text = NULL;
	size_t len;
	FILE *f;
	int rc;

	if (ct_stream_open(&f, &text, &len, e))
		return -1;
	if (old)
		fprintf(f, "%s\n", old);
	put_line(f, env->history ? env->history : "ctsr");
	for (size_t i = 0; i < n; i++) {
		const char *name = in[i] ? ct_meta_get(in[i], CT_META_INPUT) : NULL;

		if (!name)
			continue;
		fputs(before, f);
		put_line(f, name);
		before = " ";
	}
	rc = ct_err_any(ct_stream_close(f, &text, e) || ct_meta_set(dst, CT_META_HISTORY, text, e));
	free(text);
	ct_meta_drop(dst, CT_META_INPUT);
	return rc;
}
