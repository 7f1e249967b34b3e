/* pickle-tensors.c: the tensors in what a pickle made; see pickle.h. */
#include "config.h"
#include "core/mem.h"
#include "formats/pickle.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_TENSORS = 1 << 16, DEPTH = 4 };

/* Where checkpoints keep the weights of a network. */
static const char *const places[] = {"state_dict", "model", "model_state_dict", "ema"};
enum { PLACES = sizeof places / sizeof *places };

static const struct ct_pickle_value *tensor_of(
	const struct ct_pickle_values *v, const struct ct_pickle_pair *pair)
{
	const struct ct_pickle_value *x = &v->value[pair->value];

	return x->kind == CT_PICKLE_TENSOR ? x : NULL;
}

static size_t count_tensors(const struct ct_pickle_values *v, const struct ct_pickle_value *dict)
{
	size_t n = 0;

	for (size_t i = dict->first; i; i = v->pair[i].next)
		n += tensor_of(v, &v->pair[i]) != NULL;
	return n;
}

/* The value of a key, of several the last, as in Python; NULL if there is none. */
static const struct ct_pickle_value *get(
	const struct ct_pickle_values *v, const struct ct_pickle_value *dict, const char *word)
{
	const struct ct_pickle_value *found = NULL;

	for (size_t i = dict->first; i; i = v->pair[i].next) {
		const struct ct_pickle_value *key = &v->value[v->pair[i].key];

		if (key->kind == CT_PICKLE_TEXT && key->length == strlen(word) &&
			memcmp(key->text, word, key->length) == 0)
			found = &v->value[v->pair[i].value];
	}
	return found;
}

/* The dictionary of tensors that d is or that is in it, NULL if there is none; those that are found
 * are counted. */
static const struct ct_pickle_value *find(
	const struct ct_pickle_values *v, const struct ct_pickle_value *d, int depth, size_t *n)
{
	const struct ct_pickle_value *found = NULL, *x;

	if (!d || d->kind != CT_PICKLE_DICT || depth == 0)
		return NULL;
	if (count_tensors(v, d)) {
		++*n;
		return d;
	}
	for (int k = 0; k < PLACES; k++) {
		x = find(v, get(v, d, places[k]), depth - 1, n);
		found = x ? x : found;
	}
	return found;
}

static int copy_text(
	char **out, const struct ct_pickle_value *x, const char *what, struct ct_err *e)
{
	if (!x->text || x->length == 0 || memchr(x->text, 0, x->length))
		return ct_fail(e, CT_EINPUT, "a tensor whose %s is no word", what);
	*out = strndup(x->text, x->length);
	return *out ? 0 : ct_fail(e, CT_ENOMEM, "no memory for a tensor name");
}

static int copy_tensor(struct ct_pickle_tensor *t, const struct ct_pickle_values *v,
	const struct ct_pickle_pair *pair, struct ct_err *e)
{
	const size_t *part = v->part + v->value[pair->value].first;
	const struct ct_pickle_value *storage = &v->value[part[0]], *size = &v->value[part[2]],
				     *stride = &v->value[part[3]];

	t->type = storage->type;
	t->length = (uint64_t)storage->number;
	t->offset = (uint64_t)v->value[part[1]].number;
	t->rank = size->n;
	for (size_t i = 0; i < t->rank; i++) {
		t->dim[i] = (uint64_t)v->value[v->part[size->first + i]].number;
		t->stride[i] = (uint64_t)v->value[v->part[stride->first + i]].number;
	}
	return copy_text(&t->name, &v->value[pair->key], "name", e) ||
			       copy_text(&t->storage, storage, "storage", e)
		       ? -1
		       : 0;
}

static int by_name(const void *a, const void *b)
{
	const char *const *p = a, *const *q = b;

	return strcmp(*p, *q);
}

static int check_names(const struct ct_pickle *p, struct ct_err *e)
{
	const char **name;
	int rc = 0;

	if (ct_alloc(&name, p->n, sizeof *name, e))
		return -1;
	for (size_t i = 0; i < p->n; i++)
		name[i] = p->tensor[i].name;
	qsort(name, p->n, sizeof *name, by_name);
	for (size_t i = 1; i < p->n && !rc; i++)
		if (strcmp(name[i - 1], name[i]) == 0)
			rc = ct_fail(e, CT_EINPUT, "tensor '%.80s' is there twice", name[i]);
	free(name);
	return rc;
}

int ct_pickle_values_tensors(
	struct ct_pickle *p, const struct ct_pickle_values *v, size_t root, struct ct_err *e)
{
	size_t found = 0, n;
	const struct ct_pickle_value *d = find(v, &v->value[root], DEPTH, &found);

	if (!d)
		return ct_fail(e, CT_EINPUT,
			"no dictionary of tensors, nor one under state_dict, model or ema");
	if (found > 1)
		return ct_fail(e, CT_EINPUT,
			"more than one dictionary of tensors under state_dict, model and ema: "
			"save one");
	n = count_tensors(v, d);
	if (n > MOST_TENSORS)
		return ct_fail(e, CT_EINPUT, "%zu tensors", n);
	if (ct_alloc0(&p->tensor, n, sizeof *p->tensor, e))
		return -1;
	for (size_t i = d->first; i; i = v->pair[i].next)
		if (tensor_of(v, &v->pair[i]) && copy_tensor(&p->tensor[p->n++], v, &v->pair[i], e))
			return -1;
	return check_names(p, e);
}

void ct_pickle_free(struct ct_pickle *p)
{
	for (size_t i = 0; i < p->n; i++) {
		free(p->tensor[i].name);
		free(p->tensor[i].storage);
	}
	free(p->tensor);
	*p = (struct ct_pickle){0};
}
