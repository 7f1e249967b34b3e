/* data.c: see data.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "train/data.h"
#include "core/mem.h"
#include "diffusion/sample-views.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/units.h"
#include "shim/image-read.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

static int read_stack(struct ct_pictures *s, const char *path, struct ct_err *e)
{
	struct ct_stack stack = {0};
	double norm;
	size_t size;
	int rc = -1;

	if (ct_stack_read(path, &stack, e))
		goto out;
	if (ct_stack_check_finite(&stack, e) || ct_superres_norm(&stack, &norm, e)) {
		ct_blame(e, path);
		goto out;
	}
	size = stack.h * stack.w;
	for (size_t k = 0; k < stack.views; k++) {
		const float *view = ct_stack_view(&stack, k);
		float *px;

		if (ct_alloc(&px, size, sizeof *px, e))
			goto out;
		for (size_t i = 0; i < size; i++)
			px[i] = view[i] / (float)norm;
		if (ct_pictures_add(s, stack.h, stack.w, px, path, e))
			goto out;
	}
	rc = 0;
out:
	ct_stack_free(&stack);
	return rc;
}

static int read_picture(
	struct ct_pictures *s, struct ct_reading *reading, const char *path, struct ct_err *e)
{
	size_t w, h;
	float *px;

	if (ct_any_check_picture(path, e) ||
		ct_image_read_next(reading, path, &w, &h, NULL, &px, e))
		return -1;
	if (ct_image_read_check(path, w, h, px, e)) {
		free(px);
		return -1;
	}
	return ct_pictures_add(s, h, w, px, path, e);
}

static int read_file(
	struct ct_pictures *s, struct ct_reading *reading, const char *path, struct ct_err *e)
{
	return ct_any_is_stack(path) ? read_stack(s, path, e) : read_picture(s, reading, path, e);
}

/* The files that a path names: itself, or what a folder holds, in the order of their names, but for
 * sidecars: what ct-convert and dcm2niix write beside a volume. */
struct names {
	char **path; /* owned */
	size_t n;
};

static int visible(const struct dirent *d)
{
	const char *end = strrchr(d->d_name, '.');

	return d->d_name[0] != '.' && (!end || strcasecmp(end, ".json") != 0);
}

static int name_add(struct names *names, const char *folder, const char *name, struct ct_err *e)
{
	char *path = NULL;
	struct stat st;

	if (asprintf(&path, "%s/%s", folder, name) < 0)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	if (stat(path, &st) == 0 && S_ISREG(st.st_mode))
		names->path[names->n++] = path;
	else
		free(path);
	return 0;
}

