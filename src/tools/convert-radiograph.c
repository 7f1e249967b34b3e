/* convert-radiograph.c: planes, pictures and DICOM radiographs, as a stack of as many views.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/modes.h"
#include "core/mem.h"
#include "core/stack.h"
#include "dicom/form.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "shim/image-read.h"
#include "tools/convert.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SOURCE_MM = 1000 }; /* mm from the plane to what stands for the source of parallel rays */
#define UPRIGHT "RIP"      /* a patient who is seen from the front or behind */

/* Rays cross the plane at right angles. */
static void place(struct ct_view *view, const struct ct_vol *v)
{
	double n[3], length;

	ct_vol_centre(v, view->centre);
	for (int r = 0; r < 3; r++) {
		const int s = (r + 1) % 3, t = (r + 2) % 3;

		view->u[r] = v->affine[r][0];
		view->v[r] = v->affine[r][1];
		n[r] = v->affine[s][0] * v->affine[t][1] - v->affine[t][0] * v->affine[s][1];
	}
	length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
	for (int r = 0; r < 3; r++)
		view->source[r] = view->centre[r] - SOURCE_MM * n[r] / length;
}

static int check(const struct ct_vol *v, bool intensity, struct ct_err *e)
{
	if (v->n[2] != 1)
		return ct_fail(e, CT_EGEOM, "--radiograph: has %zu planes, not one", v->n[2]);
	for (size_t i = 0, n = ct_vol_count(v); i < n && intensity; i++)
		if (!(v->data[i] >= 0 && v->data[i] <= 1))
			return ct_fail(e, CT_EINPUT,
				"--radiograph: pixel %zu,%zu is %g, no grey value from 0 to 1",
				i % v->n[0], i / v->n[0], (double)v->data[i]);
	return 0;
}

static int read_picture(
	struct ct_reading *reading, const char *path, struct ct_vol *v, struct ct_err *e)
{
	float *gray = NULL;
	size_t w, h;
	int rc = -1;

	if (ct_image_read_next(reading, path, &w, &h, NULL, &gray, e) == 0 &&
		ct_vol_alloc(v, (const size_t[]){w, h, 1}, e) == 0) {
		memcpy(v->data, gray, w * h * sizeof *gray);
		rc = 0;
	}
	free(gray);
	return rc;
}

/* Where a picture lies, whose pixels are of mm, if that is known: what --rescale makes of it is
 * there then. */
static int finish(struct ct_vol *v, const struct convert *p, const char *path, const double mm[2],
	const struct ct_env *env, struct ct_err *e)
{
	const bool known = !isnan(mm[0]);
	struct ct_raw how = {.spacing = {1, 1, 1}};

	if (known && p->pitch)
		return ct_fail(e, CT_EUSAGE, "--pitch: %s states its own pixel size, %g,%g mm",
			path, mm[0], mm[1]);
	if ((p->pitch && ct_cli_numbers("pitch", p->pitch, ',', 2, true, how.spacing, e)) ||
		ct_raw_axes("orient",
			ct_modes_given(&env->command->given, "orient") ? p->orient : UPRIGHT,
			how.world, how.sign, e))
		return -1;
	if (!(how.spacing[0] > 0 && how.spacing[1] > 0))
		return ct_fail(e, CT_EUSAGE, "--pitch: %s is not positive", p->pitch);
	if (known)
		memcpy(how.spacing, mm, 2 * sizeof *mm);
	ct_raw_place(v, &how);
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = (float)(p->slope * (double)v->data[i] + p->inter);
	return ct_vol_check_finite(v, e)
		       ? ct_blame(e, path)
		       : ct_meta_input(&v->meta, path, 2,
				 (const struct ct_piece[]){{v->affine, sizeof v->affine},
					 {v->data, ct_vol_count(v) * sizeof *v->data}},
				 e);
}

