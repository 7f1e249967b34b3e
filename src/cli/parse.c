/* parse.c: values of options that are more than a number; see cli.h. */
#include "config.h"
#include "cli/cli.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int ct_cli_numbers(const char *option, const char *s, char sep, size_t n, bool spread, double *v,
	struct ct_err *e)
{
	if (!ct_words_numbers(s, sep, n, spread, v))
		return ct_fail(e, CT_EUSAGE, "--%s: '%s' is not %zu number%s%s", option, s, n,
			n == 1 ? "" : "s", spread && n > 1 ? ", or one for all" : "");
	return 0;
}

int ct_cli_within(const char *option, const char *s, size_t n, bool spread, double lo, double hi,
	double *v, struct ct_err *e)
{
	if (ct_cli_numbers(option, s, ',', n, spread, v, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		if (!(v[i] >= lo && v[i] <= hi))
			return ct_fail(
				e, CT_EUSAGE, "--%s: %g is outside [%g, %g]", option, v[i], lo, hi);
	return 0;
}

int ct_cli_dims(const char *option, const char *s, size_t n, size_t *v, struct ct_err *e)
{
	double x[4];

	if (n > 4 || ct_cli_numbers(option, s, 'x', n, false, x, e))
		return -1;
	for (size_t i = 0; i < n; i++) {
		if (!(x[i] >= 1 && x[i] <= 1e6) || x[i] != floor(x[i]))
			return ct_fail(e, CT_EUSAGE, "--%s: '%s' is not a size", option, s);
		v[i] = (size_t)x[i];
	}
	return 0;
}

int ct_cli_range(const char *option, const char *s, double v[2], struct ct_err *e)
{
	if (ct_cli_numbers(option, s, ':', 2, false, v, e))
		return -1;
	if (!(v[0] < v[1]))
		return ct_fail(e, CT_EUSAGE, "--%s: '%s' is empty", option, s);
	return 0;
}

int ct_cli_memory(double *bytes, const char *text, struct ct_err *e)
{
	static const char units[] = "KMGT";
	const size_t number = text ? strspn(text, "0123456789.") : 0;
	const char *unit = text && text[number] ? strchr(units, text[number]) : NULL;
	char *end;

	*bytes = 0;
	if (!text)
		return 0;
	*bytes = strtod(text, &end);
	if (number == 0 || end != text + number || !unit || text[number + 1])
		return ct_fail(
			e, CT_EUSAGE, "--memory: '%.80s' is no size such as 600M or 2G", text);
	*bytes = ldexp(*bytes, 10 * (int)(unit - units + 1));
	return *bytes > 0 && *bytes < 0x1p50
		       ? 0
		       : ct_fail(e, CT_EUSAGE, "--memory: %.80s is no size of a memory", text);
}
