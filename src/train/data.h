/* data.h: pictures and volumes for ct-train, from files and folders of them.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TRAIN_DATA_H
#define CT_TRAIN_DATA_H
#include "core/vol.h"
#include "diffusion/patches.h"
#include "shim/reader.h"
#include "train/subject.h"

/* Warns of each file that is trained on and held out. CT_EINPUT, CT_ENOMEM. */
int train_files_check(const struct train_files *f, const struct ct_env *env, struct ct_err *e);
/* CT_EOUTPUT if the folder, of --cache or of OUT, is one of them. */
int train_files_apart(const struct train_files *f, const char *folder, struct ct_err *e);

/* Add what `path` names to the set: an EXR stack, divided by its largest value; a picture; or all
 * pictures and stacks of a folder in the order of their names. The key "input" of *meta becomes
 * the name and a hash of it all. CT_EINPUT, CT_ENUMERIC naming the file; CT_ESTOP. */
int train_data_read(struct ct_pictures *s, struct ct_reading *reading, const char *path,
	struct ct_meta *meta, const struct ct_env *env, struct ct_err *e);

#define TRAIN_DATA_READS 0.05 /* of a training, about */

/* What takes a volume of HU, and what it holds if that is kept; it comes from `path`, which may be
 * held out. */
typedef int train_volume_fn(
	void *ctx, bool held, struct ct_vol *v, const char *path, struct ct_err *e);
/* Reads the volumes of all files, or of all in a folder in the order of their names, and hands on
 * each; *data becomes their names and hashes. `bytes` are the HU of the bytes 0 and 255, NaN if
 * files hold HU; `what` is the work that is reported. CT_EINPUT, CT_ENUMERIC naming the file. */
int train_data_volumes(const struct train_files *files, struct train_data *data,
	const double bytes[static 2], train_volume_fn *take, void *ctx, const char *what,
	const struct ct_env *env, struct ct_err *e);

#endif
