/* ct-report: one page to look at what became of a CT, and at what in it not to trust. */
#include "config.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "tools/lib/installed.h"
#include "tools/page.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FORM "report.html"

struct params {
	const char *lr, *hr, *out, *std, *truth, *log;
};

static const struct params defaults = {0};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, lr, CT_READS, "LR", "the low-resolution CT, NIfTI, or -"),
	CT_ARG(struct params, hr, CT_READS, "HR", "what was made of it, NIfTI, or -"),
	CT_ARG_OUT(struct params, out, CT_WRITES, "OUT", CT_ENDS_PAGE, "HTML to write, or -"),
	CT_INPUT(struct params, std, 0, "std", "FILE",
		"the error that is expected at each voxel of HR, in HU, as ct-restore --std writes it"),
	CT_INPUT(struct params, truth, 0, "truth", "FILE",
		"the CT that HR should be, on the same grid: the page shows the error too"),
	CT_INPUT(struct params, log, 0, "log", "FILE",
		"text: what the commands that made HR said and took, as CTSR_LOG of ct-pipeline(7) "
		"collects it; its warnings are shown first"),
	CT_OPT_END,
};

struct job {
	const struct params *p;
	const struct ct_env *env;
	struct page page;
	char *form, *log;
};

/* A text file, ended by a zero. */
static int read_text(char **to, const char *path, struct ct_err *e)
{
	unsigned char *data;
	size_t n;

	if (ct_slurp(path, &data, &n, e))
		return -1;
	*to = strndup((const char *)data, n);
	free(data);
	return *to ? 0 : ct_fail(e, CT_ENOMEM, "no memory");
}

/* Where a folder ends that the n characters at s, of a message, begin with: behind the last slash,
 * if the first word has one, as a name may hold blanks; else of a word that begins at the root or
 * at ".", or whose last part has a dot. */
static size_t folder_of(const char *s, size_t n, bool first)
{
	const size_t blank = strcspn(s, " ,;'\n"), word = blank < n ? blank : n;
	const char *slash = memrchr(s, '/', word);
	const bool is = slash && (first || *s == '/' || *s == '.' ||
					 memchr(slash, '.', word - (size_t)(slash - s)));

	if (is && first)
		slash = memrchr(s, '/', n);
	return is ? (size_t)(slash + 1 - s) : 0;
}

/* Names of files lose their folders, in place: they are nobody's business. */
static void forget_folders(char *text)
{
	char *to = text;
	bool first = true, word = true; /* of a part that ": " ends; of any */

	for (const char *s = text; *s;) {
		const char *end = s + strcspn(s, "\n"), *colon = strstr(s, ": ");
		const size_t n = (size_t)((colon && colon < end ? colon : end) - s);

		if (first || word)
			s += folder_of(s, n, first);
		first = *s == '\n' || (*s == ' ' && s > text && s[-1] == ':');
		word = strchr(" ,;'", *s) != NULL;
		*to++ = *s++;
	}
	*to = '\0';
}

static int read_form(char **to, struct ct_err *e)
{
	char *path;
	const int rc = ct_installed_find(&path, FORM, "/../share/ctsr", CT_DATADIR, R_OK, e);
	int done = -1;

	if (rc < 0)
		return -1;
	done = rc > 0 ? ct_fail(e, CT_EINPUT, "%s: is not there: the page is laid out by it", path)
		      : read_text(to, path, e);
	free(path);
	return done;
}

static const char *base_name(const char *path)
{
	const char *slash = strrchr(path, '/');

	return slash ? slash + 1 : path;
}

static int read_volume(struct page_volume *v, const char *path, bool hu, const struct ct_vol *grid,
	struct ct_err *e)
{
	if (!path)
		return 0;
	v->name = base_name(path);
	if ((hu ? ct_vol_read_hu(path, &v->vol, e) : ct_vol_read(path, &v->vol, e)))
		return -1;
	return ct_vol_check_finite(&v->vol, e) || (grid && ct_vol_same_grid(&v->vol, grid, e))
		       ? ct_blame(e, path)
		       : 0;
}

/* Volumes of the size of HR that are held at a time. */
static double volumes_of(const struct params *p)
{
	return 4 + (p->std != NULL) + (p->truth != NULL);
}

static int read_all(struct job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	struct page *page = &j->page;

	if (read_form(&j->form, e) || (p->log && read_text(&j->log, p->log, e)) ||
		read_volume(&page->lr, p->lr, true, NULL, e) ||
		read_volume(&page->hr, p->hr, true, NULL, e))
		return -1;
	if (j->log)
		forget_folders(j->log);
	page->log = j->log;
	return read_volume(&page->std, p->std, false, &page->hr.vol, e) ||
			       read_volume(&page->truth, p->truth, true, &page->hr.vol, e)
		       ? -1
		       : 0;
}

static int write_page(const struct job *j, struct ct_err *e)
{
	struct ct_out o = {0};
	int rc = -1;

	if (ct_out_open(&o, j->p->out, j->env, e) == 0 &&
		page_write(o.f, j->form, &j->page, j->env, e) == 0)
		rc = ct_out_commit(&o, e);
	ct_out_abandon(&o);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct job j = {.p = params, .env = env};
	int rc = -1;

	if (read_all(&j, e) == 0 && page_measure(&j.page, env, e) == 0)
		rc = write_page(&j, e);
	page_free(&j.page);
	free(j.form);
	free(j.log);
	return rc;
}

static const struct ct_tool tool = {
	.name = "ct-report",
	.brief = "Write a page to look at a refined CT, and at what in it not to trust.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_IN_HU,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
