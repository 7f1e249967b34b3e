/* words.c: see words.h. */
#include "config.h"
#include "core/words.h"

#include <string.h>

int ct_words_find(const char *words, const char *word)
{
	const size_t len = strlen(word);

	for (int i = 0; *words; i++) {
		size_t n = strcspn(words, "|");

		if (n == len && memcmp(words, word, n) == 0)
			return i;
		words += n + (words[n] == '|');
	}
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
