/* resume.c: see resume.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/keep.h"
#include "cli/resume.h"
#include "cli/files.h"
#include "cli/stop.h"
#include "cli/table.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/temp.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* In front of the keys of a run, among the metadata of its state. */
#define RUN "run."
#define WHICH "version"
/* The hash of what a state holds; those of builds before it was have none. */
#define CONTENT "content"

static int take(struct ct_resume *r, const char *name, const char *value, struct ct_err *e)
{
	char key[200];

	snprintf(key, sizeof key, RUN "%s", name);
	return ct_meta_set(&r->key, key, value, e);
}

int ct_resume_value(struct ct_resume *r, struct ct_err *e, const char *name, const char *fmt, ...)
{
	char *value;
	va_list ap;
	int rc;

	va_start(ap, fmt);
	if (vasprintf(&value, fmt, ap) < 0)
		value = NULL;
	va_end(ap);
	rc = value ? take(r, name, value, e) : ct_fail(e, CT_ENOMEM, "no memory for a state");
	free(value);
	return rc;
}

static int take_options(struct ct_resume *r, struct ct_err *e)
{
	for (const struct ct_opt *o = r->opts; o->type != CT_T_END; o++) {
		char name[CT_TABLE_NAME], number[80];
		const char *value = number;

		if (o->counts != CT_COUNTS_VALUE)
			continue;
		ct_table_name(name, o);
		ct_table_text(number, sizeof number, o, r->params, 17);
		if (o->type == CT_T_STR)
			value = *(
				const char *const *)(const void *)((const char *)r->params + o->at);
		if (take(r, name, value ? value : "", e))
			return -1;
	}
	return 0;
}

static bool is_state(const char *path)
{
	struct ct_meta m = {0};
	struct ct_err why;
	bool is = ct_tensors_read_meta(path, &m, &why) == 0 && ct_meta_get(&m, RUN WHICH);

	ct_meta_free(&m);
	return is;
}

/* Is there no state, or one that the run goes on from or was told to forget? */
static int may_replace(struct ct_resume *r, const struct ct_env *env, struct ct_err *e)
{
	bool state;

	if (access(r->path, F_OK) != 0)
		return 0;
	state = is_state(r->path);
	r->own = ct_io_rule_of(env).force && state;
	if (r->wanted || r->own)
		return 0;
	return !state ? ct_fail(e, CT_EOUTPUT,
				"%s: is not the state of a run, so is not written over", r->path)
		      : ct_fail(e, CT_EOUTPUT,
				"%s: exists; --resume goes on from it, --force starts anew",
				r->path);
}

/* Nothing lies beside a pipe or a device; a link to one has a place of its own. */
static bool is_stream(const char *out)
{
	struct stat st;

	return strcmp(out, "-") == 0 || (stat(out, &st) == 0 && S_ISFIFO(st.st_mode)) ||
	       (lstat(out, &st) == 0 && S_ISCHR(st.st_mode));
}

int ct_resume_open(struct ct_resume *r, const char *out, bool wanted, const struct ct_opt *opts,
	const void *params, const struct ct_env *env, struct ct_err *e)
{
	const bool stream = is_stream(out);

	*r = (struct ct_resume){.wanted = wanted, .opts = opts, .params = params};
	if (stream && wanted)
		return ct_fail(e, CT_EUSAGE, "--resume wants OUT to be a file");
	if (!stream && !env->command->dry_run && asprintf(&r->path, "%s.state", out) < 0) {
		r->path = NULL;
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	}
	if (r->path && (ct_files_apart(opts, params, r->path, e) ||
			       ct_temp_claim(r->path, &r->claim, e) < 0 || may_replace(r, env, e)))
		return -1;
	if (r->path)
		ct_stop_hold();
	if (ct_resume_value(r, e, WHICH, "%s %s", env->tool, PACKAGE_VERSION) ||
		ct_resume_value(r, e, "--seed", "%llu", (unsigned long long)env->seed))
		return -1;
	return take_options(r, e);
}

/* What the reader says of the content, behind the name of the file. */
static const char *hash_of(const struct ct_meta *m)
{
	const char *input = m ? ct_meta_get(m, CT_META_INPUT) : NULL;
	const char *hash = input ? strrchr(input, ' ') : NULL;

	return hash ? hash + 1 : "not given";
}

