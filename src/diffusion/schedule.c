/* schedule.c: see schedule.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "diffusion/schedule.h"
#include "core/mem.h"

#include <assert.h>
#include <stdlib.h>

void ct_schedule_default(struct ct_schedule *s)
{
	const double lo = 1e-4, hi = 0.02;

	s->abar_[0] = 1.0;
	for (size_t t = 0; t < CT_TIMESTEPS; t++) {
		const double beta = lo + (hi - lo) * (double)t / (CT_TIMESTEPS - 1);

		s->abar_[t + 1] = s->abar_[t] * (1.0 - beta);
	}
}

double ct_schedule_abar(const struct ct_schedule *s, int t)
{
	assert(t >= -1 && t < CT_TIMESTEPS);
	return s->abar_[t + 1];
}

int ct_schedule_start(size_t steps)
{
	assert(steps > 0 && steps <= CT_TIMESTEPS);
	return (int)(CT_TIMESTEPS / steps * (steps - 1));
}

/* Timestep of position k, 0 <= k < steps, counted from the clean end. */
static int time_at(size_t k, size_t steps, size_t start)
{
	return (int)(steps > 1 ? start * k / (steps - 1) : start);
}

int ct_schedule_times(
	int **t, size_t *n, size_t steps, int start, size_t length, size_t repeat, struct ct_err *e)
{
	size_t room, *left = NULL; /* returns left at each position */

	*t = NULL;
	*n = 0;
	assert(start >= 0 && start < CT_TIMESTEPS && steps > 0);
	assert(length > 0 && repeat > 0 && repeat <= CT_TIMESTEPS);
	if (steps > (size_t)start + 1)
		return ct_fail(
			e, CT_EUSAGE, "%zu steps do not fit into %d timesteps", steps, start + 1);
	/* Each of at most steps/length places adds 2 length entries a return. */
	room = steps + 1 + (steps / length) * 2 * length * (repeat - 1);
	if (ct_alloc(t, room, sizeof **t, e) || ct_alloc0(&left, steps, sizeof *left, e)) {
		free(*t);
		*t = NULL;
		return -1;
	}
	for (size_t k = 0; k + length < steps; k += length)
		left[k] = repeat - 1;
	for (size_t k = steps; k-- > 0;) {
		(*t)[(*n)++] = time_at(k, steps, (size_t)start);
		if (left[k] == 0)
			continue;
		left[k]--;
		for (size_t i = 0; i < length; i++)
			(*t)[(*n)++] = time_at(++k, steps, (size_t)start);
	}
	(*t)[(*n)++] = -1;
	free(left);
	return 0;
}
