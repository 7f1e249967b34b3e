/* memory.c: see memory.h. */
#include "config.h"
#include "cli/folder.h"
#include "cli/memory.h"
#include "core/room.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MIB 1048576.0
enum { PLANES = 16 }; /* that a thread has in hand, or works in */

int ct_memory_bytes(size_t *bytes, const char *text, struct ct_err *e)
{
	static const char units[] = "KMGT";
	const size_t number = strspn(text, "0123456789.");
	const char *unit = text[number] ? strchr(units, text[number]) : NULL;
	char *end;
	double value = strtod(text, &end);

	if (number == 0 || end != text + number || !unit || text[number + 1])
		return ct_fail(
			e, CT_EUSAGE, "--memory: '%.80s' is no size such as 600M or 2G", text);
	value = ldexp(value, 10 * (int)(unit - units + 1));
	if (!(value < 0x1p50))
		return ct_fail(e, CT_EUSAGE, "--memory: %.80s is beyond any memory", text);
	*bytes = (size_t)value;
	return 0;
}

double ct_memory_held(void)
{
	FILE *f = fopen("/proc/self/status", "r");
	double kib = 0;
	char line[200];

	while (f && fgets(line, sizeof line, f))
		if (strncmp(line, "VmHWM:", 6) == 0)
			kib = strtod(line + 6, NULL);
	if (f)
		fclose(f);
	return 1024 * kib;
}

/* Most of what is free, which others may take, too. */
#define SHARE 0.8

double ct_memory_most(const char *given, double free)
{
	struct ct_err e;
	size_t bytes;

	if (given && ct_memory_bytes(&bytes, given, &e) == 0)
		return (double)bytes;
	return free > 0 ? SHARE * free : (double)INFINITY;
}

bool ct_memory_fits(double need, const char *given, double free)
{
	return given ? CT_MEMORY_SPARE * need <= ct_memory_most(given, free)
		     : free <= 0 || need <= free;
}

static void most_of(char own[static 32], double bytes)
{
	snprintf(own, 32, "%.0fM", fmax(floor(ct_memory_most(NULL, bytes) / MIB), 1));
}

static void warn(const char *text, double need, double bytes, const struct ct_env *env)
{
	ct_log(env, CT_WARN,
		"takes %.0f MiB of memory, and %.0f are free: --memory %s, the rest in files",
		ceil(need / MIB), floor(bytes / MIB), text);
}

const char *ct_memory_choose(
	char own[static 32], const char *given, double need, const struct ct_env *env)
{
	const double bytes = ct_memory_free("");
	const bool is_free = ct_memory_fits(need, NULL, bytes);

	if (given && is_free &&
		ct_memory_fits(need + CT_MEMORY_BASE / CT_MEMORY_SPARE, given, bytes))
		return NULL;
	if (given || is_free)
		return given;
	most_of(own, bytes);
	warn(own, need, bytes, env);
	return own;
}

int ct_memory_open(const char *text, const char *out, struct ct_err *e)
{
	size_t bytes;
	char *dir;
	int rc;

	if (!text || ct_room_is_open())
		return 0;
	if (ct_memory_bytes(&bytes, text, e))
		return -1;
	dir = ct_folder_of(out);
	rc = dir ? ct_room_open(dir, bytes, e) : ct_fail(e, CT_ENOMEM, "no memory for a file name");
	free(dir);
	return rc;
}

int ct_memory_check(const char *text, const size_t n[static 3], double fixed,
	const struct ct_env *env, struct ct_err *e)
{
	const double planes = PLANES * 4.0 * (double)n[0] * (double)n[1];
	const double least = CT_MEMORY_BASE + fixed + planes * (double)ct_par_threads(env->par);
	size_t bytes;

	if (!text || ct_memory_bytes(&bytes, text, e))
		return text ? -1 : 0;
	return (double)bytes >= least ? 0
				      : ct_fail(e, CT_ENOMEM, "--memory %s: this takes %.0fM", text,
						ceil(least / MIB));
}

int ct_memory_begin(
	struct ct_memory *m, const char *given, const char *out, double times, struct ct_err *e)
{
	const double bytes = ct_memory_free("");
	size_t most;

	*m = (struct ct_memory){.given = given, .text = given, .out = out};
	m->enough = bytes > 0 ? bytes : (double)INFINITY;
	if (given) {
		if (ct_memory_bytes(&most, given, e))
			return -1;
		m->enough = fmin(m->enough, ((double)most - CT_MEMORY_BASE) / CT_MEMORY_SPARE);
	} else if (bytes > 0) {
		most_of(m->own, bytes);
		m->text = m->own;
	}
	if (ct_memory_open(m->text, out, e))
		return -1;
	if (m->text)
		ct_room_await(times, m->enough);
	return 0;
}

int ct_memory_settle(struct ct_memory *m, double need, const size_t n[static 3], double fixed,
	const struct ct_env *env, struct ct_err *e)
{
	if (need <= m->enough && !ct_room_is_open()) {
		ct_room_close();
		return 0;
	}
	if (!m->text || ct_memory_open(m->text, m->out, e))
		return m->text ? -1 : 0;
	if (!m->given && !m->told)
		warn(m->text, need, m->enough, env);
	m->told = true;
	return ct_memory_check(m->text, n, fixed, env, e);
}

void ct_memory_cost(double *memory, double *disk, double bytes, const char *text)
{
	struct ct_err e;
	size_t most;

	*memory = bytes;
	*disk = 0;
	if (!text || ct_memory_bytes(&most, text, &e) || bytes <= (double)most)
		return;
	*memory = (double)most;
	*disk = bytes;
}
