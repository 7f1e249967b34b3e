/* Hostile slice profiles: refused, or an operator whose rows sum up to 1 and that travels.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "operator/slice-profile.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const int fuzz_rounds = 3000;

static void check_rows(const struct ct_degrade *d)
{
	struct ct_taps t = {0};
	struct ct_err e = {0};

	if (ct_degrade_axis_taps(&t, d, 2, 24, &e))
		abort();
	for (size_t i = 0; i < t.n_out; i++) {
		double sum = 0;

		for (size_t q = 0; q < t.taps; q++)
			sum += t.w[i * t.taps + q];
		if (!(fabs(sum - 1) < 1e-9))
			abort();
	}
	ct_taps_free(&t);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_degrade d = {{1, 1, 4}, {0}, CT_DECIMATE_SINC, {0}}, got;
	struct ct_slice_profile_said said = CT_SLICE_PROFILE_NOTHING;
	struct ct_meta m = {0};
	struct ct_err e = {0};

	if (ct_slice_profile_parse(&said.samples, (const char *)data, size, &e) ||
		ct_slice_profile_set(&d, 2, &said, 3, &e)) {
		if (e.code == CT_OK || e.msg[0] == '\0')
			abort();
		return 0;
	}
	fuzz_taken++;
	check_rows(&d);
	if (ct_degrade_put(&m, &d, &e) || ct_degrade_get(&m, &got, &e) ||
		got.profile.n != d.profile.n)
		abort();
	check_rows(&got);
	ct_meta_free(&m);
	return 0;
}

size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const char *const text[] = {"# mm weight\n-1 .25\n0 .5 # middle\n\n1 .25\n",
		"-4 .022\n-3 .067\n-2 .128\n-1 .181\n0 .203\n1 .179\n2 .128\n3 .067\n4 .024",
		"-1.5e0 0\r\n0 1\r\n1.5 -1e-2\r\n"};

	if (k > 2)
		return 0;
	*data = (unsigned char *)strdup(text[k]);
	if (!*data)
		exit(99);
	return strlen(text[k]);
}
