/* ctsr-call.c: the environment of a call, and errors. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "core/simd.h"
#include "ctsr/ctsr-impl.h"
#include "formats/ends.h"

#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Static_assert((int)CTSR_USAGE == CT_EUSAGE && (int)CTSR_INPUT == CT_EINPUT &&
		       (int)CTSR_OUTPUT == CT_EOUTPUT && (int)CTSR_GEOMETRY == CT_EGEOM &&
		       (int)CTSR_NUMBER == CT_ENUMERIC && (int)CTSR_MEMORY == CT_ENOMEM &&
		       (int)CTSR_CANCELLED == CT_ESTOP && (int)CTSR_FAILED == CT_EFAIL,
	"the codes are the same");

const char *ctsr_version(void)
{
	return PACKAGE_VERSION;
}

int ctsr_call_given(struct ctsr_call *k, bool given)
{
	return given ? 0 : ct_fail(&k->err, CT_EUSAGE, "%s: an argument is NULL", k->name);
}

int ctsr_call_named(struct ctsr_call *k, const char *path, const char *ends)
{
	char text[60];

	if (!ct_ends_any(path) || ct_ends_match(path, ends))
		return 0;
	ct_ends_text(text, sizeof text, ends);
	return ct_fail(&k->err, CT_EUSAGE, "%s: %s writes %s", path, k->name, text);
}

static void *const none = NULL;

int ctsr_call_makes(struct ctsr_call *k, void *at, size_t size, void (*drop)(void *object))
{
	if (ctsr_call_given(k, at))
		return -1;
	if (k->makes && k->made[0].at == at)
		return ct_fail(&k->err, CT_EUSAGE, "%s: two results in one place", k->name);
	memcpy(at, &none, sizeof none);
	k->made[k->makes].at = at;
	k->made[k->makes++].drop = drop;
	return ct_alloc0(at, 1, size, &k->err);
}

void ctsr_give_defaults(void *theirs, size_t size, const void *defaults, size_t known)
{
	if (theirs)
		memcpy(theirs, defaults, size < known ? size : known);
}

int ctsr_take_options(void *mine, size_t size, const void *theirs, struct ct_err *e)
{
	size_t n;

	if (!theirs)
		return 0;
	memcpy(&n, theirs, sizeof n);
	if (n < sizeof n || n > size)
		return ct_fail(e, CT_EUSAGE,
			"options of %zu bytes, at most %zu are known: set their size to sizeof", n,
			size);
	memcpy(mine, theirs, n);
	memcpy(mine, &size, sizeof size);
	return 0;
}

int ctsr_take_window(struct ct_window_rule *r, const double asked[2], struct ct_err *e)
{
	*r = (struct ct_window_rule){0};
	if (isnan(asked[0]) && isnan(asked[1]))
		return 0;
	if (!(asked[0] < asked[1]))
		return ct_fail(e, CT_EUSAGE, "the window %g to %g is none", asked[0], asked[1]);
	memcpy(r->range, asked, sizeof r->range);
	snprintf(r->words, sizeof r->words, "window %.17g:%.17g", asked[0], asked[1]);
	return 0;
}

int ctsr_check_report(const void *theirs, struct ct_err *e)
{
	size_t n = sizeof n;

	if (theirs)
		memcpy(&n, theirs, sizeof n);
	return n >= sizeof n && n <= 1 << 16
		       ? 0
		       : ct_fail(e, CT_EUSAGE, "a report of %zu bytes: set its size to sizeof", n);
}

int ctsr_give_report(void *theirs, void *mine, size_t size, struct ct_err *e)
{
	size_t n;

	if (!theirs)
		return 0;
	if (ctsr_check_report(theirs, e))
		return -1;
	memcpy(&n, theirs, sizeof n);
	memcpy(mine, &n, sizeof n);
	memcpy(theirs, mine, n < size ? n : size);
	return 0;
}

static void report(
	const struct ct_env *env, const char *what, size_t done, size_t total, size_t likely)
{
	struct ctsr_call *k = env->ctx;
	const locale_t ours = uselocale(k->theirs);

	(void)likely;
	if (k->c.progress && k->c.progress(k->c.user, what, done, total))
		__atomic_store_n(&k->stop, 1, __ATOMIC_RELAXED);
	uselocale(ours);
}

static void tell(const struct ct_env *env, enum ct_level level, const char *text)
{
	const struct ctsr_call *k = env->ctx;
	char *mine = k->c.log ? strdup(text) : NULL;
	locale_t ours;

	if (!mine) /* none asks for it, or no memory */
		return;
	ctsr_name_members(mine);
	ours = uselocale(k->theirs);
	k->c.log(k->c.user, level == CT_TOLD ? CT_INFO : (int)level, mine);
	uselocale(ours);
	free(mine);
}

static size_t threads_of(const ctsr_context *c)
{
	cpu_set_t set;

	if (c->threads)
		return c->threads;
	return sched_getaffinity(0, sizeof set, &set) == 0 ? (size_t)CPU_COUNT(&set) : 1;
}

