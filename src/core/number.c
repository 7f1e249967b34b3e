/* number.c: see number.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool is_digit(char c)
{
	return c >= '0' && c <= '9';
}

static const char *behind_digits(const char *s)
{
	while (is_digit(*s))
		s++;
	return s;
}

/* Behind the decimal number at s; s if there is none. */
static const char *behind(const char *s)
{
	const char *first = s + (*s == '+' || *s == '-');
	const char *at = behind_digits(first);
	size_t digits = (size_t)(at - first);

	if (*at == '.') {
		const char *fraction = at + 1;

		at = behind_digits(fraction);
		digits += (size_t)(at - fraction);
	}
	if (digits == 0)
		return s;
	if (*at == 'e' || *at == 'E') {
		const char *power = at + 1 + (at[1] == '+' || at[1] == '-');

		if (is_digit(*power))
			at = behind_digits(power);
	}
	return at;
}

double ct_number_begin(const char *text, const char **end)
{
	const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
	const char *stop = behind(text);
	double x = (double)NAN;
	char *got = NULL;

	if (stop != text && plain)
		x = strtod_l(text, &got, plain);
	if (plain)
		freelocale(plain);
	if (got != stop || !isfinite(x)) {
		*end = text;
		return (double)NAN;
	}
	*end = stop;
	return x;
}

static const char *behind_blanks(const char *s)
{
	return s + strspn(s, " \t");
}

bool ct_number_read(double *x, const char *text)
{
	const char *first = behind_blanks(text), *end;
	const double got = ct_number_begin(first, &end);

	if (end == first || *behind_blanks(end))
		return false;
	*x = got;
	return true;
}

bool ct_number_field(double *x, const char *text, size_t n)
{
	char whole[128];

	while (n > 0 && (text[n - 1] == '\0' || text[n - 1] == ' '))
		n--;
	if (n == 0 || n >= sizeof whole || memchr(text, '\0', n))
		return false;
	memcpy(whole, text, n);
	whole[n] = '\0';
	return ct_number_read(x, whole);
}

bool ct_number_whole(long long *x, const char *text, long long lo, long long hi)
{
	const char *first = text + (*text == '+' || (lo < 0 && *text == '-'));
	const char *stop = behind_digits(first);
	const int was = errno;
	bool fits;
	long long got;

	if (stop == first || *stop)
		return false;
	errno = 0;
	got = strtoll(text, NULL, 10);
	fits = errno == 0 && got >= lo && got <= hi;
	errno = was;
	if (!fits)
		return false;
	*x = got;
	return true;
}

bool ct_number_u64(uint64_t *x, const char *text)
{
	const int was = errno;
	unsigned long long got;
	bool fits;

	if (!is_digit(*text) || *behind_digits(text))
		return false;
	errno = 0;
	got = strtoull(text, NULL, 10);
	fits = errno == 0;
	errno = was;
	if (!fits)
		return false;
	*x = got;
	return true;
}

bool ct_number_exact(double *x, const char *text, const char **end)
{
	const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
	char *got = NULL;

	if (!plain)
		return false;
	*x = strtod_l(text, &got, plain);
	freelocale(plain);
	*end = got;
	return got != text && isfinite(*x) && (!*got || *got == ' ');
}

locale_t ct_number_point(void)
{
	const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);

	return uselocale(plain);
}
