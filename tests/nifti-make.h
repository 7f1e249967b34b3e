/* nifti-make.h: NIfTI files made byte by byte, apart from the codec under test.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_NIFTI_MAKE_H
#define CT_TESTS_NIFTI_MAKE_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct made {
	int version;
	bool big;
	unsigned char *p; /* the file */
	size_t n;
};

/* Integer of `bytes` bytes. */
__attribute__((unused)) static void put_int(struct made *m, size_t at, size_t bytes, int64_t x)
{
	for (size_t i = 0; i < bytes; i++)
		m->p[at + i] = (unsigned char)((uint64_t)x >> 8 * (m->big ? bytes - 1 - i : i));
}

__attribute__((unused)) static void put_real(struct made *m, size_t at, size_t bytes, double x)
{
	float f = (float)x;
	uint32_t u;
	uint64_t w;

	memcpy(&u, &f, 4);
	memcpy(&w, &x, 8);
	put_int(m, at, bytes, bytes == 4 ? (int64_t)u : (int64_t)w);
}

/* Fields that have another place and width in each version. */
__attribute__((unused)) static void put_dim(struct made *m, size_t k, int64_t x)
{
	if (m->version == 1)
		put_int(m, 40 + 2 * k, 2, x);
	else
		put_int(m, 16 + 8 * k, 8, x);
}

__attribute__((unused)) static void put_pixdim(struct made *m, size_t k, double x)
{
	if (m->version == 1)
		put_real(m, 76 + 4 * k, 4, x);
	else
		put_real(m, 104 + 8 * k, 8, x);
}

__attribute__((unused)) static void put_slope(struct made *m, double slope, double inter)
{
	size_t w = m->version == 1 ? 4 : 8, at = m->version == 1 ? 112 : 176;

	put_real(m, at, w, slope);
	put_real(m, at + w, w, inter);
}

__attribute__((unused)) static void put_codes(struct made *m, int qform, int sform)
{
	size_t w = m->version == 1 ? 2 : 4, at = m->version == 1 ? 252 : 344;

	put_int(m, at, w, qform);
	put_int(m, at + w, w, sform);
}

/* Quaternion b,c,d and offset x,y,z. */
__attribute__((unused)) static void put_quaternion(struct made *m, const double v[6])
{
	size_t w = m->version == 1 ? 4 : 8, at = m->version == 1 ? 256 : 352;

	for (size_t i = 0; i < 6; i++)
		put_real(m, at + i * w, w, v[i]);
}

__attribute__((unused)) static void put_srow(struct made *m, const double v[12])
{
	size_t w = m->version == 1 ? 4 : 8, at = m->version == 1 ? 280 : 400;

	for (size_t i = 0; i < 12; i++)
		put_real(m, at + i * w, w, v[i]);
}

__attribute__((unused)) static void put_units(struct made *m, int units)
{
	put_int(m, m->version == 1 ? 123 : 500, m->version == 1 ? 1 : 4, units);
}

__attribute__((unused)) static void put_start(struct made *m, int64_t at)
{
	if (m->version == 1)
		put_real(m, 108, 4, (double)at);
	else
		put_int(m, 168, 8, at);
}

/* A file of nx x ny x nz voxels of `bytes` bytes behind `ext` bytes of extensions, all zero;
 * voxel sizes 1, 2, 3 mm. The voxels begin at the return value. */
__attribute__((unused)) static size_t make(
	struct made *m, int version, bool big, int type, size_t bytes, const int n[3], size_t ext)
{
	size_t head = version == 1 ? 348 : 540, start = head + 4 + ext;

	m->version = version;
	m->big = big;
	m->n = start + bytes * (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
	m->p = calloc(m->n, 1);
	if (!m->p)
		exit(99);
	put_int(m, 0, 4, (int64_t)head);
	if (version == 1)
		memcpy(m->p + 344, "n+1", 4);
	else
		memcpy(m->p + 4, "n+2\0\r\n\032\n", 8);
	put_int(m, version == 1 ? 70 : 12, 2, type);
	put_int(m, version == 1 ? 72 : 14, 2, (int64_t)(8 * bytes));
	put_dim(m, 0, 3);
	put_pixdim(m, 0, 1);
	for (size_t a = 0; a < 3; a++) {
		put_dim(m, a + 1, n[a]);
		put_pixdim(m, a + 1, (double)(a + 1));
	}
	put_start(m, (int64_t)start);
	m->p[head] = ext > 0;
	return start;
}

/* An extension at `at`: size with its head, code, text. */
__attribute__((unused)) static void put_ext(
	struct made *m, size_t at, int size, int code, const char *text)
{
	put_int(m, at, 4, size);
	put_int(m, at + 4, 4, code);
	memcpy(m->p + at + 8, text, strlen(text));
}

#endif
