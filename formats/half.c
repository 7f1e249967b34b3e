/* half.c: see half.h. */
#include "config.h"
#include "formats/half.h"

#include <math.h>
#include <string.h>

float ct_half_to_float(uint16_t h)
{
	const int exponent = h >> 10 & 31;
	const float fraction = (float)(h & 1023), sign = h & 0x8000 ? -1.0f : 1.0f;

	if (exponent == 0) /* zero and denormals: multiples of 2^-24 */
		return sign * fraction * 0x1p-24f;
	if (exponent == 31)
		return fraction > 0 ? NAN : sign * INFINITY;
	return sign * ldexpf(1024 + fraction, exponent - 25);
}

uint16_t ct_half_from_float(float x)
{
	const uint16_t sign = signbit(x) ? 0x8000 : 0;
	const float a = fabsf(x);
	int exponent;
	float scaled;

	if (isnan(x))
		return (uint16_t)(sign | 0x7e00);
	if (a >= 65520) /* half way past the largest half */
		return (uint16_t)(sign | 0x7c00);
	if (a < 0x1p-14f) /* rintf rounds ties to even; 1024 carries into the smallest normal */
		return (uint16_t)(sign | (int)rintf(a * 0x1p24f));
	frexpf(a, &exponent);                     /* a = m 2^exponent, m in [1/2, 1) */
	scaled = rintf(ldexpf(a, 11 - exponent)); /* in [1024, 2048] */
	return (uint16_t)(sign | (((exponent + 14) << 10) + (int)scaled - 1024));
}

float ct_half_from_bfloat(uint16_t b)
{
	const uint32_t bits = (uint32_t)b << 16;
	float x;

	memcpy(&x, &bits, sizeof x);
	return x;
}