int ct_resume_input(
	struct ct_resume *r, const char *name, const struct ct_meta *m, struct ct_err *e)
{
	if (take(r, name, hash_of(m), e))
		return -1;
	for (size_t i = 0; m && i < m->n; i++) {
		const struct ct_pair *p = &m->pair[i];
		char key[160];

		if (strcmp(p->key, CT_META_INPUT) == 0 || strcmp(p->key, CT_META_HISTORY) == 0 ||
			strncmp(p->key, "nifti.", 6) == 0)
			continue;
		snprintf(key, sizeof key, "%s %s", name, p->key);
		if (take(r, key, p->value, e))
			return -1;
	}
	return 0;
}

/* Of all that a state holds but the keys of its run. */
static void digest(char hex[static CT_HASH_HEX], const struct ct_tensors *state)
{
	struct ct_hash h;
	uint64_t bits[2];

	ct_hash_begin(&h);
	for (size_t i = 0; i < state->meta.n; i++) {
		const struct ct_pair *p = &state->meta.pair[i];

		if (strncmp(p->key, RUN, sizeof RUN - 1) == 0 || strcmp(p->key, CONTENT) == 0 ||
			strcmp(p->key, CT_META_INPUT) == 0)
			continue;
		ct_hash_add(&h, p->key, strlen(p->key) + 1);
		ct_hash_add(&h, p->value, strlen(p->value) + 1);
	}
	for (size_t i = 0; i < state->n; i++) {
		const struct ct_tensor *t = &state->t[i];

		ct_hash_add(&h, t->name, strlen(t->name) + 1);
		ct_hash_add(&h, t->dim, t->rank * sizeof *t->dim);
		ct_hash_add(&h, t->data, ct_tensor_count(t) * sizeof *t->data);
	}
	ct_hash_digest(&h, bits);
	snprintf(hex, CT_HASH_HEX, "%016llx%016llx", (unsigned long long)bits[1],
		(unsigned long long)bits[0]);
}

static int check_content(
	const struct ct_resume *r, const struct ct_tensors *state, struct ct_err *e)
{
	const char *content = ct_meta_get(&state->meta, CONTENT);
	char hex[CT_HASH_HEX];

	digest(hex, state);
	if (!content || strcmp(content, hex) == 0)
		return 0;
	return ct_fail(e, CT_EINPUT, "%s: is damaged: it holds other than what was saved", r->path);
}

/* Is what every option names that is an input part of the key? */
static bool complete(const struct ct_resume *r)
{
	for (const struct ct_opt *o = r->opts; o->type != CT_T_END; o++) {
		char key[80];

		snprintf(key, sizeof key, RUN "--%s", o->name ? o->name : "");
		if (o->counts == CT_COUNTS_CONTENT && !ct_meta_get(&r->key, key))
			return false;
	}
	return true;
}

/* `was` and `is` of a key: NULL if it is not there. */
static int differs(const struct ct_resume *r, const char *key, const char *was, const char *is,
	struct ct_err *e)
{
	const char *name = key + sizeof RUN - 1;

	if (was && is && (strncmp(was, "xxh3:", 5) == 0 || strncmp(is, "xxh3:", 5) == 0))
		return ct_fail(e, CT_EINPUT, "%s: is of a run where %s held something else",
			r->path, name);
	return ct_fail(e, CT_EINPUT, "%s: is of a run where %s was '%.80s', not '%.80s'", r->path,
		name, was ? was : "", is ? is : "");
}

static int compare(const struct ct_resume *r, const struct ct_meta *state, struct ct_err *e)
{
	if (!ct_meta_get(state, RUN WHICH))
		return ct_fail(e, CT_EINPUT, "%s: is not the state of a run", r->path);
	for (size_t i = 0; i < r->key.n; i++) {
		const struct ct_pair *p = &r->key.pair[i];
		const char *was = ct_meta_get(state, p->key);

		if (!was || strcmp(was, p->value) != 0)
			return differs(r, p->key, was, p->value, e);
	}
	for (size_t i = 0; i < state->n; i++) {
		const struct ct_pair *p = &state->pair[i];

		if (strncmp(p->key, RUN, sizeof RUN - 1) == 0 && !ct_meta_get(&r->key, p->key))
			return differs(r, p->key, p->value, NULL, e);
	}
	return 0;
}

