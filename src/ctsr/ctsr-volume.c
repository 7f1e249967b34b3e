/* ctsr-volume.c: volumes in memory. */
#include "config.h"
#include "core/mem.h"
#include "ctsr/ctsr-impl.h"
#include "formats/voxels.h"
#include "gs/mixture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int ctsr_make_volume(ctsr_volume **v, struct ct_err *e)
{
	return ct_alloc0(v, 1, sizeof **v, e);
}

void ctsr_volume_free(ctsr_volume *v)
{
	if (!v)
		return;
	if (v->borrowed)
		v->v.data = NULL;
	ct_vol_free(&v->v);
	free(v);
}

int ctsr_check_volume(const ctsr_volume *v, struct ct_err *e)
{
	return ct_vol_check_grid(&v->v, e) || ct_vol_check_finite(&v->v, e) ? -1 : 0;
}

/* Sizes and affine; data NULL: allocated, all zero. */
static int make(ctsr_volume **out, const size_t size[3], const double affine[3][4], float *data,
	struct ct_err *e)
{
	ctsr_volume *v;
	size_t bytes;

	if (size[0] == 0 || size[1] == 0 || size[2] == 0)
		return ct_fail(e, CT_EUSAGE, "an empty volume: %zux%zux%zu voxels", size[0],
			size[1], size[2]);
	if (ct_size_mul(&bytes, size[0], size[1], "volume", e) ||
		ct_size_mul(&bytes, bytes, size[2], "volume", e) ||
		ct_size_mul(&bytes, bytes, sizeof *data, "volume", e) || ctsr_make_volume(&v, e))
		return -1;
	v->borrowed = data != NULL;
	v->v.data = data;
	if (!data && ct_alloc0(&v->v.data, bytes, 1, e))
		goto fail;
	memcpy(v->v.n, size, sizeof v->v.n);
	for (int a = 0; a < 3; a++)
		v->v.affine[a][a] = 1;
	if (affine)
		memcpy(v->v.affine, affine, sizeof v->v.affine);
	if (ct_vol_check_grid(&v->v, e))
		goto fail;
	*out = v;
	return 0;
fail:
	ctsr_volume_free(v);
	return -1;
}

int ctsr_volume_new(ctsr_volume **v, const size_t size[3], const double affine[3][4], ctsr_error *e)
{
	struct ct_err err;

	if (!v || !size)
		return ctsr_no_null(__func__, e);
	*v = NULL;
	return ctsr_give_error(make(v, size, affine, NULL, &err), &err, e);
}

int ctsr_volume_wrap(ctsr_volume **v, const size_t size[3], const double affine[3][4], float *data,
	ctsr_error *e)
{
	struct ct_err err;

	if (v)
		*v = NULL;
	if (!v || !size || !data)
		return ctsr_no_null(__func__, e);
	return ctsr_give_error(make(v, size, affine, data, &err), &err, e);
}

int ctsr_volume_from_int16(ctsr_volume **v, const size_t size[3], const double affine[3][4],
	const int16_t *data, double slope, double intercept, ctsr_error *e)
{
	struct ct_err err;
	int rc;

	if (v)
		*v = NULL;
	if (!v || !size || !data)
		return ctsr_no_null(__func__, e);
	if (!isfinite(slope) || !isfinite(intercept))
		rc = ct_fail(&err, CT_EUSAGE, "slope %g or intercept %g is not finite", slope,
			intercept);
	else
		rc = make(v, size, affine, NULL, &err);
	for (size_t i = 0; rc == 0 && i < ct_vol_count(&(*v)->v); i++)
		(*v)->v.data[i] = (float)(slope * data[i] + intercept);
	return ctsr_give_error(rc, &err, e);
}

float *ctsr_volume_data(const ctsr_volume *v)
{
	return v ? v->v.data : NULL;
}

void ctsr_volume_grid(const ctsr_volume *v, size_t size[3], double affine[3][4])
{
	if (v && size)
		memcpy(size, v->v.n, sizeof v->v.n);
	if (v && affine)
		memcpy(affine, v->v.affine, sizeof v->v.affine);
}

int ctsr_volume_to_int16(const ctsr_volume *v, int16_t *data, ctsr_error *e)
{
	struct ct_err err;

	if (!v || !data)
		return ctsr_no_null(__func__, e);
	if (ct_voxels_i16(ct_vol_count(&v->v), data, v->v.data, false))
		return 0;
	return ctsr_give_error(ct_fail(&err, CT_ENUMERIC, "a voxel does not fit int16"), &err, e);
}

const char *ctsr_volume_get(const ctsr_volume *v, const char *key)
{
	return v && key ? ct_meta_get(&v->v.meta, key) : NULL;
}

const char *ctsr_volume_key(const ctsr_volume *v, size_t i)
{
	return v && i < v->v.meta.n ? v->v.meta.pair[i].key : NULL;
}

int ctsr_volume_set(ctsr_volume *v, const char *key, const char *value, ctsr_error *e)
{
	struct ct_err err;
	int rc = 0;

	if (!v || !key)
		return ctsr_no_null(__func__, e);
	if (!*key)
		rc = ct_fail(&err, CT_EUSAGE, "an empty key");
	else if (value)
		rc = ct_meta_set(&v->v.meta, key, value, &err);
	else
		ct_meta_drop(&v->v.meta, key);
	return ctsr_give_error(rc, &err, e);
}

/* Linear at the index x. */
static float at(const struct ct_vol *v, const double x[3])
{
	size_t low[3], step[3] = {1, v->n[0], v->n[0] * v->n[1]};
	double f[3], sum = 0;

	for (int a = 0; a < 3; a++) {
		if (!(x[a] >= 0 && x[a] <= (double)(v->n[a] - 1)))
			return NAN;
		low[a] = (size_t)x[a];
		f[a] = x[a] - (double)low[a];
	}
	for (unsigned corner = 0; corner < 8; corner++) {
		double weight = 1;
		size_t i = 0;

		for (int a = 0; a < 3; a++) {
			const unsigned up = corner >> a & 1;

			weight *= up ? f[a] : 1 - f[a];
			i += (low[a] + up) * step[a];
		}
		if (weight > 0)
			sum += weight * (double)v->data[i];
	}
	return (float)sum;
}

int ctsr_volume_sample(
	float *values, const ctsr_volume *v, size_t n, const double (*points)[3], ctsr_error *e)
{
	static const size_t none[3];
	struct ct_block k;
	struct ct_err err;

	if (!v || (n && (!values || !points)))
		return ctsr_no_null(__func__, e);
	if (ct_block_init(&k, (const double(*)[4])v->v.affine, none, v->v.n, &err))
		return ctsr_give_error(-1, &err, e);
	for (size_t i = 0; i < n; i++) {
		double x[3] = {0};

		for (int a = 0; a < 3; a++) {
			for (int b = 0; b < 3; b++)
				x[a] += k.inv[a][b] * (points[i][b] - k.world[b]);
			/* rounding must not put a centre of the border outside */
			if (fabs(x[a] - nearbyint(x[a])) < 1e-9 * (1 + fabs(x[a])))
				x[a] = nearbyint(x[a]);
		}
		values[i] = at(&v->v, x);
	}
	return 0;
}
