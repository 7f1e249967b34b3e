/* ply.c: Gaussians as PLY, binary little-endian, so that 3-D Gaussian splatting viewers open them.
 *
 * Properties, all float: x y z nx ny nz f_dc_0..2 opacity scale_0..2 rot_0..3 density. Position in
 * mm, scale is ln of the standard deviation in mm, rot the quaternion w x y z, density the
 * raw signed value that the activation maps. nx..nz are 0; f_dc and opacity are for viewers
 * only: warm for positive and cold for negative density, as opaque as it is strong. What else
 * a set has stands in lines "comment ct:KEY=VALUE", with \n, \\ and \xHH for bytes that a line
 * cannot hold.
 */
#include "config.h"
#include "formats/ply.h"
#include "formats/bytes.h"
#include "formats/ends.h"
#include "formats/format.h"
#include "formats/handler.h"

#include <string.h>

const char *const ct_ply_names[CT_PLY_FIELDS] = {"x", "y", "z", "scale_0", "scale_1", "scale_2",
	"rot_0", "rot_1", "rot_2", "rot_3", "density"};

bool ct_ply_own(const char *key)
{
	static const char *const own[] = {CT_PLY_UNITS, CT_PLY_ACTIVATION, CT_PLY_GAMMA,
		CT_PLY_STEP, CT_PLY_GRID, CT_PLY_AFFINE};

	for (size_t i = 0; i < sizeof own / sizeof *own; i++)
		if (strcmp(own[i], key) == 0)
			return true;
	return false;
}

static int sniff(const unsigned char *data, size_t n)
{
	return n >= 4 && (memcmp(data, "ply\n", 4) == 0 || memcmp(data, "ply\r", 4) == 0)
		       ? CT_SNIFF_MAGIC
		       : CT_SNIFF_NO;
}

static int read_any(
	const unsigned char *data, size_t n, const char *name, struct ct_any *a, struct ct_err *e)
{
	return ct_bytes_read_ply(data, n, name, &a->gauss, e);
}

static int write_any(
	const char *path, const struct ct_any *a, const struct ct_env *env, struct ct_err *e)
{
	return ct_gauss_write(path, &a->gauss, env, e);
}

const struct ct_format ct_format_ply = {.name = "PLY",
	.kind = CT_KIND_GAUSS,
	.ends = CT_ENDS_GAUSS,
	.sniff = sniff,
	.read_bytes = read_any,
	.write = write_any};

int ct_gauss_read(const char *path, struct ct_gauss *g, struct ct_err *e)
{
	static const struct ct_format *const list[] = {&ct_format_ply, NULL};
	struct ct_any a = {0};
	int rc = ct_format_read(list, path, &a, e);

	*g = a.gauss;
	return rc;
}
