/* number.h: numbers in text, read whole or not at all, and the same in every locale.
 *
 * A number is decimal: a sign, digits with at most one point, an exponent. 1,5 and 1.5. and 0x10
 * are none, nor are nan and inf, nor what is too large for a double. The only reader: none but
 * number.c calls strtod or its kin.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_NUMBER_H
#define CT_CORE_NUMBER_H
#include <locale.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif

/* The number that the text begins with, and *end behind it; NaN, and *end the text, if it begins
 * with none. For lists, and for numbers with a unit. */
double ct_number_begin(const char *text, const char **end);
/* Is the text one number and no more, but for blanks at its ends? Then *x is that. */
bool ct_number_read(double *x, const char *text);
/* The same of n bytes, which may end in zeros; a zero before a digit is none of them. */
bool ct_number_field(double *x, const char *text, size_t n);
/* Is the text digits and no more (errno stays as it was: formats/format.c), after a sign if lo < 0,
 * of a number from lo to hi? */
bool ct_number_whole(long long *x, const char *text, long long lo, long long hi);
/* The same, up to what 64 bits hold. */
bool ct_number_u64(uint64_t *x, const char *text);
/* A number that "%a" printed, with a blank behind it or the end; false if it is not finite. */
bool ct_number_exact(double *x, const char *text, const char **end);

/* From here on this thread reads and prints numbers with a point, whatever its program chose; what
 * it had before is returned, for uselocale. */
locale_t ct_number_point(void);

#ifdef __cplusplus
}
#endif
#endif
