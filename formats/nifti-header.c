/* nifti-header.c: the fixed headers of NIfTI-1 and NIfTI-2, and the affine in them.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vec3.h"
#include "formats/nifti-impl.h"
#include "formats/voxels.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#define AT(f) offsetof(struct ct_nii, f)
/* Where a field lies in version 1 and 2, and in struct ct_nii. */
static const struct field {
	size_t at, count;
	struct {
		size_t at;
		enum ct_voxel type;
	} in[2];
} fields[] = {
	{AT(dim), 8, {{40, CT_V_I16}, {16, CT_V_I64}}},
	{AT(type), 1, {{70, CT_V_I16}, {12, CT_V_I16}}},
	{AT(bits), 1, {{72, CT_V_I16}, {14, CT_V_I16}}},
	{AT(pixdim), 8, {{76, CT_V_F32}, {104, CT_V_F64}}},
	{AT(start), 1, {{108, CT_V_F32}, {168, CT_V_I64}}},
	{AT(slope), 1, {{112, CT_V_F32}, {176, CT_V_F64}}},
	{AT(inter), 1, {{116, CT_V_F32}, {184, CT_V_F64}}},
	{AT(units), 1, {{123, CT_V_U8}, {500, CT_V_I32}}},
	{AT(qform), 1, {{252, CT_V_I16}, {344, CT_V_I32}}},
	{AT(sform), 1, {{254, CT_V_I16}, {348, CT_V_I32}}},
	{AT(quat), 3, {{256, CT_V_F32}, {352, CT_V_F64}}},
	{AT(shift), 3, {{268, CT_V_F32}, {376, CT_V_F64}}},
	{AT(srow), 12, {{280, CT_V_F32}, {400, CT_V_F64}}},
};

static const char magic1[4] = "n+1", magic1_pair[4] = "ni1";
static const char magic2[8] = "n+2\0\r\n\032\n", magic2_pair[8] = "ni2\0\r\n\032\n";

/* The bits of one number. */
static uint64_t bits_of(const unsigned char *p, enum ct_voxel type, bool big)
{
	const size_t bytes = ct_voxel_bytes((int)type);
	uint64_t u = 0;

	memcpy(&u, p, bytes);
	return big ? __builtin_bswap64(u) >> (64 - 8 * bytes) : u;
}

static double get(const unsigned char *p, enum ct_voxel type, bool big)
{
	const uint64_t u = bits_of(p, type, big);
	float f;
	double d;

	switch ((int)type) {
	case CT_V_U8: return (double)u;
	case CT_V_I16: return (double)(int16_t)u;
	case CT_V_I32: return (double)(int32_t)u;
	case CT_V_I64: return (double)(int64_t)u;
	case CT_V_F32: memcpy(&f, &u, sizeof f); return (double)f;
	default: memcpy(&d, &u, sizeof d); return d;
	}
}

static void put(unsigned char *p, enum ct_voxel type, double x)
{
	const float f = (float)x;
	int64_t whole;

	if (type == CT_V_F32)
		memcpy(p, &f, sizeof f);
	else if (type == CT_V_F64)
		memcpy(p, &x, sizeof x);
	else {
		whole = (int64_t)x;
		memcpy(p, &whole, ct_voxel_bytes((int)type));
	}
}

size_t ct_nii_size(const struct ct_nii *h)
{
	return h->version == 2 ? CT_NII_HEAD2 : CT_NII_HEAD1;
}

int ct_nii_sniff(struct ct_nii *h, const unsigned char *raw, struct ct_err *e)
{
	for (int big = 0; big < 2; big++)
		for (int version = 1; version <= 2; version++)
			if (bits_of(raw, CT_V_I32, big) ==
				(version == 2 ? CT_NII_HEAD2 : CT_NII_HEAD1)) {
				h->version = version;
				h->big = big;
				return 0;
			}
	return ct_fail(e, CT_EINPUT, "not a NIfTI file");
}

static int check_magic(const struct ct_nii *h, const unsigned char *raw, struct ct_err *e)
{
	const char *m = (const char *)raw + (h->version == 2 ? 4 : 344);
	const size_t n = h->version == 2 ? sizeof magic2 : sizeof magic1;

	if (memcmp(m, h->version == 2 ? magic2 : magic1, n) == 0)
		return 0;
	if (memcmp(m, h->version == 2 ? magic2_pair : magic1_pair, n) == 0)
		return ct_fail(e, CT_EINPUT,
			"header of a .hdr/.img pair: only single-file NIfTI (.nii) is read");
	if (h->version == 1 && memcmp(m, "\0\0\0", 4) == 0)
		return ct_fail(e, CT_EINPUT, "Analyze 7.5 header, not NIfTI (no magic)");
	return ct_fail(e, CT_EINPUT, "not a NIfTI file (wrong magic)");
}