static int read_dicom(const struct convert *p, const char *path, struct ct_vol *v,
	const struct ct_env *env, struct ct_err *e)
{
	double mm[2];

	if (ct_dicom_radiograph(v, mm, path, e))
		return -1;
	if (isnan(mm[0]) && !p->pitch)
		return ct_fail(e, CT_EGEOM,
			"%s: has no ImagerPixelSpacing or PixelSpacing; pass the size of a pixel by "
			"--pitch",
			path);
	return finish(v, p, path, mm, env, e);
}

/* What says all of that itself. */
static int read_volume(const struct convert *p, const char *path, struct ct_vol *v,
	const struct ct_env *env, struct ct_err *e)
{
	static const char *const said[] = {"pitch", "rescale", "orient"};
	const char *const files[] = {path, p->out};
	struct convert one = *p;

	for (size_t i = 0; i < (p->raw ? 1 : sizeof said / sizeof *said); i++)
		if (ct_modes_given(&env->command->given, said[i]))
			return ct_fail(e, CT_EUSAGE,
				"--%s: not with %s, which is no picture that is read: a volume states "
				"it itself",
				said[i], path);
	one.in = path;
	one.files = (struct ct_list){.n = 2, .v = files};
	return convert_read(&one, v, env, e);
}

static int read_plane(const struct convert *p, struct ct_reading *reading, const char *path,
	struct ct_vol *v, const struct ct_env *env, struct ct_err *e)
{
	const double none[2] = {(double)NAN, (double)NAN};

	if (!p->raw && dicom_form_of(path) != NOT_DICOM)
		return read_dicom(p, path, v, env, e);
	if (p->raw || !convert_is_picture(path))
		return read_volume(p, path, v, env, e);
	return read_picture(reading, path, v, e) ? -1 : finish(v, p, path, none, env, e);
}

/* View k of s, which is made for the first. */
static int add(struct ct_stack *s, size_t k, const struct convert *p, const struct ct_vol *v,
	struct ct_err *e)
{
	const char *path = p->files.v[k];

	if (check(v, p->radiograph == CONVERT_INTENSITY, e))
		return ct_blame(e, path);
	if (k == 0 && ct_stack_alloc(s, p->files.n - 1, v->n[1], v->n[0], e))
		return -1;
	if (s->w != v->n[0] || s->h != v->n[1])
		return ct_fail(e, CT_EGEOM, "%s: has %zux%zu pixels, but %s has %zux%zu", path,
			v->n[0], v->n[1], p->in, s->w, s->h);
	memcpy(ct_stack_view(s, k), v->data, ct_vol_count(v) * sizeof *v->data);
	place(&s->view[k], v);
	return 0;
}

int convert_radiograph(const struct convert *p, const struct ct_env *env, struct ct_err *e)
{
	const size_t n = p->files.n - 1;
	const struct ct_meta **from = NULL;
	struct ct_reading reading = {0};
	struct ct_vol *v = NULL;
	struct ct_stack s = {0};
	int rc = -1;

	if (ct_alloc0(&v, n, sizeof *v, e) || ct_alloc0(&from, n, sizeof *from, e))
		goto out;
	for (size_t k = 0; k < n; k++) {
		if (ct_check_stop(env, e) ||
			read_plane(p, &reading, p->files.v[k], &v[k], env, e) ||
			add(&s, k, p, &v[k], e))
			goto out;
		from[k] = &v[k].meta;
		free(v[k].data); /* the rest is small */
		v[k].data = NULL;
	}
	s.beam = CT_PARALLEL;
	if (ct_meta_set(&s.meta, CT_META_QUANTITY,
		    p->radiograph == CONVERT_INTENSITY ? CT_QUANTITY_INTENSITY
						       : CT_QUANTITY_LINE_INTEGRAL,
		    e) == 0 &&
		ct_meta_step(&s.meta, env, n, from, e) == 0)
		rc = ct_stack_write(p->out, &s, env, e);
out:
	ct_reading_end(&reading);
	for (size_t k = 0; v && k < n; k++)
		ct_vol_free(&v[k]);
	free(v);
	free(from);
	ct_stack_free(&s);
	return rc;
}
