/* ddnm-input.c: see ddnm-parts.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "tools/ddnm-parts.h"
#include "formats/any.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "shim/image-read.h"

#include <stdlib.h>
#include <string.h>

static int read_picture(const char *path, struct ct_stack *s, struct ct_err *e)
{
	struct ct_piece piece;
	float *gray = NULL;
	size_t h, w;
	int rc = -1;

	if (ct_any_check_picture(path, e) || ct_image_read(path, &w, &h, NULL, &gray, e) ||
		ct_image_read_check(path, w, h, gray, e) || ct_stack_alloc(s, 1, h, w, e))
		goto out;
	piece = (struct ct_piece){s->data, h * w * sizeof *gray};
	memcpy(s->data, gray, h * w * sizeof *gray);
	s->beam = CT_PARALLEL;
	s->view[0] = (struct ct_view){.source = {0, -1000, 0}, .u = {1, 0, 0}, .v = {0, 0, -1}};
	rc = ct_err_any(ct_meta_set(&s->meta, CT_META_QUANTITY, CT_QUANTITY_INTENSITY, e) ||
			ct_meta_input(&s->meta, path, 1, &piece, e));
out:
	free(gray);
	return rc;
}

int ddnm_picture_read(const char *path, struct ct_stack *s, struct ct_err *e)
{
	return ct_any_is_stack(path) ? ct_stack_read(path, s, e) : read_picture(path, s, e);
}

int ddnm_picture_check(const char *path, const struct ct_stack *s, struct ct_err *e)
{
	const char *quantity = ct_meta_get(&s->meta, CT_META_QUANTITY);

	if (!ct_ends_match(path, CT_ENDS_PICTURE) ||
		(s->views == 1 && quantity && strcmp(quantity, CT_QUANTITY_INTENSITY) == 0))
		return 0;
	return ct_fail(e, CT_EUSAGE, "%s: only a picture can be written as PNG; use EXR", path);
}

int ddnm_picture_write(const char *path, const struct ct_stack *s, const char *beside,
	const struct ct_stack *std, const struct ct_env *env, struct ct_err *e)
{
	static const struct ct_format *const formats[] = {&ct_format_exr, &ct_format_png, NULL};
	struct ct_out_set both = {0};
	struct ct_io_rule rule = ct_io_rule_of(env);
	struct ct_env own = *env;
	int rc = 0;

	rule.together = beside ? &both : NULL;
	own.files = &rule;
	if (beside)
		rc = ct_stack_write(beside, std, &own, e);
	if (rc == 0)
		rc = ct_format_write(formats, path,
			&(struct ct_any){.kind = CT_KIND_STACK, .stack = *s},
			&(struct ct_format_how){0}, &own, e);
	if (rc == 0)
		rc = ct_out_set_commit(&both, e);
	ct_out_set_drop(&both);
	return rc;
}
