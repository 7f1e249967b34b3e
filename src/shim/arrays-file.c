/* arrays-file.c: see arrays.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/arrays.h"

#include <hdf5.h>
#include <matio.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { DEEPEST = 4 }; /* structs within structs */

/* Number i of a variable of MATLAB, whose first index runs fastest. */
static double number(const matvar_t *v, size_t i)
{
	switch ((int)v->class_type) {
	case MAT_C_DOUBLE: return ((const double *)v->data)[i];
	case MAT_C_SINGLE: return (double)((const float *)v->data)[i];
	case MAT_C_INT8: return ((const int8_t *)v->data)[i];
	case MAT_C_UINT8: return ((const uint8_t *)v->data)[i];
	case MAT_C_INT16: return ((const int16_t *)v->data)[i];
	case MAT_C_UINT16: return ((const uint16_t *)v->data)[i];
	case MAT_C_INT32: return ((const int32_t *)v->data)[i];
	case MAT_C_UINT32: return ((const uint32_t *)v->data)[i];
	case MAT_C_INT64: return (double)((const int64_t *)v->data)[i];
	case MAT_C_UINT64: return (double)((const uint64_t *)v->data)[i];
	default: return 0;
	}
}

static int take_numbers(struct ct_arrays *a, const matvar_t *v, const char *name, struct ct_err *e)
{
	struct ct_array *x;
	size_t at[CT_ARRAY_DIMS] = {0}, from = 0;

	if (v->rank < 1 || v->rank > CT_ARRAY_DIMS || v->isComplex || !v->data)
		return 0; /* no projections, nor what says anything of them */
	if (!(x = ct_arrays_add(a, name, e)))
		return -1;
	x->dims = (size_t)v->rank;
	for (size_t d = 0; d < x->dims; d++)
		x->n[d] = v->dims[d];
	if (ct_array_alloc(x, e))
		return -1;
	if (x->count > v->nbytes / Mat_SizeOfClass(v->class_type))
		return ct_fail(e, CT_EINPUT, "%s: truncated", name);
	x->first = number(v, 0);
	for (size_t i = 0; i < x->count; i++) { /* in order of C */
		size_t stride = 1;

		x->data[i] = (float)number(v, from);
		for (size_t d = 0; d < x->dims; d++)
			stride *= x->n[d];
		for (size_t d = x->dims; d-- > 0;) {
			stride /= x->n[d];
			from += stride;
			if (++at[d] < x->n[d])
				break;
			from -= x->n[d] * stride;
			at[d] = 0;
		}
	}
	return 0;
}

static int take_text(struct ct_arrays *a, const matvar_t *v, const char *name, struct ct_err *e)
{
	const size_t n = v->data && v->data_size ? v->nbytes / (size_t)v->data_size : 0;
	struct ct_array *x = ct_arrays_add(a, name, e);

	for (size_t i = 0; x && i < n && i + 1 < sizeof x->text; i++)
		x->text[i] = v->data_size == 2 ? (char)((const uint16_t *)v->data)[i]
					       : ((const char *)v->data)[i];
	return x ? 0 : -1;
}

static int take_variable(
	struct ct_arrays *a, matvar_t *v, const char *before, int depth, struct ct_err *e)
{
	char name[CT_ARRAY_NAME];

	if (!v || !v->name)
		return 0;
	if ((size_t)snprintf(name, sizeof name, "%s%s%s", before, *before ? "." : "", v->name) >=
		sizeof name)
		return ct_fail(e, CT_EINPUT, "%.60s...: the name is too long", name);
	if (v->class_type == MAT_C_STRUCT) {
		const unsigned n = Mat_VarGetNumberOfFields(v);

		for (unsigned i = 0; depth < DEEPEST && v->rank == 2 && v->dims[0] == 1 &&
				     v->dims[1] == 1 && i < n;
			i++)
			if (take_variable(
				    a, Mat_VarGetStructFieldByIndex(v, i, 0), name, depth + 1, e))
				return -1;
		return 0;
	}
	if (v->class_type == MAT_C_CHAR)
		return take_text(a, v, name, e);
	return v->class_type >= MAT_C_DOUBLE && v->class_type <= MAT_C_UINT64
		       ? take_numbers(a, v, name, e)
		       : 0;
}

static int read_matlab(struct ct_arrays *a, const char *path, struct ct_err *e)
{
	mat_t *m = Mat_Open(path, MAT_ACC_RDONLY);
	matvar_t *v;
	int rc = 0;

	if (!m)
		return ct_fail(e, CT_EINPUT, "cannot be opened as a file of MATLAB, 5 or 7.3");
	while (rc == 0 && (v = Mat_VarReadNext(m))) {
		rc = take_variable(a, v, "", 0, e);
		Mat_VarFree(v);
	}
	Mat_Close(m);
	return rc || a->n ? rc : ct_fail(e, CT_EINPUT, "holds no numbers, or is truncated");
}

