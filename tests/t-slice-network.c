/* The slice network: what it says, in double, and its tensors.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "tests/tap.h"
#include "slice-network-make.h"
#include "nn/dnn.h"

#include <math.h>
#include <string.h>

/* The network in double. */
static void twin(double *out, const struct ct_slice_network *r, const float *x, const float *extra)
{
	const size_t n = ct_patch_count(&r->shape), f = r->inputs, w = r->width;
	double feature[64], h1[64], h2[64];

	for (size_t k = 0; k < r->components; k++) {
		feature[k] = 0;
		for (size_t i = 0; i < n; i++)
			feature[k] +=
				(double)r->basis[k * n + i] * ((double)x[i] - (double)r->mean[i]);
	}
	for (size_t k = 0; k < CT_SLICE_NETWORK_FEATURES; k++)
		feature[r->components + k] = (double)extra[k];
	for (size_t k = 0; k < w; k++) {
		h1[k] = (double)r->all[r->at[CT_PART_1_BIAS] + k];
		for (size_t i = 0; i < f; i++)
			h1[k] += (double)r->all[r->at[CT_PART_1] + k * f + i] * feature[i];
		h1[k] /= 1 + exp(-h1[k]);
	}
	for (size_t k = 0; k < w; k++) {
		h2[k] = (double)r->all[r->at[CT_PART_2_BIAS] + k];
		for (size_t i = 0; i < w; i++)
			h2[k] += (double)r->all[r->at[CT_PART_2] + k * w + i] * h1[i];
		h2[k] /= 1 + exp(-h2[k]);
	}
	for (size_t more = 1; more <= r->more; more++) {
		memcpy(h1, h2, sizeof h1);
		for (size_t k = 0; k < w; k++) {
			double a = (double)r->all[r->at[CT_PART_2_BIAS] + more * w + k];

			for (size_t i = 0; i < w; i++)
				a += (double)r->all[r->at[CT_PART_2] + (more * w + k) * w + i] *
				     h1[i];
			h2[k] += a / (1 + exp(-a));
		}
	}
	for (size_t k = 0; k < r->out; k++) {
		out[k] = (double)r->all[r->at[CT_PART_LINEAR_BIAS] + k] +
			 (double)r->all[r->at[CT_PART_3_BIAS] + k];
		for (size_t i = 0; i < f; i++)
			out[k] += (double)r->all[r->at[CT_PART_LINEAR] + k * f + i] * feature[i];
		for (size_t i = 0; i < w; i++)
			out[k] += (double)r->all[r->at[CT_PART_3] + k * w + i] * h2[i];
	}
}

static void network(void)
{
	struct ct_slice_network q = {0}, r = {.shape = {2, 6, 1, 1, true},
						 .components = 9,
						 .width = 21,
						 .more = 2};
	struct ct_slice_network_work w = {0};
	struct ct_tensors t = {0};
	struct ct_slice_network_ready ready;
	double want[5], worst = 0;
	float patch[5 * 36];

	random_network(&r);
	must(ct_slice_network_work_alloc(&w, &r, 5, &err));
	ct_rng_normals(5 * 36, patch, 6, 0, 0);
	memcpy(w.patch, patch, sizeof patch);
	for (size_t i = 0; i < 5; i++)
		ct_rng_normals(CT_SLICE_NETWORK_FEATURES, ct_slice_network_features(&w, &r, i), 6,
			1, 50 * i);
	const int was = ct_dnn_enter();
	must(ct_slice_network_ready_alloc(&ready, &r, &err));
	must(ct_slice_network_run(&r, &ready, &w, 5, &err));
	ct_slice_network_ready_free(&ready);
	ct_dnn_leave(was);
	for (size_t i = 0; i < 5; i++) {
		twin(want, &r, patch + 36 * i, ct_slice_network_features(&w, &r, i));
		for (size_t k = 0; k < 5; k++)
			worst = fmax(worst, fabs(want[k] - (double)w.out[5 * i + k]));
	}
	OK(worst < 1e-5, "the network is what it says (%g)", worst);
	must(ct_slice_network_put(&r, &t, "2", &err));
	must(ct_slice_network_get(&q, &t, "2", &err));
	OK(q.shape.cell == 2 && q.shape.side == 6 && q.shape.depth == 1 && q.shape.slices == 1 &&
			q.shape.swap && q.components == 9 && q.width == 21 && q.more == 2 &&
			memcmp(q.all, r.all, r.at[CT_PARTS] * sizeof *r.all) == 0 &&
			memcmp(q.mean, r.mean, (36 + 9 * 36) * sizeof *r.mean) == 0,
		"and comes back from its tensors");
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.w2")->data[0] = NAN;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "2.w2"),
		"a NaN, be it the first of them, is named");
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.w2")->data[0] = 0;
	ct_tensors_find(&t, "2.w2")->dim[0] = 62;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && strstr(err.msg, "2.w2"),
		"and part of a layer: %s", err.msg);
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.w2")->dim[0] = 10 * 21;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && strstr(err.msg, "11 hidden layers"),
		"and too many: %s", err.msg);
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.w2")->dim[0] = 63;
	ct_tensors_find(&t, "2.w3")->dim[1] = 20;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && strstr(err.msg, "2.w3"),
		"and another shape");
	ct_slice_network_free(&q);
	ct_tensors_find(&t, "2.shape")->data[1] = 7;
	OK(ct_slice_network_get(&q, &t, "2", &err) == -1 && err.code == CT_EINPUT,
		"and a patch that none can be");
	ct_slice_network_free(&q);
	ct_tensors_free(&t);
	ct_slice_network_work_free(&w);
	ct_slice_network_free(&r);
}

int main(void)
{
	network();
	return tap_done();
}
