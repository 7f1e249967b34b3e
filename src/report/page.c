/* page.c: the page of ct-report, laid out; see page.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/text.h"
#include "report/page.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

/* Text as HTML shows it: nothing in it is markup, and what is no UTF-8 is U+FFFD. */
static void put_text(FILE *f, const char *s)
{
	for (size_t n; *s; s += n ? n : 1) {
		n = ct_text_character(s);
		if (n == 0 || ((unsigned char)*s < ' ' && *s != '\n' && *s != '\t') || *s == 127)
			fputs("\xef\xbf\xbd", f);
		else if (strchr("<>&\"'", *s))
			fprintf(f, "&#%d;", *s);
		else
			fwrite(s, 1, n, f);
	}
}

void ct_page_write_words(FILE *f, const char *fmt, ...)
{
	char text[1000];
	va_list ap;

	va_start(ap, fmt);
	vsnprintf(text, sizeof text, fmt, ap);
	va_end(ap);
	put_text(f, text);
}

/* Where a folder ends that the n characters at s, of a message, begin with: behind the last slash,
 * if the first word has one, as a name may hold blanks; else of a word that begins at the root or
 * at ".", or whose last part has a dot. */
static size_t folder_of(const char *s, size_t n, bool first)
{
	size_t word = strcspn(s, " ,;'\n");
	const char *slash;
	bool is;

	while (n > 0 && s[n - 1] == '/')
		n--; /* of a folder its own name stays */
	word = word < n ? word : n;
	while (word > 0 && s[word - 1] == '/')
		word--;
	slash = memrchr(s, '/', word);
	is = slash &&
	     (first || *s == '/' || *s == '.' || memchr(slash, '.', word - (size_t)(slash - s)));

	if (is && first)
		slash = memrchr(s, '/', n);
	return is ? (size_t)(slash + 1 - s) : 0;
}

void ct_page_forget_folders(char *text)
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

static void put_title(FILE *f, const struct ct_page *p)
{
	fputs("<title>", f);
	ct_page_write_words(f, "%s: report", p->hr.name);
	fputs("</title>\n", f);
}

/* "128 x 128 x 128 voxels of 1.5 x 1.5 x 1.5 mm". */
static void put_grid(FILE *f, const struct ct_vol *v)
{
	double mm[3];

	ct_vol_spacing(v, mm);
	ct_page_write_words(f,
		"%zu \u00d7 %zu \u00d7 %zu voxels of %.4g \u00d7 %.4g \u00d7 %.4g mm", v->n[0],
		v->n[1], v->n[2], mm[0], mm[1], mm[2]);
}

static void put_head(FILE *f, const struct ct_page *p)
{
	fputs("<h1>", f);
	put_text(f, p->hr.name);
	fputs("</h1>\n<p class=\"sub\">", f);
	put_grid(f, &p->hr.vol);
	ct_page_write_words(f, ", %g \u00d7 %g \u00d7 %g times as many as ", p->by.factor[0],
		p->by.factor[1], p->by.factor[2]);
	ct_page_write_words(f, "%s: ", p->lr.name);
	put_grid(f, &p->lr.vol);
	fputs(".</p>\n<p class=\"sub\">Before is the scan by cubic interpolation, after is the result",
		f);
	if (p->truth.name)
		ct_page_write_words(f, "; the error is that to %s", p->truth.name);
	fputs(".</p>\n", f);
}

static void put_warnings(FILE *f, const struct ct_page *p)
{
	if (p->warnings == 0) {
		fputs("<section id=\"warnings\" class=\"card fine\"><h2>No warning</h2>\n<p>It agrees "
		      "with the scan, which is not noisy, and little of it is uncertain. What is finer "
		      "than the scan is an expectation all the same.</p></section>\n",
			f);
		return;
	}
	fputs("<section id=\"warnings\" class=\"card warn\"><h2>What not to trust</h2>\n<ul>\n", f);
	for (size_t i = 0; i < p->warnings; i++) {
		fputs("<li>", f);
		put_text(f, p->warning[i]);
		fputs("</li>\n", f);
	}
	fputs("</ul></section>\n", f);
}

/* What ran: the history of the result, and what the commands said. */
static void put_ran(FILE *f, const struct ct_page *p)
{
	const char *history = ct_meta_get(&p->hr.vol.meta, CT_META_HISTORY);

	fputs("<section id=\"ran\" class=\"card\"><h2>What ran</h2>\n", f);
	if (history) {
		fputs("<pre>", f);
		put_text(f, history);
		fputs("</pre>\n", f);
	}
	if (p->log && *p->log) {
		fputs("<h2>Log, time and memory</h2>\n<pre>", f);
		put_text(f, p->log);
		fputs("</pre>\n", f);
	}
	fputs("</section>\n", f);
}

static void put_foot(FILE *f, const struct ct_page *p)
{
	(void)p;
	fputs("Made by ctsr " PACKAGE_VERSION
	      ". For research, not for diagnosis. This file holds the name of a patient only if a "
	      "file name has it, and loads nothing from the network.\n",
		f);
}

/* One part, by its word. */
static int put_part(FILE *f, const char *word, size_t n, const struct ct_page *p,
	const struct ct_env *env, struct ct_err *e)
{
	static const struct {
		const char *word;
		void (*put)(FILE *f, const struct ct_page *p);
	} parts[] = {{"TITLE", put_title}, {"HEAD", put_head}, {"WARNINGS", put_warnings},
		{"CARDS", ct_page_write_cards}, {"RAN", put_ran}, {"FOOT", put_foot},
		{"META", ct_page_write_meta}};

	for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
		if (strlen(parts[i].word) == n && memcmp(parts[i].word, word, n) == 0) {
			parts[i].put(f, p);
			return 0;
		}
	if (n == strlen("PICTURES") && memcmp(word, "PICTURES", n) == 0)
		return ct_page_write_pictures(f, p, env, e);
	return ct_fail(e, CT_EINPUT, "has a part @%.*s@ that is not known", (int)n, word);
}

int ct_page_write(FILE *f, const char *form, const struct ct_page *p, const struct ct_env *env,
	struct ct_err *e)
{
	for (const char *s = form; *s;) {
		const size_t n = strcspn(s, "\n"), line = n + (s[n] == '\n');

		if (n > 2 && s[0] == '@' && s[n - 1] == '@') {
			if (put_part(f, s + 1, n - 2, p, env, e))
				return -1;
		} else
			fwrite(s, 1, line, f);
		s += line;
	}
	return 0;
}
