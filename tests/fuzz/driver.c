/* Replays a fuzz target: its own seeds, or the files named, each with ROUNDS mutations drawn
 * from a fixed linear congruential generator. A crash or a sanitizer report is the failure. */
#include "config.h"
#include "driver.h"
#include "../tap.h"

#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 1500, ROOM = 256 };

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

	LLVMFuzzerTestOneInput(seed, n);
	for (int round = 0; round < ROUNDS; round++) {
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
	OK(1, "%s and %d mutations of its %zu bytes", name, ROUNDS, n);
}

static unsigned char *load(const char *path, size_t *n)
{
	unsigned char *p = malloc(1 << 20);
	FILE *f = fopen(path, "rb");

	if (!p || !f)
		exit(99);
	*n = fread(p, 1, 1 << 20, f);
	fclose(f);
	return p;
}

int main(int argc, char **argv)
{
	unsigned char *p;
	char name[40];
	size_t n;

	for (int i = 1; i < argc; i++) {
		p = load(argv[i], &n);
		replay(p, n, argv[i]);
		free(p);
	}
	for (size_t k = 0; argc < 2 && (n = fuzz_seed(k, &p)) > 0; k++) {
		snprintf(name, sizeof name, "seed %zu", k);
		replay(p, n, name);
		free(p);
	}
	return tap_done();
}
