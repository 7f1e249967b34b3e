/* text.c: see text.h. */
#include "config.h"
#include "formats/text.h"

#include <stdlib.h>
#include <string.h>

json_t *ct_text_json(const char *s)
{
	json_t *v = json_string(s);
	char *plain;

	if (v || !(plain = strdup(s)))
		return v;
	for (char *p = plain; *p; p++)
		if ((unsigned char)*p > 0x7f)
			*p = '?';
	v = json_string(plain);
	free(plain);
	return v;
}
