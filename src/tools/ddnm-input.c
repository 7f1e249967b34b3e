/* ddnm-input.c: see ddnm.h. */
#include "config.h"
#include "tools/ddnm.h"
#include "diffusion/superres.h"
#include "core/mem.h"
#include "formats/any.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "resolution/upsample.h"
#ifdef HAVE_OIIO
#include "shim/image.h"
#endif

#include <math.h>
#include <stdlib.h>
#include <string.h>

int ddnm_input_blur(double *sigma, const struct ct_stack *in, size_t scale, struct ct_err *e)
{
	const struct ct_view *w = &in->view[0];
	const struct ct_meta *m = &in->meta;
	const char *up = ct_meta_get(m, CT_META_UPSAMPLE);
	double voxels[3] = {(double)scale / 4, 0, 0}, dso = 1, dsd = 1, a[12], mm = 0, pitch;

	*sigma = 0;
	if (up && ct_words_find(CT_WORDS(CT_UPSAMPLE_LIST), up) >= CT_UPSAMPLE_DC)
		return 0; /* the blur is undone */
	*sigma = 0.8 * (double)scale / 4;
	voxels[1] = voxels[2] = voxels[0];
	if (ct_meta_numbers(m, CT_META_SIGMA, 3, voxels, e) < 0 ||
		ct_meta_numbers(m, CT_META_SCAN_DSO, 1, &dso, e) < 0 ||
		ct_meta_numbers(m, CT_META_SCAN_DSD, 1, &dsd, e) < 0)
		return -1;
	switch (ct_meta_numbers(m, CT_META_VOLUME_AFFINE, 12, a, e)) {
	case 0: break;
	case 1: return 0;
	default: return -1;
	}
	for (int c = 0; c < 3; c++)
		mm += voxels[c] * hypot(hypot(a[c], a[c + 4]), a[c + 8]) / 3;
	pitch = hypot(hypot(w->u[0], w->u[1]), w->u[2]) / (double)scale;
	*sigma = 0.8 * mm * (in->beam == CT_PARALLEL ? 1 : dsd / dso) / pitch;
	return 0;
}

int ddnm_input_norm(double *norm, double given, const struct ct_stack *in, struct ct_err *e)
{
	const char *quantity = ct_meta_get(&in->meta, CT_META_QUANTITY);

	if (quantity && strcmp(quantity, CT_QUANTITY_LINE_INTEGRAL) != 0 &&
		strcmp(quantity, CT_QUANTITY_INTENSITY) != 0)
		return ct_fail(
			e, CT_EINPUT, "is a stack of %.40s, not of line integrals", quantity);
	*norm = given;
	if (given > 0)
		return 0;
	if (ct_superres_norm(in, norm, e))
		return -1;
	if (quantity && strcmp(quantity, CT_QUANTITY_INTENSITY) == 0)
		*norm = fmax(*norm, 1.0);
	return 0;
}

int ddnm_input_scale(
	size_t *scale, int given, const struct ct_stack *in, const char *path, struct ct_err *e)
{
	double coarsen = given ? given : 4;

	if (ct_meta_numbers(&in->meta, CT_META_COARSEN, 1, &coarsen, e) < 0)
		return ct_blame(e, path);
	if (!(coarsen >= 2 && coarsen <= 64) || coarsen != floor(coarsen))
		return ct_fail(e, CT_EINPUT, "%s: %s is %g, not a whole number from 2 to 64", path,
			CT_META_COARSEN, coarsen);
	if (given && given != (int)coarsen)
		return ct_fail(e, CT_EUSAGE,
			"--factor %d contradicts %s, which was coarsened %g times", given, path,
			coarsen);
	*scale = (size_t)coarsen;
	return 0;
}

int ddnm_input_operator(enum ct_measurement_kind *op, int given, const struct ct_stack *in,
	const char *path, struct ct_err *e)
{
	const char *pixel = ct_meta_get(&in->meta, CT_META_PIXEL);
	int known = pixel ? ct_words_find(CT_WORDS(CT_PIXEL_LIST), pixel) : CT_PIXEL_POINT;

	if (known < 0)
		return ct_fail(e, CT_EINPUT, "%s: %s is '%.40s', not one of %s", path,
			CT_META_PIXEL, pixel, CT_WORDS(CT_PIXEL_LIST));
	*op = given < 0 ? CT_MEASUREMENT_MEAN : (enum ct_measurement_kind)given;
	if (known == CT_PIXEL_POINT)
		return 0;
	if (given >= 0 && *op != ct_pixel_measures((enum ct_pixel)known))
		return ct_fail(e, CT_EUSAGE,
			"--expert operator: %s contradicts %s, whose pixels are %s",
			CT_WORD(CT_MEASUREMENT_LIST, *op), path, pixel);
	*op = ct_pixel_measures((enum ct_pixel)known);
	return 0;
}

