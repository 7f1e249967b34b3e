/* frame.c: see frame.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "estimate/frame.h"
#include "core/meta.h"
#include "core/vec3.h"
#include "inverse/upsample.h"
#include "operator/mirror.h"
#include "operator/regrid.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

bool ct_frame_maps(const struct ct_frame *f)
{
	return f->times != 1 || f->plus != 0;
}

bool ct_frame_turns(const struct ct_frame *f)
{
	return f->axis[0] != 0 || f->axis[1] != 1;
}

static unsigned mirrored(const struct ct_frame *f)
{
	unsigned axes = 0;

	for (int d = 0; d < 3; d++)
		axes |= f->sign[d] < 0 ? 1U << d : 0;
	return axes;
}

bool ct_frame_copies(const struct ct_frame *f)
{
	return ct_frame_maps(f) || ct_frame_turns(f) || mirrored(f) != 0;
}

struct ct_frame ct_frame_of(const struct ct_vol *v)
{
	const char *quantity = ct_meta_get(&v->meta, CT_META_QUANTITY);
	struct ct_frame f = CT_FRAME_NONE;
	double spread, least = (double)INFINITY;

	ct_vol_axes(v, f.axis, f.sign);
	for (int d = 0; d < 3; d++)
		f.back[f.axis[d]] = d;
	if (!quantity || strcmp(quantity, CT_QUANTITY_OTHER) != 0)
		return f;
	spread = ct_upsample_spread(v);
	if (!(spread > 0))
		return f;
	for (size_t i = 0; i < ct_vol_count(v); i++)
		least = fmin(least, (double)v->data[i]);
	f.times = exp2(round(log2(CT_FRAME_SPREAD / spread)));
	f.plus = round(CT_FRAME_LEAST - f.times * least);
	return f;
}

#define TURN(x) ct_vec3_order((x), sizeof *(x), axis)

void ct_frame_said(struct ct_said *said, const int axis[static 3])
{
	TURN(said->factor);
	TURN(said->spacing);
	TURN(said->sigma);
	TURN(said->axis);
	said->third = ct_vec3_place(said->third, axis);
}

void ct_frame_operator(struct ct_operator *is, const int axis[static 3])
{
	ct_degrade_turn(&is->operator, axis);
	is->slices = ct_vec3_place(is->slices, axis);
	TURN(is->texture.alike);
	TURN(is->alike);
	TURN(is->seen);
	TURN(is->told);
	TURN(is->joint);
	TURN(is->scanner.thickness);
	TURN(is->scanner.spacing);
	TURN(is->apart);
	TURN(is->cubic);
}

static int scale_noise(struct ct_meta *m, double times, struct ct_err *e)
{
	double noise;
	const int none = ct_meta_numbers(m, CT_META_NOISE, 1, &noise, e);

	return none < 0 ? -1 : none ? 0 : ct_meta_setf(m, e, CT_META_NOISE, "%.9g", times * noise);
}

static void map(float *to, const float *from, size_t n, double times, double plus)
{
	for (size_t i = 0; i < n; i++)
		to[i] = (float)(times * (double)from[i] + plus);
}

int ct_frame_map(struct ct_vol *v, const struct ct_frame *f, struct ct_err *e)
{
	if (!ct_frame_maps(f))
		return 0;
	map(v->data, v->data, ct_vol_count(v), f->times, f->plus);
	return scale_noise(&v->meta, f->times, e);
}

void ct_frame_map_error(struct ct_vol *error, const struct ct_frame *f)
{
	map(error->data, error->data, ct_vol_count(error), f->times, 0);
}

int ct_frame_enter(struct ct_vol *own, const struct ct_vol **use, const struct ct_frame *f,
	const struct ct_vol *v, struct ct_par *par, struct ct_err *e)
{
	*use = v;
	if (!ct_frame_copies(f))
		return 0;
	*use = own;
	if (ct_vol_like(own, v, e) || ct_meta_copy(&own->meta, &v->meta, e) ||
		(ct_frame_maps(f) && scale_noise(&own->meta, f->times, e)))
		return -1;
	map(own->data, v->data, ct_vol_count(v), f->times, f->plus);
	if (ct_frame_turns(f))
		return ct_regrid_turn(own, f->axis, f->sign, e);
	ct_mirror(own, mirrored(f), par);
	return 0;
}

static int turn_back(
	struct ct_vol *v, const struct ct_frame *f, struct ct_par *par, struct ct_err *e)
{
	int sign[3];

	for (int a = 0; a < 3; a++)
		sign[a] = f->sign[f->back[a]];
	if (ct_frame_turns(f))
		return ct_regrid_turn(v, f->back, sign, e);
	ct_mirror(v, mirrored(f), par);
	return 0;
}

int ct_frame_leave(struct ct_vol *v, const struct ct_frame *f, struct ct_par *par, struct ct_err *e)
{
	if (turn_back(v, f, par, e))
		return -1;
	if (!ct_frame_maps(f))
		return 0;
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = (float)(((double)v->data[i] - f->plus) / f->times);
	return scale_noise(&v->meta, 1 / f->times, e);
}

int ct_frame_leave_error(
	struct ct_vol *error, const struct ct_frame *f, struct ct_par *par, struct ct_err *e)
{
	for (size_t i = 0; ct_frame_maps(f) && i < ct_vol_count(error); i++)
		error->data[i] = (float)((double)error->data[i] / f->times);
	return turn_back(error, f, par, e);
}

void ct_frame_words(char *to, size_t room, const struct ct_frame *f)
{
	const size_t n = strlen(to);

	if (ct_frame_maps(f))
		snprintf(to + n, room - n,
			"%sthe unit of the values is not known: 1 counts as %g HU", *to ? "; " : "",
			f->times);
}
