/* zip.h: members of a zip archive that are stored as they are: what torch.save writes.
 *
 * Found by the directory at the end of the archive, of either kind (32 and 64 bits); nothing is
 * inflated. Sizes and places are checked against the file when it is opened, so that no member is
 * larger than the file and together they are not either; CRC-32 when one has been read.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_ZIP_H
#define CT_FORMATS_ZIP_H
#include "core/err.h"

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

struct ct_zip_member {
	const char *name; /* borrowed from the archive */
	uint64_t at, size;
	uint32_t crc;
};

struct ct_zip {
	FILE *f;
	uint64_t size; /* of the file */
	size_t n;
	struct ct_zip_member *member; /* sorted by name */
	char *names;
	/* of the member that is read */
	const struct ct_zip_member *now;
	uint64_t left;
	unsigned long crc;
};

/* Directory of a file that seeks, which is borrowed. *z must be zero, and is to be freed in any
 * case. CT_EINPUT naming the member and the field. */
int ct_zip_open(struct ct_zip *z, FILE *f, struct ct_err *e);
void ct_zip_free(struct ct_zip *z);
/* By its whole name, or NULL. */
const struct ct_zip_member *ct_zip_find(const struct ct_zip *z, const char *name);
/* Read a member: begin, as many takes as give its size, and end, which looks at the CRC; or all of
 * it. */
int ct_zip_begin(struct ct_zip *z, const struct ct_zip_member *m, struct ct_err *e);
int ct_zip_take(struct ct_zip *z, void *data, size_t n, struct ct_err *e);
int ct_zip_end(struct ct_zip *z, struct ct_err *e);
int ct_zip_read(struct ct_zip *z, const struct ct_zip_member *m, void *data, struct ct_err *e);

#endif
