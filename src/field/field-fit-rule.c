/* field-fit-rule.c: the published configurations, and ours (field-fit.h).
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "field/field-fit.h"

#include <math.h>

static const struct ct_encoding dense = {
	.kind = CT_ENCODING_GRID, .levels = 5, .base = 8, .growth = 2};
static const struct ct_encoding hash = {
	.kind = CT_ENCODING_HASH, .levels = 16, .log2_table = 19, .base = 16, .growth = 2};

void ct_field_rule_encoding(struct ct_field_rule *r, enum ct_encoding_kind kind)
{
	if (r->shape.encoding.kind == kind && ct_encoding_width(&r->shape.encoding))
		return;
	r->shape.encoding =
		kind == CT_ENCODING_GRID ? dense
		: kind == CT_ENCODING_HASH
			? hash
			: (struct ct_encoding){.kind = CT_ENCODING_FREQUENCIES, .frequencies = 10};
}

void ct_field_rule_network(struct ct_field_rule *r, size_t depth, size_t width)
{
	struct ct_network *n = &r->shape.network;

	n->width = width;
	n->depth = depth;
	n->skip = depth >= 6 ? depth / 2 + 1 : 0;
}

void ct_field_rule_samples(struct ct_field_rule *r, enum ct_samples_kind kind)
{
	const bool two = kind == CT_SAMPLES_LINES || kind == CT_SAMPLES_CUBES;
	const bool rays = kind == CT_SAMPLES_RAYS;

	r->samples = (struct ct_samples){kind, two ? 64 : rays ? 192 : 1, two ? 64 : 0};
	r->shape.network.outputs = two ? 2 : 1;
	r->shape.network.last = two || rays ? CT_NETWORK_SIGMOID : CT_NETWORK_LINEAR;
	r->batch = two || rays ? 1024 : kind == CT_SAMPLES_PROFILE ? 12 : 0;
	r->adaptive = kind == CT_SAMPLES_CUBES;
	r->tv = kind == CT_SAMPLES_PROFILE ? 5e-3 : 0;
}

enum { FINEST = 512 }; /* intervals of a dense grid: a finer one is more than int32_t counts */

void ct_field_rule_levels(struct ct_field_rule *r, size_t side)
{
	struct ct_encoding *c = &r->shape.encoding;
	double grid = (double)c->base;

	if (c->kind != CT_ENCODING_GRID)
		return;
	for (c->levels = 1; grid * c->growth <= fmin((double)side, FINEST); c->levels++)
		grid *= c->growth;
}

static void coordinates(struct ct_field_rule *r, enum ct_samples_kind kind, size_t frequencies)
{
	r->shape.encoding =
		(struct ct_encoding){.kind = CT_ENCODING_FREQUENCIES, .frequencies = frequencies};
	ct_field_rule_samples(r, kind);
	ct_field_rule_network(r, 8, 256);
	r->rate[0] = 2e-3;
	r->rate[1] = 2e-5;
	r->warm = 1000;
	r->cold = 0.01;
	r->iterations = 200000;
}

static void attenuation(struct ct_field_rule *r, size_t views, bool sax)
{
	r->shape.encoding = hash;
	ct_field_rule_samples(r, CT_SAMPLES_RAYS);
	ct_field_rule_network(r, sax ? 2 : 3, 32);
	r->shape.network.skip = sax ? 1 : 2;
	r->shape.network.slope = 0.01;
	if (sax) {
		r->shape.network.attention = (struct ct_attention){2, 8, 4};
		r->samples.n = 256;
		r->windows = 16;
	}
	r->rate[0] = 1e-3;
	r->rate[1] = 1e-4;
	r->stepwise = true;
	r->iterations = (sax ? 1500 : 3000) * (views ? views : 1);
}

void ct_field_rule_like(struct ct_field_rule *r, enum ct_field_like like, size_t views)
{
	*r = (struct ct_field_rule){.every = 1000};
	if (like == CT_FIELD_LIKE_NERF)
		coordinates(r, CT_SAMPLES_LINES, 10);
	else if (like == CT_FIELD_LIKE_CUNERF)
		coordinates(r, CT_SAMPLES_CUBES, 11);
	else if (like != CT_FIELD_LIKE_AUTO || views)
		attenuation(r, views, like == CT_FIELD_LIKE_SAX);
	else {
		r->shape.encoding = dense;
		ct_field_rule_samples(r, CT_SAMPLES_PROFILE);
		ct_field_rule_network(r, 2, 32);
		r->rate[0] = 2e-2;
		r->rate[1] = 1e-3;
		r->iterations = 600;
	}
}

int ct_field_rule_check(const struct ct_field_rule *r, struct ct_err *e)
{
	const struct ct_samples *s = &r->samples;
	const size_t side = (size_t)lround(cbrt((double)s->n));
	const struct ct_attention *a = &r->shape.network.attention;

	if (r->tv > 0 && s->kind != CT_SAMPLES_PROFILE)
		return ct_fail(e, CT_EUSAGE, "--loss tv: needs --samples profile");
	if (r->adaptive && s->kind == CT_SAMPLES_PROFILE)
		return ct_fail(e, CT_EUSAGE, "--loss adaptive: not with --samples profile");
	if (s->kind == CT_SAMPLES_CUBES && side * side * side != s->n)
		return ct_fail(e, CT_EUSAGE,
			"--expert count: %zu samples of a cube are no lattice: use 8, 27, 64, 125",
			s->n);
	if (a->segment && (s->kind != CT_SAMPLES_RAYS || s->n % a->segment))
		return ct_fail(e, CT_EUSAGE,
			"attention of sax-nerf needs --samples rays, and an even number of them");
	if (!(r->rate[0] > 0))
		return ct_fail(e, CT_EUSAGE, "--expert rate: %g is not above 0", r->rate[0]);
	if (ct_encoding_check(&r->shape.encoding, e) || ct_network_check(&r->shape.network, e)) {
		e->code = CT_EUSAGE;
		return -1;
	}
	return 0;
}
