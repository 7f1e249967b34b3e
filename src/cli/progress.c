/* progress.c: see progress.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/progress.h"
#include "core/clock.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void ct_progress_clear(struct ct_progress *p)
{
	if (p->drawn)
		fputs("\r\033[K", stderr);
	p->drawn = false;
}

/* The time to the end, as long as it is to be believed. */
static void put_left(struct ct_progress *p, double seconds)
{
	const bool far = seconds > 2 * p->left + 10;
	int whole;

	p->left = fmin(p->left, seconds);
	whole = (int)fmin(ceil(p->left), 1e8);
	if (!far)
		fprintf(stderr, ", about %d:%02d left", whole / 60, whole % 60);
}

static void put_slicer(struct ct_progress *p, double share, double t)
{
	if (share < 1 && t - p->last < 0.2)
		return;
	printf("<filter-progress>%.3f</filter-progress>\n", share);
	fflush(stdout);
	p->last = t;
}

void ct_progress_draw(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	struct ct_progress *p = env->ctx;
	const double share = total ? ct_env_share(done, total, likely) : 0;
	const double t = ct_clock_wall();

	if (!p || p->how == CT_PROGRESS_NONE)
		return;
	if (total == 0) {
		p->what[0] = '\0';
		return;
	}
	if (p->how == CT_PROGRESS_SLICER) {
		put_slicer(p, share, t);
		return;
	}
	if (share >= 1) {
		ct_progress_clear(p);
		p->what[0] = '\0';
		return;
	}
	if (strcmp(p->what, what) != 0) {
		snprintf(p->what, sizeof p->what, "%s", what);
		p->start = t;
		p->first = p->share = share;
		p->left = (double)INFINITY;
		p->last = p->how == CT_PROGRESS_PIPE && p->last == 0 ? t : p->last;
	}
	p->share = fmax(p->share, share);
	if (t - p->last < (p->how == CT_PROGRESS_PIPE ? 60 : 0.2))
		return;
	p->last = t;
	fprintf(stderr, "%s%s: %d %%", p->how == CT_PROGRESS_PIPE ? "" : "\r\033[K", env->tool,
		(int)(100 * p->share));
	if (p->share > p->first)
		put_left(p, (t - p->start) * (1 - p->share) / (p->share - p->first));
	if (p->how == CT_PROGRESS_PIPE)
		fputc('\n', stderr);
	p->drawn = p->how == CT_PROGRESS_TERMINAL;
	fflush(stderr);
}
