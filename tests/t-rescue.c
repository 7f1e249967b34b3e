/* A result whose folder has gone: kept where temporary files go, and the state from there on.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/resume.h"
#include "core/env.h"
#include "formats/io.h"
#include "tap.h"

#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define CT_PARAMS struct params
struct params {
	const char *in;
	int n;
};
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN", ""), CT_OPT(n, 'n', "n", "N", 0, 9, ""), CT_OPT_END};
static const struct params params = {"in", 3};

static int pack(struct ct_tensors *t, const void *work, struct ct_err *e)
{
	struct ct_tensor *x;
	const size_t one = 1;

	if (ct_tensors_add(t, "x", 1, &one, &x, e))
		return -1;
	x->data[0] = *(const float *)work;
	return 0;
}

static int unpack(void *work, const struct ct_tensors *t, struct ct_err *e)
{
	*(float *)work = t->n == 1 ? t->t[0].data[0] : 0;
	(void)e;
	return 0;
}

static bool put_there(const char *path)
{
	FILE *f = fopen(path, "w");

	return f && fclose(f) == 0;
}

/* A file is for its owner alone until it has its name. */
static void test_rights(void)
{
	struct ct_err e = {0};
	struct ct_out o;
	struct stat st;

	umask(022);
	OK(ct_out_open(&o, "x", NULL, &e) == 0 && stat(o.tmp.path, &st) == 0 &&
			(st.st_mode & 0777) == 0600,
		"a temporary file is for its owner");
	OK(ct_put(&o, "x", 1, &e) == 0 && ct_out_commit(&o, &e) == 0 && stat("x", &st) == 0 &&
			(st.st_mode & 0777) == 0644,
		"and then for whom the mask says");
	unlink("x");
}

int main(void)
{
	const struct ct_command command = {0};
	const struct ct_env env = {.tool = "ct-test", .command = &command};
	const float work = 42;
	char root[] = "/tmp/t-rescue.XXXXXX", pattern[200];
	struct ct_resume r = {0};
	struct ct_err e = {0};
	float got = 0;
	struct stat st;
	glob_t found;

	if (!mkdtemp(root) || chdir(root) || mkdir("d", 0777) || mkdir("tmp", 0777))
		return 99;
	setenv("TMPDIR", "tmp", 1);
	test_rights();
	OK(ct_resume_open(&r, "d/o", false, opts, &params, &env, &e) == 0, "a run begins");
	OK(ct_resume_load(&r, unpack, NULL, &e) == 1, "with no state");
	if (unlink("d/o.state.ct-locked") || rmdir("d"))
		return 99;
	ct_fail(&e, CT_EOUTPUT, "d/o: No such file or directory");
	OK(ct_resume_rescue(&r, pack, &work, &e) == -1 && e.code == CT_EOUTPUT,
		"its folder goes; the failure stays one");
	snprintf(pattern, sizeof pattern, "tmp/kept.*.o.state");
	OK(glob(pattern, 0, NULL, &found) == 0 && found.gl_pathc == 1, "the result is kept");
	OK(strstr(e.msg, "d/o: No such") == e.msg && strstr(e.msg, found.gl_pathv[0]),
		"and where is said: %s", e.msg);
	OK(stat(found.gl_pathv[0], &st) == 0 && (st.st_mode & 0777) == 0600, "for its owner");
	if (mkdir("d", 0777) || rename(found.gl_pathv[0], "d/o.state"))
		return 99;
	ct_resume_close(&r);
	OK(ct_resume_open(&r, "d/o", true, opts, &params, &env, &e) == 0 &&
			ct_resume_load(&r, unpack, &got, &e) == 0 && got == 42,
		"moved to where it belongs it is gone on from");
	ct_resume_done(&r);
	OK(stat("d/o.state", &st) != 0, "and removed at the end");
	ct_resume_close(&r);
	OK(ct_resume_open(&r, "d/o", false, opts, &params, &env, &e) == 0 &&
			put_there("d/o.state") && ct_resume_save(&r, pack, &work, &e) == -1 &&
			e.code == CT_EOUTPUT,
		"what another run puts there meanwhile is not written over: %s", e.msg);
	ct_resume_done(&r);
	OK(stat("d/o.state", &st) == 0, "nor removed");
	ct_resume_close(&r);
	globfree(&found);
	unlink("d/o.state");
	rmdir("d");
	rmdir("tmp");
	return rmdir(root) ? 99 : tap_done();
}
