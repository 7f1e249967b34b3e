/* ctsr-volume.c: volumes in memory. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "ctsr/ctsr-impl.h"
#include "formats/units.h"
#include "formats/voxels.h"
#include "gs/mixture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void ctsr_volume_free(ctsr_volume *v)
{
	if (!v)
		return;
	if (v->borrowed)
		v->v.data = NULL;
	ct_vol_free(&v->v);
	free(v);
}

static void drop(void *object)
{
	ctsr_volume_free(object);
}

int ctsr_make_volume(struct ctsr_call *k, ctsr_volume **v)
{
	return ctsr_call_makes(k, v, sizeof **v, drop);
}

int ctsr_check_volume(const ctsr_volume *v, struct ct_err *e)
{
	return ct_err_any(ct_vol_check_grid(&v->v, e) || ct_vol_check_finite(&v->v, e));
}

int ctsr_check_hu(const ctsr_volume *v, const char *name, struct ct_err *e)
{
	return ct_units_check(&v->v, "the metadata key quantity", e) ||
			       ct_vol_check_finite(&v->v, e)
		       ? ct_blame(e, name)
		       : 0;
}

int ctsr_copy_volume(struct ct_vol *to, const ctsr_volume *v, struct ct_err *e)
{
	if (ct_vol_like(to, &v->v, e))
		return -1;
	memcpy(to->data, v->v.data, ct_vol_count(to) * sizeof *to->data);
	ct_meta_free(&to->meta);
	return ct_meta_copy(&to->meta, &v->v.meta, e);
}

int ctsr_zeros_like(struct ct_vol *v, const ctsr_volume *like, struct ct_err *e)
{
	if (ct_vol_check_grid(&like->v, e) || ct_vol_like(v, &like->v, e))
		return -1;
	memset(v->data, 0, ct_vol_count(v) * sizeof *v->data);
	return 0;
}

/* Sizes and affine; data NULL: allocated, all zero. */
static int make(struct ctsr_call *k, ctsr_volume **out, bool given, const size_t *size,
	const double affine[3][4], float *data)
{
	struct ct_err *e = &k->err;
	struct ct_vol *v;
	size_t bytes;

	if (ctsr_make_volume(k, out) || ctsr_call_given(k, given))
		return -1;
	if (size[0] == 0 || size[1] == 0 || size[2] == 0)
		return ct_fail(e, CT_EUSAGE, "an empty volume: %zux%zux%zu voxels", size[0],
			size[1], size[2]);
	(*out)->borrowed = data != NULL;
	v = &(*out)->v;
	v->data = data;
	if (ct_size_mul(&bytes, size[0], size[1], "volume", e) ||
		ct_size_mul(&bytes, bytes, size[2], "volume", e) ||
		ct_size_mul(&bytes, bytes, sizeof *data, "volume", e) ||
		(!data && ct_alloc0(&v->data, bytes, 1, e)))
		return -1;
	memcpy(v->n, size, sizeof v->n);
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 1;
	if (affine)
		memcpy(v->affine, affine, sizeof v->affine);
	return ct_vol_check_grid(v, e);
}

int ctsr_volume_new(ctsr_volume **v, const size_t size[3], const double affine[3][4], float *data,
	ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);

	return ctsr_call_end(&k, make(&k, v, size, size, affine, data), e);
}

int ctsr_volume_from_int16(ctsr_volume **v, const size_t size[3], const double affine[3][4],
	const int16_t *data, double slope, double intercept, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	int rc = make(&k, v, size && data, size, affine, NULL);

	if (rc == 0 && (!isfinite(slope) || !isfinite(intercept)))
		rc = ct_fail(&k.err, CT_EUSAGE, "slope %g or intercept %g is not finite", slope,
			intercept);
	for (size_t i = 0; rc == 0 && i < ct_vol_count(&(*v)->v); i++)
		(*v)->v.data[i] = (float)(slope * data[i] + intercept);
	return ctsr_call_end(&k, rc, e);
}

float *ctsr_volume_data(const ctsr_volume *v, size_t size[3], double affine[3][4])
{
	if (v && size)
		memcpy(size, v->v.n, sizeof v->v.n);
	if (v && affine)
		memcpy(affine, v->v.affine, sizeof v->v.affine);
	return v ? v->v.data : NULL;
}

int ctsr_volume_to_int16(const ctsr_volume *v, int16_t *data, ctsr_error *e)
{
	struct ctsr_call k = CTSR_CALL(__func__);
	int rc = ctsr_call_given(&k, v && data);

	if (rc == 0 && !ct_voxels_i16(ct_vol_count(&v->v), data, v->v.data, false))
		rc = ct_fail(&k.err, CT_ENUMERIC, "a voxel does not fit int16");
	return ctsr_call_end(&k, rc, e);
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
	struct ctsr_call k = CTSR_CALL(__func__);
	int rc = ctsr_call_given(&k, v && key);

	if (rc == 0 && !*key)
		rc = ct_fail(&k.err, CT_EUSAGE, "an empty key");
	if (rc == 0 && value)
		rc = ct_meta_set(&v->v.meta, key, value, &k.err);
	else if (rc == 0)
		ct_meta_drop(&v->v.meta, key);
	return ctsr_call_end(&k, rc, e);
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
	struct ctsr_call k = CTSR_CALL(__func__);
	struct ct_block grid;
	const int rc = ctsr_call_given(&k, v && (!n || (values && points))) ||
		       ct_block_init(&grid, (const double(*)[4])v->v.affine, none, v->v.n, &k.err);

	for (size_t i = 0; rc == 0 && i < n; i++) {
		double x[3] = {0};

		for (int a = 0; a < 3; a++) {
			for (int b = 0; b < 3; b++)
				x[a] += grid.inv[a][b] * (points[i][b] - grid.world[b]);
			/* rounding must not put a centre of the border outside */
			if (fabs(x[a] - nearbyint(x[a])) < 1e-9 * (1 + fabs(x[a])))
				x[a] = nearbyint(x[a]);
		}
		values[i] = at(&v->v, x);
	}
	return ctsr_call_end(&k, rc, e);
}
