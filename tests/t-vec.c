/* t-vec.c: core/vec.h at the level that this program is compiled for, against plain C.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/vec-exp.h"
#include "core/vec-i16.h"
#include "tests/tap.h"

#include <float.h>
#include <stdbool.h>

enum { MOST = 64 };

/* A kernel of a level that this processor lacks must not run. */
static bool runs(void)
{
	struct ct_err e;
	char word[3] = {'v', (char)('0' + CT_SIMD_LEVEL), 0};

	return CT_SIMD_LEVEL == 1 || ct_simd_use(word, &e) == 0;
}

static void parts(void)
{
	float in[MOST], out[MOST];
	double apart[MOST];
	bool same = true;

	for (int i = 0; i < MOST; i++)
		in[i] = (float)(i + 1);
	for (size_t n = 0; n <= CT_F32_LANES; n++) {
		ct_f32 v = ct_f32_load_n(in, n);

		for (size_t i = 0; i < CT_F32_LANES; i++)
			same = same && v[i] == (i < n ? in[i] : 0);
		memset(out, 0, sizeof out);
		ct_f32_store_n(out, ct_f32_load(in), n);
		for (size_t i = 0; i < MOST; i++)
			same = same && out[i] == (i < n ? in[i] : 0);
	}
	OK(same, "the first n lanes are loaded and stored, and no others");
	same = true;
	for (size_t n = 0; n <= CT_F32_LANES; n++)
		for (size_t i = 0; i < CT_F32_LANES; i++)
			same = same && ct_i32_first(n)[i] == (i < n ? -1 : 0);
	OK(same, "a mask of the first n lanes");
	same = true;
	for (size_t i = 0; i < CT_F32_LANES; i++)
		same = same && ct_f32_slide(ct_f32_load(in), ct_f32_load(in + CT_F32_LANES))[i] ==
				       in[CT_F32_LANES + i - 1];
	OK(same, "the last lane slides in");
	OK(signbit(ct_f32_set(-0.0f)[0]), "all lanes -0");
	ct_f64_narrow(out, ct_f64_widen(in + 3) * 2.0);
	same = true;
	for (size_t i = 0; i < CT_F64_LANES; i++)
		same = same && out[i] == 2 * in[i + 3];
	OK(same, "floats as doubles and back");
	same = true;
	for (size_t i = 0; i < 3 * CT_F64_LANES; i++)
		apart[i] = (double)i;
	for (size_t i = 0; i < CT_F64_LANES; i++)
		same = same && ct_f64_gather(apart + 1, 3)[i] == (double)(3 * i + 1);
	OK(same, "doubles that are apart");
}

static bool same_as(ct_f32 v, float want)
{
	for (size_t i = 0; i < CT_F32_LANES; i++)
		if (memcmp(&(float){v[i]}, &want, sizeof want) != 0)
			return false;
	return true;
}

static bool same_as64(ct_f64 v, double want)
{
	for (size_t i = 0; i < CT_F64_LANES; i++)
		if (memcmp(&(double){v[i]}, &want, sizeof want) != 0)
			return false;
	return true;
}

/* int16_t, whose register is half as long. */
static void halves(void)
{
	static const float around[] = {
		0.5f, 1.5f, -0.5f, -1.5f, 2.4999998f, -32767.0f, 32767.0f, -0.0f};
	static const int32_t whole[] = {0, 2, 0, -2, 2, -32767, 32767, 0};
	int16_t in[MOST], out[MOST];
	bool same = true;

	for (int i = 0; i < MOST; i++)
		in[i] = (int16_t)(i % 2 ? -32768 + i : 32767 - i);
	for (size_t n = 0; n <= CT_F32_LANES; n++) {
		const ct_i32 v = ct_i32_load_i16(in + 1, n);

		for (size_t i = 0; i < CT_F32_LANES; i++)
			same = same && v[i] == (i < n ? in[i + 1] : 0) &&
			       ct_f32_from(v)[i] == (float)v[i];
		memset(out, 0, sizeof out);
		ct_i32_store_i16(out, ct_i32_load_i16(in, CT_F32_LANES), n);
		for (size_t i = 0; i < MOST; i++)
			same = same && out[i] == (i < n ? in[i] : 0);
	}
	OK(same, "the first n 16-bit numbers are loaded and stored, and no others");
	same = true;
	for (size_t k = 0; k < sizeof whole / sizeof *whole; k++)
		for (size_t i = 0; i < CT_F32_LANES; i++)
			same = same && ct_i32_round(ct_f32_set(around[k]))[i] == whole[k];
	OK(same, "the nearest whole number, the even one of two");
}

