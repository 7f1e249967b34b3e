/* words.h: an enum and its words in one list, so that neither can drift from the other.
 *
 *   #define CT_BEAM_LIST(X) X(CT_CONE, "cone") X(CT_PARALLEL, "parallel")
 *   enum ct_beam { CT_BEAM_LIST(CT_WORD_VALUE) };
 *
 * CT_WORDS(CT_BEAM_LIST) is the constant "cone|parallel", for a row of an option table (cli.h) and
 * for ct_words_find; CT_WORD(CT_BEAM_LIST, b) the word of the value b. In prose: "one of"
 * CT_BEAM_LIST(CT_WORD_SPACE). The values of a list count from 0.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_WORDS_H
#define CT_CORE_WORDS_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

#define CT_WORD_VALUE(value, word) value,
#define CT_WORD_TEXT(value, word) word,
#define CT_WORD_BAR(value, word) "|" word
#define CT_WORD_SPACE(value, word) " " word

#define CT_WORDS(list) (&list(CT_WORD_BAR)[1])
/* With the words of a second list behind those of the first. */
#define CT_WORDS_TWO(list, more) (&list(CT_WORD_BAR) more(CT_WORD_BAR)[1])
#define CT_BIT(value) (1u << (value)) /* of a set of words */
#define CT_WORD(list, value) (((const char *const[]){list(CT_WORD_TEXT)})[value])

/* The word at this place of "a|b|c", from 0, and its length; NULL if there is none. */
const char *ct_words_at(const char *words, int place, size_t *n);
/* Place of `word` in "a|b|c", from 0, or -1. */
int ct_words_find(const char *words, const char *word);
/* The nearest of some words to one that is none of them: by at most two letters that are changed,
 * added, left out or exchanged with their neighbour, in any case; the first of several. Zeroes but
 * for `word` are no guess. */
struct ct_words_guess {
	const char *word; /* n letters */
	size_t n;
	const char *near; /* NULL if there is none */
	size_t length, apart;
};
enum { CT_WORDS_HINT = 100 };
void ct_words_guess(struct ct_words_guess *g, const char *word, size_t n);
/* "; did you mean PREFIX and the guess?", or nothing. */
const char *ct_words_hint(
	char out[CT_WORDS_HINT], const struct ct_words_guess *g, const char *prefix);
/* The same of "a|b|c". */
const char *ct_words_hint_of(char out[CT_WORDS_HINT], const char *words, const char *word);
/* *place <- that; CT_EINPUT if `what` is none of them. */
int ct_words_take(
	int *place, const char *words, const char *what, const char *word, struct ct_err *e);
/* v <- n finite numbers of "a,b,c", with `between` for the comma, or one number that stands for all
 * if `spread`. Is the text that and no more? */
bool ct_words_numbers(const char *text, char between, size_t n, bool spread, double *v);

#endif
