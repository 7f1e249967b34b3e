/* pt-make.h: checkpoints of PyTorch, byte by byte. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_PT_MAKE_H
#define CT_TESTS_PT_MAKE_H
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

struct bytes {
	unsigned char data[1 << 16];
	size_t n;
};

static void put(struct bytes *b, const void *data, size_t n)
{
	if (n > sizeof b->data - b->n)
		exit(99);
	if (n)
		memcpy(b->data + b->n, data, n);
	b->n += n;
}

static void little(struct bytes *b, uint64_t x, size_t n)
{
	for (size_t i = 0; i < n; i++, x >>= 8)
		put(b, &(unsigned char){(unsigned char)x}, 1);
}

/* Instructions without zeros in them. */
static void op(struct bytes *b, const char *s)
{
	put(b, s, strlen(s));
}

static void word(struct bytes *b, const char *s)
{
	op(b, "X");
	little(b, strlen(s), 4);
	op(b, s);
}

/* BININT, or LONG1 where that is too little. */
static void number(struct bytes *b, int64_t x)
{
	if (x == (int32_t)x) {
		op(b, "J");
		little(b, (uint64_t)x, 4);
	} else {
		op(b, "\x8a\x08");
		little(b, (uint64_t)x, 8);
	}
}

static void numbers(struct bytes *b, size_t n, const int64_t *x)
{
	op(b, "(");
	for (size_t i = 0; i < n; i++)
		number(b, x[i]);
	op(b, "t");
}

struct part {
	const char *type, *storage;
	int64_t length, offset;
	size_t rank;
	int64_t size[9], stride[9];
};

static void tensor(struct bytes *b, struct part p)
{
	op(b, "ctorch._utils\n_rebuild_tensor_v2\n((");
	word(b, "storage");
	op(b, "ctorch\n");
	op(b, p.type);
	op(b, "Storage\n");
	word(b, p.storage);
	word(b, "cpu");
	number(b, p.length);
	op(b, "tQ");
	number(b, p.offset);
	numbers(b, p.rank, p.size);
	numbers(b, p.rank, p.stride);
	op(b, "\x89"
	      "ccollections\nOrderedDict\n)RtR");
}

/* What the next members and the end say that is not so. */
static struct {
	unsigned method, flags, local, disk;
	uint32_t crc;
	int64_t size, packed, at, dir, count, bytes;
	int wide; /* sizes and places in 64 bits; 2: but without them */
} lie;

struct archive {
	struct bytes b, dir;
	size_t n;
};

static void member(struct archive *a, const char *name, const void *data, size_t n)
{
	const uint32_t crc = (uint32_t)crc32(0, data, (unsigned)n) ^ lie.crc;
	const uint64_t at = a->b.n + (uint64_t)lie.at, size = n + (uint64_t)lie.size,
		       packed = size + (uint64_t)lie.packed;
	const size_t length = strlen(name);

	op(&a->b, "PK\3\4");
	little(&a->b, 0, 22);
	little(&a->b, length + lie.local, 2);
	little(&a->b, 3, 2);
	op(&a->b, name);
	op(&a->b, "FBx");
	put(&a->b, data, n);
	op(&a->dir, "PK\1\2");
	little(&a->dir, 0, 4);
	little(&a->dir, lie.flags, 2);
	little(&a->dir, lie.method, 2);
	little(&a->dir, 0, 4);
	little(&a->dir, crc, 4);
	little(&a->dir, lie.wide ? UINT32_MAX : packed, 4);
	little(&a->dir, lie.wide ? UINT32_MAX : size, 4);
	little(&a->dir, length, 2);
	little(&a->dir, lie.wide == 1 ? 34 : 0, 2);
	little(&a->dir, 0, 10);
	little(&a->dir, lie.wide ? UINT32_MAX : at, 4);
	op(&a->dir, name);
	if (lie.wide == 1) {
		little(&a->dir, 7, 2); /* a field of another kind first */
		little(&a->dir, 2, 2);
		little(&a->dir, 0, 2);
		little(&a->dir, 1, 2);
		little(&a->dir, 24, 2);
		little(&a->dir, size, 8);
		little(&a->dir, packed, 8);
		little(&a->dir, at, 8);
	}
	a->n++;
}

static void finish(struct archive *a)
{
	const uint64_t at = a->b.n + (uint64_t)lie.dir, n = a->n + (uint64_t)lie.count,
		       bytes = a->dir.n + (uint64_t)lie.bytes;

	put(&a->b, a->dir.data, a->dir.n);
	if (lie.wide) {
		const uint64_t here = a->b.n;

		op(&a->b, "PK\6\6");
		little(&a->b, 44, 8);
		little(&a->b, 0, 4);
		little(&a->b, lie.disk, 4);
		little(&a->b, 0, 4);
		little(&a->b, n, 8);
		little(&a->b, n, 8);
		little(&a->b, bytes, 8);
		little(&a->b, at, 8);
		op(&a->b, "PK\6\7");
		little(&a->b, 0, 4);
		little(&a->b, here + (lie.wide > 2 ? 1 : 0), 8);
		little(&a->b, 1, 4);
	}
	op(&a->b, "PK\5\6");
	little(&a->b, lie.disk, 4);
	little(&a->b, lie.wide ? 65535 : n, 2);
	little(&a->b, lie.wide ? 65535 : n, 2);
	little(&a->b, lie.wide ? UINT32_MAX : bytes, 4);
	little(&a->b, lie.wide ? UINT32_MAX : at, 4);
	little(&a->b, 0, 2); /* no comment */
}

/* A dictionary of one tensor of two numbers, and its storage "0". */
__attribute__((unused)) static void simple(struct archive *a, struct part p)
{
	static const float x[2] = {1.5f, -2};
	static struct bytes k;

	*a = (struct archive){.n = 0};
	k.n = 0;
	op(&k, "\x80\2}");
	word(&k, "w");
	tensor(&k, p);
	op(&k, "s.");
	member(a, "a/data.pkl", k.data, k.n);
	member(a, "a/data/0", x, sizeof x);
	finish(a);
}
static const struct part two __attribute__((unused)) = {"Float", "0", 2, 0, 1, {2}, {1}};

#endif
