/* words.c: see words.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "core/words.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

const char *ct_words_at(const char *words, int place, size_t *n)
{
	for (; *words; words += *n + (words[*n] == '|')) {
		*n = strcspn(words, "|");
		if (place-- == 0)
			return words;
	}
	return NULL;
}

int ct_words_find(const char *words, const char *word)
{
	const size_t len = strlen(word);
	const char *at;
	size_t n;

	for (int i = 0; (at = ct_words_at(words, i, &n)); i++)
		if (n == len && memcmp(at, word, n) == 0)
			return i;
	return -1;
}

static size_t least(size_t a, size_t b)
{
	return a < b ? a : b;
}

static bool same(const char *a, const char *b)
{
	return tolower((unsigned char)*a) == tolower((unsigned char)*b);
}

/* How many letters to change, add, leave out or exchange; a and b are no longer than LONGEST. */
enum { LONGEST = 32 };
static size_t apart(const char *a, size_t n, const char *b, size_t m)
{
	size_t row[3][LONGEST + 1]; /* of the letters of a before, of one less, of two less */

	for (size_t k = 0; k <= m; k++)
		row[0][k] = k;
	for (size_t i = 0; i < n; i++) {
		memmove(row[1], row[0], 2 * sizeof row[0]);
		row[0][0] = i + 1;
		for (size_t k = 0; k < m; k++) {
			size_t here = least(row[1][k] + !same(a + i, b + k),
				least(row[0][k], row[1][k + 1]) + 1);

			if (i > 0 && k > 0 && same(a + i, b + k - 1) && same(a + i - 1, b + k))
				here = least(here, row[2][k - 1] + 1);
			row[0][k + 1] = here;
		}
	}
	return row[0][m];
}

void ct_words_guess(struct ct_words_guess *g, const char *word, size_t n)
{
	const size_t most = n > 3 && g->n > 3 ? 2 : 1;
	size_t by;

	if (n > LONGEST || g->n > LONGEST || n < 2 || g->n == 0)
		return;
	by = apart(g->word, g->n, word, n);
	if (by > most || (g->near && by >= g->apart))
		return;
	g->near = word;
	g->length = n;
	g->apart = by;
}

const char *ct_words_hint(
	char out[CT_WORDS_HINT], const struct ct_words_guess *g, const char *prefix)
{
	*out = '\0';
	if (g->near)
		snprintf(out, CT_WORDS_HINT, "; did you mean %s%.*s?", prefix, (int)g->length,
			g->near);
	return out;
}

const char *ct_words_hint_of(char out[CT_WORDS_HINT], const char *words, const char *word)
{
	struct ct_words_guess g = {.word = word, .n = strlen(word)};
	const char *at;
	size_t n;

	for (int i = 0; (at = ct_words_at(words, i, &n)); i++)
		ct_words_guess(&g, at, n);
	return ct_words_hint(out, &g, "");
}

int ct_words_take(
	int *place, const char *words, const char *what, const char *word, struct ct_err *e)
{
	char hint[CT_WORDS_HINT];

	*place = ct_words_find(words, word);
	return *place >= 0 ? 0
			   : ct_fail(e, CT_EINPUT, "%s '%.40s' is not one of %s%s", what, word,
				     words, ct_words_hint_of(hint, words, word));
}

bool ct_words_numbers(const char *text, char between, size_t n, bool spread, double *v)
{
	const char *at = text; /* behind the last number */
	size_t got = 0;

	for (const char *end; got < n && (got == 0 || *at == between); got++, at = end) {
		const char *from = at + (got > 0);

		from += strspn(from, " ");
		v[got] = ct_number_begin(from, &end);
		if (end == from)
			return false;
	}
	if (got == 1 && spread)
		for (; got < n; got++)
			v[got] = v[0];
	return got == n && !*at;
}
