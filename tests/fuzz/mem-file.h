/* mem-file.h: bytes as a file with a name, for readers that want one.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_FUZZ_MEM_FILE_H
#define CT_TESTS_FUZZ_MEM_FILE_H
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

#endif
