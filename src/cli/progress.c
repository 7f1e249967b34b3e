/* progress.c: see progress.h. */
#include "config.h"
#include "cli/progress.h"
#include "core/clock.h"

#include <stdio.h>
#include <string.h>

void ct_progress_clear(struct ct_progress *p)
{
	if (p->drawn)
		fputs("\r\033[K", stderr);
	p->drawn = false;
}

void ct_progress_draw(const struct ct_env *env, const char *what, size_t done, size_t total)
{
	struct ct_progress *p = env->ctx;
	double t;

	if (!p || !p->on || total == 0)
		return;
	t = ct_clock_wall();
	if (strcmp(p->what, what) != 0) {
		snprintf(p->what, sizeof p->what, "%s", what);
		p->start = t;
		p->last = 0;
		p->first = done;
	}
	if (t - p->last < 0.2 && done < total)
		return;
	p->last = t;
	fprintf(stderr, "\r\033[K%s: %s %zu/%zu", env->tool, what, done, total);
	if (done > p->first && done < total) {
		double left = (t - p->start) * (double)(total - done) / (double)(done - p->first);

		fprintf(stderr, ", %.0f:%02d left", (double)((int)left / 60), (int)left % 60);
	}
	p->drawn = true;
	if (done >= total)
		ct_progress_clear(p);
	fflush(stderr);
}
