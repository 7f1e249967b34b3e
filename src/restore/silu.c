/* silu.c: see silu.h. */
#include "config.h"
#include "restore/silu.h"
#include "unet/sigmoid.h"

void CT_SIMD_HERE(ct_silu_rows)(size_t rows, size_t n, float *h, float *a, const float *bias)
{
	for (size_t r = 0; r < rows; r++, a += n, h += n)
		for (size_t i = 0; i < n; i += CT_F32_LANES) {
			size_t m = n - i < CT_F32_LANES ? n - i : CT_F32_LANES;
			ct_f32 x = ct_f32_load_n(a + i, m) + ct_f32_load_n(bias + i, m);

			ct_f32_store_n(a + i, x, m);
			ct_f32_store_n(h + i, x * ct_f32_sigmoid(x), m);
		}
}

void CT_SIMD_HERE(ct_silu_rows_back)(size_t count, float *d, const float *h, const float *a)
{
	for (size_t i = 0; i < count; i += CT_F32_LANES) {
		size_t m = count - i < CT_F32_LANES ? count - i : CT_F32_LANES;
		ct_f32 s = ct_f32_sigmoid(ct_f32_load_n(a + i, m));

		ct_f32_store_n(d + i,
			ct_f32_load_n(d + i, m) * (s + ct_f32_load_n(h + i, m) * (1.0f - s)), m);
	}
}
