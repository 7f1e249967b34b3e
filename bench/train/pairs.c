/* pairs.c: training pairs of the volume network: what ct-sr makes of a reduced CT, and what that
 * lacks.
 *
 *   pairs CT.nii NETWORKS.safetensors FIRST COUNT FOLDER SIDE FACTOR THICK
 *
 * Pair number i of a CT is a cube of at most SIDE voxels a side (restore/example.h), reduced FACTOR
 * times along all axes, or (THICK 1) along one, refined as ct-sr does: by the inversion and then,
 * in all their passes, by the slice networks of NETWORKS ("-": none). So x and `added` are what
 * ct_restore gives a volume network (restore/restore.h), and sigma, noise and decimate what it
 * tells it. FOLDER gets CT-i.pair for each of the COUNT pairs from FIRST on, but not for those that
 * are too small or to which ct-sr adds nothing (band-limited thick slices), little-endian:
 *
 *   int32 nx, ny, nz, decimate, coarse (bit a: axis a), factor
 *   float32 sigma (LR voxels), noise (HU), RMS of the rest (HU), 0
 *   int16 x[nz][ny][nx]       the refined cube, 1/8 HU
 *   int16 added[nz][ny][nx]   all that the slice networks added to the inversion, 1/16 HU
 *   int16 rest[nz][ny][nx]    truth - x, 1/16 HU
 *
 * A static program for a machine that has nothing of ours: dnn-plain.c is linked before oneDNN.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "formats/format.h"
#include "restore/example.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SHARE_X 8
#define SHARE_REST 16
#define NOISE 30

struct pairs_job {
	struct ct_vol vol;
	struct ct_tensors weights;
	struct ct_slice_prior prior;
	struct ct_example_rule rule;
	struct ct_env env;
	const char *folder, *name;
	uint64_t first_index;
};

static short rounded(float v, float share)
{
	return (short)fminf(fmaxf(roundf(v * share), -32768), 32767);
}

static uint64_t hash(const char *s)
{
	uint64_t h = 1469598103934665603u;

	for (; *s; s++)
		h = (h ^ (unsigned char)*s) * 1099511628211u;
	return h;
}

static int write_pair(const struct pairs_job *j, int i, const struct ct_example *p,
	const float *inversion, struct ct_err *e)
{
	const size_t n = p->n[0] * p->n[1] * p->n[2];
	const int head[6] = {(int)p->n[0], (int)p->n[1], (int)p->n[2], (int)p->regime.decimate,
		p->coarse[0] + 2 * p->coarse[1] + 4 * p->coarse[2], (int)j->rule.factor};
	const float told[4] = {
		(float)p->regime.sigma, (float)p->regime.noise, sqrtf((float)p->variance), 0};
	short *out = malloc(3 * n * sizeof *out);
	char name[4096], part[4200];
	bool whole = false;
	FILE *f;

	snprintf(name, sizeof name, "%s/%s-%d.pair", j->folder, j->name, i);
	snprintf(part, sizeof part, "%s.part", name);
	f = fopen(part, "wb");
	for (size_t k = 0; k < n && out; k++) {
		out[k] = rounded(p->base[k], SHARE_X);
		out[n + k] = rounded(p->base[k] - inversion[k], SHARE_REST);
		out[2 * n + k] = rounded(p->rest[k], SHARE_REST);
	}
	if (f && out)
		whole = fwrite(head, sizeof head, 1, f) == 1 &&
			fwrite(told, sizeof told, 1, f) == 1 &&
			fwrite(out, sizeof *out, 3 * n, f) == 3 * n;
	if (f && fclose(f) != 0)
		whole = false;
	free(out);
	if (whole && rename(part, name) == 0)
		return 0;
	return ct_fail_errno(e, CT_EOUTPUT, name);
}

/* 1 if there is no such pair. */
static int make(const struct pairs_job *j, int i, struct ct_err *e)
{
	const uint64_t index = j->first_index + (uint64_t)i;
	struct ct_example p = {0};
	float *inversion = NULL;
	size_t n;
	int rc = ct_example_alloc(&p, &j->vol, &j->rule, index, &j->env, e);

	if (rc)
		return rc;
	n = p.n[0] * p.n[1] * p.n[2] * sizeof *inversion;
	inversion = malloc(n);
	rc = inversion ? 0 : ct_fail(e, CT_ENOMEM, "no memory for a pair");
	if (rc == 0) {
		memcpy(inversion, p.base, n);
		if (j->rule.after)
			rc = ct_example_after(&p, &j->rule, index, &j->env, e);
	}
	if (rc == 0)
		rc = write_pair(j, i, &p, inversion, e);
	free(inversion);
	ct_example_free(&p);
	return rc;
}

static int begin(struct pairs_job *j, char **v, struct ct_err *e)
{
	const char *slash = strrchr(v[1], '/');

	j->rule = (struct ct_example_rule){.side = (size_t)atoi(v[6]),
		.factor = (size_t)atoi(v[7]),
		.thick = atoi(v[8]) != 0,
		.whole = true,
		.scale = {1.1, 2.3},
		.noise = NOISE,
		.clip = {-512, 3071},
		.seed = 1};
	j->folder = v[5];
	j->name = slash ? slash + 1 : v[1];
	j->first_index = hash(j->name) >> 40 << 20;
	if (ct_vol_read(v[1], &j->vol, e))
		return -1;
	ct_example_soft(j->rule.soft, &j->vol);
	if (strcmp(v[2], "-") == 0)
		return 0;
	if (ct_tensors_read(v[2], &j->weights, e) ||
		ct_slice_prior_alloc(&j->prior, &j->weights, e))
		return -1;
	j->rule.after = &j->prior;
	return 0;
}

int main(int c, char **v)
{
	struct pairs_job j = {0};
	struct ct_err e = {0};
	int rc;

	if (c != 9) {
		fprintf(stderr,
			"usage: pairs CT.nii NETWORKS FIRST COUNT FOLDER SIDE FACTOR THICK\n");
		return 2;
	}
	rc = begin(&j, v, &e);
	for (int i = atoi(v[3]); rc == 0 && i < atoi(v[3]) + atoi(v[4]); i++)
		if (make(&j, i, &e) < 0)
			rc = -1;
	if (rc)
		fprintf(stderr, "pairs: %s: %s\n", v[1], e.msg);
	return rc ? 1 : 0;
}
