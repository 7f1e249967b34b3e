/* zip.c: see zip.h; the format is PKWARE's APPNOTE 6.3. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/zip.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum {
	LOCAL = 30,             /* bytes of a local header, without name and extra */
	CENTRAL = 46,           /* of an entry of the directory */
	END = 22,               /* of the record at the end */
	LOCATOR = 20,           /* of what says where the 64-bit record is */
	END64 = 56,             /* of that record */
	MOST_MEMBERS = 1 << 17, /* members */
	MOST_DIR = 1 << 25,     /* bytes of the directory */
	FLAG_SECRET = 1,
};

static uint64_t little(const unsigned char *p, size_t n)
{
	uint64_t x = 0;

	while (n-- > 0)
		x = x << 8 | p[n];
	return x;
}

static int get(
	struct ct_zip *z, uint64_t at, void *data, size_t n, const char *what, struct ct_err *e)
{
	if (at > z->size || n > z->size - at || fseeko(z->f, (off_t)at, SEEK_SET) != 0 ||
		fread(data, 1, n, z->f) != n)
		return ct_fail(e, CT_EINPUT, "zip: ends inside %s", what);
	return 0;
}

/* What the end of the archive says of its directory. */
struct end {
	uint64_t n, bytes, at, disk, here;
};

/* The 64-bit record, if there is one before the one at `at`. */
static int read_end64(struct ct_zip *z, uint64_t at, struct end *d, struct ct_err *e)
{
	unsigned char loc[LOCATOR], rec[END64];

	if (at < LOCATOR)
		return 0;
	if (get(z, at - LOCATOR, loc, sizeof loc, "its end", e))
		return -1;
	if (memcmp(loc, "PK\6\7", 4) != 0)
		return 0;
	if (get(z, little(loc + 8, 8), rec, sizeof rec, "its 64-bit end", e))
		return -1;
	if (memcmp(rec, "PK\6\6", 4) != 0)
		return ct_fail(e, CT_EINPUT, "zip: no 64-bit end where it should be");
	*d = (struct end){.disk = little(rec + 16, 4) | little(rec + 20, 4),
		.here = little(rec + 24, 8),
		.n = little(rec + 32, 8),
		.bytes = little(rec + 40, 8),
		.at = little(rec + 48, 8)};
	return 0;
}

/* The record at the end; torch.save writes no comment behind it. */
static int read_end(struct ct_zip *z, struct end *d, struct ct_err *e)
{
	const uint64_t at = z->size < END ? 0 : z->size - END;
	unsigned char rec[END] = {0};

	if (z->size >= END && get(z, at, rec, sizeof rec, "its end", e))
		return -1;
	if (memcmp(rec, "PK\5\6", 4) != 0)
		return ct_fail(e, CT_EINPUT, "zip: no directory at the end: cut short?");
	*d = (struct end){.disk = little(rec + 4, 2) | little(rec + 6, 2),
		.here = little(rec + 8, 2),
		.n = little(rec + 10, 2),
		.bytes = little(rec + 12, 4),
		.at = little(rec + 16, 4)};
	if (read_end64(z, at, d, e))
		return -1;
	if (d->disk || d->here != d->n)
		return ct_fail(e, CT_EINPUT, "zip: one of several volumes");
	if (d->n > MOST_MEMBERS || d->bytes > MOST_DIR || d->n * CENTRAL > d->bytes)
		return ct_fail(e, CT_EINPUT, "zip: a directory of %llu members in %llu bytes",
			(unsigned long long)d->n, (unsigned long long)d->bytes);
	return 0;
}

/* Fields of an entry that do not fit into 32 bits stand in its extra field of kind 1, in this
 * order.
 */
static int widen(const char *name, const unsigned char *extra, size_t n, uint64_t *const field[3],
	struct ct_err *e)
{
	while (n >= 4) {
		const size_t kind = (size_t)little(extra, 2), size = (size_t)little(extra + 2, 2);
		size_t at = 4;

		if (size > n - 4)
			break;
		for (int i = 0; kind == 1 && i < 3; i++)
			if (*field[i] == UINT32_MAX && at + 8 <= 4 + size) {
				*field[i] = little(extra + at, 8);
				at += 8;
			}
		extra += 4 + size;
		n -= 4 + size;
	}
	for (int i = 0; i < 3; i++)
		if (*field[i] == UINT32_MAX)
			return ct_fail(e, CT_EINPUT, "%s: no 64-bit size or place", name);
	return 0;
}

/* One entry of the directory, of which `n` bytes are left; its length in *used. Its name is closed
 * with a zero over what follows it, once that has been read. */
static int read_entry(struct ct_zip *z, unsigned char *p, size_t n, size_t *used,
	struct ct_zip_member *m, struct ct_err *e)
{
	uint64_t packed, *const field[3] = {&m->size, &packed, &m->at};
	size_t name, extra, comment;
	char label[100];

