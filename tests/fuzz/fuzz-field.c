/* Hostile tensors of a neural field: refused, or the field has a value. */
#include "config.h"
#include "driver.h"
#include "field/field.h"
#include "formats/format.h"
#include "mem-file.h"
#include "seed-file.h"

const int fuzz_rounds = 1500;

enum { MOST = 1 << 24, POINTS = 8 };

static int value(const struct ct_field *f, struct ct_err *e)
{
	const float x[3 * POINTS] = {0, 0.5f, 1, 1, 0.25f};
	float y[4 * POINTS];
	struct ct_field_work *w;
	int rc;

	if (POINTS % ct_field_segment(f))
		return 0;
	if (ct_field_work_alloc(&w, f, POINTS, e))
		return -1;
	rc = ct_field_forward(f, w, POINTS, x, y, e);
	ct_field_work_free(w);
	return rc;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_field *f = NULL;
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	int rc = ct_tensors_read(mem_file(data, size, mem_length(data, size, MOST)), &w, &e);

	if (rc == 0)
		rc = ct_field_get(&f, &w, &e);
	if (rc == 0)
		rc = value(f, &e);
	if (rc && (e.code == CT_OK || e.msg[0] == '\0'))
		abort();
	fuzz_taken += rc == 0;
	ct_field_free(f);
	ct_tensors_free(&w);
	return 0;
}

/* Of every encoding, one with attention. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	struct ct_field_shape s = {.network = {.width = 2, .depth = 2, .skip = 1, .outputs = 1}};
	struct ct_tensors w = {0};
	struct ct_err e = {0};
	struct ct_field *f;
	size_t n;

	if (k > 3)
		return 0;
	s.encoding = (struct ct_encoding){.kind = CT_ENCODING_FREQUENCIES, .frequencies = 1};
	if (k == 1 || k == 2)
		s.encoding =
			(struct ct_encoding){.kind = k == 1 ? CT_ENCODING_GRID : CT_ENCODING_HASH,
				.levels = 2,
				.features = 1,
				.log2_table = k == 1 ? 0 : 3,
				.base = 2,
				.growth = 1.5};
	if (k == 3)
		s.network.attention = (struct ct_attention){2, 2, 2};
	if (ct_field_alloc(&f, &s, 1, &e) || ct_field_put(f, &w, &e))
		exit(99);
	n = seed_file(data, ct_tensors_write(seed_path(), &w, false, &seed_env, &e));
	ct_field_free(f);
	ct_tensors_free(&w);
	return n;
}
