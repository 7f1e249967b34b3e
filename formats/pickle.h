/* pickle.h: what a checkpoint of PyTorch says of its tensors: its pickle is read, never executed.
 *
 * A pickle is a program for a stack machine that may call any function of Python. Of its
 * instructions this one knows those that torch.save writes for numbers, words, tuples, lists,
 * dictionaries and tensors, and of functions three: the ones that make an ordered dictionary, a
 * tensor of a storage, and a parameter of a tensor. Any other is refused by name. Nothing that it
 * reads makes it allocate more than a few times the length of the pickle.
 */
#ifndef CT_FORMATS_PICKLE_H
#define CT_FORMATS_PICKLE_H
#include "core/err.h"
#include "core/tensors.h"
#include "formats/voxels.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Numbers that lie elsewhere: storages are named, and tensors are parts of them. */
struct ct_pickle_tensor {
	char *name;    /* its key in the dictionary; owned */
	char *storage; /* owned */
	enum ct_voxel type;
	uint64_t length; /* of the storage, numbers */
	uint64_t offset; /* of the first number */
	size_t rank;
	uint64_t dim[CT_MAX_RANK], stride[CT_MAX_RANK]; /* in numbers */
};

struct ct_pickle {
	size_t n;
	struct ct_pickle_tensor *tensor; /* in the order of the dictionary; names are unique */
};

/* The tensors of the one dictionary of them: the outermost, or that under "state_dict", "model",
 * "model_state_dict" or "ema" in it, as deep as that goes. *p must be zero, and is to be freed in
 * any case. CT_EINPUT naming the instruction and its place, the function, or the tensor. */
int ct_pickle_read(struct ct_pickle *p, const unsigned char *data, size_t n, struct ct_err *e);
void ct_pickle_free(struct ct_pickle *p);

/* The values that a pickle makes; between pickle.c, which runs it, pickle-objects.c, which knows
 * what it may call, and pickle-tensors.c, which looks for the tensors in the result. */
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
};

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

/* Pair 0 is none. */
struct ct_pickle_values {
	struct ct_pickle_value *value;
	size_t *part;
	struct ct_pickle_pair *pair;
	size_t n_value, cap_value, n_part, cap_part, n_pair, cap_pair;
};

/* The object of this name, if it is one that a dictionary of tensors needs. */
bool ct_pickle_value_global(
	struct ct_pickle_value *out, const char *module, size_t nm, const char *name, size_t nn);
/* The storage that the tuple t names; and what function f gives of the arguments t. NULL, or why
 * not. */
const char *ct_pickle_value_storage(struct ct_pickle_value *out, const struct ct_pickle_values *v,
	const struct ct_pickle_value *t);
const char *ct_pickle_value_call(struct ct_pickle_value *out, const struct ct_pickle_values *v,
	const struct ct_pickle_value *f, const struct ct_pickle_value *t);
/* The tensors under value `root`. */
int ct_pickle_values_tensors(
	struct ct_pickle *p, const struct ct_pickle_values *v, size_t root, struct ct_err *e);

#endif
