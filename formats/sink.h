/* sink.h: a volume as a stream of bytes, compressed or not, into a file that is there when it is
 * whole (io.h). */
#ifndef CT_FORMATS_SINK_H
#define CT_FORMATS_SINK_H
#include "core/vol.h"
#include "formats/io.h"

#include <zlib.h>

struct ct_sink {
	struct ct_out out;
	bool packed;
	z_stream z;
	unsigned char *buf; /* [CT_SOURCE_BLOCK] compressed bytes */
	void *block;        /* [CT_SOURCE_BLOCK] voxels */
	uint64_t at;        /* bytes that went into the file */
};

int ct_sink_open(struct ct_sink *s, const char *path, const struct ct_env *env, struct ct_err *e);
/* What follows is compressed: gzip, or else zlib. */
int ct_sink_pack(struct ct_sink *s, bool gzip, struct ct_err *e);
int ct_sink_give(struct ct_sink *s, const void *data, size_t n, struct ct_err *e);
/* n voxels x, int16, rounded, or float32. *fits: they fit int16, if `exact` as they are. */
int ct_sink_some(struct ct_sink *s, size_t n, const float *x, bool i16, bool exact, bool *fits,
	struct ct_err *e);
/* All voxels. CT_ESTOP. */
int ct_sink_voxels(struct ct_sink *s, const struct ct_vol *v, bool i16, const struct ct_env *env,
	struct ct_err *e);
/* All is given. */
int ct_sink_end(struct ct_sink *s, struct ct_err *e);
/* What is given next is in the place of the first bytes of the file, and not compressed. */
int ct_sink_rewind(struct ct_sink *s, struct ct_err *e);
/* The file is there if rc is 0, else none of it; rc, or -1. */
int ct_sink_close(struct ct_sink *s, int rc, struct ct_err *e);

#endif
