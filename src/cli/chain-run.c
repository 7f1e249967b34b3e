/* chain-run.c: the commands of a chain, run; see chain.h. */
#include "config.h"
#include "cli/chain.h"
#include "cli/content.h"
#include "cli/resume.h"
#include "cli/stop.h"
#include "core/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#define OUTPUT "OUT"
#define NOT_MADE "not made" /* it is not known what the output holds */

/* What of a step was done before. */
enum done { NOTHING, BEGUN, DONE };

static const struct ct_opt no_options[] = {CT_OPT_END};

/* What a file holds goes into the key: 0, or 1 if it cannot be told before it is read. */
static int name_input(struct ct_resume *r, const char *name, const char *path,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_meta m = {0};
	int rc = ct_content_read(&m, path, env, e);

	if (rc == 0)
		rc = m.n == 0 ? 1 : ct_resume_input(r, name, &m, e);
	ct_meta_free(&m);
	return rc;
}

/* Its words, and what the files hold that they name; 1 if that cannot be told. */
static int name_step(struct ct_resume *r, const struct ct_chain *c, size_t i,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_step *s = &c->step[i];
	int rc = ct_resume_value(r, e, "command", "%s", s->tool), told;

	for (size_t k = 1; k < s->argc && rc >= 0; k++) {
		const char *word = s->argv[k], *path = ct_chain_input(c, i, k);
		char name[40];

		if (strcmp(word, s->output) == 0)
			continue;
		snprintf(name, sizeof name, "word %zu", k);
		if (!path && ct_resume_value(r, e, name, "%s", word))
			return -1;
		told = path ? name_input(r, name, path, env, e) : 0;
		rc = told < 0 ? -1 : rc | told;
	}
	return rc;
}

/* The state of the run of a command, opened and named; 1 if what it reads cannot be told. */
static int open_step(struct ct_resume *r, const struct ct_chain *c, size_t i,
	const struct ct_env *env, struct ct_err *e)
{
	struct ct_env own = *env;
	char *path = ct_chain_step_path(c, i);
	int rc;

	if (!path)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	own.force = true;
	own.seed = 0; /* it is among the words where there is one */
	rc = ct_resume_open(r, path, c->resume, no_options, NULL, &own, e) ||
			     ct_resume_value(r, e, OUTPUT, NOT_MADE)
		     ? -1
		     : name_step(r, c, i, env, e);
	r->own = true; /* the folder is locked: a broken one too */
	free(path);
	return rc;
}

/* Is the state there of this run, and with this output? It is its name alone. */
static bool same(struct ct_resume *r, const struct ct_env *env)
{
	struct ct_err why = {0};
	int rc = ct_resume_load(r, NULL, NULL, &why);

	if (rc < 0)
		ct_log(env, CT_DEBUG, "%s", why.msg);
	return rc == 0;
}

