/* Places of a plan: disjoint, aligned, the first that is large enough; how much room all took.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "tap.h"
#include "nn/arena.h"

#include <stdbool.h>
#include <string.h>

enum { UNITS = 400, UNIT = 16, SPANS = 30 };

int main(void)
{
	struct ct_arena a = {0};
	bool taken[UNITS] = {false};
	size_t at[SPANS], units[SPANS], n = 0, top = 0, wrong = 0, exact = 0, full = 0;

	for (uint64_t q = 0; q < 4000; q++) {
		if (n < SPANS && ct_rng_below(1, 0, q, 5) < 3) {
			const size_t count = ct_rng_below(1, 1, q, 5 * UNIT),
				     want = count / UNIT + 1;
			size_t first = 0, run = 0;

			for (size_t i = 0; i < UNITS && run < want; i++) {
				run = taken[i] ? 0 : run + 1;
				first = i + 1 - run;
			}
			exact += run == want && first + want < UNITS && taken[first + want];
			must(ct_arena_take(&a, count, &at[n], &err));
			wrong += at[n] != first * UNIT;
			for (size_t i = 0; i < want; i++)
				taken[first + i] = true;
			top = first + want > top ? first + want : top;
			units[n++] = want;
			full += n == SPANS;
		} else if (n > 0) {
			const size_t k = ct_rng_below(1, 2, q, n);

			ct_arena_give(&a, at[k]);
			for (size_t i = 0; i < units[k]; i++)
				taken[at[k] / UNIT + i] = false;
			at[k] = at[--n];
			units[k] = units[n];
		}
		wrong += a.n != n || a.top != top * UNIT;
	}
	OK(wrong == 0, "the first place that is free and large enough, in units of 64 bytes");
	OK(exact > 20 && full > 20, "some fit exactly (%zu), and many live (%zu)", exact, full);
	ct_arena_give(&a, 12345 * UNIT);
	OK(a.n == n, "what was not taken is not given back");
	ct_arena_free(&a);
	OK(!a.live && a.n == 0 && a.top == 0, "it is freed");
	return tap_done();
}
