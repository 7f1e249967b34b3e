/* chain-run.c: the commands of a chain, run; see chain.h. */
#include "config.h"
#include "cli/chain.h"
#include "cli/cli.h"
#include "cli/content.h"
#include "cli/stop.h"
#include "core/clock.h"
#include "core/stream.h"
#include "formats/io.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

/* What of a step was done before. */
enum done { NOTHING, BEGUN, DONE };

/* A step as its state tells of it. */
struct state {
	char *key;                   /* owned: lines of its words, and what its inputs hold */
	char output[CT_CONTENT_HEX]; /* what that holds; "": it is not known */
	bool told;                   /* all that the inputs hold */
};

static int make_key(struct state *st, const struct ct_chain *c, size_t i, const struct ct_env *env,
	struct ct_err *e)
{
	const struct ct_step *s = &c->step[i];
	size_t n;
	FILE *f;
	int rc = 0;

	if (ct_stream_open(&f, &st->key, &n, e))
		return -1;
	st->told = true;
	fprintf(f, "\n%s %s\n%s\n", env->tool, PACKAGE_VERSION, s->argv[0]);
	for (size_t k = 1; k < s->argc && rc == 0; k++) {
		const char *input = ct_chain_input(c, i, k);
		char hex[CT_CONTENT_HEX];

		if (input && (rc = ct_content_read(hex, input, env, e)) == 0) {
			st->told &= *hex != '\0';
			fprintf(f, "%s\n", hex);
		} else if (!input && strcmp(s->argv[k], s->output) != 0)
			fprintf(f, "%s\n", s->argv[k]);
	}
	fputc('\n', f);
	return ct_stream_close(f, &st->key, e) || rc ? -1 : 0;
}

/* The state of step i, or NULL. */
static char *read_state(const struct ct_chain *c, size_t i)
{
	char *path = ct_chain_path(c, "step-%zu.state", i + 1);
	unsigned char *text = NULL;
	struct ct_err why;
	size_t n;

	if (path && access(path, F_OK) == 0)
		ct_slurp(path, &text, &n, &why);
	free(path);
	return (char *)text;
}

bool ct_chain_owns(const struct ct_chain *c, const char *output)
{
	const size_t n = strlen(output);
	size_t i = 0;
	char *state;
	bool is;

	while (i < c->n && strcmp(c->step[i].output, output) != 0)
		i++;
	state = c->kept && i < c->n ? read_state(c, i) : NULL;
	is = state && strncmp(state, output, n) == 0 && state[n] == '\n';
	free(state);
	return is;
}

static enum done look(const struct ct_chain *c, size_t i, const struct state *st)
{
	char *was = st->told ? read_state(c, i) : NULL, *is = was ? strchr(was, '\n') : NULL;
	const size_t key = strlen(st->key);
	enum done done = NOTHING;

	if (is && strncmp(is, st->key, key) == 0)
		done = !is[key] ? BEGUN : strcmp(is + key, st->output) == 0 ? DONE : NOTHING;
	free(was);
	return done;
}

static int save(const struct ct_chain *c, size_t i, const struct state *st, const char *made,
	struct ct_err *e)
{
	char *path = ct_chain_path(c, "step-%zu.state", i + 1);
	struct ct_out o = {0};
	int rc = path ? ct_out_open_private(&o, path, e) : ct_fail(e, CT_ENOMEM, "no memory");

	if (rc == 0) {
		fprintf(o.f, "%s%s%s", c->step[i].output, st->key, made);
		rc = ct_out_commit(&o, e);
	}
	ct_out_abandon(&o);
	free(path);
	return rc;
}