static int names_of(struct names *names, const char *path, struct ct_err *e)
{
	struct dirent **found = NULL;
	struct stat st;
	bool folder = stat(path, &st) == 0 && S_ISDIR(st.st_mode);
	int n = folder ? scandir(path, &found, visible, alphasort) : 1, rc;

	if (n < 0)
		return ct_fail(e, CT_EINPUT, "%s: cannot be read", path);
	rc = ct_alloc0(&names->path, (size_t)n + 1, sizeof(char *), e);
	if (rc == 0 && !folder) {
		names->path[0] = strdup(path);
		names->n = names->path[0] != NULL;
		rc = names->n ? 0 : ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	for (int i = 0; folder && i < n; i++) {
		if (rc == 0)
			rc = name_add(names, path, found[i]->d_name, e);
		free(found[i]);
	}
	free(found);
	return rc;
}

static void names_free(struct names *names)
{
	for (size_t i = 0; i < names->n; i++)
		free(names->path[i]);
	free(names->path);
	*names = (struct names){0};
}

static bool is_one_of(const struct stat *a, const struct stat *b, size_t n)
{
	for (size_t i = 0; i < n; i++)
		if (a->st_dev == b[i].st_dev && a->st_ino == b[i].st_ino)
			return true;
	return false;
}

int train_files_check(const struct train_files *f, const struct ct_env *env, struct ct_err *e)
{
	struct names held = {0}, data = {0};
	struct stat *other = NULL, is;
	int rc = f->validate ? names_of(&held, f->validate, e) : 0;

	if (rc == 0)
		rc = ct_alloc0(&other, held.n + 1, sizeof *other, e);
	for (size_t i = 0; i < held.n && rc == 0; i++)
		if (stat(held.path[i], &other[i])) /* reading it says why */
			other[i].st_ino = 0;
	for (size_t k = 0; k < f->n && held.n && rc == 0; k++) {
		rc = names_of(&data, f->v[k], e);
		for (size_t i = 0; i < data.n; i++)
			if (stat(data.path[i], &is) == 0 && is_one_of(&is, other, held.n))
				ct_log(env, CT_WARN,
					"%s: is trained on and held out: its loss there says little",
					data.path[i]);
		names_free(&data);
	}
	names_free(&held);
	free(other);
	return rc;
}

int train_files_apart(const struct train_files *f, const char *folder, struct ct_err *e)
{
	struct stat is, other;

	if (stat(folder, &is))
		return 0;
	for (size_t i = 0; i <= f->n; i++) {
		const char *path = i < f->n ? f->v[i] : f->validate;

		if (path && stat(path, &other) == 0 && is_one_of(&is, &other, 1))
			return ct_fail(e, CT_EOUTPUT,
				"%s: is a folder of DATA, and what is written there would be data, too",
				path);
	}
	return 0;
}

int train_data_read(struct ct_pictures *s, struct ct_reading *reading, const char *path,
	struct ct_meta *meta, const struct ct_env *env, struct ct_err *e)
{
	const size_t first = s->n;
	struct names names = {0};
	struct ct_hash hash;
	int rc = names_of(&names, path, e);

	for (size_t i = 0; rc == 0 && i < names.n; i++)
		rc = ct_err_any(ct_check_stop(env, e) || read_file(s, reading, names.path[i], e));
	names_free(&names);
	if (rc)
		return -1;
	if (s->n == first)
		return ct_fail(e, CT_EINPUT, "%s: no pictures in it", path);
	ct_hash_begin(&hash);
	for (size_t i = first; i < s->n; i++) {
		const struct ct_picture *p = &s->picture[i];

		ct_hash_add(&hash, p->px, p->h * p->w * sizeof *p->px);
	}
	return ct_hash_input(&hash, meta, path, e);
}

/* Maps a volume of bytes to HU: 0 and 255 are map[0] and map[1], unless that is NaN. */
static int to_hu(struct ct_vol *v, const char *path, const double map[static 2], struct ct_err *e)
{
	const size_t n = ct_vol_count(v);
	float least = INFINITY, most = -INFINITY;
	bool bytes = true;

	for (size_t i = 0; i < n; i++) {
		least = fminf(least, v->data[i]);
		most = fmaxf(most, v->data[i]);
		bytes = bytes && v->data[i] == floorf(v->data[i]);
	}
	bytes = bytes && least >= 0 && most <= 255;
	if (!(most > least))
		return ct_fail(
			e, CT_EINPUT, "%s: every voxel is %g: expected a CT", path, (double)least);
	for (size_t i = 0; i < n && bytes && !isnan(map[0]); i++)
		v->data[i] = (float)(map[0] + (double)v->data[i] / 255 * (map[1] - map[0]));
	if (bytes && !isnan(map[0]))
		return 0;
	if (least >= 0 && !ct_meta_get(&v->meta, CT_META_QUANTITY))
		return ct_fail(e, CT_EINPUT, "%s: values from %g to %g are not HU%s", path,
			(double)least, (double)most, bytes ? ": give --bytes" : "");
	return ct_units_check(v, "ct-convert --units", e) || ct_meta_need_hu(&v->meta, false, e)
		       ? ct_blame(e, path)
		       : 0;
}

static int read_volume(struct ct_vol *v, const char *path, const double bytes[static 2],
	struct ct_hash *hash, struct ct_err *e)
{
	const char *input;

	if (ct_vol_read(path, v, e) || (ct_vol_check_finite(v, e) && ct_blame(e, path)) ||
		to_hu(v, path, bytes, e))
		return -1;
	input = ct_meta_get(&v->meta, CT_META_INPUT);
	ct_hash_add(hash, input, strlen(input));
	return 0;
}

/* What the volumes come from and go to. */
struct reading {
	const double *bytes;
	train_volume_fn *take;
	void *ctx;
	const char *what;
	const struct ct_env *env;
};

static int read_volumes(const struct reading *r, const char *path, bool held, struct ct_meta *meta,
	struct ct_err *e)
{
	struct names names = {0};
	struct ct_hash hash;
	int rc = names_of(&names, path, e);

	ct_hash_begin(&hash);
	for (size_t i = 0; i < names.n && rc == 0; i++) {
		struct ct_vol v = {0};

		ct_progress(r->env, r->what, i, names.n);
		if (read_volume(&v, names.path[i], r->bytes, &hash, e) ||
			r->take(r->ctx, held, &v, names.path[i], e))
			rc = -1;
		ct_vol_free(&v);
	}
	if (rc == 0)
		rc = ct_hash_input(&hash, meta, path, e);
	names_free(&names);
	return rc;
}

int train_data_volumes(const struct train_files *files, struct train_data *data,
	const double bytes[static 2], train_volume_fn *take, void *ctx, const char *what,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_env_part part = {.env = env, .to = TRAIN_DATA_READS};
	struct ct_env own;
	const struct reading r = {bytes, take, ctx, what, &own};

	ct_env_part(&own, &part);
	for (size_t i = 0; i < files->n; i++)
		if (read_volumes(&r, files->v[i], false, &data->input[i], e))
			return -1;
	return files->validate ? read_volumes(&r, files->validate, true, &data->held, e) : 0;
}
