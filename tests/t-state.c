/* The state of a run: what it is of, who may go on from it, what becomes of it at the end.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/resume.h"
#include "core/env.h"
#include "formats/format.h"
#include "capture.h"
#include "scratch.h"

#include <glob.h>
#include <sys/resource.h>
#include <sys/wait.h>

#define COLOURS(X) X(RED, "red") X(GREEN, "green") X(BLUE, "blue")
enum colour { COLOURS(CT_WORD_VALUE) };

struct params {
	const char *in, *mask, *name, *out;
	int n, word;
	double x;
	bool flag, idle, resume;
};
#define P struct params
#define CT_PARAMS P
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN", ""),
	CT_INPUT(mask, 0, "mask", "FILE", ""),
	CT_TEXT(name, 0, "name", "S", ""),
	CT_OPT(n, 'n', "n", "N", 0, 9, ""),
	CT_OPT(x, 'x', "x", "X", 0, 0, ""),
	CT_CHOICE(word, 0, "word", CT_WORDS(COLOURS), ""),
	CT_FLAG(flag, 0, "flag", ""),
	CT_FLAG(idle, 0, "idle", "", CT_IDLE),
	CT_FLAG(resume, 0, "resume", "", CT_IDLE),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_STACK, ""),
	CT_OPT_END,
};
static const P params = {.in = "in", .out = "o", .n = 3, .word = 1, .x = 0.1};
static struct ct_io_rule files;
static struct ct_command command;
static struct ct_env env = {.tool = "ct-t", .files = &files, .command = &command};
static struct ct_err e;

static int pack(struct ct_tensors *t, const void *work, struct ct_err *why)
{
	struct ct_tensor *x;
	const size_t one = 1;

	if (ct_tensors_add(t, "x", 1, &one, &x, why))
		return -1;
	x->data[0] = *(const float *)work;
	return 0;
}

static int pack_fails(struct ct_tensors *t, const void *work, struct ct_err *why)
{
	(void)t;
	(void)work;
	return ct_fail(why, CT_ENUMERIC, "no number");
}

/* The metadata of what a run reads. */
static struct ct_meta meta(const char *key, const char *value)
{
	struct ct_meta m = {0};

	must(ct_meta_set(&m, "kind", "k", &err));
	if (key)
		must(ct_meta_set(&m, key, value, &err));
	return m;
}

/* Open the state of this run, named as if it reads *in and has no mask. */
static int open_run(struct ct_resume *r, const P *p, bool wanted, const struct ct_meta *in)
{
	e = (struct ct_err){0};
	return ct_resume_open(r, "o", wanted, opts, p, &env, &e) ||
	       ct_resume_input(r, "IN", in, &e) || ct_resume_input(r, "--mask", NULL, &e);
}

/* How many tensors there are. */
static int count(void *n, const struct ct_tensors *state, struct ct_err *why)
{
	(void)why;
	*(size_t *)n = state->n;
	return 0;
}

static void leave(const P *p, const struct ct_meta *in)
{
	const float work = 42;
	struct ct_resume r;

	remove("o.state");
	if (open_run(&r, p, false, in) || ct_resume_save(&r, pack, &work, &e))
		exit(99);
	ct_resume_close(&r);
}

static void leave_state(const struct ct_meta *in)
{
	leave(&params, in);
}

/* Does a run with these go on from what is there? Else why not. */
static bool goes_on(const P *p, const struct ct_meta *in)
{
	struct ct_resume r;
	size_t n = 0;
	bool goes = open_run(&r, p, true, in) == 0 && ct_resume_load(&r, count, &n, &e) == 0 &&
		    n == 1 && r.own;

	ct_resume_close(&r);
	return goes;
}

