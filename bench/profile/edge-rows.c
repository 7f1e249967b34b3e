/* edge-rows.c: the rows of profile.h of volumes from standard input, for rows.py.
 *
 * A request: int32 nx, ny, nz, axis, alone, no; float32 factor; nx ny nz float32 HU. The answer:
 * int32 rows of each set, and 256 rows of each in float32, of which those past that are 0.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "estimate/profile.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 256 };

static int answer(const int32_t head[6], float factor, const float *x)
{
	const size_t n[3] = {(size_t)head[0], (size_t)head[1], (size_t)head[2]};
	static struct ct_profile_rows r;
	struct ct_padding padding = {0};
	struct ct_err err;
	int32_t count[CT_PROFILE_SETS];
	static float out[ROWS][CT_EDGE_ROW];

	if (ct_padding_find(&padding, x, n, &err) ||
		ct_profile_rows_draw(&r, x, &padding, n, head[3], (double)factor, head[4] != 0,
			(unsigned)head[5], NULL, &err)) {
		fprintf(stderr, "edge-rows: %s\n", err.msg);
		return -1;
	}
	for (int k = 0; k < CT_PROFILE_SETS; k++)
		count[k] = r.clipped && k == 0 ? 0 : (int32_t)r.n[k];
	fwrite(count, sizeof count, 1, stdout);
	for (int k = 0; k < CT_PROFILE_SETS; k++) {
		memset(out, 0, sizeof out);
		/* the rows of two axes lie one after the other */
		for (size_t i = 0; i < ROWS && i < r.n[k]; i++)
			memcpy(out[i], r.set[k][r.n[k] > ROWS ? i * r.n[k] / ROWS : i],
				sizeof out[i]);
		fwrite(out, sizeof out, 1, stdout);
	}
	ct_padding_free(&padding);
	return fflush(stdout);
}

int main(void)
{
	int32_t head[6];
	float factor;

	while (fread(head, sizeof head, 1, stdin) == 1 &&
		fread(&factor, sizeof factor, 1, stdin) == 1) {
		const size_t count = (size_t)head[0] * (size_t)head[1] * (size_t)head[2];
		float *x = malloc(count * sizeof *x);

		if (!x || fread(x, sizeof *x, count, stdin) != count || answer(head, factor, x))
			return 1;
		free(x);
	}
	return 0;
}
