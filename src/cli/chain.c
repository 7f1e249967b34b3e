/* chain.c: see chain.h. */
#include "config.h"
#include "cli/chain.h"
#include "core/clock.h"
#include "core/mem.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* Where this program lies: the other commands lie beside it. */
static char *own_folder(void)
{
	char path[4096];
	ssize_t n = readlink("/proc/self/exe", path, sizeof path - 1);
	char *slash;

	if (n <= 0)
		return strdup("");
	path[n] = '\0';
	slash = strrchr(path, '/');
	if (!slash)
		return strdup("");
	slash[1] = '\0';
	return strdup(path);
}

char *ct_chain_path(const struct ct_chain *c, const char *name)
{
	char *s = NULL;

	return asprintf(&s, "%s/%s", c->folder, name) < 0 ? NULL : s;
}

int ct_chain_open(struct ct_chain *c, const char *folder, bool resume, const struct ct_env *env,
	struct ct_err *e)
{
	char *log = NULL;
	int rc = -1;

	*c = (struct ct_chain){0};
	c->tools = own_folder();
	if (folder) {
		c->folder = strdup(folder);
		if (c->folder && mkdir(folder, 0777) != 0 && errno != EEXIST)
			return ct_fail(e, CT_EOUTPUT, "%s: %s", folder, strerror(errno));
	} else {
		const char *tmp = getenv("TMPDIR");

		c->temporary = true;
		if (asprintf(&c->folder, "%s/ct-sr.XXXXXX", tmp && *tmp ? tmp : "/tmp") < 0)
			c->folder = NULL;
		else if (!mkdtemp(c->folder)) {
			ct_fail(e, CT_EOUTPUT, "%s: %s", c->folder, strerror(errno));
			c->temporary = false;
			return -1;
		}
	}
	log = c->folder ? ct_chain_path(c, "commands.sh") : NULL;
	if (!log || !c->tools || asprintf(&c->threads, "%zu", ct_par_threads(env->par)) < 0)
		ct_fail(e, CT_ENOMEM, "no memory");
	else if (folder && !resume && !env->force && access(log, F_OK) == 0)
		ct_fail(e, CT_EOUTPUT,
			"%s: holds an earlier run; --resume goes on with it, "
			"--force starts anew",
			folder);
	else
		rc = 0;
	free(log);
	return rc;
}

static int take_word(struct ct_step *s, char *word, struct ct_err *e)
{
	if (!word || s->argc + 4 > CT_CHAIN_ARGS) { /* room for --resume, NULL */
		free(word);
		return ct_fail(e, CT_ENOMEM, "command %s is too long", s->tool);
	}
	s->argv[s->argc++] = word;
	return 0;
}

int ct_chain_add(struct ct_chain *c, struct ct_err *e, bool resumable, const char *output,
	const char *tool, ...)
{
	struct ct_step *s;
	const char *word;
	va_list ap;
	int rc;

	if (ct_grow(&c->step, &c->cap, c->n + 1, sizeof *c->step, e))
		return -1;
	s = &c->step[c->n++];
	*s = (struct ct_step){.tool = tool, .output = output, .resumable = resumable};
	rc = take_word(s, strdup(tool), e);
	va_start(ap, tool);
	while (rc == 0 && (word = va_arg(ap, const char *)))
		rc = take_word(s, strdup(word), e);
	va_end(ap);
	return rc;
}

int ct_chain_word(struct ct_chain *c, struct ct_err *e, const char *fmt, ...)
{
	char *word = NULL;
	va_list ap;

	va_start(ap, fmt);
	if (vasprintf(&word, fmt, ap) < 0)
		word = NULL;
	va_end(ap);
	return take_word(&c->step[c->n - 1], word, e);
}

/* The command as a shell would read it. */
static char *line_of(const struct ct_step *s)
{
	char *text = NULL;
	size_t len;
	FILE *f = open_memstream(&text, &len);

	if (!f)
		return NULL;
	for (size_t i = 0; i < s->argc; i++) {
		const char *w = s->argv[i];

		if (i)
			fputc(' ', f);
		if (*w && !w[strspn(w, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
				       "0123456789_-+=.,:/@%")])
			fputs(w, f);
		else {
			fputc('\'', f);
			for (; *w; w++)
				*w == '\'' ? fputs("'\\''", f) : fputc(*w, f);
			fputc('\'', f);
		}
	}
	if (fclose(f) == 0)
		return text;
	free(text);
	return NULL;
}

void ct_chain_print(const struct ct_chain *c, void *f)
{
	for (size_t i = 0; i < c->n; i++) {
		char *line = line_of(&c->step[i]);

		if (line)
			fprintf(f, "%s\n", line);
		free(line);
	}
}

/* How many leading steps the log says are done, with their outputs there. */
static size_t steps_done(const struct ct_chain *c, const char *log)
{
	FILE *f = fopen(log, "r");
	char *line = NULL;
	size_t cap = 0, done = 0;
	ssize_t n;

	while (f && done < c->n && (n = getline(&line, &cap, f)) > 0) {
		char *want;
		int same;

		if (line[0] == '#')
			continue;
		if (line[n - 1] == '\n')
			line[n - 1] = '\0';
		want = line_of(&c->step[done]);
		same = want && strcmp(line, want) == 0;
		free(want);
		if (!same || access(c->step[done].output, F_OK) != 0)
			break;
		done++;
	}
	free(line);
	if (f)
		fclose(f);
	return done;
}

