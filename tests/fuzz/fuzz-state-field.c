/* Hostile states of ct-field: refused, or the fit makes a step from them and has values.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "state-run.h"
#include "field/field-fit.h"

const int fuzz_rounds = 1500;

enum { SIDE = 4 };

/* Two fields, as cubes and lines have. */
static void begin(struct ct_field_fit *f, struct ct_vol *v, struct ct_field_data *d)
{
	struct ct_field_rule r;
	struct ct_env env = {0};
	struct ct_err e = {0};

	*v = (struct ct_vol){0};
	if (ct_vol_alloc(v, (size_t[3]){SIDE, SIDE, SIDE}, &e))
		exit(99);
	for (int a = 0; a < 3; a++)
		v->affine[a][a] = 1;
	for (size_t i = 0; i < ct_vol_count(v); i++)
		v->data[i] = i % 3 ? 0.5f : 0.25f;
	*d = (struct ct_field_data){.lr = v, .fine = v};
	ct_field_data_box(d, v);
	ct_field_rule_like(&r, CT_FIELD_LIKE_AUTO, 0);
	ct_field_rule_samples(&r, CT_SAMPLES_LINES);
	ct_field_rule_network(&r, 1, 2);
	r.shape.encoding =
		(struct ct_encoding){.kind = CT_ENCODING_GRID, .levels = 1, .base = 2, .growth = 1};
	r.samples.n = r.samples.fine = r.batch = 2;
	r.iterations = 20;
	r.every = 0;
	if (ct_field_fit_init(f, &r, d, &env, &e))
		exit(99);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_field_data d;
	struct ct_field_fit f;
	struct ct_env env = {0};
	struct ct_err e = {0};
	struct ct_resume run;
	struct ct_vol v;
	int rc;

	begin(&f, &v, &d);
	state_of(&run, data, size);
	rc = ct_resume_load(&run, ct_field_fit_unpack, &f, &e);
	if (rc <= 0)
		state_check(rc, &e);
	fuzz_taken += rc == 0;
	if (rc == 0) {
		f.rule.iterations = f.step + 1;
		rc = ct_field_fit_run(&f, &d, &env, &e) || ct_field_fit_volume(&v, &f, &d, &env, &e)
			     ? -1
			     : 0;
		state_check(rc, &e);
	}
	ct_resume_close(&run);
	ct_field_fit_free(&f);
	ct_vol_free(&v);
	return 0;
}

/* Of a fit that has not begun, and of one that is done. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	struct ct_field_data d;
	struct ct_field_fit f;
	struct ct_env env = {0};
	struct ct_err e = {0};
	struct ct_resume run;
	struct ct_vol v;
	size_t n;

	if (k > 1)
		return 0;
	begin(&f, &v, &d);
	if (k && ct_field_fit_run(&f, &d, &env, &e))
		exit(99);
	state_run(&run, seed_path());
	n = state_seed(data, ct_resume_save(&run, ct_field_fit_pack, &f, &e));
	ct_resume_close(&run);
	ct_field_fit_free(&f);
	ct_vol_free(&v);
	return n;
}
