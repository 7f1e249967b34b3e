/* tensors-read.c: tensors by name, of all formats that hold some; see format.h. */
#include "config.h"
#include "formats/any.h"
#include "formats/format.h"

int ct_tensors_read(const char *path, struct ct_tensors *w, struct ct_err *e)
{
	static const struct ct_format *const list[] = {
		&ct_format_safetensors, &ct_format_pytorch, NULL};
	struct ct_any a = {0};
	int rc = ct_format_read(list, path, &a, e);

	*w = a.tensors;
	return rc;
}