	if (n < CENTRAL || memcmp(p, "PK\1\2", 4) != 0)
		return ct_fail(e, CT_EINPUT, "zip: entry %zu of the directory is none", z->n);
	name = (size_t)little(p + 28, 2);
	extra = (size_t)little(p + 30, 2);
	comment = (size_t)little(p + 32, 2);
	*used = CENTRAL + name + extra + comment;
	if (*used > n || name == 0 || memchr(p + CENTRAL, 0, name))
		return ct_fail(e, CT_EINPUT, "zip: entry %zu of the directory has no name", z->n);
	snprintf(label, sizeof label, "%.*s", (int)(name < 90 ? name : 90), p + CENTRAL);
	*m = (struct ct_zip_member){.name = (char *)p,
		.crc = (uint32_t)little(p + 16, 4),
		.size = little(p + 24, 4),
		.at = little(p + 42, 4)};
	packed = little(p + 20, 4);
	if (little(p + 8, 2) & FLAG_SECRET)
		return ct_fail(e, CT_EINPUT, "%s: is encrypted", label);
	if (little(p + 10, 2) != 0)
		return ct_fail(e, CT_EINPUT, "%s: compressed by method %llu; torch.save stores",
			label, (unsigned long long)little(p + 10, 2));
	if (widen(label, p + CENTRAL + name, extra, field, e))
		return -1;
	if (m->size != packed)
		return ct_fail(e, CT_EINPUT, "%s: stored, but %llu bytes are %llu", label,
			(unsigned long long)packed, (unsigned long long)m->size);
	if (m->at > z->size || m->size > z->size - m->at)
		return ct_fail(e, CT_EINPUT, "%s: %llu bytes at %llu in a file of %llu", label,
			(unsigned long long)m->size, (unsigned long long)m->at,
			(unsigned long long)z->size);
	memmove(p, p + CENTRAL, name);
	p[name] = '\0';
	return 0;
}

static int by_name(const void *a, const void *b)
{
	const struct ct_zip_member *p = a, *q = b;

	return strcmp(p->name, q->name);
}

static int read_directory(struct ct_zip *z, const struct end *d, struct ct_err *e)
{
	uint64_t sum = 0;
	size_t at = 0, used = 0;

	if (ct_alloc(&z->names, (size_t)d->bytes, 1, e) ||
		ct_alloc0(&z->member, (size_t)d->n, sizeof *z->member, e) ||
		get(z, d->at, z->names, (size_t)d->bytes, "its directory", e))
		return -1;
	for (; z->n < d->n; z->n++, at += used) {
		if (read_entry(z, (unsigned char *)z->names + at, (size_t)d->bytes - at, &used,
			    &z->member[z->n], e))
			return -1;
		sum += z->member[z->n].size;
	}
	if (sum > z->size)
		return ct_fail(e, CT_EINPUT, "zip: members of %llu bytes in a file of %llu",
			(unsigned long long)sum, (unsigned long long)z->size);
	qsort(z->member, z->n, sizeof *z->member, by_name);
	for (size_t i = 1; i < z->n; i++)
		if (strcmp(z->member[i - 1].name, z->member[i].name) == 0)
			return ct_fail(e, CT_EINPUT, "%.100s: is there twice", z->member[i].name);
	return 0;
}

int ct_zip_open(struct ct_zip *z, FILE *f, struct ct_err *e)
{
	struct end d = {0};
	off_t size;

	z->f = f;
	if (fseeko(f, 0, SEEK_END) != 0 || (size = ftello(f)) < 0)
		return ct_fail(e, CT_EINPUT, "zip: not a file that seeks");
	z->size = (uint64_t)size;
	return ct_err_any(read_end(z, &d, e) || read_directory(z, &d, e));
}

void ct_zip_free(struct ct_zip *z)
{
	free(z->member);
	free(z->names);
	*z = (struct ct_zip){0};
}

const struct ct_zip_member *ct_zip_find(const struct ct_zip *z, const char *name)
{
	const struct ct_zip_member key = {.name = name};

	return z->n ? bsearch(&key, z->member, z->n, sizeof key, by_name) : NULL;
}

int ct_zip_begin(struct ct_zip *z, const struct ct_zip_member *m, struct ct_err *e)
{
	const size_t length = strlen(m->name);
	unsigned char head[LOCAL];
	char name[256];
	uint64_t data;

	if (get(z, m->at, head, sizeof head, m->name, e))
		return -1;
	data = m->at + LOCAL + little(head + 26, 2) + little(head + 28, 2);
	if (memcmp(head, "PK\3\4", 4) != 0 || little(head + 26, 2) != length ||
		length > sizeof name || get(z, m->at + LOCAL, name, length, m->name, e) ||
		memcmp(name, m->name, length) != 0)
		return ct_fail(e, CT_EINPUT, "%.100s: is not where the directory says", m->name);
	if (data > z->size || m->size > z->size - data || fseeko(z->f, (off_t)data, SEEK_SET) != 0)
		return ct_fail(e, CT_EINPUT, "%.100s: ends behind the end of the file", m->name);
	z->now = m;
	z->left = m->size;
	z->crc = crc32(0, NULL, 0);
	return 0;
}

int ct_zip_take(struct ct_zip *z, void *data, size_t n, struct ct_err *e)
{
	if (n > z->left || fread(data, 1, n, z->f) != n)
		return ct_fail(e, CT_EINPUT, "%.100s: ends too early", z->now->name);
	z->left -= n;
	z->crc = crc32_z(z->crc, data, n);
	return 0;
}

int ct_zip_end(struct ct_zip *z, struct ct_err *e)
{
	if (z->left || z->crc != z->now->crc)
		return ct_fail(e, CT_EINPUT, "%.100s: CRC %08lx, the directory says %08lx",
			z->now->name, z->crc, (unsigned long)z->now->crc);
	return 0;
}

int ct_zip_read(struct ct_zip *z, const struct ct_zip_member *m, void *data, struct ct_err *e)
{
	return ct_err_any(ct_zip_begin(z, m, e) || ct_zip_take(z, data, (size_t)m->size, e) ||
			  ct_zip_end(z, e));
}
