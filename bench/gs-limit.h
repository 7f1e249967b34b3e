/* gs-limit.h: the arithmetic that pixels need, alone: those of all ellipses, and no others, in
 * whole vectors in cache: a multiplication and an addition of the pixel, two multiplications of the
 * recurrence. Included once for each level with LANES, TARGET (an attribute) and UPDATE (a name),
 * of which nothing is left. BLOCK is the number of pixels.
 * SPDX-License-Identifier: Apache-2.0
 */
TARGET static void UPDATE(float *p, size_t rounds)
{
	typedef float vector __attribute__((vector_size(4 * LANES)));
	enum { CHAINS = 8 };
	vector e[CHAINS], step[CHAINS];

	for (size_t k = 0; k < rounds; k++) {
		for (size_t j = 0; j < CHAINS; j++) {
			e[j] = (vector){0} + p[0] * 0 + 0.25f;
			step[j] = e[j] * 3.999f;
		}
		for (size_t i = 0; i < BLOCK; i += CHAINS * LANES)
			for (size_t j = 0; j < CHAINS; j++) {
				vector v;

				memcpy(&v, p + i + j * LANES, sizeof v);
				v += 0.5f * e[j];
				memcpy(p + i + j * LANES, &v, sizeof v);
				e[j] *= step[j];
				step[j] *= 0.9999f;
			}
	}
}

#undef LANES
#undef TARGET
#undef UPDATE