/* In the new process. What it says of what was made of the source at once names that. */
static void become(
	const struct ct_chain *c, size_t i, bool again, pid_t parent, const struct ct_env *env)
{
	const struct ct_step *s = &c->step[i];
	char path[sizeof c->tools + 100], threads[40], *called, *argv[CT_CHAIN_WORDS + 5],
		force[] = "--force", quiet[] = "--quiet", verbose[] = "--verbose",
		resume[] = "--resume";
	size_t n = s->argc;

	ct_stop_uncatch();
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (getppid() != parent)
		_exit(CT_EFAIL);
	if (strcmp(s->output, "-") != 0) /* standard output is for the data alone */
		dup2(env->verbose < 0 ? open("/dev/null", O_WRONLY | O_CLOEXEC) : STDERR_FILENO,
			STDOUT_FILENO);
	if (i > 0 && c->called && asprintf(&called, "%s\n%s", c->step[0].output, c->called) > 0)
		setenv(CT_CALLED, called, 1);
	else
		unsetenv(CT_CALLED);
	snprintf(threads, sizeof threads, "--threads=%zu", ct_par_threads(env->par));
	memcpy(argv, s->argv, n * sizeof *argv);
	argv[n++] = force;
	argv[n++] = threads;
	if (env->verbose)
		argv[n++] = env->verbose < 0 ? quiet : verbose;
	if (again && s->resumable)
		argv[n++] = resume;
	argv[n] = NULL;
	snprintf(path, sizeof path, "%s%s", c->tools, argv[0]);
	execv(path, argv);
	execvp(argv[0], argv);
	fprintf(stderr, "%s: %s: %s\n", env->tool, argv[0], strerror(errno));
	_exit(CT_EFAIL);
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

static int start(
	const struct ct_chain *c, size_t i, bool again, const struct ct_env *env, struct ct_err *e)
{
	const char *tool = c->step[i].argv[0], *of = i > 0 ? c->called : NULL;
	const pid_t parent = getpid();
	double began = ct_clock_wall();
	char how[40] = "failed";
	pid_t pid;
	int status, code;

	if (ct_check_stop(env, e))
		return -1;
	pid = fork();
	if (pid < 0)
		return ct_fail(e, CT_ENOMEM, "cannot start %s: %s", tool, strerror(errno));
	if (pid == 0)
		become(c, i, again, parent, env);
	if (wait_for(pid, &status, env))
		return ct_fail_errno(e, CT_EFAIL, tool);
	code = WIFSIGNALED(status) ? CT_EFAIL : WEXITSTATUS(status);
	if (code == CT_ESTOP || (WIFSIGNALED(status) && ct_stopping(env)))
		return ct_fail(e, CT_ESTOP,
			c->kept ? "stopped on request; the same command goes on"
				: "stopped on request");
	if (WIFSIGNALED(status))
		snprintf(how, sizeof how, "was killed by signal %d", WTERMSIG(status));
	if (code)
		return ct_fail(e, (enum ct_code)code, "%s %s%s%.200s", tool, how,
			of ? "; what it reads was made of " : "", of ? of : "");
	ct_log(env, CT_INFO, "%s took %.1f s", tool, ct_clock_wall() - began);
	return 0;
}

/* A step in a folder that is kept: left out if it is done, and else noted before and after. */
static int run_step(struct ct_chain *c, size_t i, const struct ct_env *env, struct ct_err *e)
{
	const char *output = c->step[i].output;
	struct state st = {0};
	enum done was;
	int rc = -1;

	if (make_key(&st, c, i, env, e) || ct_content_read(st.output, output, env, e))
		goto out;
	was = look(c, i, &st);
	if (was == DONE)
		c->left_out++;
	else if (save(c, i, &st, "", e) || start(c, i, was == BEGUN, env, e) ||
		 ct_content_read(st.output, output, env, e))
		goto out;
	rc = st.told && *st.output ? save(c, i, &st, st.output, e) : 0;
out:
	free(st.key);
	return rc;
}

/* Is there a file of somebody else's that a command, or the script, would replace? */
static int check_folder(const struct ct_chain *c, const struct ct_env *env, struct ct_err *e)
{
	const size_t n = strlen(c->folder);
	char *script = ct_chain_path(c, "commands.sh"), *state, head[40] = "";
	const char *foreign = NULL;
	FILE *f = script ? fopen(script, "r") : NULL;
	int rc = 0;

	if (f && (fread(head, 1, sizeof head - 1, f) == 0 ||
			 (strstr(head, "#!/bin/sh\nset -e\nCDPATH= cd ") != head &&
				 strstr(head, "#!/bin/sh\nset -e\ncd -- ") != head)))
		foreign = script;
	for (size_t i = 0; i < c->n && !foreign; i++) {
		const char *out = c->step[i].output;

		if (strncmp(out, c->folder, n) != 0 || out[n] != '/' || access(out, F_OK) != 0)
			continue;
		state = read_state(c, i);
		if (!state)
			foreign = out;
		free(state);
	}
	if (foreign && !ct_io_rule_of(env).force)
		rc = ct_fail(e, CT_EOUTPUT,
			"%s: exists, and no run in this folder made it; name another folder, or "
			"--force overwrites it",
			foreign);
	if (f)
		fclose(f);
	free(script);
	return rc;
}

int ct_chain_run(struct ct_chain *c, const struct ct_env *env, struct ct_err *e)
{
	if (c->kept && check_folder(c, env, e))
		return -1;
	if (c->kept && ct_chain_write(c, env, e))
		return -1;
	for (size_t i = 0; i < c->n; i++)
		if (c->kept ? run_step(c, i, env, e) : start(c, i, false, env, e))
			return -1;
	if (c->left_out)
		ct_log(env, CT_INFO, "%zu of %zu steps were done", c->left_out, c->n);
	return 0;
}
