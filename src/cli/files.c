/* files.c: see files.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/files.h"
#include "cli/modes.h"
#include "cli/table.h"
#include "formats/beside.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "formats/out-folder.h"
#include "formats/signature.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The files of a run, one after the other. */
struct walk {
	const struct ct_opt *opt; /* row of the file */
	const void *params;
	size_t next; /* in the list of that row */
	bool last_written;
	bool output;
	const char *path;
};

static const void *field(const struct ct_opt *o, const void *params)
{
	return (const char *)params + o->at;
}

/* Is this flag or text, if the command has it, given? */
static bool given(const struct ct_opt *opts, const void *params, const char *name)
{
	for (const struct ct_opt *o = opts; o->type != CT_T_END; o++)
		if (o->name && strcmp(o->name, name) == 0)
			return o->type == CT_T_FLAG
				       ? *(const bool *)field(o, params)
				       : *(const char *const *)field(o, params) != NULL;
	return false;
}

/* Does an option name the output, so that the operands are all inputs? */
static bool named(const struct ct_opt *opts, const void *params)
{
	for (const struct ct_opt *o = opts; o->type != CT_T_END; o++)
		if (o->role == CT_WRITES && *(const char *const *)field(o, params))
			return true;
	return false;
}

static struct walk begin(const struct ct_opt *opts, const void *params)
{
	return (struct walk){.opt = opts, .params = params, .last_written = !named(opts, params)};
}

/* The next file, or NULL behind the last one. */
static const char *step(struct walk *w)
{
	for (; w->opt->type != CT_T_END; w->opt++, w->next = 0) {
		const struct ct_opt *o = w->opt;
		const void *at = field(o, w->params);
		const bool list = o->type == CT_T_LIST;
		const size_t n = list ? ((const struct ct_list *)at)->n : 1;

		if (o->role == CT_NO_FILE || w->next >= n)
			continue;
		w->path =
			list ? ((const struct ct_list *)at)->v[w->next] : *(const char *const *)at;
		w->next++;
		w->output =
			o->role == CT_WRITES || o->role == CT_REWRITES ||
			o->role == CT_WRITES_BESIDE ||
			(o->role == CT_READS_WRITES && w->last_written && n > 1 && w->next == n);
		if (w->path)
			return w->path;
	}
	return NULL;
}

/* An input may have a second file: the voxels of a header, the JSON beside NIfTI. */
static int check_beside(const char *path, const char *input, struct ct_err *e)
{
	const bool stream = strcmp(input, "-") == 0;
	char *beside[2] = {stream ? NULL : ct_beside_name(input)};
	int rc = stream ? 0 : ct_headed_source(&beside[1], input, e);

	for (int i = 0; i < 2; i++)
		if (rc == 0 && beside[i] && access(beside[i], F_OK) == 0 &&
			ct_out_same(path, beside[i], true))
			rc = ct_fail(e, CT_EOUTPUT,
				"%s: would be written over the %s of %s, an input", path,
				i ? "voxels" : "scanner", input);
	free(beside[0]);
	free(beside[1]);
	return rc;
}

/* Is the output none of the files of the run, but for the place `self`? */
static int apart(const struct ct_opt *opts, const void *params, const char *path,
	const struct walk *self, struct ct_err *e)
{
	for (struct walk w = begin(opts, params); step(&w);) {
		const bool word = !ct_table_is_file(w.opt) && access(w.path, F_OK) != 0;

		if (word || (self && w.opt == self->opt && w.next == self->next))
			continue;
		if (ct_out_same(path, w.path, !w.output))
			return ct_fail(e, CT_EOUTPUT,
				"%s: would be written over %s, %s of the same run", path, w.path,
				w.output ? "another output" : "an input");
		if (!w.output && check_beside(path, w.path, e))
			return -1;
	}
	return 0;
}

int ct_files_apart(
	const struct ct_opt *opts, const void *params, const char *path, struct ct_err *e)
{
	return apart(opts, params, path, NULL, e);
}

/* The row of the output that is standard output, or NULL. */
static const struct ct_opt *on_stdout(const struct ct_opt *opts, const void *params)
{
	struct stat out, st;
	const bool known = fstat(STDOUT_FILENO, &out) == 0 && !S_ISCHR(out.st_mode);

	for (struct walk w = begin(opts, params); step(&w);)
		if (w.output && (strcmp(w.path, "-") == 0 || (known && stat(w.path, &st) == 0 &&
								     st.st_dev == out.st_dev &&
								     st.st_ino == out.st_ino)))
			return w.opt;
	return NULL;
}

bool ct_files_write_stdout(const struct ct_opt *opts, const void *params)
{
	return on_stdout(opts, params) != NULL;
}

const char *ct_files_hidden(const struct ct_opt *opts, const void *params, const char *word)
{
	if (!given(opts, params, "deid"))
		return NULL;
	for (struct walk w = begin(opts, params); step(&w);)
		if (strcmp(w.path, word) == 0 &&
			(ct_table_is_file(w.opt) || access(word, F_OK) == 0))
			return w.output ? "OUT" : "IN";
	for (const struct ct_opt *o = opts; o->type != CT_T_END; o++) {
		const char *uid = o->name && strcmp(o->name, "series") == 0
					  ? *(const char *const *)field(o, params)
					  : NULL;

		if (uid && strchr(uid, '.') && strcmp(uid, word) == 0)
			return "UID";
	}
	return NULL;
}

