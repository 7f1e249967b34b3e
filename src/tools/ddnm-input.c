/* ddnm-input.c: see ddnm.h. */
#include "config.h"
#include "tools/ddnm.h"
#include "diffusion/superres.h"
#include "resolution/upsample.h"

#include <math.h>
#include <string.h>

int ddnm_input_blur(double *sigma, const struct ct_stack *in, size_t scale, struct ct_err *e)
{
	const struct ct_view *w = &in->view[0];
	const struct ct_meta *m = &in->meta;
	const char *up = ct_meta_get(m, CT_META_UPSAMPLE);
	double voxels[3] = {(double)scale / 4, 0, 0}, dso = 1, dsd = 1, a[12], mm, pitch;

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
	mm = hypot(hypot(a[0], a[4]), a[8]);
	pitch = hypot(hypot(w->u[0], w->u[1]), w->u[2]) / (double)scale;
	*sigma = 0.8 * (voxels[0] + voxels[1] + voxels[2]) / 3 * mm *
		 (in->beam == CT_PARALLEL ? 1 : dsd / dso) / pitch;
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
