/* Arrays that lie in files: what they hold, how much of it is in memory, and what is left behind.
 */
#include "config.h"
#include "cli/memory.h"
#include "core/mem.h"
#include "core/par.h"
#include "core/room.h"
#include "tap.h"

#include <dirent.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ARRAYS = 12, MIB = 1 << 20, EACH = 8 * MIB / 4, PIECE = 1 << 16 };

static struct ct_err err;

/* "VmHWM" or "VmRSS", MiB; 0 if it is not told. */
static double memory(const char *key)
{
	FILE *f = fopen("/proc/self/status", "r");
	char line[200];
	double kib = 0;

	while (f && fgets(line, sizeof line, f))
		if (strncmp(line, key, strlen(key)) == 0)
			kib = strtod(line + strlen(key) + 1, NULL);
	if (f)
		fclose(f);
	return kib / 1024;
}

static size_t files(const char *folder)
{
	DIR *d = opendir(folder);
	size_t n = 0;

	while (d && readdir(d))
		n++;
	if (d)
		closedir(d);
	return n - 2;
}

struct job {
	uint32_t *v[ARRAYS];
	int wrong[ARRAYS * EACH / PIECE];
};

static uint32_t value(size_t array, size_t i)
{
	return (uint32_t)(array * 2654435761U + i * 40503U);
}

static void fill(void *arg, size_t piece, size_t worker)
{
	struct job *j = arg;
	const size_t a = piece * PIECE / EACH, at = piece * PIECE % EACH;

	(void)worker;
	for (size_t i = at; i < at + PIECE; i++)
		j->v[a][i] = value(a, i);
}

static void look(void *arg, size_t piece, size_t worker)
{
	struct job *j = arg;
	const size_t a = piece * PIECE / EACH, at = piece * PIECE % EACH;

	(void)worker;
	for (size_t i = at; i < at + PIECE; i++)
		j->wrong[piece] += j->v[a][i] != value(a, i);
}

static void arrays(void)
{
	static struct job j;
	struct ct_par *par = NULL;
	const size_t pieces = ARRAYS * EACH / PIECE;
	const double before = memory("VmHWM");
	int wrong = 0, dirty = 0;
	char *small;

	must(ct_par_alloc(&par, 3, &err));
	must(ct_room_open("room", 40 * MIB, &err));
	OK(ct_room_is_open() && files("room") == 0, "a room, empty");
	must(ct_room_alloc(&small, 1000, 1, &err));
	for (size_t a = 0; a < ARRAYS; a++)
		must((a % 2 ? ct_room_alloc : ct_room_alloc0)(&j.v[a], EACH, 4, &err));
	for (size_t i = 0; i < EACH; i += PIECE)
		dirty += j.v[2][i] != 0;
	OK(dirty == 0, "zero where it is asked for");
	ct_par_for(par, pieces, fill, &j);
	ct_par_for(par, pieces, look, &j);
	for (size_t p = 0; p < pieces; p++)
		wrong += j.wrong[p];
	OK(wrong == 0, "holds what was written, %d MiB of it", ARRAYS * EACH / MIB * 4);
	if (before == 0 || before > 20)
		printf("# the process holds %.0f MiB: bound not looked at\n", before);
	else
		OK(memory("VmHWM") < 40, "within 40 MiB (%.1f, %.1f before)", memory("VmHWM"),
			before);
	OK(files("room") == 0, "no file has a name");
	for (size_t a = 0; a < ARRAYS; a++)
		ct_room_free(j.v[a]);
	ct_room_free(small);
	ct_room_free(NULL);
	ct_room_close();
	OK(!ct_room_is_open() && (before == 0 || before > 20 || memory("VmRSS") < before + 8),
		"and given back");
	must(ct_room_alloc(&j.v[0], EACH, 4, &err));
	fill(&j, 0, 0);
	ct_room_free(j.v[0]);
	ct_par_free(par);
}

static void refused(void)
{
	float *v = NULL;

	must(ct_room_open("nowhere", 40 * MIB, &err));
	OK(ct_room_alloc(&v, EACH, 4, &err) == -1 && err.code == CT_EOUTPUT &&
			strstr(err.msg, "nowhere: no room for 8 MiB: ") == err.msg,
		"a folder that there is not: %s", err.msg);
	OK(ct_room_alloc(&v, SIZE_MAX / 2, 4, &err) == -1 && err.code == CT_EINPUT,
		"more than there is: %s", err.msg);
	ct_room_close();
}

