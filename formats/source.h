/* source.h: the bytes of a volume as a stream, compressed or not, and its voxels; in and out.
 *
 * What reads does not seek but to learn how long the file is, so pipes work.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_SOURCE_H
#define CT_FORMATS_SOURCE_H
#include "core/vol.h"
#include "formats/io.h"
#include "formats/voxels.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <zlib.h>

/* bytes converted at a time: stays in the second-level cache */
enum { CT_SOURCE_BLOCK = 1 << 18 };

enum ct_packing {
	CT_PACKING_TELL, /* gzip, if it begins with its two bytes; else not, and NIfTI */
	CT_PACKING_NONE,
	CT_PACKING_ZLIB, /* or gzip */
};

struct ct_source {
	FILE *f;
	bool packed, ended;
	z_stream z;
	unsigned char *block; /* [CT_SOURCE_BLOCK], between calls */
	unsigned char *in;    /* [CT_SOURCE_BLOCK] compressed bytes */
	uint64_t at;          /* bytes given out so far */
	uint64_t left;        /* no more than this can come, UINT64_MAX if unknown */
	uint64_t size;        /* bytes of the file, UINT64_MAX if unknown */
	uint64_t from, to;    /* compressed bytes read so far, and what became of them */
};

/* What is left of f. CT_EINPUT; CT_ENOMEM. */
int ct_source_open(struct ct_source *s, FILE *f, enum ct_packing packing, struct ct_err *e);
/* f stays open. Also legal on a zeroed struct. */
void ct_source_close(struct ct_source *s);
/* Exactly n bytes. CT_EINPUT if there are fewer. */
int ct_source_take(struct ct_source *s, void *dst, size_t n, struct ct_err *e);
/* Pass over what is before byte `at`. */
int ct_source_skip(struct ct_source *s, uint64_t at, struct ct_err *e);

/* Numbers as they lie there. */
struct ct_stored {
	enum ct_voxel type;
	bool big;            /* big-endian */
	double slope, inter; /* HU = slope*stored + inter */
};
/* Those of n voxels are so many bytes. CT_EINPUT. */
int ct_stored_bytes(
	const struct ct_stored *how, const size_t n[static 3], size_t *bytes, struct ct_err *e);
/* The rest as the data of v, of whose grid this is, and its key "input", NAME and a hash of sizes,
 * affine and voxels; behind the voxels what is compressed is inflated, for its check sum.
 * CT_EGEOM for a grid that is none; CT_EINPUT before anything is allocated if the file is too
 * short; CT_ENOMEM. */
int ct_source_volume(struct ct_source *s, const struct ct_stored *how, const char *name,
	struct ct_vol *v, struct ct_err *e);
/* Bytes of s behind those that were given out; of what is compressed, once ct_source_volume is
 * back. 0 if that is not known. */
uint64_t ct_source_behind(const struct ct_source *s);
/* The key "input" of a volume that is not read: as ct_source_volume sets it. CT_EGEOM, CT_ENOMEM.
 */
int ct_source_sign(struct ct_vol *v, const char *name, struct ct_err *e);
/* The numbers that are all of f: "longer than LONGER" if there are more. */
int ct_source_whole(FILE *f, const struct ct_stored *how, size_t n, float *out, const char *longer,
	struct ct_err *e);

/* The way out: into a file that is there when it is whole (io.h). */
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
