/* exr.c: what the reader and the writer of EXR stacks share; see exr.h. */
#include "config.h"
#include "formats/exr.h"
#include "formats/bytes.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/handler.h"

#include <stdio.h>
#include <string.h>

bool ct_exr_reserved(const char *name)
{
	static const char *const ours[] = {CT_EXR_VERSION, CT_EXR_META, "ct:input", "ct:beam",
		"ct:angleDeg", "ct:source", "ct:detCentre", "ct:detU", "ct:detV"};

	for (size_t i = 0; i < sizeof ours / sizeof *ours; i++)
		if (strcmp(name, ours[i]) == 0)
			return true;
	return false;
}

void ct_exr_complaint(exr_const_context_t c, exr_result_t code, const char *msg)
{
	void *user = NULL;
	struct ct_exr_file *f;

	if (!c || exr_get_user_data(c, &user) != EXR_ERR_SUCCESS || !user)
		return;
	f = user;
	if (!f->msg[0])
		snprintf(f->msg, sizeof f->msg, "%s",
			msg && *msg ? msg : exr_get_default_error_message(code));
}

int ct_exr_fail(const struct ct_exr_file *f, const char *path, exr_result_t r, enum ct_code code,
	struct ct_err *e)
{
	if (r == EXR_ERR_OUT_OF_MEMORY)
		code = CT_ENOMEM;
	return ct_fail(
		e, code, "%s: %s", path, f->msg[0] ? f->msg : exr_get_default_error_message(r));
}

static int sniff(const unsigned char *data, size_t n)
{
	return n >= 4 && memcmp(data, "\x76\x2f\x31\x01", 4) == 0 ? CT_SNIFF_MAGIC : CT_SNIFF_NO;
}

static int read_any(
	const unsigned char *data, size_t n, const char *name, struct ct_any *a, struct ct_err *e)
{
	return ct_bytes_read_exr(data, n, name, &a->stack, e);
}

static int write_any(
	const char *path, const struct ct_any *a, const struct ct_env *env, struct ct_err *e)
{
	return ct_stack_write(path, &a->stack, env, e);
}

const struct ct_format ct_format_exr = {.name = "EXR",
	.kind = CT_KIND_STACK,
	.ends = CT_ENDS_STACK,
	.sniff = sniff,
	.read_bytes = read_any,
	.write = write_any};

int ct_stack_read(const char *path, struct ct_stack *s, struct ct_err *e)
{
	static const struct ct_format *const list[] = {&ct_format_exr, NULL};
	struct ct_any a = {0};
	int rc = ct_format_read(list, path, &a, e);

	*s = a.stack;
	return rc;
}
