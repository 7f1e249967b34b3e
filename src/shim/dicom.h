/* dicom.h: DICOM files through vtk-dicom; the geometry is core/slices.h.
 *
 * A picture that a decoder gives up on, or a file that ends early, is an error here, never a
 * picture of zeros. A JPEG 2000 stream whose last tile-part states a length that runs past its
 * end is decoded to its end-of-codestream mark instead. Compressed pictures are decoded in a
 * process of their own, since the decoders are known to die of damaged ones.
 */
#ifndef CT_SHIM_DICOM_H
#define CT_SHIM_DICOM_H
#include "core/err.h"
#include "core/slices.h"

#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif

struct ct_env;
struct ct_vol;

/* What the DICOM pictures among the paths say, folders with all that is below them; files in
 * folders that are no DICOM pictures are passed over. *s is for ct_dicom_free. CT_EINPUT. */
int ct_dicom_scan(
	const char *const *paths, size_t n, struct ct_slice **s, size_t *count, struct ct_err *e);
void ct_dicom_free(struct ct_slice *s, size_t count);
/* Stored values of one picture into out[rows*columns], row by row. CT_EINPUT. */
int ct_dicom_pixels(const struct ct_slice *s, float *out, struct ct_err *e);
/* One series as a volume in HU, RAS+; `which` as in ct_slices_pick. Several series are listed
 * in the log. Codes as of the functions above and ct_slices_grid. *v must be zero. */
int ct_dicom_read(const char *const *paths, size_t n, const char *which, struct ct_vol *v,
	const struct ct_env *env, struct ct_err *e);

#ifdef __cplusplus
}
#endif
#endif