/* The name of a datatype that is not read. */
static const char *odd_type(int type)
{
	switch (type) {
	case 1: return "bits";
	case 32: return "complex64";
	case 128: return "RGB";
	case 1536: return "float128";
	case 1792: return "complex128";
	case 2048: return "complex256";
	case 2304: return "RGBA";
	default: return "unknown";
	}
}

int ct_nii_unpack(struct ct_nii *h, const unsigned char *raw, struct ct_err *e)
{
	const size_t first = ct_nii_size(h) + 4;
	size_t bytes;

	if (check_magic(h, raw, e))
		return -1;
	for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
		const struct field *f = &fields[i];
		const enum ct_voxel type = f->in[h->version - 1].type;
		const unsigned char *p = raw + f->in[h->version - 1].at;

		for (size_t k = 0; k < f->count; k++) {
			double x = get(p + k * ct_voxel_bytes((int)type), type, h->big);

			memcpy((char *)h + f->at + k * sizeof x, &x, sizeof x);
		}
	}
	bytes = ct_voxel_bytes((int)h->type);
	if (!bytes)
		return ct_fail(e, CT_EINPUT, "datatype %d (%s) is not supported", (int)h->type,
			odd_type((int)h->type));
	if (h->bits != 0 && h->bits != (double)(8 * bytes))
		return ct_fail(e, CT_EINPUT, "bitpix is %g for datatype %d of %zu bits", h->bits,
			(int)h->type, 8 * bytes);
	if (h->start == 0)
		h->start = (double)first;
	if (!(h->start >= (double)first && h->start <= 0x1p53 && h->start == floor(h->start)))
		return ct_fail(
			e, CT_EINPUT, "vox_offset %g is wrong (at least %zu)", h->start, first);
	if (isinf(h->slope) || (h->slope != 0 && !isnan(h->slope) && isinf(h->inter)))
		return ct_fail(
			e, CT_EINPUT, "scl_slope is %g and scl_inter %g", h->slope, h->inter);
	if (h->slope == 0 || isnan(h->slope)) {
		h->slope = 1;
		h->inter = 0;
	}
	if (!isfinite(h->inter))
		h->inter = 0;
	return 0;
}

void ct_nii_pack(const struct ct_nii *h, const char *descrip, unsigned char *raw)
{
	put(raw, CT_V_I32, (double)ct_nii_size(h));
	if (h->version == 2)
		memcpy(raw + 4, magic2, sizeof magic2);
	else {
		memcpy(raw + 344, magic1, sizeof magic1);
		raw[38] = 'r'; /* "regular": Analyze readers ask for it */
	}
	for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
		const struct field *f = &fields[i];
		const enum ct_voxel type = f->in[h->version - 1].type;
		unsigned char *p = raw + f->in[h->version - 1].at;

		for (size_t k = 0; k < f->count; k++) {
			double x;

			memcpy(&x, (const char *)h + f->at + k * sizeof x, sizeof x);
			put(p + k * ct_voxel_bytes((int)type), type, x);
		}
	}
	snprintf((char *)raw + (h->version == 2 ? 240 : 148), 80, "%s", descrip);
}

int ct_nii_dims(const struct ct_nii *h, size_t n[static 3], struct ct_err *e)
{
	if (!(h->dim[0] >= 1 && h->dim[0] <= 7))
		return ct_fail(
			e, CT_EINPUT, "dim[0] is %g: a NIfTI has 1 to 7 dimensions", h->dim[0]);
	for (int a = 0; a < 3; a++)
		n[a] = 1;
	for (int a = 1; a <= (int)h->dim[0]; a++) {
		if (a > 3 && h->dim[a] == 0)
			continue; /* as other programs write it: 1 */
		if (!(h->dim[a] >= 1 && h->dim[a] <= 0x1p40))
			return ct_fail(e, CT_EINPUT, "dim[%d] is %.0f", a, h->dim[a]);
		if (a > 3 && h->dim[a] > 1)
			return ct_fail(e, CT_EINPUT,
				"dim[%d] is %.0f: only one 3-D volume a file is read", a,
				h->dim[a]);
		if (a <= 3)
			n[a - 1] = (size_t)h->dim[a];
	}
	return 0;
}

