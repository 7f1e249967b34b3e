/* Hostile EXR: the reader must refuse or give a sound stack, and leave nothing behind.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "formats/format.h"
#include "formats/any.h"
#include "fuzz-file.h"

#include <stdlib.h>

const int fuzz_rounds = 1500;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct ct_any a = {0};
	const struct ct_stack *s = &a.stack;
	struct ct_err e = {0};
	float sum = 0;

	if (ct_format_read_bytes(&ct_format_exr, data, size, "fuzz", &a, &e) == 0)
		for (size_t i = 0, n = ct_stack_count(s); i < n; i++)
			sum += s->data[i];
	else if (s->data || s->view || e.code == CT_OK || e.msg[0] == '\0')
		abort();
	fuzz_taken += e.code == CT_OK && !(sum > 1e38f); /* so that the numbers are read */
	ct_any_free(&a);
	return 0;
}

/* Noise and a plain picture: chunks as they are and deflated. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	struct ct_stack s = {0};
	struct ct_err e = {0};
	size_t n;

	if (k > 1)
		return 0;
	if (ct_stack_alloc(&s, 1 + k, 20, 8, &e))
		exit(99);
	for (size_t i = 0; i < s.views; i++)
		s.view[i] = (struct ct_view){
			.source = {1000}, .centre = {-500}, .u = {0, 1}, .v = {0, 0, -1}};
	for (size_t i = 0; i < ct_stack_count(&s); i++)
		s.data[i] = k ? 0.5f : (float)(i * 2654435761u % 1000003) / 7;
	ct_meta_set(&s.meta, "history", "ct-project", &e);
	ct_meta_set(&s.meta, "a key too long for the name of an attribute", "x", &e);
	n = seed_file(data, ct_stack_write(seed_path(), &s, &seed_env, &e));
	ct_stack_free(&s);
	return n;
}
