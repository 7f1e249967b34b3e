/* env.c: see env.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/env.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

void ct_log(const struct ct_env *env, enum ct_level level, const char *fmt, ...)
{
	char text[800];
	va_list ap;

	if (!env || !env->log ||
		((int)level > env->verbose && level != CT_WARN && level != CT_TOLD))
		return;
	va_start(ap, fmt);
	vsnprintf(text, sizeof text, fmt, ap);
	va_end(ap);
	env->log(env, level, text);
}

void ct_progress(const struct ct_env *env, const char *what, size_t done, size_t total)
{
	ct_progress_until(env, what, done, total, 0);
}

void ct_progress_until(
	const struct ct_env *env, const char *what, size_t done, size_t most, size_t likely)
{
	if (env && env->progress)
		env->progress(env, what, done, most, likely);
}

double ct_env_share(size_t done, size_t total, size_t likely)
{
	const size_t end = likely == 0 ? total : likely > done ? likely : done + 1;

	return done >= total ? 1 : (double)done / (double)end;
}

static void part_progress(
	const struct ct_env *env, const char *what, size_t done, size_t most, size_t likely)
{
	struct ct_env_part *p = env->ctx;

	(void)what;
	if (most > 0)
		p->done = fmax(p->done, ct_env_share(done, most, likely));
	ct_progress(p->env, CT_PROGRESS_WHOLE,
		(size_t)(CT_PROGRESS_PARTS * (p->from + p->done * (p->to - p->from))),
		most > 0 ? CT_PROGRESS_PARTS : 0);
}

static void part_log(const struct ct_env *env, enum ct_level level, const char *text)
{
	const struct ct_env_part *p = env->ctx;

	p->env->log(p->env, level, text);
}

void ct_env_part(struct ct_env *own, struct ct_env_part *part)
{
	*own = *part->env;
	own->ctx = part;
	own->progress = own->progress ? part_progress : NULL;
	own->log = own->log ? part_log : NULL;
}

bool ct_stopping(const struct ct_env *env)
{
	return env && env->stop && __atomic_load_n(env->stop, __ATOMIC_RELAXED);
}

int ct_check_stop(const struct ct_env *env, struct ct_err *e)
{
	return ct_stopping(env) ? ct_fail(e, CT_ESTOP, "stopped on request") : 0;
}