/* sform, qform and pixdim to one affine, and back. */
#define APART 0.1    /* mm: less is rounding */
#define LONGEST 1.01 /* part of a unit quaternion: what is beyond 1 is rounding */

/* Rotation of the unit quaternion (a,b,c,d) whose a >= 0 is implied. */
static void rotation(double r[3][3], const double q[3])
{
	double b = q[0], c = q[1], d = q[2], a = 1 - (b * b + c * c + d * d);

	if (a < 1e-7) { /* half a turn: what is left of a is rounding */
		double s = 1 / sqrt(b * b + c * c + d * d);

		b *= s;
		c *= s;
		d *= s;
		a = 0;
	} else
		a = sqrt(a);
	r[0][0] = a * a + b * b - c * c - d * d;
	r[0][1] = 2 * (b * c - a * d);
	r[0][2] = 2 * (b * d + a * c);
	r[1][0] = 2 * (b * c + a * d);
	r[1][1] = a * a + c * c - b * b - d * d;
	r[1][2] = 2 * (c * d - a * b);
	r[2][0] = 2 * (b * d - a * c);
	r[2][1] = 2 * (c * d + a * b);
	r[2][2] = a * a + d * d - b * b - c * c;
}

/* Quaternion of a proper rotation, from whichever of its parts is largest. */
static void quaternion(double q[3], double r[3][3])
{
	const double t[4] = {r[0][0] + r[1][1] + r[2][2], r[0][0] - r[1][1] - r[2][2],
		r[1][1] - r[0][0] - r[2][2], r[2][2] - r[0][0] - r[1][1]};
	double p[4], s;
	int k = 0;

	for (int i = 1; i < 4; i++)
		if (t[i] > t[k])
			k = i;
	p[k] = sqrt(fmax(1 + t[k], 0)) / 2;
	s = 1 / (4 * p[k]);
	if (k == 0) {
		for (int i = 0; i < 3; i++)
			p[i + 1] = (r[(i + 2) % 3][(i + 1) % 3] - r[(i + 1) % 3][(i + 2) % 3]) * s;
	} else {
		int i = k - 1, j = (i + 1) % 3, l = (i + 2) % 3;

		p[0] = (r[l][j] - r[j][l]) * s;
		p[j + 1] = (r[j][i] + r[i][j]) * s;
		p[l + 1] = (r[l][i] + r[i][l]) * s;
	}
	for (int i = 0; i < 3; i++)
		q[i] = p[0] < 0 ? -p[i + 1] : p[i + 1];
}

/* The orthogonal factor of the polar decomposition, Newton's iteration Q <- (Q + Q^-T)/2
 * (Higham 1986): the rotation (or reflection) nearest to m. Near-orthogonal m needs a few
 * steps; returns the sign of the determinant. */
static double polar(double m[3][3])
{
	double c[3][3], det = 1;

	for (int step = 0; step < 12; step++) {
		det = ct_vec3_dual(c, m[0], m[1], m[2]);
		for (int i = 0; i < 3; i++)
			for (int j = 0; j < 3; j++)
				m[i][j] = (m[i][j] + c[i][j] / det) / 2;
	}
	return det < 0 ? -1 : 1;
}

static double mm_per_unit(const struct ct_nii *h)
{
	switch ((int)h->units & 7) {
	case 1: return 1e3;
	case 3: return 1e-3;
	default: return 1;
	}
}

static void by_quaternion(double a[3][4], const struct ct_nii *h)
{
	const double flip = h->pixdim[0] < 0 ? -1 : 1;
	double r[3][3];

	rotation(r, h->quat);
	for (int i = 0; i < 3; i++) {
		for (int j = 0; j < 3; j++)
			a[i][j] = r[i][j] * h->pixdim[j + 1] * (j == 2 ? flip : 1);
		a[i][3] = h->shift[i];
	}
}

static bool is_length(double x)
{
	return isfinite(x) && x > 0;
}

