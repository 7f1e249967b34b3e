/* Replays a fuzz target: its own seeds with mutations drawn from a fixed linear congruential
 * generator, and the inputs of its corpus; or the files that are named. A crash or a sanitizer
 * report is the failure.
 *   fuzz-x [FILE...]         replay
 *   fuzz-x --seeds FOLDER    write the seeds there; also of the target that libFuzzer drives
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "../tap.h"

#include <stdlib.h>
#include <string.h>

size_t fuzz_taken;

enum { ROOM = 256, MOST_FILE = 1 << 20, MOST_CORPUS = 1 << 24 };

static uint64_t lcg(uint64_t *s)
{
	*s = *s * 6364136223846793005u + 1442695040888963407u;
	return *s >> 33;
}

/* A few edits of the n bytes at p, which has ROOM bytes to spare; the new size. */
static size_t mutate(unsigned char *p, size_t n, uint64_t *s)
{
	static const uint64_t edge[] = {0, 1, 2, 0x7f, 0x80, 0xff, 0x7fff, 0x8000, 0xffff,
		0x7fffffff, 0x80000000, 0xffffffff, 0x7f800000, 0x7fc00000, UINT64_C(1) << 62,
		INT64_MAX, UINT64_MAX};
	const size_t max = n + ROOM;

	for (uint64_t edits = 1 + lcg(s) % 4; edits && n; edits--) {
		size_t at = lcg(s) % (lcg(s) % 2 ? n : n < 400 ? n : 400), len;
		uint64_t word;

		switch (lcg(s) % 6) {
		case 0: p[at] ^= (unsigned char)(1u << lcg(s) % 8); break;
		case 1: p[at] = (unsigned char)lcg(s); break;
		case 2: /* an edge value in either byte order */
			word = edge[lcg(s) % (sizeof edge / sizeof edge[0])];
			len = (size_t)1 << lcg(s) % 4;
			for (size_t i = 0, big = lcg(s) % 2; i < len && at + i < n; i++)
				p[at + i] = (unsigned char)(word >> 8 * (big ? len - 1 - i : i));
			break;
		case 3: /* cut */ n = at; break;
		case 4: /* take a run out */
			len = 1 + lcg(s) % 32;
			len = len < n - at ? len : n - at;
			memmove(p + at, p + at + len, n - at - len);
			n -= len;
			break;
		default: /* say a run twice */
			len = 1 + lcg(s) % 32;
			len = len < n - at ? len : n - at;
			if (n + len <= max) {
				memmove(p + at + len, p + at, n - at);
				n += len;
			}
		}
	}
	return n;
}

static void replay(const unsigned char *seed, size_t n, const char *name)
{
	uint64_t state = n;

	fuzz_taken = 0;
	LLVMFuzzerTestOneInput(seed, n);
	OK(fuzz_taken > 0, "%s is taken", name);
	for (int round = 0; round < fuzz_rounds; round++) {
		unsigned char *p = malloc(n + ROOM), *exact;
		size_t size;

		if (!p)
			exit(99);
		memcpy(p, seed, n);
		size = mutate(p, n, &state);
		exact = realloc(p, size ? size : 1); /* so that reading past the end is caught */
		LLVMFuzzerTestOneInput(exact ? exact : p, size);
		free(exact ? exact : p);
	}
	OK(1, "%s and %d mutations of its %zu bytes", name, fuzz_rounds, n);
}

static void replay_bytes(const unsigned char *p, size_t n)
{
	unsigned char *exact = malloc(n ? n : 1); /* so that reading past the end is caught */

	if (!exact)
		exit(99);
	memcpy(exact, p, n);
	LLVMFuzzerTestOneInput(exact, n);
	free(exact);
}

/* The bytes of a file, from malloc. */
static unsigned char *whole(const char *path, size_t most, size_t *n)
{
	unsigned char *p = malloc(most);
	FILE *f = fopen(path, "rb");

	if (!p)
		exit(99);
	*n = f ? fread(p, 1, most, f) : 0;
	if (f)
		fclose(f);
	return p;
}

static void replay_file(const char *path)
{
	size_t n;
	unsigned char *p = whole(path, MOST_FILE, &n);

	replay_bytes(p, n);
	free(p);
}

/* tests/fuzz/corpus/x.tar of the target fuzz-x, which scripts/fuzz-corpus.sh writes: a block with
 * the name and size of a file, its bytes, filled up to a block; last a block of zeros. */
static void replay_corpus(const char *target)
{
	enum { BLOCK = 512, SIZE = 124, KIND = 156, MAGIC = 257 };
	const char *top = getenv("srcdir"), *name = strrchr(target, '/');
	size_t files = 0, at = 0, n;
	unsigned char *p;
	char path[4000];

	name = name ? name + 1 : target;
	name += strncmp(name, "fuzz-", 5) == 0 ? 5 : 0;
	snprintf(path, sizeof path, "%s/tests/fuzz/corpus/%s.tar", top ? top : ".", name);
	p = whole(path, MOST_CORPUS, &n);
	while (n - at >= BLOCK && memcmp(p + at + MAGIC, "ustar", 5) == 0 && p[at + KIND] == '0') {
		const size_t size = strtoul((const char *)p + at + SIZE, NULL, 8);

		if (size > n - at - BLOCK)
			break;
		replay_bytes(p + at + BLOCK, size);
		files++;
		at += BLOCK + (size + BLOCK - 1) / BLOCK * BLOCK;
		at = at < n ? at : n;
	}
	OK(files > 0, "%zu inputs of %s are replayed", files, path);
	OK(at < n && p[at] == 0, "%s is a whole archive of plain files", path);
	free(p);
}

static void write_seeds(const char *folder)
{
	unsigned char *p;
	char path[4000];
	size_t n;

	for (size_t k = 0; (n = fuzz_seed(k, &p)) > 0; k++) {
		FILE *f;

		snprintf(path, sizeof path, "%s/seed-%zu", folder, k);
		f = fopen(path, "wb");
		if (!f || fwrite(p, 1, n, f) != n || fclose(f))
			exit(99);
		free(p);
	}
}

#ifdef CT_FUZZER /* libFuzzer has main */
int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	if (*argc == 3 && strcmp((*argv)[1], "--seeds") == 0) {
		write_seeds((*argv)[2]);
		exit(0);
	}
	(void)replay, (void)replay_corpus, (void)tap_done;
	return 0;
}
#else
int main(int argc, char **argv)
{
	unsigned char *p;
	char name[40];
	size_t n;

	if (argc == 3 && strcmp(argv[1], "--seeds") == 0) {
		write_seeds(argv[2]);
		return 0;
	}
	for (int i = 1; i < argc; i++) {
		replay_file(argv[i]);
		OK(1, "%s", argv[i]);
	}
	for (size_t k = 0; argc < 2 && (n = fuzz_seed(k, &p)) > 0; k++) {
		snprintf(name, sizeof name, "seed %zu", k);
		replay(p, n, name);
		free(p);
	}
	if (argc < 2)
		replay_corpus(argv[0]);
	return tap_done();
}
#endif
