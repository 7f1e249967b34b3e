/* fdk-cosine.c: see fdk-cosine.h. In pieces of known length, which the compiler makes vectors of.
 */
#include "config.h"
#include "recon/fdk-cosine.h"
#include "core/vec.h"

#include <math.h>

void CT_SIMD_HERE(ct_fdk_cosine)(size_t w, float *weight, const float *share_of, double foot,
	double pitch, double y, double d)
{
	enum { N = 32 };
	double r2 = d * d + y * y, cosine[N];

	for (size_t from = 0; from < w; from += N) {
		double first = (double)from - foot;
		size_t n = w - from < N ? w - from : N;

		for (int k = 0; k < N; k++) {
			double x = (first + k) * pitch;

			cosine[k] = d / sqrt(r2 + x * x);
		}
		for (size_t k = 0; k < n; k++)
			weight[from + k] = (float)((double)share_of[from + k] * cosine[k]);
	}
}