int ct_nii_affine(const struct ct_nii *h, double a[3][4], int *code, struct ct_err *e)
{
	const double mm = mm_per_unit(h), turn = ct_vec3_length(h->quat);

	memset(a, 0, 3 * sizeof a[0]);
	*code = h->sform > 0 ? (int)h->sform : h->qform > 0 ? (int)h->qform : 0;
	for (int i = 0; i < 3 && !(h->sform > 0); i++)
		if (!is_length(h->pixdim[i + 1]))
			return ct_fail(e, CT_EGEOM, "pixdim[%d] is %g", i + 1, h->pixdim[i + 1]);
	if (!(h->sform > 0) && h->qform > 0 && !(turn <= LONGEST))
		return ct_fail(e, CT_EGEOM,
			"quatern_b, _c and _d are a vector %g long: no rotation, whose has at most 1",
			turn);
	if (h->sform > 0)
		memcpy(a, h->srow, sizeof h->srow);
	else if (h->qform > 0)
		by_quaternion(a, h);
	else
		for (int i = 0; i < 3; i++)
			a[i][i] = h->pixdim[i + 1];
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 4; j++)
			a[i][j] *= mm;
	return 0;
}

static double handedness(double a[3][4])
{
	double dual[3][3];

	return ct_vec3_dual(dual, a[0], a[1], a[2]);
}

/* How far a corner of the grid lies from itself, at most. */
static double apart(double a[3][4], double b[3][4], const size_t n[3])
{
	double most = 0;

	for (unsigned corner = 0; corner < 8; corner++) {
		double ijk[3], d[3];

		ct_cell_corner(ijk, n, corner, 0);
		for (int i = 0; i < 3; i++) {
			d[i] = a[i][3] - b[i][3];
			for (int j = 0; j < 3; j++)
				d[i] += (a[i][j] - b[i][j]) * ijk[j];
		}
		if (!(ct_vec3_length(d) <= most))
			most = ct_vec3_length(d); /* NaN too */
	}
	return most;
}

int ct_nii_doubt(char out[static CT_NII_DOUBT], const struct ct_nii *h, const size_t n[static 3],
	struct ct_err *e)
{
	const double mm = mm_per_unit(h);
	double s[3][4], q[3][4], most;
	bool lengths = true;

	*out = '\0';
	if (!(h->sform > 0))
		return 0;
	memcpy(s, h->srow, sizeof s);
	for (int j = 0; j < 3; j++) {
		const double side = ct_vec3_length((const double[]){s[0][j], s[1][j], s[2][j]});

		lengths = lengths && is_length(h->pixdim[j + 1]);
		if (!(fabs(h->pixdim[j + 1] - side) * (double)n[j] * mm <= APART) && !*out)
			snprintf(out, CT_NII_DOUBT,
				"pixdim[%d] is %g, but voxels are %g long in the sform, which is "
				"used",
				j + 1, h->pixdim[j + 1], side);
	}
	if (!(h->qform > 0) || !lengths)
		return 0;
	by_quaternion(q, h);
	if (handedness(q) * handedness(s) < 0)
		return ct_fail(e, CT_EGEOM,
			"qform and sform are mirror images: which side is left is not known");
	most = apart(q, s, n) * mm;
	if (!(most <= APART) && h->qform == h->sform && !*out)
		snprintf(out, CT_NII_DOUBT,
			"qform and sform are up to %.3g mm apart; the sform is used", most);
	return 0;
}

int ct_nii_set_affine(struct ct_nii *h, const struct ct_vol *v, bool shear, struct ct_err *e)
{
	double mm[3], q[3][3], r[3][3], worst = 0;

	ct_vol_spacing(v, mm);
	memcpy(h->pixdim + 1, mm, sizeof mm);
	memcpy(h->srow, v->affine, sizeof h->srow);
	h->units = 2;
	h->pixdim[0] = 1;
	if (ct_vol_check_grid(v, e)) {
		h->sheared =
			shear && mm[0] > 0 && mm[1] > 0 && mm[2] > 0 && mm[0] + mm[1] + mm[2] < 1e6;
		if (h->sheared)
			*e = (struct ct_err){0};
		return h->sheared ? 0 : -1;
	}
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			q[i][j] = r[i][j] = v->affine[i][j] / mm[j];
	h->pixdim[0] = polar(q);
	for (int i = 0; i < 3; i++) {
		double off = 0;

		for (int j = 0; j < 3; j++)
			off += fabs(q[i][j] - r[i][j]) * mm[j] * (double)v->n[j];
		worst = fmax(worst, off / fmin(fmin(mm[0], mm[1]), mm[2]));
	}
	if (!(worst <= 0.05))
		return ct_fail(e, CT_EGEOM,
			"the grid is sheared: its corners would move by %.2g voxels in the qform",
			worst);
	for (int i = 0; i < 3; i++)
		q[i][2] *= h->pixdim[0];
	quaternion(h->quat, q);
	for (int i = 0; i < 3; i++)
		h->shift[i] = v->affine[i][3];
	return 0;
}
