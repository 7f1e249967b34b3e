/* hu-window.c: see hu-window.h. */
#include "config.h"
#include "tools/hu-window.h"
#include "cli/cli.h"

#include <ctype.h>
#include <string.h>

#define ROW(name, width, level) {name, {(level) - (width) / 2.0, (level) + (width) / 2.0}},
static const struct {
	const char *name;
	double window[2];
} windows[] = {HU_WINDOW_LIST(ROW)};

int hu_window_parse(
	double window[2], bool *hu, const char *option, const char *text, struct ct_err *e)
{
	*hu = isalpha((unsigned char)*text);
	if (!*hu)
		return ct_cli_range(option, text, window, e);
	for (size_t i = 0; i < sizeof windows / sizeof *windows; i++)
		if (strcmp(text, windows[i].name) == 0) {
			memcpy(window, windows[i].window, sizeof windows[i].window);
			return 0;
		}
	return ct_fail(e, CT_EUSAGE,
		"--%s: '%s' is neither LO:HI nor one of" HU_WINDOW_LIST(HU_WINDOW_SPACE), option,
		text);
}
