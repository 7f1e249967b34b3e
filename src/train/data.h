/* data.h: pictures for ct-train from stacks, picture files and folders of them. */
#ifndef CT_TRAIN_DATA_H
#define CT_TRAIN_DATA_H
#include "core/err.h"
#include "core/meta.h"
#include "core/stack.h"
#include "core/vol.h"
#include "diffusion/patches.h"

/* Add what `path` names to the set: an EXR stack, divided by its largest value; a picture; or all
 * pictures and stacks of a folder in the order of their names. The key "input" of *meta becomes
 * the name and a hash of it all. CT_EINPUT, CT_ENUMERIC naming the file. */
int train_data_read(
	struct ct_pictures *s, const char *path, struct ct_meta *meta, struct ct_err *e);

/* Maps a volume of bytes to HU: 0 and 255 are map[0] and map[1], unless that is NaN. CT_EINPUT
 * naming the file for values that cannot be HU. */
int train_data_hu(struct ct_vol *v, const char *path, const double map[static 2], struct ct_err *e);

/* The files that `path` names: itself, or what a folder holds, in the order of their names. */
struct train_names {
	char **path; /* owned */
	size_t n;
};
int train_data_names(struct train_names *names, const char *path, struct ct_err *e);
void train_names_free(struct train_names *names);

#endif