/* Standard input and output serve once each, and a report in JSON has that for itself. */
static int check_streams(const struct ct_opt *opts, const void *params,
	const struct ct_command *command, struct ct_err *e)
{
	const struct ct_opt *taken =
		command->json && !command->dry_run ? on_stdout(opts, params) : NULL;
	char name[CT_TABLE_NAME];
	size_t streams[2] = {0};

	for (struct walk w = begin(opts, params); step(&w);)
		streams[w.output] += strcmp(w.path, "-") == 0;
	if (streams[0] > 1)
		return ct_fail(e, CT_EUSAGE, "only one input can be standard input");
	if (streams[1] > 1)
		return ct_fail(e, CT_EUSAGE, "only one output can be standard output");
	if (taken) {
		ct_table_name(name, taken);
		return ct_fail(e, CT_EUSAGE, "--json: %s is standard output: name a file", name);
	}
	return 0;
}

/* What names of this row end in. */
static const char *ends_of(const struct ct_opt *o, const struct ct_tool *t, const void *params)
{
	const struct ct_ends *x = o->ends;

	while (x + 1 < o->ends + CT_ENDINGS && x[1].ends && !ct_modes_hold(&x->when, t, params))
		x++;
	return x->ends;
}

/* May the output have that name? A pipe or a device may have any. */
static bool may_end(const struct ct_opt *o, const char *path, const char *ends)
{
	struct stat st;

	if (o->dicom && ct_files_is_dicom(path))
		return ct_ends_match("a." CT_ENDS_DICOM, ends);
	return !ct_ends_any(path) || ct_ends_match(path, ends) ||
	       (stat(path, &st) == 0 && !S_ISREG(st.st_mode));
}

int ct_files_names(const struct ct_tool *t, const void *params, struct ct_err *e)
{
	for (struct walk w = begin(t->opts, params); step(&w);) {
		const char *ends = w.output ? ends_of(w.opt, t, params) : NULL;
		char text[200], name[CT_TABLE_NAME];

		ct_table_name(name, w.opt);
		if (!*w.path)
			return ct_fail(
				e, CT_EUSAGE, "%s: its name is empty: expected a file", name);
		if (!w.output || may_end(w.opt, w.path, ends))
			continue;
		ct_ends_text(text, sizeof text, ends);
		return ct_fail(e, CT_EUSAGE, "%s: %s is written as %s", w.path, name, text);
	}
	return 0;
}

bool ct_files_is_dicom(const char *path)
{
	const size_t n = strlen(path);

	return ct_out_folder_named(path) || (n > 4 && strcasecmp(path + n - 4, ".dcm") == 0);
}

/* May it be written? A series in a folder that is read would be read with it the next time. */
static int check_output(
	const struct ct_opt *opts, const struct walk *w, const struct ct_env *env, struct ct_err *e)
{
	const bool dicom = w->opt->dicom && ct_files_is_dicom(w->path);

	for (struct walk o = begin(opts, w->params); dicom && step(&o);)
		if (!o.output && ct_out_folder_named(o.path) &&
			ct_out_folder_holds(o.path, w->path))
			return ct_fail(e, CT_EOUTPUT, "%s: lies in %s, an input", w->path, o.path);
	for (struct walk o = begin(opts, w->params); dicom && step(&o);)
		if (!o.output && ct_out_folder_named(w->path) &&
			ct_out_folder_holds(w->path, o.path))
			return ct_fail(e, CT_EOUTPUT,
				"%s: holds %s, an input, and would be replaced", w->path, o.path);
	if (dicom && ct_out_folder_named(w->path))
		return ct_out_folder_check(w->path, w->opt->dicom, env, e);
	if (apart(opts, w->params, w->path, w, e))
		return -1;
	if (!dicom && strcmp(w->path, "-") != 0 && ct_signature_of(w->path) == CT_KIND_DICOM)
		return ct_fail(e, CT_EOUTPUT,
			"%s: is DICOM, and is replaced only by DICOM: remove it first, or name "
			"another file",
			w->path);
	return ct_out_check(w->path, env, e);
}

int ct_files_check(
	const struct ct_opt *opts, const void *params, const struct ct_env *env, struct ct_err *e)
{
	if (check_streams(opts, params, env->command, e))
		return -1;
	if (env->command->dry_run)
		return 0;
	for (struct walk w = begin(opts, params); step(&w);) {
		struct ct_io_rule rule = ct_io_rule_of(env);
		struct ct_env own = *env;

		own.files = &rule;
		rule.force |= w.opt->role == CT_REWRITES &&
			      (given(opts, params, "resume") || given(opts, params, "keep"));
		if (w.output && check_output(opts, &w, &own, e))
			return -1;
	}
	return 0;
}