static void elements(void)
{
	static const float x[] = {-3.5f, -1, -0.25f, 0, 0.3f, 1, 2.75f, 1e6f, 3e-39f};
	bool least = true, most = true, size = true, root = true, whole = true, pick = true;

	for (size_t i = 0; i < sizeof x / sizeof *x; i++) {
		const ct_f32 a = ct_f32_set(x[i]);
		const ct_f64 d = ct_f64_set((double)x[i]);

		for (size_t j = 0; j < sizeof x / sizeof *x; j++) {
			const ct_f32 b = ct_f32_set(x[j]);
			const ct_f64 f = ct_f64_set((double)x[j]);

			least = least && same_as(ct_f32_min(a, b), x[i] < x[j] ? x[i] : x[j]) &&
				same_as64(ct_f64_min(d, f), (double)(x[i] < x[j] ? x[i] : x[j]));
			most = most && same_as(ct_f32_max(a, b), x[i] > x[j] ? x[i] : x[j]) &&
			       same_as64(ct_f64_max(d, f), (double)(x[i] > x[j] ? x[i] : x[j]));
			pick = pick &&
			       same_as(ct_f32_pick(a < b, a, b), x[i] < x[j] ? x[i] : x[j]) &&
			       same_as64(ct_f64_pick(d < f, d, f),
				       (double)(x[i] < x[j] ? x[i] : x[j]));
		}
		size = size && same_as(ct_f32_abs(a), fabsf(x[i])) &&
		       same_as64(ct_f64_abs(d), fabs((double)x[i]));
		whole = whole && ct_f64_floor(d)[0] == floor((double)x[i]);
		if (x[i] >= 0)
			root = root && same_as(ct_f32_sqrt(a), sqrtf(x[i])) &&
			       same_as64(ct_f64_sqrt(d), sqrt((double)x[i]));
	}
	OK(least, "the lesser");
	OK(most, "the greater");
	OK(pick, "one or the other by a mask");
	OK(size, "without the sign");
	OK(whole, "rounded down");
	OK(root, "square roots are correctly rounded");
	OK(same_as(ct_f32_min(ct_f32_set(NAN), ct_f32_set(2)), 2) &&
			same_as(ct_f32_max(ct_f32_set(NAN), ct_f32_set(2)), 2),
		"of NaN and b, b");
	OK(isnan(ct_f32_min(ct_f32_set(2), ct_f32_set(NAN))[0]) &&
			isnan(ct_f64_max(ct_f64_set(2), ct_f64_set((double)NAN))[0]),
		"of a and NaN, NaN");
}

static void fused(void)
{
	const float a = 1 + FLT_EPSILON, c = -(1 + 2 * FLT_EPSILON);
	const ct_f32 got = ct_f32_fma(ct_f32_set(a), ct_f32_set(a), ct_f32_set(c));
	const float rounded = a * a; /* 1 + 2 eps: what is below half a unit is lost */

	OK(same_as(got, CT_SIMD_LEVEL == 2 ? rounded + c : fmaf(a, a, c)),
		"a product and a sum are rounded %s", CT_SIMD_LEVEL == 2 ? "each" : "once");
}

