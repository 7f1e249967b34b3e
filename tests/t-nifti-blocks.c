/* NIfTI by the block: large volumes, gzip members, what a header may ask for, NIfTI-2.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/rng.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/nifti.h"
#include "formats/io.h"
#include "nifti-make.h"
#include "tap.h"

#include <unistd.h>
#include <zlib.h>

static const struct ct_env force = {
	.tool = "ct-test", .files = &(const struct ct_io_rule){.force = true}};
enum { BLOCK = 1 << 18 }; /* of nifti.c */

static int parse(const void *p, size_t n, struct ct_vol *v)
{
	struct ct_any a = {0};
	int rc;

	err = (struct ct_err){0};
	rc = ct_format_read_bytes(&ct_format_nifti, p, n, "x.nii", &a, &err);
	*v = a.vol;
	return rc;
}

static void make_volume(struct ct_vol *v, size_t nx, size_t ny, size_t nz)
{
	const size_t n[3] = {nx, ny, nz};

	*v = (struct ct_vol){0};
	must(ct_vol_alloc(v, n, &err));
	memset(v->data, 0, ct_vol_count(v) * sizeof *v->data);
	for (int i = 0; i < 3; i++)
		v->affine[i][i] = 1;
}

static unsigned char *load(const char *path, size_t *n)
{
	FILE *f = fopen(path, "rb");
	unsigned char *p = malloc(1 << 22);

	if (!f || !p)
		exit(99);
	*n = fread(p, 1, 1 << 22, f);
	fclose(f);
	return p;
}

/* Volumes of many blocks, back to the bit, plain and gzip, with metadata longer than a block. */
static void test_blocks(void)
{
	static const char *const names[] = {"b.nii", "b.nii.gz"};
	struct ct_vol v, w = {0};
	char *text = malloc(3 * BLOCK);
	unsigned char *p;
	size_t n;

	if (!text)
		exit(99);
	make_volume(&v, 100, 100, 30);
	for (size_t i = 0; i < 3 * BLOCK; i++)
		text[i] = (char)('a' + (char)ct_rng_below(3, 0, i, 26));
	text[3 * BLOCK - 1] = '\0';
	must(ct_meta_set(&v.meta, "history", text, &err));
	for (int real = 0; real < 4; real++)
		for (int i = 0; i < 2; i++) {
			for (size_t k = 0; k < 300000; k++)
				v.data[k] = real == 1 ? ct_rng_normal(1, 2, k)
						      : (float)ct_rng_below(1, 2, k, 60000) - 30000;
			if (real > 1) /* the last, behind the first block, or the first */
				v.data[real == 2 ? 299999 : 0] = 0.5f;
			OK(ct_vol_write(names[i], &v, &force, &err) == 0 &&
					ct_vol_read(names[i], &w, &err) == 0 &&
					memcmp(v.data, w.data, 300000 * sizeof *v.data) == 0 &&
					strcmp(ct_meta_get(&w.meta, "history"), text) == 0,
				"%s of 300000 %s voxels", names[i], real ? "real" : "whole");
			ct_vol_free(&w);
			p = load(names[i], &n);
			OK(i ? p[0] == 0x1f : p[70] == (real ? 16 : 4), "as it should be");
			free(p);
			unlink(names[i]);
		}
	ct_vol_free(&v);
	free(text);
}

/* A gzip member of stored blocks and of `size` bytes in all: an extra field makes up for it. */
static size_t put_member(unsigned char *out, size_t size, const unsigned char *p, size_t n)
{
	const size_t most = 65535, blocks = (n + most - 1) / most, used = 20 + n + 5 * blocks,
		     extra = size - used;
	const uint32_t tail[2] = {(uint32_t)crc32(0, p, (uInt)n), (uint32_t)n};
	unsigned char *o = out;

	if (used > size || extra > most)
		exit(99);
	memcpy(o, "\x1f\x8b\x08\x04\0\0\0\0\0\xff", 10);
	o[10] = (unsigned char)extra;
	o[11] = (unsigned char)(extra >> 8);
	memset(o + 12, 0, extra);
	o += 12 + extra;
	for (size_t at = 0; at < n; at += most) {
		const size_t k = n - at < most ? n - at : most;

		*o++ = at + k == n;
		for (int i = 0; i < 4; i++)
			*o++ = (unsigned char)((i < 2 ? k : ~k) >> 8 * (i % 2));
		memcpy(o, p + at, k);
		o += k;
	}
	for (int i = 0; i < 8; i++)
		*o++ = (unsigned char)(tail[i / 4] >> 8 * (i % 4));
	return (size_t)(o - out);
}

