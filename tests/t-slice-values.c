/* Stored values to HU: 32 bits exactly, and padding that lossy compression moved. */
#include "config.h"
#include "tap.h"
#include "series/slice.h"

#include <stdint.h>
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

int main(void)
{
	test_base();
	test_lossy();
	return tap_done();
}
