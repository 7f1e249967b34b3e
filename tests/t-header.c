/* The elements of a DICOM header: UIDs, decimal strings, what several have in common; the place of
 * a plane. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "series/header.h"
#include "series/slice.h"
#include "tap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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

int main(void)
{
	uids();
	numbers();
	lists();
	places();
	return tap_done();
}