static int take_dataset(struct ct_arrays *a, hid_t set, const char *name, struct ct_err *e)
{
	const hid_t space = H5Dget_space(set);
	const int dims = H5Sget_simple_extent_ndims(space);
	struct ct_array *x;
	hsize_t n[CT_ARRAY_DIMS];
	int rc = -1;

	if (dims < 1 || dims > CT_ARRAY_DIMS) {
		H5Sclose(space);
		return ct_fail(e, CT_EINPUT, "exchange/%s: has %d dimensions, not 1 to %d", name,
			dims, CT_ARRAY_DIMS);
	}
	H5Sget_simple_extent_dims(space, n, NULL);
	H5Sclose(space);
	if (!(x = ct_arrays_add(a, name, e)))
		return -1;
	x->dims = (size_t)dims;
	for (int d = 0; d < dims; d++)
		x->n[d] = (size_t)n[d];
	if (ct_array_alloc(x, e) == 0)
		rc = H5Dread(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, x->data) < 0
			     ? ct_fail(e, CT_EINPUT, "exchange/%s: cannot be read as numbers", name)
			     : 0;
	x->first = rc ? 0 : (double)x->data[0];
	return rc;
}

/* The text of the attribute "units", if it has one. */
static int take_units(struct ct_arrays *a, hid_t set, const char *name, struct ct_err *e)
{
	char full[CT_ARRAY_NAME], *text = NULL;
	struct ct_array *x;
	hid_t attr, type;

	if (H5Aexists(set, "units") <= 0 || (attr = H5Aopen(set, "units", H5P_DEFAULT)) < 0)
		return 0;
	snprintf(full, sizeof full, "%s.units", name);
	type = H5Aget_type(attr);
	x = ct_arrays_add(a, full, e);
	if (x && H5Tis_variable_str(type) > 0) {
		const hid_t memory = H5Tcopy(H5T_C_S1);

		H5Tset_size(memory, H5T_VARIABLE);
		H5Tset_cset(memory, H5Tget_cset(type));
		if (H5Aread(attr, memory, &text) >= 0 && text)
			strncpy(x->text, text, sizeof x->text - 1);
		H5free_memory(text);
		H5Tclose(memory);
	} else if (x && H5Tget_class(type) == H5T_STRING && H5Tget_size(type) < sizeof x->text) {
		H5Aread(attr, type, x->text);
	}
	H5Tclose(type);
	H5Aclose(attr);
	return x ? 0 : -1;
}

static int read_exchange(struct ct_arrays *a, const char *path, struct ct_err *e)
{
	static const char *const names[] = {"data", "data_white", "data_dark", "theta"};
	hid_t file, group;
	int rc = 0;

	H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
	if ((file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT)) < 0)
		return ct_fail(e, CT_EINPUT, "HDF5 that cannot be opened: damaged or truncated");
	if ((group = H5Gopen2(file, "exchange", H5P_DEFAULT)) < 0) {
		H5Fclose(file);
		return ct_fail(e, CT_EINPUT,
			"HDF5 without a group \"exchange\": expected Data Exchange, with exchange/data; "
			"make .npy of other files, for --scanner");
	}
	for (size_t k = 0; k < sizeof names / sizeof *names && rc == 0; k++) {
		hid_t set;

		if (H5Lexists(group, names[k], H5P_DEFAULT) <= 0)
			continue;
		set = H5Dopen2(group, names[k], H5P_DEFAULT);
		if (set < 0) {
			rc = ct_fail(e, CT_EINPUT, "exchange/%s: is no dataset", names[k]);
			break;
		}
		rc = ct_err_any(
			take_dataset(a, set, names[k], e) || take_units(a, set, names[k], e));
		H5Dclose(set);
	}
	H5Gclose(group);
	H5Fclose(file);
	return rc;
}

int arrays_file_read(struct ct_arrays *a, const char *path, struct ct_err *e)
{
	char head[6] = "";
	FILE *f = fopen(path, "rb");
	int rc;

	if (!f)
		return ct_fail(e, CT_EINPUT, "%s: cannot be opened", path);
	rc = fread(head, 1, sizeof head, f) == sizeof head ? 0 : 1;
	fclose(f);
	rc = rc == 0 && memcmp(head, "MATLAB", sizeof head) == 0 ? read_matlab(a, path, e)
								 : read_exchange(a, path, e);
	return rc ? ct_blame(e, path) : 0;
}
