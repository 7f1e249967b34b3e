/* kept.c: see kept.h. */
#include "config.h"
#include "cli/kept.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/temp.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define STATE "run.state"
#define SCRIPT "commands.sh"
#define FIRST ": what a run in this folder has made\n" /* behind the command and its version */

char *ct_kept_path(const struct ct_kept *k, const char *name)
{
	char *path = NULL;

	return asprintf(&path, "%s/%s", k->folder, name) < 0 ? NULL : path;
}

void ct_kept_hash(char hex[static CT_CONTENT_HEX], const char *text, size_t n)
{
	uint64_t bits[2];

	ct_hash_pieces(bits, 1, &(const struct ct_piece){text, n});
	snprintf(hex, CT_CONTENT_HEX, "%016llx%016llx", (unsigned long long)bits[0],
		(unsigned long long)bits[1]);
}

static int no_memory(struct ct_err *e)
{
	return ct_fail(e, CT_ENOMEM, "no memory for a file name");
}

static int take_lock(struct ct_kept *k, struct ct_err *e)
{
	char *path = ct_kept_path(k, "lock");
	int rc = 0;

	if (!path)
		return no_memory(e);
	k->fresh = access(path, F_OK) != 0;
	k->lock = open(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
	if (k->lock < 0)
		rc = ct_fail_errno(e, CT_EOUTPUT, path);
	else if (!ct_temp_wait(k->lock))
		rc = ct_fail(e, CT_EOUTPUT,
			errno == EWOULDBLOCK ? "%s: another run works in it"
					     : "%s: cannot be locked",
			k->folder);
	free(path);
	return rc;
}

/* A line of a step, or of the script. */
static void take_line(struct ct_kept *k, const char *line)
{
	struct ct_kept_step s = {0};
	size_t i;

	if (sscanf(line, "%zu %32[0-9a-f-] %32[0-9a-f-] %32[0-9a-f]", &i, s.key, s.made, s.name) ==
			4 &&
		i < CT_KEPT_STEPS)
		k->step[i] = s;
	else if (sscanf(line, "script %32[0-9a-f]", s.made) == 1)
		k->script = s;
}

/* Is it the state of a run of this command, and of which version? */
static bool take_first(struct ct_kept *k, const char *text)
{
	const size_t n = strlen(k->tool);
	const char *behind = strstr(text, FIRST);

	if (!behind || strncmp(text, k->tool, n) != 0 || text[n] != ' ')
		return false;
	k->other = strlen(PACKAGE_VERSION) != (size_t)(behind - text) - n - 1 ||
		   strncmp(text + n + 1, PACKAGE_VERSION, strlen(PACKAGE_VERSION)) != 0;
	return true;
}

static int read_state(struct ct_kept *k, struct ct_err *e)
{
	char *path = ct_kept_path(k, STATE);
	unsigned char *text = NULL;
	int rc = path ? 0 : no_memory(e);
	size_t n;

	if (path && access(path, F_OK) == 0 && (rc = ct_slurp(path, &text, &n, e)) == 0) {
		k->foreign = !take_first(k, (char *)text);
		for (char *line = (char *)text; !k->foreign && *line;) {
			char *end = line + strcspn(line, "\n"), *next = end + (*end != '\0');

			*end = '\0';
			take_line(k, line);
			line = next;
		}
	}
	free(text);
	free(path);
	return rc;
}

int ct_kept_open(struct ct_kept *k, const char *folder, const struct ct_env *env, struct ct_err *e)
{
	*k = (struct ct_kept){.folder = strdup(folder), .lock = -1, .tool = env->tool};
	if (!k->folder)
		return no_memory(e);
	if (mkdir(folder, 0777) != 0 && errno != EEXIST)
		return ct_fail_errno(e, CT_EOUTPUT, folder);
	return take_lock(k, e) || read_state(k, e) ? -1 : 0;
}

bool ct_kept_owns(const struct ct_kept *k, const char *output)
{
	char name[CT_CONTENT_HEX];

	ct_kept_hash(name, output, strlen(output));
	for (size_t i = 0; i < CT_KEPT_STEPS; i++)
		if (strcmp(k->step[i].name, name) == 0)
			return true;
	return false;
}

static int refuse(struct ct_kept *k, const char *foreign, struct ct_err *e)
{
	k->refused = true;
	return ct_fail(e, CT_EOUTPUT,
		"%s: exists, and no run in this folder made it; name another folder, or --force "
		"overwrites it",
		foreign);
}

int ct_kept_check(struct ct_kept *k, size_t n, const char *const *outputs, const struct ct_env *env,
	struct ct_err *e)
{
	const size_t len = strlen(k->folder);
	char *state = ct_kept_path(k, STATE);
	int rc = !state                                    ? no_memory(e)
		 : k->foreign && !ct_io_rule_of(env).force ? refuse(k, state, e)
							   : 0;

	for (size_t i = 0; i < n && rc == 0 && !ct_io_rule_of(env).force; i++)
		if (strncmp(outputs[i], k->folder, len) == 0 && outputs[i][len] == '/' &&
			access(outputs[i], F_OK) == 0 && !ct_kept_owns(k, outputs[i]))
			rc = refuse(k, outputs[i], e);
	free(state);
	return rc;
}

enum ct_kept_done ct_kept_look(
	const struct ct_kept *k, size_t i, const char *key, const char *content)
{
	const struct ct_kept_step *s = &k->step[i];

	if (k->other || !*key || strcmp(s->key, key) != 0)
		return CT_KEPT_NOTHING;
	if (strcmp(s->made, "-") == 0)
		return CT_KEPT_BEGUN;
	return strcmp(s->made, content) == 0 ? CT_KEPT_DONE : CT_KEPT_NOTHING;
}

static int save(const struct ct_kept *k, struct ct_err *e)
{
	char *path = ct_kept_path(k, STATE);
	struct ct_out o = {0};
	int rc = path ? ct_out_open_private(&o, path, e) : no_memory(e);

	if (rc == 0) {
		fprintf(o.f, "%s %s" FIRST, k->tool, PACKAGE_VERSION);
		for (size_t i = 0; i < CT_KEPT_STEPS; i++)
			if (*k->step[i].name)
				fprintf(o.f, "%zu %s %s %s\n", i, k->step[i].key, k->step[i].made,
					k->step[i].name);
		if (*k->script.made)
			fprintf(o.f, "script %s\n", k->script.made);
		rc = ct_out_commit(&o, e);
	}
	ct_out_abandon(&o);
	free(path);
	return rc;
}

int ct_kept_note(struct ct_kept *k, size_t i, const char *output, const char *key, const char *made,
	struct ct_err *e)
{
	struct ct_kept_step *s = &k->step[i];

	if (k->other) /* what another version made is only owned */
		for (size_t j = 0; j < CT_KEPT_STEPS; j++)
			if (*k->step[j].name)
				snprintf(k->step[j].key, sizeof k->step[j].key, "-");
	k->other = false;
	snprintf(s->key, sizeof s->key, "%s", *key ? key : "-");
	snprintf(s->made, sizeof s->made, "%s", *made ? made : "-");
	ct_kept_hash(s->name, output, strlen(output));
	return save(k, e);
}

int ct_kept_script(
	struct ct_kept *k, const char *text, size_t n, const struct ct_env *env, struct ct_err *e)
{
	char *path = ct_kept_path(k, SCRIPT), is[CT_CONTENT_HEX] = "", want[CT_CONTENT_HEX];
	const struct ct_io_rule rule = {.force = true};
	struct ct_env own = *env;
	struct ct_out o = {0};
	int rc = path ? ct_content_read(is, path, env, e) : no_memory(e);
	bool as_it_is, ours;

	own.files = &rule;
	ct_kept_hash(want, text, n);
	as_it_is = strcmp(is, want) == 0;
	ours = !*is || as_it_is || strcmp(is, k->script.made) == 0;
	if (rc == 0 && !ours && *k->script.made)
		ct_log(env, CT_WARN,
			"%s: was edited, and stays as it is: this run may not be what it does",
			path);
	else if (rc == 0 && !ours && !ct_io_rule_of(env).force)
		rc = refuse(k, path, e);
	else if (rc == 0) {
		if (!as_it_is)
			rc = ct_out_open(&o, path, &own, e) || ct_put(&o, text, n, e) ||
					     ct_out_commit(&o, e)
				     ? -1
				     : 0;
		snprintf(k->script.made, sizeof k->script.made, "%s", want);
		rc = rc ? -1 : save(k, e);
	}
	ct_out_abandon(&o);
	free(path);
	return rc;
}

void ct_kept_close(struct ct_kept *k)
{
	char *path = k->lock >= 0 && k->fresh && k->refused ? ct_kept_path(k, "lock") : NULL;

	if (path) /* a folder that was refused stays as it was */
		unlink(path);
	free(path);
	if (k->lock >= 0)
		close(k->lock);
	free(k->folder);
	*k = (struct ct_kept){.lock = -1};
}
