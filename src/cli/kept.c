/* kept.c: see kept.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/kept.h"
#include "formats/io.h"
#include "formats/temp.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define FIRST ": what a run in this folder made\n" /* behind the command and its version */

static int no_memory(struct ct_err *e)
{
	return ct_fail(e, CT_ENOMEM, "no memory for a file name");
}

/* FOLDER/NAME, to be freed; NULL if no memory. */
static char *in_folder(const struct ct_kept *k, const char *name)
{
	char *path = NULL;

	return asprintf(&path, "%s/%s", k->folder, name) < 0 ? NULL : path;
}

/* The name of an output in the folder, "/NAME", or NULL for one elsewhere. */
static const char *within(const struct ct_kept *k, const char *output)
{
	const size_t n = strlen(k->folder);

	return strncmp(output, k->folder, n) == 0 && output[n] == '/' ? output + n : NULL;
}

static int take_lock(struct ct_kept *k, struct ct_err *e)
{
	char *path = in_folder(k, "lock");
	struct stat st;
	int rc = 0;

	if (!path)
		return no_memory(e);
	k->lock = open(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
	if (k->lock < 0)
		rc = ct_fail_errno(e, CT_EOUTPUT, path);
	else if (!ct_temp_wait(k->lock))
		rc = ct_fail(e, CT_EOUTPUT,
			errno == EWOULDBLOCK ? "%s: another run works in it"
					     : "%s: cannot be locked",
			k->folder);
	else if (fstat(k->lock, &st) || st.st_nlink == 0)
		rc = ct_fail(e, CT_EOUTPUT, "%s: another run just removed it", k->folder);
	k->made &= rc == 0;
	free(path);
	return rc;
}

/* One line is that of a file; no name has an end of line. */
static int take_line(struct ct_kept *k, const char *line, bool old, struct ct_err *e)
{
	struct ct_kept_note s = {0};
	size_t place;
	int made_now, at = 0;

	if (sscanf(line, "%zu %d %32[0-9a-f-] %32[0-9a-f-] %n", &place, &made_now, s.key, s.made,
		    &at) < 4 ||
		!at || place >= CT_KEPT_PLACES)
		return 0;
	s.old = old || !made_now;
	s.name = strdup(line + at);
	free(k->note[place].name);
	k->note[place] = s;
	return s.name ? 0 : no_memory(e);
}

static int read_state(struct ct_kept *k, const char *path, struct ct_err *e)
{
	unsigned char *text = NULL;
	char *line, *behind, *end, first[120];
	int rc = 0;
	size_t n;

	if (access(path, F_OK) != 0)
		return 0;
	if (ct_slurp(path, &text, &n, e))
		return -1;
	n = strlen(k->tool);
	line = (char *)text;
	behind = strstr(line, FIRST);
	k->noted = behind && strncmp(line, k->tool, n) == 0 && line[n] == ' ';
	snprintf(first, sizeof first, "%s %s" FIRST, k->tool, PACKAGE_VERSION);
	n = strlen(first);
	for (line = behind ? strchr(behind, '\n') + 1 : NULL; k->noted && *line && rc == 0;
		line = end + 1) {
		end = strchrnul(line, '\n');
		if (*end == '\0') /* the file ends in the middle of a line */
			break;
		*end = '\0';
		rc = take_line(k, line, strncmp((char *)text, first, n) != 0, e);
	}
	free(text);
	return rc;
}

/* What is there where no run has worked. */
static int check_foreign(const struct ct_kept *k, size_t n, const char *const *outputs,
	const struct ct_env *env, struct ct_err *e)
{
	for (size_t i = 0; i < n && !k->noted; i++) {
		if (!within(k, outputs[i]) || access(outputs[i], F_OK) != 0)
			continue;
		if (!ct_io_rule_of(env).force)
			return ct_fail(e, CT_EOUTPUT,
				"%s: exists, and no run in this folder made it; name another "
				"folder, or --force overwrites it",
				outputs[i]);
		if (unlink(outputs[i]))
			return ct_fail_errno(e, CT_EOUTPUT, outputs[i]);
	}
	return 0;
}

/* A folder that is refused stays as it was, so it is locked after that; and the run that worked in
 * it meanwhile may have made more. */
int ct_kept_open(struct ct_kept *k, const char *folder, size_t n, const char *const *outputs,
	const struct ct_env *env, struct ct_err *e)
{
	char *own[2] = {0};
	int rc;

	*k = (struct ct_kept){.folder = strdup(folder), .lock = -1, .tool = env->tool};
	if (!k->folder || !(own[0] = in_folder(k, "run.state")) ||
		!(own[1] = in_folder(k, "commands.sh")))
		rc = no_memory(e);
	else if (!(k->made = mkdir(folder, 0777) == 0) && errno != EEXIST)
		rc = ct_fail_errno(e, CT_EOUTPUT, folder);
	else
		rc = ct_err_any(read_state(k, own[0], e) ||
				check_foreign(k, 2, (const char *const *)own, env, e) ||
				check_foreign(k, n, outputs, env, e) || take_lock(k, e) ||
				read_state(k, own[0], e));
	free(own[0]);
	free(own[1]);
	return rc;
}

bool ct_kept_owns(const struct ct_kept *k, size_t place, const char *output)
{
	const char *was = k->note[place].name, *name = within(k, output);

	return was && strcmp(was, name ? name : output) == 0;
}

int ct_kept_unchanged(const struct ct_kept *k, size_t place, const char *output,
	const struct ct_env *env, struct ct_err *e)
{
	const char *made = k->note[place].made;
	char hex[CT_HASH_HEX];

	if (within(k, output) || !ct_kept_owns(k, place, output) || strcmp(made, "-") == 0 ||
		ct_io_rule_of(env).force)
		return 0;
	if (ct_hash_file(hex, output, env, e))
		return -1;
	return !*hex || strcmp(hex, made) == 0
		       ? 0
		       : ct_fail(e, CT_EOUTPUT,
				 "%s: was changed since a run made it; --force overwrites it",
				 output);
}

int ct_kept_look(enum ct_kept_is *is, char hex[static CT_HASH_HEX], struct ct_kept *k, size_t place,
	const char *output, const char *key, bool of_own, const struct ct_env *env,
	struct ct_err *e)
{
	const bool owned = ct_kept_owns(k, place, output), inside = within(k, output) != NULL;
	const struct ct_kept_note *s = &k->note[place];
	const bool same = owned && strcmp(s->key, key) == 0, ours = owned && !s->old;

	*is = ours && same && strcmp(s->made, "-") == 0 ? CT_KEPT_BEGUN : CT_KEPT_MISSING;
	if (ct_hash_file(hex, output, env, e))
		return -1;
	if (!*hex)
		return 0;
	if (owned && strcmp(s->made, hex) == 0) {
		if (ours && same)
			*is = CT_KEPT_DONE;
		else if (inside && unlink(output))
			return ct_fail_errno(e, CT_EOUTPUT, output);
	} else if (!inside) {
		if (ct_kept_unchanged(k, place, output, env, e))
			return -1;
		if (owned && strcmp(s->made, "-") != 0)
			ct_log(env, CT_WARN, "%s: was changed, and is made again", output);
	} else if (owned && !same && !of_own)
		return ct_fail(e, CT_EOUTPUT,
			"%s: is not what a run made of this input with these options, so is not "
			"written over: remove it, or name another folder",
			output);
	else {
		*is = CT_KEPT_OWN;
		ct_log(env, CT_WARN,
			"%s: is not what a run in this folder made: it is used as it is", output);
		if (!owned)
			return ct_kept_note(k, place, output, key, "-", e);
	}
	return 0;
}

int ct_kept_note(struct ct_kept *k, size_t place, const char *output, const char *key,
	const char *made, struct ct_err *e)
{
	const char *name = within(k, output);
	char *path = in_folder(k, "run.state");
	struct ct_kept_note s = {.name = strdup(name ? name : output)};
	struct ct_out o = {0};
	int rc = path && s.name ? ct_out_open_private(&o, path, e) : no_memory(e);

	snprintf(s.key, sizeof s.key, "%s", key);
	snprintf(s.made, sizeof s.made, "%s", made);
	free(k->note[place].name);
	k->note[place] = s;
	if (rc == 0) {
		fprintf(o.f, "%s %s" FIRST, k->tool, PACKAGE_VERSION);
		for (size_t i = 0; i < CT_KEPT_PLACES; i++)
			if (k->note[i].name && !strchr(k->note[i].name, '\n'))
				fprintf(o.f, "%zu %d %s %s %s\n", i, !k->note[i].old,
					k->note[i].key, k->note[i].made, k->note[i].name);
		rc = ct_out_commit(&o, e);
	}
	ct_out_abandon(&o);
	free(path);
	return rc;
}

int ct_kept_script(
	struct ct_kept *k, const char *text, size_t n, const struct ct_env *env, struct ct_err *e)
{
	const struct ct_kept_note *s = &k->note[CT_KEPT_SCRIPT];
	char *path = in_folder(k, "commands.sh"), is[CT_HASH_HEX], want[CT_HASH_HEX];
	struct ct_out o = {0};
	int rc = path ? ct_hash_file(is, path, env, e) : no_memory(e);

	ct_hash_hex(want, n, text);
	if (rc == 0 && *is && strcmp(is, want) != 0 && strcmp(is, s->made) != 0)
		ct_log(env, CT_WARN,
			"%s: was edited, and stays as it is: this run may not be what it does",
			path);
	else if (rc == 0 && strcmp(is, want) != 0)
		rc = ct_err_any((*is && unlink(path) && ct_fail_errno(e, CT_EOUTPUT, path)) ||
				ct_kept_note(k, CT_KEPT_SCRIPT, path, "-", want, e) ||
				ct_out_open(&o, path, env, e) || ct_put(&o, text, n, e) ||
				ct_out_commit(&o, e));
	ct_out_abandon(&o);
	free(path);
	return rc;
}

/* The folder, where it holds nothing but our lock. */
static void remove_empty(const struct ct_kept *k)
{
	char *lock = in_folder(k, "lock");
	struct dirent **in = NULL;
	int n = scandir(k->folder, &in, NULL, NULL);

	if (n == 3 && lock) { /* with . and .. */
		unlink(lock);
		rmdir(k->folder);
	}
	while (n > 0)
		free(in[--n]);
	free(in);
	free(lock);
}

void ct_kept_close(struct ct_kept *k)
{
	if (k->made && k->lock >= 0)
		remove_empty(k);
	if (k->lock >= 0)
		close(k->lock);
	for (size_t i = 0; i < CT_KEPT_PLACES; i++)
		free(k->note[i].name);
	free(k->folder);
	*k = (struct ct_kept){.lock = -1};
}
