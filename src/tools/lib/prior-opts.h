/* prior-opts.h: the options of a prior: --prior, its file or the installed one, and --arch
 * KEY=VALUE,..., what its network is, in words. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TOOLS_LIB_PRIOR_OPTS_H
#define CT_TOOLS_LIB_PRIOR_OPTS_H
#include "restore/restore.h"
#include "nn/arch.h"

/* Of pictures, for ct-ddnm, and of slices. */
#define PRIOR_PICTURES "prior.safetensors"
#define PRIOR_SLICES "slices.safetensors"

/* The slice prior of `given`, or the installed one, and its metadata. Codes of the readers. */
int prior_file_read(
	struct ct_slice_prior *prior, struct ct_meta *meta, const char *given, struct ct_err *e);

/* The items of the option as keys and values; NULL has none. CT_EUSAGE. */
int prior_arch_parse(struct ct_meta *m, const char *text, struct ct_err *e);
/* Those of a network that is to be made, but for "net", which a has. CT_EUSAGE for another key,
 * CT_EINPUT for a value that the key does not take. */
int prior_arch_set(struct ct_unet_arch *a, const struct ct_meta *m, struct ct_err *e);
/* Add to the metadata of weights what the option states and they do not. CT_EUSAGE for what they
 * state otherwise, and for a key that no prior has. */
int prior_arch_add(struct ct_meta *weights, const struct ct_meta *m, struct ct_err *e);

#endif