int ct_resume_load(struct ct_resume *r, ct_resume_unpack *unpack, void *work, struct ct_err *e)
{
	struct ct_tensors state = {0};
	int rc;

	assert(complete(r));
	if (!r->wanted || !r->path || access(r->path, F_OK) != 0)
		return 1;
	if (ct_tensors_read(r->path, &state, e))
		return -1;
	rc = ct_err_any(compare(r, &state.meta, e) || check_content(r, &state, e));
	if (rc == 0 && unpack(work, &state, e))
		rc = ct_blame(e, r->path);
	r->own |= rc == 0;
	ct_tensors_free(&state);
	return rc;
}

static int write_to(const struct ct_resume *r, const char *path, ct_resume_pack *pack,
	const void *work, struct ct_err *e)
{
	struct ct_tensors state = {0};
	char content[CT_HASH_HEX];
	int rc = pack(&state, work, e);

	for (size_t i = 0; i < r->key.n && rc == 0; i++)
		rc = ct_meta_set(&state.meta, r->key.pair[i].key, r->key.pair[i].value, e);
	digest(content, &state);
	if (rc == 0)
		rc = ct_meta_set(&state.meta, CONTENT, content, e);
	if (rc == 0)
		rc = ct_tensors_write_private(path, &state, e);
	ct_tensors_free(&state);
	return rc;
}

static int save(struct ct_resume *r, ct_resume_pack *pack, const void *work, struct ct_err *e)
{
	int rc;

	if (!r->own && access(r->path, F_OK) == 0)
		return ct_fail(
			e, CT_EOUTPUT, "%s: was put there by another run meanwhile", r->path);
	ct_stop_defer(true);
	rc = write_to(r, r->path, pack, work, e);
	r->own |= rc == 0;
	ct_stop_defer(false);
	return rc;
}

/* What goes on from a state: the command may have no --resume. */
static const char *again(const struct ct_resume *r)
{
	const struct ct_opt *o = r->opts;

	while (o->type != CT_T_END && !(o->name && strcmp(o->name, "resume") == 0))
		o++;
	return o->type == CT_T_END ? "the same command" : "--resume";
}

/* A state that cannot be in its place is kept in the folder for temporary files, if there is room;
 * *e says so of `what`, and what the next run then does. -1. */
static int elsewhere(const struct ct_resume *r, ct_resume_pack *pack, const void *work,
	const char *what, const char *does, struct ct_err *e)
{
	const struct ct_err why = *e;
	struct ct_err other;
	char *name = ct_keep_name(r->path);

	ct_stop_defer(true);
	if (name && write_to(r, name, pack, work, &other) == 0)
		ct_fail(e, why.code, "%.160s; %s is kept in %.120s: moved to %.120s, %s %s",
			why.msg, what, name, r->path, again(r), does);
	else if (name)
		unlink(name);
	ct_stop_defer(false);
	free(name);
	return -1;
}

int ct_resume_save(struct ct_resume *r, ct_resume_pack *pack, const void *work, struct ct_err *e)
{
	if (!r->path || save(r, pack, work, e) == 0)
		return 0;
	return elsewhere(r, pack, work, "what is done", "goes on from it", e);
}

int ct_resume_rescue(struct ct_resume *r, ct_resume_pack *pack, const void *work, struct ct_err *e)
{
	const struct ct_err why = *e;
	struct ct_err other;

	if (!r->path)
		return -1;
	if (save(r, pack, work, &other) == 0)
		return ct_fail(
			e, why.code, "%.300s; the result is kept: %s writes it", why.msg, again(r));
	return elsewhere(r, pack, work, "the result", "writes it", e);
}

void ct_resume_done(const struct ct_resume *r)
{
	if (r->path && r->own)
		unlink(r->path);
}

void ct_resume_close(struct ct_resume *r)
{
	ct_temp_remove(&r->claim);
	free(r->path);
	ct_meta_free(&r->key);
	*r = (struct ct_resume){0};
}
