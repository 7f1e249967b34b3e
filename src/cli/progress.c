/* progress.c: see progress.h. */
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

/* The time to the likely end, as long as it is to be believed. */
static void put_left(struct ct_progress *p, double seconds, bool may_end, bool likely)
{
	const bool held = seconds > p->left, far = seconds > 2 * p->left + 10;
	int whole;

	p->left = fmin(p->left, seconds);
	whole = (int)fmin(ceil(p->left), 1e8);
	if (!far)
		fprintf(stderr, ", %s%d:%02d left",
			!may_end         ? ""
			: held || likely ? "about "
					 : "at most ",
			whole / 60, whole % 60);
}

void ct_progress_draw(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	struct ct_progress *p = env->ctx;
	const size_t end = likely == 0 ? total : likely > done ? likely : done + 1;
	double t;

	if (!p || !(p->on || p->slicer) || total == 0)
		return;
	t = ct_clock_wall();
	if (p->slicer) {
		if (done >= total || t - p->last >= 0.2) {
			printf("<filter-progress>%.3f</filter-progress>\n",
				done < total ? (double)done / (double)end : 1.0);
			fflush(stdout);
			p->last = t;
		}
		return;
	}
	if (done >= total) {
		ct_progress_clear(p);
		p->what[0] = '\0';
		return;
	}
	if (strcmp(p->what, what) != 0 || done < p->done) {
		snprintf(p->what, sizeof p->what, "%s", what);
		p->start = t;
		p->last = 0;
		p->first = done;
		p->left = (double)INFINITY;
	}
	p->done = done;
	if (t - p->last < 0.2)
		return;
	p->last = t;
	if (strcmp(what, CT_PROGRESS_WHOLE) == 0)
		fprintf(stderr, "\r\033[K%s: %zu %%", env->tool, 100 * done / total);
	else
		fprintf(stderr, "\r\033[K%s: %s %zu%s%zu", env->tool, what, done,
			likely ? " of at most " : "/", total);
	if (done > p->first)
		put_left(p, (t - p->start) * (double)(end - done) / (double)(done - p->first),
			likely > 0, likely < total);
	p->drawn = true;
	fflush(stderr);
}
