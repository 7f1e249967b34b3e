/* dicom-vol.c: a series to a volume. See dicom.h. */
#include "config.h"
#include "core/env.h"
#include "core/inflate.h"
#include "core/vol.h"
#include "shim/dicom.h"

#include <math.h>
#include <string.h>

static void list(const struct ct_slice *s, size_t n, const struct ct_env *env)
{
	size_t number = 1;

	for (size_t k = 0, count; k < n; k += count) {
		count = ct_slices_count(s, n, k);
		ct_log(env, CT_WARN, "series %zu: %zu %s %zux%zu '%s' %s", number++, count,
			s[k].modality, s[k].columns, s[k].rows, s[k].about, s[k].series);
	}
}

/* Some converters give every slice a frame of its own. */
static void warn_frames(const struct ct_slice *s, size_t n, const struct ct_env *env)
{
	for (size_t k = 1; k < n; k++)
		if (strcmp(s[k].frame, s[0].frame) != 0) {
			ct_log(env, CT_WARN,
				"slices of one series name several frames of reference; their "
				"positions are taken to be in one");
			return;
		}
}

/* Pictures of many bytes in files of few: nothing is decoded, nothing allocated. */
static int check_size(const struct ct_slice *s, size_t n, struct ct_err *e)
{
	double from = 0, to = 0;

	for (size_t k = 0; k < n; k++) {
		from += s[k].bytes;
		to += s[k].claimed;
	}
	return ct_inflate_check((uint64_t)fmin(from, 1e18), (uint64_t)fmin(to, 1e18), e)
		       ? ct_blame(e, s->path)
		       : 0;
}

static int fill(
	struct ct_vol *v, const struct ct_slice *s, const struct ct_env *env, struct ct_err *e)
{
	const size_t n[3] = {s->columns, s->rows, v->n[2]}, area = n[0] * n[1];
	double affine[3][4];

	memcpy(affine, v->affine, sizeof affine);
	if (ct_vol_alloc(v, n, e))
		return -1;
	memcpy(v->affine, affine, sizeof affine);
	for (size_t k = 0; k < n[2]; k++) {
		if (ct_check_stop(env, e) || ct_dicom_pixels(&s[k], v->data + k * area, e))
			return -1;
		ct_slice_hu(&s[k], v->data + k * area);
		ct_progress(env, "reading", k + 1, n[2]);
	}
	return 0;
}

int ct_dicom_read(const char *const *paths, size_t n, const char *which, struct ct_vol *v,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_slice *s = NULL;
	size_t total = 0, first, count;
	int rc = -1;

	if (ct_dicom_scan(paths, n, &s, &total, e))
		return -1;
	ct_slices_group(s, total);
	if (ct_slices_pick(s, total, which, &first, &count, e)) {
		list(s, total, env);
		ct_blame(e, paths[0]);
	} else if (check_size(s + first, count, e) == 0 &&
		   ct_slices_grid(s + first, count, v->affine, e) == 0) {
		v->n[2] = count;
		warn_frames(s + first, count, env);
		rc = fill(v, s + first, env, e);
	}
	if (rc)
		ct_vol_free(v);
	ct_dicom_free(s, total);
	return rc;
}
