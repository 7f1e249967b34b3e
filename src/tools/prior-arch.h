/* prior-arch.h: the option --arch KEY=VALUE,...: what a network is, in words. */
#ifndef CT_TOOLS_PRIOR_ARCH_H
#define CT_TOOLS_PRIOR_ARCH_H
#include "core/meta.h"
#include "unet/arch.h"

/* The items of the option as keys and values; NULL has none. CT_EUSAGE. */
int prior_arch_parse(struct ct_meta *m, const char *text, struct ct_err *e);
/* Those of a network that is to be made. CT_EUSAGE for another key, CT_EINPUT for a value that the
 * key does not take. */
int prior_arch_set(struct ct_unet_arch *a, const struct ct_meta *m, struct ct_err *e);
/* Add to the metadata of weights what the option states and they do not. CT_EUSAGE for what they
 * state otherwise, and for a key that no prior has. */
int prior_arch_add(struct ct_meta *weights, const struct ct_meta *m, struct ct_err *e);

#endif
