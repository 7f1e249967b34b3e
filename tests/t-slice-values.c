/* Stored values to HU: 32 bits exactly, and padding that lossy compression moved.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "tap.h"
#include "series/slice.h"
#include "series/header.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Stored values beyond 2^24, which floats do not hold. */
static void test_base(void)
{
	static const uint32_t raw[4] = {2147483647, 2147483648, 2147483649, 2147484700};
	struct ct_slice s = {.columns = 4,
		.rows = 1,
		.allocated = 32,
		.scaled = true,
		.slope = 0.5,
		.intercept = -1073742024.25,
		.padded = true,
		.padding = {2147483649, 2147483649}};
	const struct ct_slice_bits how = {4, 32, false, 0, ct_slice_base(&s)};
	float px[4];

	ct_slice_widen(4, px, raw, &how);
	ct_slice_scale(&s, -1024, px);
	OK(px[0] == -200.75f && px[1] == -200.25f && px[2] == -1024 && px[3] == 325.75f,
		"values of 32 bits are scaled exactly, and padding is found");
	s.slope = 0;
	OK(ct_slice_base(&s) == 0, "no slope, no base");
	s.allocated = 16;
	s.slope = 1;
	OK(ct_slice_base(&s) == 0, "16 bits need none");
}

/* Lossy compression moves padding, which no HU of tissue is near. */
static void test_lossy(void)
{
	static const float was[6] = {-1998, -2007, -1600, -1300, -1000, 3000};
	struct ct_slice s = {.columns = 6,
		.rows = 1,
		.modality = "CT",
		.slope = 1,
		.padded = true,
		.padding = {-2000, -2000}};
	float px[6];

	memcpy(px, was, sizeof px);
	ct_slice_scale(&s, -1024, px);
	OK(memcmp(px, was, sizeof px) == 0, "without loss, padding is one value");
	s.lossy = true;
	ct_slice_scale(&s, -1024, px);
	OK(px[0] == -1024 && px[1] == -1024 && px[2] == -1024 && memcmp(px + 3, was + 3, 12) == 0,
		"with loss, it is what is nearer to it than to the least HU");
	memcpy(px, was, sizeof px);
	s.padding[0] = s.padding[1] = -1000;
	ct_slice_scale(&s, -1024, px);
	OK(px[0] == was[0] && px[3] == was[3] && px[4] == -1024 && px[5] == was[5],
		"padding among the HU is one value still");
	memcpy(px, was, sizeof px);
	s.slope = -1;
	s.padding[0] = s.padding[1] = 2000;
	px[1] = 1999;
	px[2] = 1000;
	ct_slice_scale(&s, -1024, px);
	OK(px[1] == -1024 && px[2] == -1000 && px[5] == -3000, "where the slope turns them, too");
}

static void test_hu(void)
{
	struct ct_slice s = {.columns = 3,
		.rows = 1,
		.slope = 2,
		.intercept = -1000,
		.padded = true,
		.padding = {-2000, -1500}};
	float px[3] = {-1800, 0, 300};

	ct_slice_scale(&s, -1024, px);
	OK(px[0] == -1024 && px[1] == -1000 && px[2] == -400, "rescale and padding");
}

/* Numbers of every size, with bits above those that count. */
static void test_widen(void)
{
	enum { M = 131 };
	unsigned char row[4 * M];
	float out[M];
	size_t bad = 0;

	for (size_t bytes = 1; bytes <= 4; bytes *= 2)
		for (int bits = 1; bits <= 8 * (int)bytes; bits++)
			for (int is_signed = 0; is_signed < 2; is_signed++) {
				const int shift = bits % 2 ? 8 * (int)bytes - bits : 0;
				const double base = bytes == 4 ? 1000000007 : 0;
				const struct ct_slice_bits how = {
					bytes, bits, is_signed, shift, base};
				const int64_t range = INT64_C(1) << bits;

				for (uint32_t i = 0; i < M; i++) {
					const uint32_t u = i * UINT32_C(2654435761) + i % 3;
					const uint8_t u8 = (uint8_t)u;
					const uint16_t u16 = (uint16_t)u;

					memcpy(row + bytes * i,
						bytes == 1   ? (const void *)&u8
						: bytes == 2 ? (const void *)&u16
							     : (const void *)&u,
						bytes);
				}
				ct_slice_widen(M, out, row, &how);
				for (uint32_t i = 0; i < M; i++) {
					const uint32_t u = i * UINT32_C(2654435761) + i % 3;
					const int64_t all = bytes == 1   ? (uint8_t)u
							    : bytes == 2 ? (uint16_t)u
									 : (int64_t)u;
					int64_t want = (all >> shift) % range;

					if (is_signed && want >= range / 2)
						want -= range;
					bad += out[i] != (float)(want - (int64_t)base);
				}
			}
	OK(bad == 0, "stored values of every size");
}

