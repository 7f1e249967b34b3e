/* part.c: see part.h. */
#include "config.h"
#include "cli/part.h"

#include <stdlib.h>
#include <string.h>

/* A hash in words, to be freed. */
static char *text_of(const struct ct_hash *h, struct ct_err *e)
{
	struct ct_meta m = {0};
	const char *said;
	char *text = NULL;

	if (ct_hash_input(h, &m, "-", e) == 0) {
		said = ct_meta_get(&m, CT_META_INPUT);
		text = strdup(strrchr(said, ' ') + 1);
		if (!text)
			ct_fail(e, CT_ENOMEM, "no memory");
	}
	ct_meta_free(&m);
	return text;
}

/* That of some pieces. */
static char *hash_of(size_t n, const struct ct_piece *piece, struct ct_err *e)
{
	struct ct_hash *h;
	char *text;

	if (ct_hash_alloc(&h, e))
		return NULL;
	for (size_t i = 0; i < n; i++)
		CT_SIMD(ct_hash_add)(h, piece[i].data, piece[i].bytes);
	text = text_of(h, e);
	free(h);
	return text;
}

/* Does the row of a key (resume.c) say which part a run makes? */
static bool says_part(const char *name)
{
	return strcmp(name, "run.--brick") == 0 || strcmp(name, "run.--views") == 0;
}

/* Of the names and the values of a run's key, each with the byte that ends it. */
static char *hash_of_run(const struct ct_meta *key, struct ct_err *e)
{
	struct ct_piece *piece = calloc(2 * key->n + 1, sizeof *piece);
	size_t n = 0;
	char *hash;

	if (!piece) {
		ct_fail(e, CT_ENOMEM, "no memory");
		return NULL;
	}
	for (size_t i = 0; i < key->n; i++) {
		const struct ct_pair *p = &key->pair[i];

		if (says_part(p->key))
			continue;
		piece[n++] = (struct ct_piece){p->key, strlen(p->key) + 1};
		piece[n++] = (struct ct_piece){p->value, strlen(p->value) + 1};
	}
	hash = hash_of(n, piece, e);
	free(piece);
	return hash;
}

int ct_part_range(
	struct ct_part *p, const char *option, const char *text, size_t of, struct ct_err *e)
{
	double v[2];

	if (ct_cli_range(option, text, v, e))
		return -1;
	if (!(v[0] >= 0 && v[1] <= (double)of && v[0] == (double)(size_t)v[0] &&
		    v[1] == (double)(size_t)v[1]))
		return ct_fail(e, CT_EUSAGE, "--%s: %.80s is not within 0:%zu", option, text, of);
	*p = (struct ct_part){CT_PART_VIEWS, (size_t)v[0], (size_t)v[1], of};
	return 0;
}

int ct_part_put(struct ct_meta *m, const struct ct_part *p, const struct ct_resume *run,
	const float *x, size_t n, struct ct_err *e)
{
	char *is = hash_of(1, &(struct ct_piece){x, n * sizeof *x}, e),
	     *of = hash_of_run(&run->key, e);
	int rc = -1;

	if (is && of &&
		ct_meta_setf(m, e, CT_META_PART, "%d,%zu,%zu,%zu", p->axis, p->from, p->to,
			p->of) == 0 &&
		ct_meta_set(m, CT_META_PART_RUN, of, e) == 0)
		rc = ct_meta_set(m, CT_META_PART_HASH, is, e);
	free(is);
	free(of);
	return rc;
}

int ct_part_get(struct ct_part *p, const struct ct_meta *m, struct ct_err *e)
{
	double v[4];
	int rc = ct_meta_numbers(m, CT_META_PART, 4, v, e);

	if (rc)
		return rc;
	for (int k = 0; k < 4; k++)
		if (!(v[k] >= 0 && v[k] < 1e9 && v[k] == (double)(size_t)v[k]))
			rc = -1;
	if (rc || v[0] > CT_PART_VIEWS || !(v[1] < v[2] && v[2] <= v[3]) ||
		!ct_meta_get(m, CT_META_PART_RUN) || !ct_meta_get(m, CT_META_PART_HASH))
		return ct_fail(e, CT_EINPUT, "%s '%.80s' is no part of anything", CT_META_PART,
			ct_meta_get(m, CT_META_PART));
	*p = (struct ct_part){(int)v[0], (size_t)v[1], (size_t)v[2], (size_t)v[3]};
	return 0;
}

int ct_part_check(const struct ct_meta *m, const struct ct_hash *values, struct ct_err *e)
{
	const char *was = ct_meta_get(m, CT_META_PART_HASH);
	char *is = text_of(values, e);
	int rc = -1;

	if (is)
		rc = was && strcmp(is, was) == 0
			     ? 0
			     : ct_fail(e, CT_EINPUT,
				       "is damaged: its values are not those that were written");
	free(is);
	return rc;
}

void ct_part_drop(struct ct_meta *m)
{
	ct_meta_drop(m, CT_META_PART);
	ct_meta_drop(m, CT_META_PART_RUN);
	ct_meta_drop(m, CT_META_PART_HASH);
}
