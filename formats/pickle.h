/* pickle.h: what a checkpoint says of its tensors or arrays: its pickle is read, never executed.
 *
 * A pickle is a program for a stack machine that may call any function of Python. Of its
 * instructions this one knows those that torch.save writes for numbers, words, tuples, lists,
 * dictionaries and tensors, and of functions three: the ones that make an ordered dictionary, a
 * tensor of a storage, and a parameter of a tensor; or, where arrays are asked for, those that make
 * one of numpy. Any other is refused by name. Nothing that it
 * reads makes it allocate more than a few times the length of the pickle.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_PICKLE_H
#define CT_FORMATS_PICKLE_H
#include "core/err.h"
#include "formats/voxels.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum ct_pickle_kind {
	CT_PICKLE_PLAIN,   /* None, a truth, a real number: no part of a tensor */
	CT_PICKLE_INTEGER, /* number */
	CT_PICKLE_TEXT,    /* text, length */
	CT_PICKLE_TUPLE,   /* n parts */
	CT_PICKLE_LIST,    /* what is in it is not kept */
	CT_PICKLE_DICT,    /* pairs from first to last */
	CT_PICKLE_GLOBAL,  /* number: which of those that are known */
	CT_PICKLE_STORAGE, /* text: its name; number: its length; type */
	CT_PICKLE_TENSOR,  /* parts: storage, offset, size, stride */
	/* of arrays: */
	CT_PICKLE_BYTES,  /* text, length */
	CT_PICKLE_LATIN1, /* bytes that are the letters of a text, UTF-8 */
	CT_PICKLE_DTYPE,  /* type; number: is the order of bytes the other one? */
	CT_PICKLE_ARRAY,  /* text (NULL: none yet), length, type; parts: its shape; number: below */
};
enum { CT_PICKLE_FORTRAN = 1, CT_PICKLE_BIG = 2, CT_PICKLE_UTF8 = 4 };

struct ct_pickle_value {
	enum ct_pickle_kind kind;
	enum ct_voxel type;
	int64_t number;
	const char *text; /* in the pickle */
	size_t length;
	size_t first, n; /* parts of a tuple or a tensor; first and last pair of a dictionary */
};

/* One pair of a dictionary; next is 0 for none. */
struct ct_pickle_pair {
	size_t key, value, next;
};

/* What a pickle makes; pair 0 is none. */
struct ct_pickle {
	struct ct_pickle_value *value;
	size_t *part;
	struct ct_pickle_pair *pair;
	size_t n_value, cap_value, n_part, cap_part, n_pair, cap_pair;
	size_t root; /* the value that is left at the end */
	bool arrays; /* of numpy, not tensors of PyTorch: set by who reads */
};

/* *p must be zero, but for `arrays`, and is to be freed in any case; its texts are in `data`.
 * CT_EINPUT naming the instruction and its place, or the function. */
int ct_pickle_read(struct ct_pickle *p, const unsigned char *data, size_t n, struct ct_err *e);
void ct_pickle_free(struct ct_pickle *p);
/* *out, to be freed, <- n x columns numbers, rows first, of an array of that shape (of one column
 * also n). CT_EINPUT, CT_ENOMEM. */
int ct_pickle_array(float **out, const struct ct_pickle *p, const struct ct_pickle_value *a,
	size_t n, size_t columns, struct ct_err *e);
/* Is the value this text? */
static inline bool ct_pickle_is_text(const struct ct_pickle_value *x, const char *word)
{
	return x->kind == CT_PICKLE_TEXT && x->length == strlen(word) &&
	       memcmp(x->text, word, x->length) == 0;
}

#endif
