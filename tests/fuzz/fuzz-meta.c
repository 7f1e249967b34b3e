/* Hostile metadata, lines KEY=VALUE: what is read from them is refused or sound.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/acquired.h"
#include "driver.h"
#include "operator/degrade.h"
#include "nn/arch.h"
#include "tools/lib/geometry-opts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const int fuzz_rounds = 1500;

static void must_say(const struct ct_err *e)
{
	if (e->code == CT_OK || e->msg[0] == '\0')
		abort();
}

static int parse(struct ct_meta *m, const char *text)
{
	struct ct_err e = {0};

	while (*text) {
		size_t n = strcspn(text, "\n");
		char line[400], *value;

		if (n >= sizeof line)
			return -1;
		memcpy(line, text, n);
		line[n] = '\0';
		value = strchr(line, '=');
		if (value)
			*value++ = '\0';
		if (value && line[0] && ct_meta_set(m, line, value, &e))
			return -1;
		text += n + (text[n] != '\0');
	}
	return 0;
}

/* Each reads its own keys. */
static void degrade(const struct ct_meta *m)
{
	struct ct_degrade d;
	struct ct_err e = {0};
	int rc = ct_degrade_get(m, &d, &e);

	if (rc < 0)
		must_say(&e);
	fuzz_taken += rc == 0;
	for (int a = 0; rc == 0 && a < 3; a++)
		if (!(d.factor[a] >= 1) || !isfinite(d.factor[a]) || !(d.sigma[a] >= 0))
			abort();
}

static void window(const struct ct_meta *m)
{
	struct ct_err e = {0};
	double w[2];

	if (ct_geometry_opts_window(w, NULL, m, &e))
		must_say(&e);
	else if (!(w[0] < w[1]) || !isfinite(w[1] - w[0]))
		abort();
}

static void numbers(const struct ct_meta *m)
{
	static const char *const key[] = {
		CT_META_VOLUME_SIZE, CT_META_VOLUME_AFFINE, CT_META_COARSEN};
	static const size_t n[] = {3, 12, 1};

	for (size_t k = 0; k < 3; k++) {
		struct ct_err e = {0};
		double x[12];
		int rc = ct_meta_numbers(m, key[k], n[k], x, &e);

		if (rc < 0)
			must_say(&e);
		for (size_t i = 0; rc == 0 && i < n[k]; i++)
			if (!isfinite(x[i]))
				abort();
	}
}

static void acquired(const struct ct_meta *m)
{
	struct ct_acquired a;
	struct ct_err e = {0};
	const int rc = ct_acquired_get(&a, m, &e);

	if (rc < 0)
		must_say(&e);
	else if (rc == 0 && ct_acquired_wrong(&a))
		abort();
}

static void arch(const struct ct_meta *m)
{
	const struct ct_tensors w = {.meta = *m};
	struct ct_unet_arch a;
	struct ct_err e = {0};

	if (ct_unet_arch_of(&a, &w, &e))
		must_say(&e);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_meta m = {0};
	char *text = calloc(1, size + 1);

	if (!text)
		return 0;
	if (size)
		memcpy(text, data, size);
	if (parse(&m, text) == 0) {
		degrade(&m);
		window(&m);
		numbers(&m);
		acquired(&m);
		arch(&m);
	}
	ct_meta_free(&m);
	free(text);
	return 0;
}

size_t fuzz_seed(size_t k, unsigned char **data)
{
	static const char *const text[] = {
		"factor=4,4,2\nsigma=1.7,1.7,0\ndecimate=mean\nnoise=3\nwindow=-1024:3071\n"
		"volume.size=8,8,8\nvolume.affine=1,0,0,-4,0,1,0,-4,0,0,1,-4\ncoarsen=4\n"
		"dicom.maker=GE\ndicom.kernel=SOFT\ndicom.thickness=0,0,5\n"
		"dicom.spacing=1,1,5\ndicom.collimation=0.6\n",
		"factor=4\nwindow=-512:3071\nmodel_channels=32\nchannel_mult=1:2\nnum_res_blocks=1\n"
		"attention_resolutions=8\nnum_heads=4\nimage_size=64\nin_channels=1\nout_channels=1\n"};

	if (k > 1)
		return 0;
	*data = (unsigned char *)strdup(text[k]);
	if (!*data)
		exit(99);
	return strlen(text[k]);
}