/* Is there a room after the first array of 8 MiB, if `times` that is what is held? */
static bool opens(struct ct_memory *m, const char *given, double times)
{
	char *small = NULL;
	float *v = NULL;
	bool before, open;

	must(ct_memory_begin(m, given, "room/out", times, &err));
	must(ct_room_alloc(&small, 1000, 1, &err));
	before = ct_room_is_open();
	must(ct_room_alloc(&v, EACH, 4, &err));
	open = ct_room_is_open();
	v[EACH - 1] = 1;
	ct_room_free(v);
	ct_room_free(small);
	return open && !before;
}

static void awaited(void)
{
	const size_t n[3] = {512, 512, 8};
	struct ct_env env = {0};
	struct ct_memory m;

	OK(!opens(&m, "80M", 1), "one volume fits");
	OK(!ct_room_is_open() && ct_memory_settle(&m, 8.0 * MIB, n, 0, &env, &err) == 0 &&
			!ct_room_is_open(),
		"and so does what is told then");
	OK(ct_memory_settle(&m, 15.0 * MIB, n, 0, &env, &err) == 0 && ct_room_is_open(),
		"or it does not");
	ct_room_close();
	OK(opens(&m, "80M", 2), "two do not");
	OK(ct_memory_settle(&m, 16.0 * MIB, n, 0, &env, &err) == 0, "and that is enough");
	OK(ct_memory_settle(&m, 16.0 * MIB, n, MIB, &env, &err) == -1 && err.code == CT_ENOMEM &&
			strcmp(err.msg, "--memory 80M: this takes 81M") == 0,
		"or is not: %s", err.msg);
	ct_room_close();
	if (ct_memory_free("") <= 0)
		return;
	OK(!opens(&m, NULL, 1), "what is free is enough for one");
	ct_room_close();
	OK(opens(&m, NULL, 1e12) && m.text == m.own, "and not for as many: %s", m.text);
	ct_room_close();
	OK(ct_memory_begin(&m, "some", "room/out", 1, &err) == -1 && err.code == CT_EUSAGE,
		"no size: %s", err.msg);
}

static void words(void)
{
	static const struct {
		const char *text;
		double bytes;
	} good[] = {{"1K", 1024}, {"600M", 600.0 * MIB}, {"1.5G", 1536.0 * MIB},
		{"2T", 2097152.0 * MIB}, {".5M", MIB / 2}};
	static const char *const bad[] = {"", "1", "M", "1m", "1 M", "-1M", "+1M", "1e3M", "1MB",
		"0x1M", "1.2.3M", "nan", "infM", "9999999T"};
	size_t bytes;

	for (size_t i = 0; i < sizeof good / sizeof *good; i++)
		OK(ct_memory_bytes(&bytes, good[i].text, &err) == 0 &&
				(double)bytes == good[i].bytes,
			"%s", good[i].text);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		OK(ct_memory_bytes(&bytes, bad[i], &err) == -1 && err.code == CT_EUSAGE &&
				strstr(err.msg, "--memory"),
			"'%s': %s", bad[i], err.msg);
}

static void enough(void)
{
	const size_t n[3] = {512, 512, 512};
	struct ct_env env = {0};

	OK(ct_memory_check(NULL, n, 0, &env, &err) == 0, "without a bound there is none");
	OK(ct_memory_check("80M", n, 0, &env, &err) == 0, "64 MiB, and 16 planes a thread");
	OK(ct_memory_check("79M", n, 0, &env, &err) == -1 && err.code == CT_ENOMEM &&
			strcmp(err.msg, "--memory 79M: this takes 80M") == 0,
		"%s", err.msg);
	OK(ct_memory_check("89M", n, 10 * MIB, &env, &err) == -1 &&
			strcmp(err.msg, "--memory 89M: this takes 90M") == 0,
		"%s", err.msg);
}

int main(void)
{
	char folder[] = "t-room-XXXXXX";

	if (!mkdtemp(folder) || chdir(folder) || mkdir("room", 0700))
		return 99;
	arrays();
	refused();
	awaited();
	words();
	enough();
	rmdir("room");
	if (chdir("..") || rmdir(folder))
		return 99;
	return tap_done();
}