static void exponentials(void)
{
	double worst = 0, worst64 = 0;

	for (double x = -87; x <= 88; x += 0.00371) {
		const double want = exp(x), f = (double)(float)x;

		worst = fmax(worst, fabs((double)ct_f32_exp(ct_f32_set((float)x))[0] / exp(f) - 1));
		worst64 = fmax(worst64, fabs(ct_f64_exp(ct_f64_set(x))[0] / want - 1));
	}
	OK(worst < 1.3e-7, "e^x in float to %.3g", worst);
	OK(worst64 < 5e-16, "e^x in double to %.3g", worst64);
	OK(same_as(ct_f32_exp(ct_f32_set(100)), ct_f32_exp(ct_f32_set(88))[0]) &&
			same_as(ct_f32_exp(ct_f32_set(-1e30f)), ct_f32_exp(ct_f32_set(-87))[0]) &&
			ct_f64_exp(ct_f64_set(1e9))[0] == ct_f64_exp(ct_f64_set(700))[0] &&
			ct_f64_exp(ct_f64_set(-1e9))[0] == ct_f64_exp(ct_f64_set(-700))[0],
		"as at the end beyond");
	OK(isnan(ct_f32_exp(ct_f32_set(NAN))[0]) && isnan(ct_f64_exp(ct_f64_set((double)NAN))[0]),
		"NaN gives NaN");
}

static void sums(void)
{
	static const double x[CT_SUM_LANES] = {1e16, 1, -1e16, 1, 3, -7, 1e-3, 2};
	struct ct_sum8 s;
	double want = 0;

	for (size_t p = 0; p < CT_SUM_PARTS; p++)
		s.part[p] = ct_f64_load(x + p * CT_F64_LANES);
	for (size_t i = 0; i < CT_SUM_LANES; i++)
		want += x[i];
	OK(ct_sum8_total(&s) == want, "eight sums are added from the first to the last");
}

static void tables(void)
{
	enum { TABLE = 4 * CT_F32_LANES };
	float t[TABLE + 1];
	bool one = true, two = true, four = true, far = true, order = true;

	for (int i = 0; i <= TABLE; i++)
		t[i] = (float)(i * i);
	for (int32_t first = 0; first < TABLE; first++) {
		const ct_i32 at = (ct_i32_count(first) * 5) & (TABLE - 1);
		const ct_f32 a = ct_f32_table(t, at), b = ct_f32_table2(t, at),
			     c = ct_f32_table4(t, at), d = ct_f32_gather(t, at);
		const ct_i32 more = ct_i32_max(at, ct_i32_count(first)),
			     less = ct_i32_min(at, ct_i32_count(first));
		ct_f32 e, f;

		ct_f32_gather2(&e, &f, t, at);
		for (int l = 0; l < CT_F32_LANES; l++) {
			const int i = (first + l) * 5 % TABLE, j = first + l;

			one = one && a[l] == t[i % CT_F32_LANES];
			two = two && b[l] == t[i % (2 * CT_F32_LANES)];
			four = four && c[l] == t[i];
			far = far && d[l] == t[i] && e[l] == t[i] && f[l] == t[i + 1];
			order = order && more[l] == (i > j ? i : j) && less[l] == (i < j ? i : j);
		}
	}
	OK(one && two && four, "entries of tables of one, two and four registers");
	OK(far, "entries from anywhere, and pairs of them");
	OK(order, "the lesser and the greater whole number");
}

int main(void)
{
	if (!runs()) {
		printf("1..0 # skip this processor has no v%d\n", CT_SIMD_LEVEL);
		return 0;
	}
	OK(CT_VEC_BYTES == (CT_SIMD_LEVEL == 4          ? 64
				   : CT_SIMD_LEVEL == 3 ? 32
							: 16),
		"registers of %d bytes", CT_VEC_BYTES);
	parts();
	halves();
	elements();
	tables();
	fused();
	exponentials();
	sums();
	return tap_done();
}
