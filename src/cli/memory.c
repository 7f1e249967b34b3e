/* memory.c: see memory.h. */
#include "config.h"
#include "cli/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int ct_memory_bytes(double *bytes, const char *text, struct ct_err *e)
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

double ct_memory_held(void)
{
	FILE *f = fopen("/proc/self/status", "r");
	double kib = 0;
	char line[200];

	while (f && fgets(line, sizeof line, f))
		if (strncmp(line, "VmHWM:", 6) == 0)
			kib = strtod(line + 6, NULL);
	if (f)
		fclose(f);
	return 1024 * kib;
}