static int write_log(const struct ct_chain *c, const char *log, size_t done, struct ct_err *e)
{
	FILE *f = fopen(log, "w");
	int bad;

	if (!f)
		return ct_fail(e, CT_EOUTPUT, "%s: %s", log, strerror(errno));
	fputs("#!/bin/sh\n", f);
	for (size_t i = 0; i < done; i++) {
		char *line = line_of(&c->step[i]);

		if (line)
			fprintf(f, "%s\n", line);
		free(line);
	}
	bad = ferror(f);
	return (fclose(f) != 0 || bad) ? ct_fail(e, CT_EOUTPUT, "%s: %s", log, strerror(errno)) : 0;
}

/* What a step reports goes to standard error, or nowhere. */
static void send_report(bool quiet)
{
	int fd = quiet ? open("/dev/null", O_WRONLY) : dup(STDERR_FILENO);

	if (fd >= 0) {
		dup2(fd, STDOUT_FILENO);
		close(fd);
	}
}

static int spawn(const struct ct_chain *c, struct ct_step *s, bool again, const struct ct_env *env,
	pid_t *pid, struct ct_err *e)
{
	char path[4096];
	char *argv[CT_CHAIN_ARGS + 8];
	char force[] = "--force", quiet[] = "--quiet", verbose[] = "--verbose",
	     threads[] = "--threads", resume[] = "--resume";
	size_t n = 0;

	for (; n < s->argc; n++)
		argv[n] = s->argv[n];
	argv[n++] = force;
	argv[n++] = threads;
	argv[n++] = c->threads;
	if (env->verbose != 0)
		argv[n++] = env->verbose < 0 ? quiet : verbose;
	if (again && s->resumable)
		argv[n++] = resume;
	argv[n] = NULL;
	*pid = fork();
	if (*pid < 0)
		return ct_fail(e, CT_ENOMEM, "cannot start %s: %s", s->tool, strerror(errno));
	if (*pid == 0) {
		if (strcmp(s->output, "-") != 0) /* standard output is for the data alone */
			send_report(env->verbose < 0);
		snprintf(path, sizeof path, "%s%s", c->tools, s->tool);
		execv(path, argv);
		execvp(s->tool, argv);
		fprintf(stderr, "ct-sr: %s: %s\n", s->tool, strerror(errno));
		_exit(CT_EFAIL);
	}
	return 0;
}

static int run_step(const struct ct_chain *c, struct ct_step *s, bool again,
	const struct ct_env *env, struct ct_err *e)
{
	double start = ct_clock_wall();
	pid_t pid, got;
	int status, asked = 0;

	if (spawn(c, s, again, env, &pid, e))
		return -1;
	while ((got = waitpid(pid, &status, WNOHANG)) == 0) {
		if (ct_stopping(env) && !asked++)
			kill(pid, SIGTERM);
		ct_clock_sleep(0.02);
	}
	if (got < 0)
		return ct_fail(e, CT_EFAIL, "%s: %s", s->tool, strerror(errno));
	if (WIFSIGNALED(status) && !asked)
		return ct_fail(
			e, CT_EFAIL, "%s was killed by signal %d", s->tool, WTERMSIG(status));
	if (WIFSIGNALED(status) || WEXITSTATUS(status) == CT_ESTOP)
		return ct_fail(e, CT_ESTOP,
			c->temporary ? "stopped on request"
				     : "stopped on request; --resume goes on");
	if (WEXITSTATUS(status) != 0)
		return ct_fail(e, (enum ct_code)WEXITSTATUS(status), "%s failed", s->tool);
	ct_log(env, CT_INFO, "%s took %.1f s", s->tool, ct_clock_wall() - start);
	return 0;
}

int ct_chain_run(struct ct_chain *c, bool resume, const struct ct_env *env, struct ct_err *e)
{
	char *log = ct_chain_path(c, "commands.sh");
	int rc = -1;

	if (!log)
		return ct_fail(e, CT_ENOMEM, "no memory");
	c->done = resume ? steps_done(c, log) : 0;
	if (c->done)
		ct_log(env, CT_INFO, "%zu of %zu steps are done", c->done, c->n);
	for (bool again = resume; c->done < c->n; again = false) {
		char *line = line_of(&c->step[c->done]);

		ct_log(env, CT_INFO, "%s", line ? line : "");
		free(line);
		if (write_log(c, log, c->done, e) || ct_check_stop(env, e) ||
			run_step(c, &c->step[c->done], again, env, e))
			goto out;
		c->done++;
	}
	rc = write_log(c, log, c->done, e);
out:
	free(log);
	return rc;
}

static void remove_folder(const char *folder)
{
	DIR *d = opendir(folder);
	struct dirent *x;

	while (d && (x = readdir(d)))
		if (x->d_name[0] != '.' || (x->d_name[1] && x->d_name[1] != '.'))
			unlinkat(dirfd(d), x->d_name, 0);
	if (d)
		closedir(d);
	rmdir(folder);
}

void ct_chain_close(struct ct_chain *c)
{
	if (c->temporary && c->folder)
		remove_folder(c->folder);
	for (size_t i = 0; i < c->n; i++)
		for (size_t k = 0; k < c->step[i].argc; k++)
			free(c->step[i].argv[k]);
	free(c->step);
	free(c->folder);
	free(c->tools);
	free(c->threads);
	*c = (struct ct_chain){0};
}
