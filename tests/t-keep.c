/* A result that cannot be written where it should be is kept elsewhere, and that is said.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/keep.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/io.h"
#include "tap.h"
#include "cli/resume.h"
#include "core/env.h"

#include <glob.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static struct ct_err err;
static glob_t found;

/* Is there one file of this name, of the owner alone, which the message names? */
static bool kept(const char *pattern)
{
	struct stat st;

	globfree(&found);
	return glob(pattern, 0, NULL, &found) == 0 && found.gl_pathc == 1 &&
	       strstr(err.msg, found.gl_pathv[0]) && stat(found.gl_pathv[0], &st) == 0 &&
	       (st.st_mode & 0777) == 0600;
}

static void volume(const struct ct_env *env)
{
	const size_t n[3] = {3, 4, 5};
	struct ct_vol v = {0}, back = {0};
	unsigned char head[CT_SNIFF];
	struct ct_any any = {0};

	if (ct_vol_alloc(&v, n, &err))
		exit(99);
	for (size_t i = 0; i < 60; i++)
		v.data[i] = 0.5f * (float)i;
	OK(ct_keep_vol("there.nii", &v, env, &err) == 0 && access("there.nii", R_OK) == 0 &&
			glob("tmp/*", 0, NULL, &found) == GLOB_NOMATCH,
		"what can be written is, and nothing else");
	OK(ct_keep_vol("there.nii", &v, env, &err) == -1 && err.code == CT_EOUTPUT &&
			kept("tmp/kept.*.there.nii"),
		"what is there is not written over: %s", err.msg);
	unlink(found.gl_pathv[0]);
	OK(ct_keep_vol("gone/o.nii.gz", &v, env, &err) == -1 && err.code == CT_EOUTPUT &&
			strstr(err.msg, "gone/o.nii.gz: ") == err.msg &&
			kept("tmp/kept.*.o.nii.gz"),
		"a folder that is gone: %s", err.msg);
	OK(ct_vol_read(found.gl_pathv[0], &back, &err) == 0 &&
			memcmp(back.data, v.data, 60 * sizeof *v.data) == 0,
		"it is all there");
	unlink(found.gl_pathv[0]);
	OK(ct_keep_vol("gone/o.mha", &v, env, &err) == -1 && kept("tmp/kept.*.o.mha") &&
			ct_any_read(found.gl_pathv[0], &any, &err) == 0 &&
			memcmp(any.vol.data, v.data, 60 * sizeof *v.data) == 0 &&
			ct_any_head(head, found.gl_pathv[0]) && memcmp(head, "ObjectType", 10) == 0,
		"a MetaImage that cannot be written is kept as MetaImage: %s", err.msg);
	ct_any_free(&any);
	unlink(found.gl_pathv[0]);
	setenv("TMPDIR", "nowhere", 1);
	OK(ct_keep_vol("gone/o.nii", &v, env, &err) == -1 && err.code == CT_EOUTPUT &&
			!strstr(err.msg, "kept"),
		"nor can it be kept: %s", err.msg);
	setenv("TMPDIR", "tmp", 1);
	v.data[59] = INFINITY;
	OK(ct_keep_vol("there.nii", &v,
		   &(struct ct_env){.files = &(const struct ct_io_rule){.force = true}},
		   &err) == -1 &&
			err.code == CT_ENUMERIC && strstr(err.msg, "voxel (2,3,4) is infinite"),
		"what is not finite is no result: %s", err.msg);
	unlink("there.nii");
	ct_vol_free(&v);
	ct_vol_free(&back);
}

static void stack(const struct ct_env *env)
{
	struct ct_stack s = {0}, back = {0};

	if (ct_stack_alloc(&s, 2, 3, 4, &err))
		exit(99);
	for (size_t k = 0; k < 2; k++) {
		s.view[k].source[2] = -500;
		s.view[k].centre[2] = 400;
		s.view[k].u[0] = s.view[k].v[1] = 1;
	}
	for (size_t i = 0; i < 24; i++)
		s.data[i] = (float)i;
	OK(ct_keep_stack("gone/o.exr", &s, env, &err) == -1 && kept("tmp/kept.*.o.exr") &&
			ct_stack_read(found.gl_pathv[0], &back, &err) == 0 &&
			memcmp(back.data, s.data, 24 * sizeof *s.data) == 0,
		"and so a stack: %s", err.msg);
	unlink(found.gl_pathv[0]);
	s.data[23] = NAN;
	OK(ct_keep_stack("o.exr", &s, env, &err) == -1 && err.code == CT_ENUMERIC &&
			strstr(err.msg, "view 1, row 2, column 3 is NaN"),
		"nor of a stack: %s", err.msg);
	ct_stack_free(&s);
	ct_stack_free(&back);
}

/* A result whose folder has gone: kept where temporary files go, and the state from there on. */

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

static void t_rescue(void)
{
	const struct ct_command command = {0};
	const struct ct_env env = {.tool = "ct-test", .command = &command};
	const float work = 42;
	char root[] = "/tmp/t-rescue.XXXXXX", pattern[200];
	struct ct_resume r = {0};
	struct ct_err e = {0};
	float got = 0;
	struct stat st;
	glob_t there;

	if (!mkdtemp(root) || chdir(root) || mkdir("d", 0777) || mkdir("tmp", 0777))
		exit(99);
	setenv("TMPDIR", "tmp", 1);
	test_rights();
	OK(ct_resume_open(&r, "d/o", false, opts, &params, &env, &e) == 0, "a run begins");
	OK(ct_resume_load(&r, unpack, NULL, &e) == 1, "with no state");
	if (unlink("d/o.state.ct-locked") || rmdir("d"))
		exit(99);
	ct_fail(&e, CT_EOUTPUT, "d/o: No such file or directory");
	OK(ct_resume_rescue(&r, pack, &work, &e) == -1 && e.code == CT_EOUTPUT,
		"its folder goes; the failure stays one");
	snprintf(pattern, sizeof pattern, "tmp/kept.*.o.state");
	OK(glob(pattern, 0, NULL, &there) == 0 && there.gl_pathc == 1, "the result is kept");
	OK(strstr(e.msg, "d/o: No such") == e.msg && strstr(e.msg, there.gl_pathv[0]),
		"and where is said: %s", e.msg);
	OK(stat(there.gl_pathv[0], &st) == 0 && (st.st_mode & 0777) == 0600, "for its owner");
	if (mkdir("d", 0777) || rename(there.gl_pathv[0], "d/o.state"))
		exit(99);
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
	globfree(&there);
	unlink("d/o.state");
	rmdir("d");
	rmdir("tmp");
}

int main(void)
{
	const struct ct_env env = {.tool = "ct-test"};
	char root[] = "/tmp/t-keep.XXXXXX";

	if (!mkdtemp(root) || chdir(root) || mkdir("tmp", 0777))
		return 99;
	setenv("TMPDIR", "tmp", 1);
	volume(&env);
	stack(&env);
	globfree(&found);
	rmdir("tmp");
	t_rescue();
	return rmdir(root) ? 99 : tap_done();
}
