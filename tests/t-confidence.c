/* The confidence weights of the slice prior, by how the scan was made.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "numbers.h"
#include "restore/restore.h"

static const size_t size[3] = {16, 16, 16};

/* Of networks for that very factor. */
static size_t cell_of(const struct ct_degrade *d)
{
	return (size_t)fmax(d->factor[0], fmax(d->factor[1], d->factor[2]));
}

/* When what is flat becomes linear. */
static void flat_points(void)
{
	struct ct_restore_rule rule = {.by = {.factor = {4, 4, 4}}};
	bool little, ok = true;

	for (int protocol = 1; protocol <= 3; protocol++)
		for (int noise = 0; noise < 2; noise++) {
			ct_degrade_protocol(&rule.by, protocol);
			rule.noise = noise;
			must(ct_restore_confidence(&rule, &little, cell_of(&rule.by), size, &err));
			ok = ok && rule.flat == (protocol == 3 && !noise);
		}
	rule.by.decimate = CT_DECIMATE_MEAN;
	rule.noise = 0;
	must(ct_restore_confidence(&rule, &little, cell_of(&rule.by), size, &err));
	OK(ok && !rule.flat, "point-sampled, aliased scans, without noise, are flat");
}

/* The confidence weights of ct-upsample -m prior, by how the scan was made. */
static void weights(void)
{
	static const struct {
		struct ct_degrade by;
		double noise, doubt, gate, second_gate, steps, cap, second_cap;
		int passes;
		bool little;
	} want[] = {
		{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_SINC, {0}}, 0, 1.2, 15, 10, 0.05, 360, 80,
			2, false},
		{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_SINC, {0}}, 15, 0.5, 0, 10, 0.05, 500, 80,
			2, false},
		{{{4, 2, 1}, {1.7, 0.85, 0}, CT_DECIMATE_SINC, {0}}, 0, 1.2, 15, 10, 0.05, 360, 80,
			2, false},
		{{{2, 2, 2}, {0.85, 0.85, 0.85}, CT_DECIMATE_SINC, {0}}, 0, 1.2, 15, 10, 0.05, 250,
			40, 2, false},
		{{{4, 4, 4}, {0.5, 0.5, 0.5}, CT_DECIMATE_POINT, {0}}, 0, 0, 4, 4, 0, 0, 0, 2,
			false},
		{{{4, 4, 4}, {0.5, 0.5, 0.5}, CT_DECIMATE_POINT, {0}}, 15, 0, 0, 10, 0, 0, 0, 2,
			false},
		{{{4, 4, 4}, {0.5, 1.7, 1.7}, CT_DECIMATE_POINT, {0}}, 0, 0, 4, 4, 0, 0, 0, 2,
			false},
		{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_POINT, {0}}, 0, 1.2, 4, 4, 0.05, 360, 80,
			2, false},
		{{{4, 4, 4}, {1.7, 1.7, 1.7}, CT_DECIMATE_POINT, {0}}, 15, 0.5, 0, 10, 0.05, 500,
			80, 2, false},
		{{{4, 4, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 0, 0.6, 0, 10, 0, 0, 0, 2, false},
		{{{4, 4, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 15, 0.5, 0, 10, 0, 0, 0, 2, false},
		{{{2, 2, 2}, {0}, CT_DECIMATE_MEAN, {0}}, 15, 0, 0, 10, 0.05, 250, 40, 2, false},
		{{{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 15, 0, 0, 10, 0, 0, 0, 2, false},
		{{{1, 1, 4}, {0, 0, 1.7}, CT_DECIMATE_SINC, {0}}, 0, 0.6, 4, 10, 0.05, 500, 80, 2,
			true},
		{{{1, 1, 4}, {0, 0, 1.5}, CT_DECIMATE_POINT, {0}}, 0, 0.6, 4, 10, 0.05, 500, 80, 2,
			false},
		{{{1, 1, 4}, {0}, CT_DECIMATE_MEAN, {0}}, 0, 0.6, 0, 10, 0, 0, 0, 2, false},
		{{{1, 8, 8}, {0, 3.4, 3.4}, CT_DECIMATE_SINC, {0}}, 0, 1.2, 15, 10, 0.05, 1000, 160,
			2, false},
	};

	for (size_t k = 0; k < sizeof want / sizeof *want; k++) {
		struct ct_restore_rule got = {.by = want[k].by, .noise = want[k].noise};
		const double *f = want[k].by.factor;
		const bool thick = (f[0] > 1) + (f[1] > 1) + (f[2] > 1) == 1;
		bool little;

		must(ct_restore_confidence(&got, &little, cell_of(&want[k].by), size, &err));
		OK(got.weight == 1 && got.doubt == want[k].doubt && got.gate == want[k].gate &&
				got.steps == want[k].steps && got.cap == want[k].cap &&
				got.second_gate == want[k].second_gate &&
				got.least == (thick ? 3 : 10) &&
				got.second_cap == want[k].second_cap &&
				got.passes == want[k].passes && little == want[k].little,
			"weights of scan %zu: %g, %g HU, %g, %g HU, %d passes", k, got.doubt,
			got.gate, got.steps, got.cap, got.passes);
	}
}

int main(void)
{
	flat_points();
	weights();
	return tap_done();
}
