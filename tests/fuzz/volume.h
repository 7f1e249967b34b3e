/* volume.h: what a fuzz target of a reader of volumes does with a file. */
#ifndef CT_FUZZ_VOLUME_H
#define CT_FUZZ_VOLUME_H
#include "core/vol.h"
#include "driver.h"

#include <stdio.h>
#include <stdlib.h>

typedef int volume_reader(FILE *f, const char *name, struct ct_vol *v, struct ct_err *e);

/* Read the bytes as a file of that name: all voxels, or an error and nothing. */
static void volume_look(const uint8_t *data, size_t size, const char *name, volume_reader *read)
{
	FILE *f = size ? fmemopen((void *)(uintptr_t)data, size, "rb") : NULL;
	struct ct_vol v = {0};
	struct ct_err e = {0};
	float sum = 0;

	if (!f)
		return;
	if (read(f, name, &v, &e) == 0)
		for (size_t i = 0, n = ct_vol_count(&v); i < n; i++)
			sum += v.data[i];
	else if (v.data || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += e.code == CT_OK && !(sum > 1e38f); /* so that the numbers are read */
	fclose(f);
	ct_vol_free(&v);
}

#endif
