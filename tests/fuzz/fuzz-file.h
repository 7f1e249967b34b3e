/* fuzz-file.h: bytes as a file with a name, for readers that want one; and seeds made by our own
 * writers. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_FUZZ_FILE_H
#define CT_TESTS_FUZZ_FILE_H
#include "core/env.h"
#include "formats/io.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* Its path, the same in every call; the file is as long as `zeros` if that is more than n. */
__attribute__((unused)) static const char *mem_file(const uint8_t *data, size_t n, size_t zeros)
{
	static char path[40];
	static int fd = -1;

	if (fd < 0) {
		fd = memfd_create("fuzz", MFD_CLOEXEC);
		snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
	}
	if (fd < 0 || ftruncate(fd, 0) || (n && pwrite(fd, data, n, 0) != (ssize_t)n) ||
		(zeros > n && ftruncate(fd, (off_t)zeros)))
		exit(99);
	return path;
}

/* How long safetensors say that they are, at most `most`: their numbers need not be in the input,
 * which stays small. */
__attribute__((unused)) static size_t mem_length(const uint8_t *data, size_t n, size_t most)
{
	static const char key[] = "\"data_offsets\":[";
	const size_t lead = sizeof key - 1;
	uint64_t header, end = 0;

	if (n < 8)
		return n;
	memcpy(&header, data, 8);
	if (header > n - 8)
		return n;
	for (size_t i = 8; i + lead < 8 + header; i++) {
		size_t at = i + lead;
		uint64_t x = 0;

		if (memcmp(data + i, key, lead) != 0)
			continue;
		while (at < 8 + header && data[at] != ',' && data[at] != ']')
			at++;
		for (at++; at < 8 + header && data[at] >= '0' && data[at] <= '9' && x < most; at++)
			x = 10 * x + (uint64_t)(data[at] - '0');
		end = x > end ? x : end;
	}
	return end < most ? 8 + (size_t)header + (size_t)end : n;
}

__attribute__((unused)) static const struct ct_env seed_env = {
	.files = &(const struct ct_io_rule){.force = true}};
__attribute__((unused)) static char seed_name[] = "/tmp/fuzz-seed-XXXXXX";

/* Where the writer is to write. */
__attribute__((unused)) static const char *seed_path(void)
{
	int fd = seed_name[sizeof seed_name - 2] == 'X' ? mkstemp(seed_name) : -1;

	if (fd >= 0)
		close(fd);
	return seed_name;
}

/* What it wrote, given its return value; the file is gone. */
__attribute__((unused)) static size_t seed_file(unsigned char **data, int failed)
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
