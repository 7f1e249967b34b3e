/* A result that cannot be written where it should be is kept elsewhere, and that is said.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/keep.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/io.h"
#include "tap.h"

#include <glob.h>
#include <math.h>
#include <stdbool.h>
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
	return rmdir(root) ? 99 : tap_done();
}