/* The elements of a DICOM header: UIDs, decimal strings, what several have in common; the place of
 * a plane. */

static void uids(void)
{
	static const uint64_t none[2],
		all[2] = {UINT64_MAX, UINT64_MAX},
		some[2] = {UINT64_C(0x0123456789abcdef), UINT64_C(0xfedcba9876543210)};
	char uid[CT_UID_TEXT];

	ct_header_uid(uid, none); /* 00000000-0000-8000-8000-000000000000 */
	OK(strcmp(uid, "2.25.604472133179351442128896") == 0,
		"a UUID of zeros is one of version 8");
	ct_header_uid(uid, all); /* ffffffff-ffff-8fff-bfff-ffffffffffff */
	OK(strcmp(uid, "2.25.340282366920937934553716840013076889599") == 0, "one of ones too");
	ct_header_uid(uid, some); /* 01234567-89ab-8def-bedc-ba9876543210 */
	OK(strcmp(uid, "2.25.1512366075203868711265765693962072592") == 0,
		"others are as they are");
}

static void numbers(void)
{
	static const double x[] = {0.1, -1.0 / 3, 12345.678901234567, -1e-7 / 3, 1e300, -0.0,
		-123456789.123456789, 5e-324};
	struct ct_header h = {0};
	bool fit = true, near = true;

	for (size_t i = 0; i < sizeof x / sizeof *x; i++) {
		const char *s;

		ct_header_numbers(&h, "", "X", 1, &x[i]);
		s = ct_header_get(&h, "X");
		fit &= strlen(s) <= 16;
		near &= fabs(strtod(s, NULL) - x[i]) <= fabs(x[i]) * 1e-8;
	}
	OK(fit, "decimal strings have 16 characters");
	OK(near, "and say what can be said with them");
	ct_header_numbers(&h, "A.0.", "Y", 3, (const double[]){1, -0.0, -2.5});
	OK(strcmp(ct_header_get(&h, "A.0.Y"), "1\\0\\-2.5") == 0, "three, with no -0");
	ct_header_free(&h);
}

static void lists(void)
{
	struct ct_header a = {0}, b = {0};
	struct ct_err e;

	ct_header_put(&a, "", "Same", "%d", 1);
	ct_header_put(&a, "", "Other", "a");
	ct_header_put(&a, "", "Alone", "a");
	ct_header_put(&b, "", "Other", "b");
	ct_header_put(&b, "", "Same", "0");
	ct_header_put(&b, "", "Same", "1");
	OK(strcmp(ct_header_get(&b, "Same"), "1") == 0, "the last counts");
	OK(!ct_header_get(&b, "Alone"), "what is not there is NULL");
	ct_header_agree(&a, &b);
	OK(a.n == 1 && strcmp(ct_header_get(&a, "Same"), "1") == 0, "what two have in common");
	ct_header_code(&a, "S.1.", "T", "v", "s", "m");
	OK(strcmp(ct_header_get(&a, "S.1.T.0.CodeValue"), "v") == 0 &&
			strcmp(ct_header_get(&a, "S.1.T.0.CodingSchemeDesignator"), "s") == 0 &&
			strcmp(ct_header_get(&a, "S.1.T.0.CodeMeaning"), "m") == 0,
		"a code is an item");
	OK(ct_header_check(&a, &e) == 0, "nothing failed");
	ct_header_free(&a);
	ct_header_free(&b);
	OK(a.n == 0 && !a.element, "freed");
}

static bool near3(const double *a, double x, double y, double z)
{
	return fabs(a[0] - x) < 1e-12 && fabs(a[1] - y) < 1e-12 && fabs(a[2] - z) < 1e-12;
}

static void places(void)
{
	static const double turned[3][4] = {{0, -3, 0, 10}, {2, 0.001, 0, 20}, {0, 0, -5, 30}};
	struct ct_slice s = {0};

	ct_slice_place(&s, turned, 2);
	OK(s.placed && near3(s.position, -10, -20, 20), "a place is in LPS, of its plane");
	OK(near3(s.across, 0, -1, 0) && fabs(s.pitch[0] - 2) < 1e-12, "i runs along a row");
	OK(near3(s.down, 1, 0, 0) && fabs(s.pitch[1] - 3) < 1e-6,
		"j down, at a right angle to that");
}

static void t_header(void)
{
	uids();
	numbers();
	lists();
	places();
}

int main(void)
{
	test_hu();
	test_widen();
	test_base();
	test_lossy();
	t_header();
	return tap_done();
}
