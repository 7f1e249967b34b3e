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

#endif
