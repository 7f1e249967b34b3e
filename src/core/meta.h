/* meta.h: what travels inside every file beside its numbers: key=value strings.
 *
 * The same list is a JSON object in a NIfTI extension, "ct:key" attributes in an EXR,
 * "comment ct:key=value" lines in a PLY, and __metadata__ in a safetensors file.
 *
 * Keys in use (see ct-formats(5)):
 *   history    one line a command that made the data: "ct-degrade 0.1.0 -x 4 in.nii out.nii"
 *   input      NAME xxh3:HEX of the file the list was read from, set by the readers
 *   window     "LO:HI", HU that map to density 0 and 1
 *   factor     "X,Y,Z" decimation factor of the low-resolution grid
 *   sigma      "X,Y,Z" Gaussian of the degradation, high-resolution voxels
 *   decimate   sinc | point | mean
 *   noise      standard deviation of the noise that was added, HU
 *   upsample   method that brought the data to the fine grid; factor is used up then
 *   seed       the seed of the last step that drew numbers
 *   nifti.code   qform_code and sform_code, if not 1
 *   nifti.ext.N  a foreign NIfTI extension: "ECODE BASE64"
 */
#ifndef CT_CORE_META_H
#define CT_CORE_META_H
#include "core/err.h"

#include <stddef.h>

struct ct_env;

struct ct_meta {
	size_t n, cap;
	struct ct_pair {
		char *key, *value;
	} * pair; /* in order of insertion */
};

void ct_meta_free(struct ct_meta *m);
/* Value of a key, borrowed until the list changes, or NULL. */
const char *ct_meta_get(const struct ct_meta *m, const char *key);
/* Replace or append. CT_EINPUT for an empty key, CT_ENOMEM. */
int ct_meta_set(struct ct_meta *m, const char *key, const char *value, struct ct_err *e);
int ct_meta_setf(struct ct_meta *m, struct ct_err *e, const char *key, const char *fmt, ...)
	__attribute__((format(printf, 4, 5)));
void ct_meta_drop(struct ct_meta *m, const char *key);
/* Numbers "a,b,c" of a key into v: 0; 1 if there is no such key (v untouched); -1 with
 * CT_EINPUT naming the key if the value is not exactly n finite numbers. One number
 * stands for n equal ones. */
int ct_meta_numbers(
	const struct ct_meta *m, const char *key, size_t n, double *v, struct ct_err *e);
int ct_meta_copy(struct ct_meta *dst, const struct ct_meta *src, struct ct_err *e);
/* Append this command to `history` of dst, with the names and hashes of the n lists `in`
 * (NULL entries are skipped) and the seed; drops "input". */
int ct_meta_step(struct ct_meta *dst, const struct ct_env *env, size_t n,
	const struct ct_meta *const *in, struct ct_err *e);

#endif
