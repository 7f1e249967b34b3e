/* census.c: see census.h. */
#include "config.h"
#include "series/census.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

void ct_census_free(struct ct_census *c)
{
	for (size_t i = 0; i < c->files; i++)
		free(c->file[i].path);
	for (size_t i = 0; i < c->slices; i++)
		free(c->slice[i].path);
	free(c->file);
	free(c->slice);
	if (c->store)
		close(c->store - 1);
	memset(c, 0, sizeof *c);
}

/* What stands behind the last dot of the name; "" if nothing does, or a number, as in names that
 * are UIDs. */
static const char *ending(const char *path)
{
	const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');

	if (!dot || dot == path || dot[-1] == '/' ||
		strspn(dot + 1, "0123456789") == strlen(dot + 1))
		return "";
	return dot + 1;
}

/* What macOS keeps beside a file on a disk of another system. */
static bool is_of_macos(const char *path)
{
	return strncmp(basename(path), "._", 2) == 0;
}

bool ct_file_may_belong(const struct ct_file *f, const struct ct_slice *s)
{
	const char *end = ending(f->path);
	const bool alike = strcasecmp(end, ending(s->path)) == 0;

	if (f->state == CT_FILE_UNREADABLE && f->path[0] && f->path[strlen(f->path) - 1] == '/')
		return true; /* a folder that is shut */
	if (f->series[0])
		return strcmp(f->series, s->series) == 0 &&
		       (f->state == CT_FILE_DAMAGED || f->state == CT_FILE_UNREADABLE);
	return f->state == CT_FILE_FOREIGN
		       ? alike && *end && !is_of_macos(f->path)
		       : alike && f->state != CT_FILE_PICTURE && f->state != CT_FILE_BARE;
}