static bool refused(P p, const struct ct_meta *in, const char *why)
{
	return !goes_on(&p, in) && e.code == CT_EINPUT && is_text(e.msg, why);
}
#define OTHER(change, why)                                                                         \
	do {                                                                                       \
		P is = params;                                                                     \
		change;                                                                            \
		OK(refused(is, NULL, "o.state: is of a run where " why), "another: %s", #change);  \
	} while (0)

static void test_options(void)
{
	P p = params;
	char name[100];

	leave_state(NULL);
	OK(rights_of("o.state") == 0600, "a state is its owner's");
	OK(goes_on(&p, NULL), "a run goes on from its own");
	p.idle = true;
	p.in = p.mask = "other";
	OK(goes_on(&p, NULL), "what decides nothing may differ");
	OTHER(is.n = 4, "--n was '3', not '4'");
	OTHER(is.x = 0.1 + 1e-16, "--x was '0.10000000000000001', not '0.1000000000000001'");
	OTHER(is.word = 2, "--word was 'green', not 'blue'");
	OTHER(is.flag = true, "--flag was 'no', not 'yes'");
	OTHER(is.name = "ann", "--name was '', not 'ann'");
	env.seed = 1;
	OTHER((void)is, "--seed was '0', not '1'");
	env.seed = 0;
	env.tool = "ct-u";
	OTHER((void)is, "version was 'ct-t " PACKAGE_VERSION "', not 'ct-u " PACKAGE_VERSION "'");
	env.tool = "ct-t";
	snprintf(name, sizeof name, "%099d", 1);
	p.name = name;
	remove("o.state");
	OK(!goes_on(&p, NULL) && e.code == CT_OK, "without a state there is none to go on from");
	leave(&p, NULL);
	OK(goes_on(&p, NULL), "a long word");
	name[98] = '2';
	OK(!goes_on(&p, NULL) && e.code == CT_EINPUT, "counts to its end");
}

static void test_inputs(void)
{
	struct ct_meta one = meta(CT_META_INPUT, "a.nii xxh3:1"),
		       same = meta(CT_META_INPUT, "b c.nii xxh3:1"),
		       two = meta(CT_META_INPUT, "a.nii xxh3:2"),
		       strange = meta(CT_META_INPUT, "a.nii none:1"),
		       odd = meta(CT_META_INPUT, "nothing"), none = meta(NULL, NULL);

	leave_state(&one);
	OK(goes_on(&params, &one), "the same input");
	must(ct_meta_set(&same, CT_META_HISTORY, "h", &err) ||
		ct_meta_set(&same, "nifti.x", "n", &err));
	OK(goes_on(&params, &same), "by what it holds, not where it comes from");
	OK(refused(params, &two, "o.state: is of a run where IN held something else"), "another");
	OK(refused(params, &none, "o.state: is of a run where IN held something else"),
		"what does not say what it holds");
	OK(refused(params, NULL, "o.state: is of a run where IN held something else"), "and none");
	must(ct_meta_set(&same, "nift", "n", &err));
	OK(refused(params, &same, "o.state: is of a run where IN nift was '', not 'n'"),
		"another that says more");
	leave_state(&same);
	OK(refused(params, &one, "o.state: is of a run where IN nift was 'n', not ''"), "or less");
	leave_state(&strange);
	OK(refused(params, &two, "o.state: is of a run where IN held something else"),
		"one hash tells that it is one");
	OK(refused(params, &odd, "o.state: is of a run where IN was 'none:1', not 'not given'"),
		"two words are told");
	leave_state(&none);
	OK(refused(params, &strange, "o.state: is of a run where IN was 'not given', not 'none:1'"),
		"either way");
	for (struct ct_meta *const *m =
			(struct ct_meta *[]){&one, &same, &two, &strange, &odd, &none, NULL};
		*m; m++)
		ct_meta_free(*m);
}

/* Whose a file of that name is. */
static void test_owner(void)
{
	struct ct_resume r;
	struct ct_tensors t = {0};
	const float work = 1;
	const P over = {.in = "o.state", .out = "o"};

	leave_state(NULL);
	OK(open_run(&r, &params, false, NULL) && e.code == CT_EOUTPUT &&
			is_text(e.msg, "o.state: exists; --resume goes on from it, --force starts "
				       "anew"),
		"a state is not written over");
	ct_resume_close(&r);
	OK(!is_there("o.state.ct-locked"), "who is refused holds nothing");
	files.force = true;
	OK(open_run(&r, &params, false, NULL) == 0 && r.own && is_there("o.state.ct-locked") &&
			ct_resume_load(&r, count, NULL, &e) == 1 &&
			ct_resume_save(&r, pack, &work, &e) == 0,
		"but by force");
	ct_resume_close(&r);
	OK(is_there("o.state") && !is_there("o.state.ct-locked"), "closed, it stays");
	put_text("o.state", "text");
	OK(open_run(&r, &params, false, NULL) && e.code == CT_EOUTPUT &&
			is_text(e.msg,
				"o.state: is not the state of a run, so is not written over"),
		"what is none is not");
	ct_resume_close(&r);
	must(ct_tensors_write_private("o.state", &t, &err));
	OK(open_run(&r, &params, false, NULL) && strstr(e.msg, "is not the state of a run"),
		"nor are tensors of another kind");
	ct_resume_close(&r);
	files.force = false;
	OK(refused(params, NULL, "o.state: is not the state of a run"), "from which none goes on");
	put_text("o.state", "text");
	OK(open_run(&r, &params, false, NULL) && strstr(e.msg, "is not the state of a run"),
		"what is no state is not offered to --resume");
	ct_resume_close(&r);
	OK(!goes_on(&params, NULL) && e.code == CT_EINPUT && strncmp(e.msg, "o.state: ", 9) == 0,
		"nor from a text");
	remove("o.state");
	OK(ct_resume_open(&r, "o", false, opts, &over, &env, &e) == -1 && e.code == CT_EOUTPUT &&
			strstr(e.msg, "would be written over o.state"),
		"an input is none");
	ct_resume_close(&r);
	OK(open_run(&r, &params, true, NULL) == 0 && ct_resume_load(&r, count, NULL, &e) == 1 &&
			!r.own && ct_resume_save(&r, pack, &work, &e) == 0 && r.own,
		"what was not there is one's own when it is written");
	ct_resume_done(&r);
	ct_resume_close(&r);
	OK(!is_there("o.state"), "and goes when all is done");
}

/* A stream, and a run that only tells its cost, keep none. */
static void test_none(void)
{
	const float work = 1;
	struct ct_resume r;

	e = (struct ct_err){0};
	OK(ct_resume_open(&r, "-", true, opts, &params, &env, &e) == -1 && e.code == CT_EUSAGE,
		"a stream is not resumed");
	ct_resume_close(&r);
	for (int dry = 0; dry < 2; dry++) {
		command.dry_run = dry;
		OK(ct_resume_open(&r, dry ? "o" : "-", dry, opts, &params, &env, &e) == 0 &&
				!r.path && ct_resume_input(&r, "--mask", NULL, &e) == 0 &&
				ct_resume_load(&r, count, NULL, &e) == 1 &&
				ct_resume_save(&r, pack, &work, &e) == 0,
			"no state is kept");
		ct_fail(&e, CT_EOUTPUT, "why");
		OK(ct_resume_rescue(&r, pack, &work, &e) == -1 && is_text(e.msg, "why"),
			"nor a result");
		ct_resume_done(&r);
		ct_resume_close(&r);
		OK(!is_there("o.state") && !is_there("-.state"), "and there is none");
	}
	command.dry_run = false;
}

static bool some(const char *pattern)
{
	glob_t found;
	bool is = glob(pattern, 0, NULL, &found) == 0;

	globfree(&found);
	return is;
}

static void test_rescue(void)
{
	static const struct ct_opt none[] = {CT_OPT_END};
	const float work = 7;
	struct ct_resume r;

	setenv("TMPDIR", "tmp", 1);
	if (mkdir("tmp", 0777) || open_run(&r, &params, false, NULL))
		exit(99);
	ct_fail(&e, CT_EOUTPUT, "why");
	OK(ct_resume_rescue(&r, pack, &work, &e) == -1 && e.code == CT_EOUTPUT &&
			is_text(e.msg, "why; the result is kept: --resume writes it") &&
			is_there("o.state") && !some("tmp/*"),
		"what cannot be written is kept as the state");
	ct_fail(&e, CT_EGEOM, "why");
	OK(ct_resume_rescue(&r, pack_fails, &work, &e) == -1 && e.code == CT_EGEOM &&
			is_text(e.msg, "why") && !some("tmp/*"),
		"if it can be packed");
	r.own = false; /* another has put it there */
	OK(ct_resume_rescue(&r, pack, &work, &e) == -1 && e.code == CT_EGEOM &&
			strstr(e.msg, "why; the result is kept in tmp/kept.") == e.msg &&
			strstr(e.msg, ": moved to o.state, --resume writes it") &&
			some("tmp/kept.*.o.state"),
		"or elsewhere");
	OK(ct_resume_save(&r, pack, &work, &e) == -1 && e.code == CT_EOUTPUT &&
			strstr(e.msg, "o.state: was put there by another run meanwhile; what is "
				      "done is kept in tmp/kept.") == e.msg &&
			strstr(e.msg, ": moved to o.state, --resume goes on from it"),
		"a state of unfinished work that cannot be saved in its place is kept elsewhere");
	r.opts = none;
	OK(ct_resume_save(&r, pack, &work, &e) == -1 &&
			strstr(e.msg, ": moved to o.state, the same command goes on from it"),
		"a command without --resume names none");
	r.own = true;
	OK(ct_resume_rescue(&r, pack, &work, &e) == -1 &&
			strstr(e.msg, "; the result is kept: the same command writes it"),
		"nor does one whose result is kept in its place");
	r.own = false;
	OK(ct_resume_save(&r, pack_fails, &work, &e) == -1 && !strstr(e.msg, "kept"),
		"a state that cannot be packed is kept nowhere");
	setenv("TMPDIR", "nowhere", 1);
	OK(ct_resume_save(&r, pack, &work, &e) == -1 && !strstr(e.msg, "kept"),
		"without a folder for temporary files the first error of a state stays");
	ct_fail(&e, CT_EGEOM, "why");
	OK(ct_resume_rescue(&r, pack, &work, &e) == -1 && is_text(e.msg, "why"),
		"if there is an elsewhere");
	unsetenv("TMPDIR");
	OK(ct_resume_rescue(&r, pack, &work, &e) == -1 &&
			strstr(e.msg, "kept in /tmp/kept.") != NULL,
		"which is /tmp if nothing else is said");
	if (strstr(e.msg, "/tmp/kept.")) {
		char name[25];

		snprintf(name, sizeof name, "%.24s", strstr(e.msg, "/tmp/kept."));
		OK(remove(name) == 0, "%s", name);
	}
	ct_resume_close(&r);
	unsetenv("TMPDIR");
}

/* Wrong code, an input that is not named, is an assert. */
static void test_complete(void)
{
#ifndef NDEBUG
	int status = 0;
	pid_t pid = fork();

	if (pid == 0) {
		struct ct_resume r;
		const struct rlimit no_core = {0, 0};

		setrlimit(RLIMIT_CORE, &no_core);
		if (!freopen("/dev/null", "w", stderr) ||
			ct_resume_open(&r, "o", true, opts, &params, &env, &e))
			_exit(1);
		ct_resume_load(&r, count, NULL, &e);
		_exit(2);
	}
	waitpid(pid, &status, 0);
	OK(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT, "every input has to be named");
#endif
}

int main(void)
{
	scratch_begin();
	test_options();
	test_inputs();
	test_owner();
	test_none();
	test_rescue();
	test_complete();
	return tap_done();
}