static int look(enum done *was, struct ct_resume *r, const struct ct_step *s,
	const struct ct_env *env, struct ct_err *e)
{
	int told;

	*was = same(r, env) ? BEGUN : NOTHING;
	told = name_input(r, OUTPUT, s->output, env, e);
	if (told < 0)
		return -1;
	if (told == 0 && same(r, env))
		*was = DONE;
	return ct_resume_value(r, e, OUTPUT, NOT_MADE);
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

/* What the step says of a copy of a file of the user names that. */
static void call(const struct ct_chain *c, const struct ct_step *s)
{
	const char *of, *path = ct_chain_copy(c, (size_t)(s - c->step), &of);
	char *text;

	if (path &&
		asprintf(&text, "%s\n%s", path, strcmp(of, "-") == 0 ? "standard input" : of) > 0)
		setenv(CT_CALLED, text, 1);
	else
		unsetenv(CT_CALLED);
}

/* In the new process. */
static void become(const struct ct_chain *c, const struct ct_step *s, char **argv, pid_t parent,
	const struct ct_env *env)
{
	char path[sizeof c->tools + 100];

	ct_stop_uncatch();
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (getppid() != parent)
		_exit(CT_EFAIL);
	if (strcmp(s->output, "-") != 0) /* standard output is for the data alone */
		send_report(env->verbose < 0);
	call(c, s);
	snprintf(path, sizeof path, "%s%s", c->tools, s->tool);
	execv(path, argv);
	execvp(s->tool, argv);
	fprintf(stderr, "%s: %s: %s\n", env->tool, s->tool, strerror(errno));
	_exit(CT_EFAIL);
}

static int spawn(const struct ct_chain *c, struct ct_step *s, bool again, const struct ct_env *env,
	pid_t *pid, struct ct_err *e)
{
	char *argv[CT_CHAIN_ARGS + 8];
	char force[] = "--force", quiet[] = "--quiet", verbose[] = "--verbose",
	     threads[] = "--threads", number[24], resume[] = "--resume";
	const pid_t parent = getpid();
	size_t n = 0;

	snprintf(number, sizeof number, "%zu", ct_par_threads(env->par));
	for (; n < s->argc; n++)
		argv[n] = s->argv[n];
	argv[n++] = force;
	argv[n++] = threads;
	argv[n++] = number;
	if (env->verbose < 0)
		argv[n++] = quiet;
	if (env->verbose > 0)
		argv[n++] = verbose;
	if (again && s->resumable)
		argv[n++] = resume;
	argv[n] = NULL;
	*pid = fork();
	if (*pid < 0)
		return ct_fail(e, CT_ENOMEM, "cannot start %s: %s", s->tool, strerror(errno));
	if (*pid == 0)
		become(c, s, argv, parent, env);
	return 0;
}

/* Told to stop until it does. */
static int wait_for(pid_t pid, int *status, const struct ct_env *env)
{
	pid_t got;

	ct_stop_defer(true);
	while ((got = waitpid(pid, status, WNOHANG)) == 0) {
		if (ct_stopping(env))
			kill(pid, SIGTERM);
		ct_clock_sleep(0.02);
	}
	ct_stop_defer(false);
	return got < 0 ? -1 : 0;
}

/* The command has named the file that it read, which is none of the user's. */
static int failed(const struct ct_chain *c, const struct ct_step *s, int status, struct ct_err *e)
{
	const char *of = ct_chain_origin(c, (size_t)(s - c->step));
	const enum ct_code code =
		WIFSIGNALED(status) ? CT_EFAIL : (enum ct_code)WEXITSTATUS(status);
	char how[40] = "failed";

	if (WIFSIGNALED(status))
		snprintf(how, sizeof how, "was killed by signal %d", WTERMSIG(status));
	return ct_fail(e, code, "%s %s%s%.200s", s->tool, how,
		of ? "; what it reads was made of " : "",
		of ? strcmp(of, "-") == 0 ? "standard input" : of : "");
}

static int start(const struct ct_chain *c, struct ct_step *s, bool again, const struct ct_env *env,
	struct ct_err *e)
{
	double began = ct_clock_wall();
	pid_t pid;
	int status;

	if (ct_check_stop(env, e) || spawn(c, s, again, env, &pid, e))
		return -1;
	if (wait_for(pid, &status, env))
		return ct_fail_errno(e, CT_EFAIL, s->tool);
	if (WIFSIGNALED(status) && !ct_stopping(env))
		return failed(c, s, status, e);
	if (WIFSIGNALED(status) || WEXITSTATUS(status) == CT_ESTOP)
		return ct_fail(e, CT_ESTOP,
			c->folder.temporary ? "stopped on request"
					    : "stopped on request; the same command goes on");
	if (WEXITSTATUS(status) != 0)
		return failed(c, s, status, e);
	ct_log(env, CT_INFO, "%s took %.1f s", s->tool, ct_clock_wall() - began);
	return 0;
}

/* A step that can be resumed: left out if it is done, and else noted before and after. */
static int run_step(struct ct_chain *c, size_t i, const struct ct_env *env, struct ct_err *e)
{
	struct ct_step *s = &c->step[i];
	struct ct_resume r = {0};
	enum done was = NOTHING;
	int rc = -1, told = open_step(&r, c, i, env, e);

	if (told < 0 || (told == 0 && c->resume && look(&was, &r, s, env, e)))
		goto out;
	if (was == DONE) {
		c->left_out++;
		rc = 0;
		goto out;
	}
	if (ct_resume_save(&r, NULL, NULL, e) || start(c, s, was == BEGUN, env, e))
		goto out;
	told |= name_input(&r, OUTPUT, s->output, env, e);
	rc = told == 0 ? ct_resume_save(&r, NULL, NULL, e) : told < 0 ? -1 : 0;
out:
	ct_resume_close(&r);
	return rc;
}

int ct_chain_run(struct ct_chain *c, const struct ct_env *env, struct ct_err *e)
{
	if (ct_chain_made(c, e) || (!c->folder.temporary && ct_chain_write(c, env, e)))
		return -1;
	for (size_t i = 0; i < c->n; i++)
		if (c->folder.temporary ? start(c, &c->step[i], false, env, e)
					: run_step(c, i, env, e))
			return -1;
	if (c->left_out)
		ct_log(env, CT_INFO, "%zu of %zu steps were done", c->left_out, c->n);
	return 0;
}
