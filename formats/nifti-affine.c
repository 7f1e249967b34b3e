/* nifti-affine.c: sform, qform and pixdim to one affine, and back. */
#include "config.h"
#include "formats/nifti-impl.h"
#include "core/vec3.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define APART 0.1 /* mm: less is rounding */

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
	const double mm = mm_per_unit(h);

	memset(a, 0, 3 * sizeof a[0]);
	*code = h->sform > 0 ? (int)h->sform : h->qform > 0 ? (int)h->qform : 0;
	for (int i = 0; i < 3 && !(h->sform > 0); i++)
		if (!is_length(h->pixdim[i + 1]))
			return ct_fail(e, CT_EGEOM, "pixdim[%d] is %g", i + 1, h->pixdim[i + 1]);
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