/* Behind the message, the words whose place is in a set. */
static void name_words(struct ct_err *e, const char *words, unsigned set)
{
	const char *word, *between = "";
	size_t n;

	for (int k = 0; (word = ct_words_at(words, k, &n)); k++)
		if (set & CT_BIT(k)) {
			const size_t at = strlen(e->msg);

			snprintf(e->msg + at, sizeof e->msg - at, "%s%.*s", between, (int)n, word);
			between = "|";
		}
}

int ctsr_check_members(const struct ctsr_member *m, const char *what, const char *words, int place,
	struct ct_err *e)
{
	int with = 0, without = 0;
	size_t n;

	while (m->name && (!m->given || m->with & CT_BIT(place)))
		m++;
	if (!m->name)
		return 0;
	while (ct_words_at(words, with + without, &n))
		*(m->with & CT_BIT(with + without) ? &with : &without) += 1;
	ct_fail(e, CT_EUSAGE, "%s: %s %s=", m->name, with > without ? "not with" : "needs", what);
	name_words(e, words, with > without ? ~m->with : m->with);
	return -1;
}

int ctsr_take_word(
	int *place, const char *words, const char *what, const char *word, struct ct_err *e)
{
	if (!word || ct_words_take(place, words, what, word, e) == 0)
		return 0;
	e->code = CT_EUSAGE;
	return -1;
}

/* Is it the option of a command that is named before it, as in "ct-convert --reorient"? */
static bool is_of_command(const char *text, const char *option)
{
	const char *word = option;

	while (word > text && word[-1] == ' ')
		word--;
	while (word > text && word[-1] != ' ')
		word--;
	return strncmp(word, "ct-", 3) == 0;
}

/* The option after "--" at `in`: its length, 0 if there is none, and the member of that meaning. */
static size_t option_at(const char *in, const char **member, size_t *length)
{
	static const char *const other[][2] = {{"grid", "like"}, {"class", "label"},
		{"quantity density", "density"}, {"expert t-start", "start"},
		{"expert operator", "pixel"}};
	static const char after[] = " ,:;)=";
	size_t n;

	if (strncmp(in, "--", 2) != 0)
		return 0;
	in += 2;
	for (size_t i = 0; i < sizeof other / sizeof *other; i++) {
		n = strlen(other[i][0]);
		if (strncmp(in, other[i][0], n) == 0 && strchr(after, in[n])) {
			*member = other[i][1];
			*length = strlen(*member);
			return 2 + n;
		}
	}
	n = strspn(in, "abcdefghijklmnopqrstuvwxyz-");
	*member = in;
	*length = n;
	return n && strchr(after, in[n]) ? 2 + n : 0;
}

void ctsr_name_members(char *text)
{
	const char *in = text, *member;
	char *out = text;
	size_t n, length;

	while (*in) {
		const bool begins = out == text || strchr(" (", out[-1]);

		n = begins ? option_at(in, &member, &length) : 0;
		if (!n || is_of_command(text, out)) {
			*out++ = *in++;
			continue;
		}
		for (size_t i = 0; i < length; i++)
			*out++ = member[i] == '-' ? '_' : member[i];
		in += n;
	}
	*out = '\0';
}

int ctsr_call_begin(struct ctsr_call *k, bool given, const ctsr_context *c)
{
	if (ctsr_call_given(k, given))
		return -1;
	if (ctsr_take_options(&k->c, sizeof k->c, c, &k->err))
		return -1;
	if (k->c.threads > 4096)
		return ct_fail(&k->err, CT_EUSAGE, "%u threads, at most 4096", k->c.threads);
	if (!ct_simd_level())
		return ct_fail(&k->err, CT_EFAIL,
			"this processor is older than x86-64-v2: it has no SSE4.2 or no POPCNT");
	k->files.force = k->c.overwrite != 0;
	k->env = (struct ct_env){.seed = k->c.seed,
		.verbose = k->c.verbose,
		.files = &k->files,
		.history = k->c.history,
		.stop = &k->stop,
		.log = tell,
		.progress = report,
		.ctx = k};
	if (ct_par_alloc(&k->env.par, threads_of(&k->c), &k->err))
		return -1;
	ct_par_heed(k->env.par, &k->stop);
	return 0;
}

int ctsr_call_end(struct ctsr_call *k, int rc, ctsr_error *e)
{
	ct_par_free(k->env.par);
	if (k->stop)
		rc = ct_fail(&k->err, CT_ESTOP, "cancelled by the progress callback");
	uselocale(k->theirs);
	if (!rc)
		return 0;
	for (size_t i = 0; i < k->makes; i++) {
		void *object;

		memcpy(&object, k->made[i].at, sizeof object);
		k->made[i].drop(object);
		memcpy(k->made[i].at, &none, sizeof none);
	}
	if (e) {
		e->code = (int)k->err.code;
		ctsr_name_members(k->err.msg);
		snprintf(e->message, sizeof e->message, "%s", k->err.msg);
	}
	return -1;
}

int ctsr_note_history(
	struct ctsr_call *k, struct ct_meta *m, size_t n, const struct ct_meta *const *in)
{
	if (k->env.history)
		return ct_meta_step(m, &k->env, n, in, &k->err);
	ct_meta_drop(m, CT_META_INPUT);
	return 0;
}
