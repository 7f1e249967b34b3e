/* any.h: what a file is, by content, and any of our files in one struct. */
#ifndef CT_FORMATS_ANY_H
#define CT_FORMATS_ANY_H
#include "core/gauss.h"
#include "core/stack.h"
#include "core/tensors.h"
#include "core/vol.h"
#include "core/words.h"

#include <stdbool.h>

#define CT_KIND_LIST(X)                                                                            \
	X(CT_KIND_UNKNOWN, "unknown")                                                              \
	X(CT_KIND_VOLUME, "volume")   /* NIfTI, also in gzip, MetaImage, NRRD */                   \
	X(CT_KIND_STACK, "stack")     /* OpenEXR */                                                \
	X(CT_KIND_GAUSS, "Gaussians") /* PLY */                                                    \
	X(CT_KIND_TENSORS, "tensors") /* safetensors, PyTorch */                                   \
	X(CT_KIND_DICOM, "DICOM")     /* told apart only to say so */                              \
	X(CT_KIND_PICTURE, "picture") /* PNG, TIFF, JPEG: likewise */
enum ct_kind { CT_KIND_LIST(CT_WORD_VALUE) };
/* As many first bytes of a file tell all kinds apart. */
enum { CT_SNIFF = 352 };

enum ct_kind ct_any_sniff(const unsigned char *data, size_t n);
/* A tar archive. */
bool ct_any_is_tar(const unsigned char *data, size_t n);
/* Its word. */
const char *ct_kind_name(enum ct_kind kind);

/* Is the file a stack, by its first bytes? "-" is taken for one. CT_EINPUT. */
int ct_any_is_stack(const char *path, bool *stack, struct ct_err *e);

struct ct_any {
	enum ct_kind kind; /* one of volume, stack, gauss, tensors; that member is filled */
	struct ct_vol vol;
	struct ct_stack stack;
	struct ct_gauss gauss;
	struct ct_tensors tensors;
};

/* Any of our files, "-" too. *a must be zero. CT_EINPUT for another kind of file. */
int ct_any_read(const char *path, struct ct_any *a, struct ct_err *e);
void ct_any_free(struct ct_any *a);
/* The metadata of what is there. */
const struct ct_meta *ct_any_meta(const struct ct_any *a);

#endif