int ddnm_input_classify(struct ct_prior *prior, int label, struct ct_err *e)
{
	const size_t n = prior->unet->arch.num_classes;

	if (label >= 0)
		return ct_prior_classify(prior, (size_t)label, e);
	return n ? ct_fail(e, CT_EUSAGE, "is conditioned on %zu classes: --class states one", n)
		 : 0;
}

#ifdef HAVE_OIIO
static int read_picture(const char *path, struct ct_stack *s, struct ct_err *e)
{
	struct ct_piece piece;
	float *gray = NULL;
	size_t h, w;
	int rc = -1;

	if (ct_any_check_picture(path, e) || ct_image_read(path, &w, &h, &gray, e) ||
		ct_image_check(path, w, h, gray, e) || ct_stack_alloc(s, 1, h, w, e))
		goto out;
	piece = (struct ct_piece){s->data, h * w * sizeof *gray};
	memcpy(s->data, gray, h * w * sizeof *gray);
	s->beam = CT_PARALLEL;
	s->view[0] = (struct ct_view){.source = {0, -1000, 0}, .u = {1, 0, 0}, .v = {0, 0, -1}};
	rc = ct_meta_set(&s->meta, CT_META_QUANTITY, CT_QUANTITY_INTENSITY, e) ||
			     ct_meta_input(&s->meta, path, 1, &piece, e)
		     ? -1
		     : 0;
out:
	free(gray);
	return rc;
}

static int write_png(
	const char *path, const struct ct_stack *s, const struct ct_env *env, struct ct_err *e)
{
	unsigned char *px = NULL, *png = NULL;
	struct ct_out o = {0};
	size_t n;
	int rc = -1;

	if (ct_alloc(&px, s->h, s->w, e))
		return -1;
	for (size_t i = 0; i < s->h * s->w; i++)
		px[i] = (unsigned char)lrint(255.0 * fmin(fmax((double)s->data[i], 0.0), 1.0));
	if (ct_image_encode_png(&png, &n, s->w, s->h, 1, px, e) == 0 &&
		ct_out_open(&o, path, env, e) == 0 && ct_put(&o, png, n, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	free(png);
	free(px);
	return rc;
}
#else
static int read_picture(const char *path, struct ct_stack *s, struct ct_err *e)
{
	(void)s;
	return ct_fail(
		e, CT_EINPUT, "%s: is not an EXR stack, and pictures need OpenImageIO", path);
}

static int write_png(
	const char *path, const struct ct_stack *s, const struct ct_env *env, struct ct_err *e)
{
	(void)s;
	(void)env;
	return ct_fail(e, CT_EOUTPUT, "%s: PNG needs OpenImageIO", path);
}
#endif

int ddnm_picture_read(const char *path, struct ct_stack *s, struct ct_err *e)
{
	return ct_any_is_stack(path) ? ct_stack_read(path, s, e) : read_picture(path, s, e);
}

int ddnm_picture_check(const char *path, const struct ct_stack *s, struct ct_err *e)
{
	const char *quantity = ct_meta_get(&s->meta, CT_META_QUANTITY);

	if (!ct_ends_match(path, CT_ENDS_PICTURE) ||
		(s->views == 1 && quantity && strcmp(quantity, CT_QUANTITY_INTENSITY) == 0))
		return 0;
	return ct_fail(e, CT_EUSAGE, "%s: only a picture can be written as PNG; use EXR", path);
}

int ddnm_picture_write(const char *path, const struct ct_stack *s, const char *beside,
	const struct ct_stack *std, const struct ct_env *env, struct ct_err *e)
{
	struct ct_out_set both = {0};
	struct ct_env own = *env;
	int rc = 0;

	own.together = beside ? &both : NULL;
	if (beside)
		rc = ct_stack_write(beside, std, &own, e);
	if (rc == 0)
		rc = ct_ends_match(path, CT_ENDS_PICTURE) ? write_png(path, s, &own, e)
							  : ct_stack_write(path, s, &own, e);
	if (rc == 0)
		rc = ct_out_set_commit(&both, e);
	ct_out_set_drop(&both);
	return rc;
}
