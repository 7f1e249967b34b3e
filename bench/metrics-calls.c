/* metrics-calls N A B: answers every line of standard input, the name of a figure, with the CPU
 * seconds of one call on one thread and its value. A and B are N^3 floats in [0, 1] each. For
 * b-metrics.sh. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bench.h"
#include "quality/difference.h"

#include <math.h>
#include <string.h>

static const char *const name[CT_SSIM_KINDS + 1] = {
	"r2", "skimage", "wang", "skimage11", "3d", "3d-gauss", "psnr"};

static void read_floats(float *v, size_t n, const char *path)
{
	FILE *f = fopen(path, "rb");

	if (!f || fread(v, sizeof *v, n, f) != n) {
		perror(path);
		exit(1);
	}
	fclose(f);
}

static double ssim(int kind, const size_t n[3], const float *a, const float *b)
{
	const struct ct_ssim_map map = {-2, 2, 0, 1}; /* clips nothing: values of 0 to 1 */
	const struct ct_env env = {0};
	double *sum = malloc(2 * n[2] * sizeof *sum), total = 0, count = 0;
	struct ct_ssim_rule r;
	struct ct_err e;

	ct_ssim_rule(&r, (enum ct_ssim_kind)kind, 1);
	for (int axis = kind == CT_SSIM_R2 ? 0 : 2; axis < 3; axis++) {
		if (!sum ||
			ct_ssim_volume(sum, sum + n[2], &r, axis, n, a, b, NULL, &map, &env, &e))
			exit(1);
		for (size_t k = 0; k < n[2]; k++) {
			total += sum[k];
			count += sum[n[2] + k];
		}
	}
	free(sum);
	return total / count;
}

static double psnr(const size_t n[3], const float *a, const float *b)
{
	const struct ct_ssim_map map = {-HUGE_VAL, HUGE_VAL, 0, 1};
	const struct ct_env env = {0};
	struct ct_difference d;
	struct ct_err e;
	double value;

	if (ct_difference(&d, n, a, b, NULL, &map, false, false, &env, &e))
		exit(1);
	value = 10 * log10(d.total.count / d.total.mapped);
	ct_difference_free(&d);
	return value;
}

int main(int argc, char **argv)
{
	size_t side = argc == 4 ? strtoul(argv[1], NULL, 10) : 0, count = side * side * side;
	const size_t n[3] = {side, side, side};
	float *a = malloc(count * sizeof *a), *b = malloc(count * sizeof *b);
	char line[40];

	if (side < 16 || side > 1024 || !a || !b)
		return 1;
	read_floats(a, count, argv[2]);
	read_floats(b, count, argv[3]);
	while (fgets(line, sizeof line, stdin)) {
		double t = bench_clock(CLOCK_PROCESS_CPUTIME_ID), value = 0;

		line[strcspn(line, "\n")] = '\0';
		for (int k = 0; k <= CT_SSIM_KINDS; k++)
			if (strcmp(line, name[k]) == 0)
				value = k < CT_SSIM_KINDS ? ssim(k, n, a, b) : psnr(n, a, b);
		printf("%.9g %.12g\n", bench_clock(CLOCK_PROCESS_CPUTIME_ID) - t, value);
		fflush(stdout);
	}
	free(a);
	free(b);
	return 0;
}
