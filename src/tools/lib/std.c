/* std.c: see std.h. */
#include "config.h"
#include "tools/lib/std.h"
#include "cli/keep.h"
#include "formats/format.h"
#include "formats/io.h"
#include "resolution/expected.h"

#include <string.h>

int std_of_solver(struct ct_vol *std, const struct ct_vol *x, const char *lo,
	const struct lowres_is *is, const struct ct_env *env, struct ct_err *e)
{
	if (ct_vol_alloc(std, x->n, e))
		return -1;
	memcpy(std->affine, x->affine, sizeof std->affine);
	return ct_expected_error(std->data, x, &is->by, is->noise, env, e) ? ct_blame(e, lo) : 0;
}

static int write_std(const char *path, struct ct_vol *std, size_t n,
	const struct ct_meta *const from[], const struct ct_env *env, struct ct_err *e)
{
	return ct_meta_set(&std->meta, CT_META_QUANTITY, CT_QUANTITY_ERROR, e) ||
			       ct_meta_step(&std->meta, env, n, from, e) ||
			       ct_vol_write(path, std, env, e)
		       ? -1
		       : 0;
}

int std_write(const char *path, struct ct_vol *std, const char *out, const struct ct_vol *x,
	size_t n, const struct ct_meta *const from[], const struct ct_env *env, struct ct_err *e)
{
	struct ct_out_set both = {0};
	struct ct_env own = *env;
	int rc;

	own.together = path ? &both : NULL;
	rc = (path && write_std(path, std, n, from, &own, e)) || ct_keep_vol(out, x, &own, e) ||
			     ct_out_set_commit(&both, e)
		     ? -1
		     : 0;
	ct_out_set_drop(&both);
	return rc;
}
