/* seed-file.h: seeds of a fuzz target made by our own writers.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_FUZZ_SEED_FILE_H
#define CT_TESTS_FUZZ_SEED_FILE_H
#include "core/env.h"
#include "formats/io.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static const struct ct_env seed_env = {.files = &(const struct ct_io_rule){.force = true}};
static char seed_name[] = "/tmp/fuzz-seed-XXXXXX";

/* Where the writer is to write. */
static const char *seed_path(void)
{
	int fd = seed_name[sizeof seed_name - 2] == 'X' ? mkstemp(seed_name) : -1;

	if (fd >= 0)
		close(fd);
	return seed_name;
}

/* What it wrote, given its return value; the file is gone. */
static size_t seed_file(unsigned char **data, int failed)
{
	enum { MOST = 1 << 20 };
	FILE *f = fopen(seed_name, "rb");
	size_t n;

	*data = malloc(MOST);
	if (failed || !f || !*data)
		exit(99);
	n = fread(*data, 1, MOST, f);
	fclose(f);
	unlink(seed_name);
	return n;
}

#endif