/* Members that end where a block of the file does: the first two bytes, then whole blocks. */
static void test_members(void)
{
	static const int side[3] = {100, 100, 40};
	enum { SPLIT = BLOCK - 1000 };
	struct made m;
	unsigned char *gz = malloc(1 << 20);
	size_t at = make(&m, 1, false, 2, 1, side, 0);

	if (!gz)
		exit(99);
	for (size_t i = at; i < m.n; i++)
		m.p[i] = (unsigned char)ct_rng_below(7, 0, i, 256);
	for (size_t end = BLOCK - 2; end <= BLOCK + 4; end++) {
		struct ct_vol v = {0};
		size_t n = put_member(gz, end, m.p, SPLIT), bad = 0;

		n += put_member(gz + n, 200000, m.p + SPLIT, m.n - SPLIT);
		memset(gz + n, 0, 10);
		bad += parse(gz, n + 10, &v) != 0;
		for (size_t i = 0; v.data && i < m.n - at; i++)
			bad += v.data[i] != m.p[at + i];
		OK(bad == 0, "a member of %zu bytes, and another %s", end, err.msg);
		ct_vol_free(&v);
		OK(parse(gz, end, &v) == -1 && err.code == CT_EINPUT, "alone it is half a volume");
		n = put_member(gz, end, m.p, SPLIT);
		gz[n] = 0; /* padding ends a file */
		OK(parse(gz, n + 1, &v) == -1 && err.code == CT_EINPUT, "padded, too");
	}
	free(gz);
	free(m.p);
}

/* An extension of so many bytes, in a gzip file that might be long enough for it. */
static const char *long_extension(int bytes)
{
	const int side[3] = {1, 1, 1};
	unsigned char *gz = malloc(80000);
	struct ct_vol v = {0};
	struct made m;

	if (!gz)
		exit(99);
	make(&m, 1, false, 2, 1, side, 10000);
	put_start(&m, 70000000);
	put_ext(&m, 352, bytes, 4, "");
	OK(parse(gz, put_member(gz, 75000, m.p, m.n), &v) == -1 && err.code == CT_EINPUT,
		"an extension of %d bytes: %s", bytes, err.msg);
	free(gz);
	free(m.p);
	return err.msg;
}

static void test_long(void)
{
	OK(strstr(long_extension(1 << 26), "truncated") != NULL, "64 MiB could be");
	OK(strstr(long_extension((1 << 26) + 16), "esize 67108880 is wrong") != NULL, "no more");
}

/* What a dimension above 32767 makes it. */
static void test_version(void)
{
	struct ct_vol v;
	unsigned char *p;
	size_t n;

	for (size_t side = 32767; side <= 32768; side++) {
		make_volume(&v, 1, 1, side);
		must(ct_vol_write("v.nii", &v, &force, &err));
		p = load("v.nii", &n);
		if (side == 32767)
			OK(p[0] == 92 && n == 352 + 2 * side && p[46] == 255 && p[47] == 127,
				"NIfTI-1 up to 32767");
		else
			OK(p[0] == 28 && n == 544 + 2 * side && p[40] == 0 && p[41] == 128 &&
					memcmp(p + 4, "n+2\0\r\n\032\n", 8) == 0 && p[12] == 4 &&
					p[14] == 16 && p[168] == 544 - 512 && p[169] == 2 &&
					p[500] == 2 && p[344] == 1 && p[348] == 1 &&
					strncmp((char *)p + 240, "ct-test ", 8) == 0,
				"then NIfTI-2");
		free(p);
		ct_vol_free(&v);
	}
	unlink("v.nii");
}

static void test_stop(void)
{
	const volatile sig_atomic_t stop = 1;
	const struct ct_env env = {
		.files = &(const struct ct_io_rule){.force = true}, .stop = &stop};
	struct ct_vol v;

	make_volume(&v, 2, 2, 2);
	OK(ct_vol_write("s.nii.gz", &v, &env, &err) == -1 && err.code == CT_ESTOP &&
			access("s.nii.gz", F_OK) != 0,
		"who is told to stop leaves no file");
	ct_vol_free(&v);
}

int main(void)
{
	char dir[] = "/tmp/t-nifti-blocks.XXXXXX";

	if (!mkdtemp(dir) || chdir(dir) != 0)
		return 99;
	test_blocks();
	test_members();
	test_long();
	test_version();
	test_stop();
	if (chdir("/") != 0 || rmdir(dir) != 0)
		OK(0, "%s is left empty", dir);
	return tap_done();
}
