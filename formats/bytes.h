/* bytes.h: the readers of format.h without files: what is in memory or comes as a stream. `name`
 * stands for the path in messages. Results must be zero before and stay so on failure. */
#ifndef CT_FORMATS_BYTES_H
#define CT_FORMATS_BYTES_H
#include "core/err.h"
#include "core/gauss.h"
#include "core/stack.h"
#include "core/tensors.h"
#include "core/vol.h"

#include <stdio.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are copied as they are");

int ct_bytes_read_exr(const unsigned char *data, size_t n, const char *name, struct ct_stack *s,
	struct ct_err *e);
int ct_bytes_read_ply(const unsigned char *data, size_t n, const char *name, struct ct_gauss *g,
	struct ct_err *e);
/* Never seeks. */
int ct_bytes_read_safetensors(FILE *f, const char *name, struct ct_tensors *w, struct ct_err *e);
/* A checkpoint of PyTorch; seeks. */
int ct_bytes_read_pt(FILE *f, const char *name, struct ct_tensors *w, struct ct_err *e);
/* Set their key "input": the last thing that a reader does. */
int ct_tensors_sign(struct ct_tensors *w, const char *path, struct ct_err *e);

#endif
