/* words.c: see words.h. */
#include "config.h"
#include "core/number.h"
#include "core/words.h"

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

int ct_words_take(
	int *place, const char *words, const char *what, const char *word, struct ct_err *e)
{
	*place = ct_words_find(words, word);
	return *place >= 0
		       ? 0
		       : ct_fail(e, CT_EINPUT, "%s '%.40s' is not one of %s", what, word, words);
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
