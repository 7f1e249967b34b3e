/* ply-write.c: Gaussians to PLY; see ply.h. */
#include "config.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/ply.h"
#include "core/mem.h"
#include "core/stream.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 1024, COLUMNS = 18 };

static void put_escaped(FILE *f, const char *s, bool key)
{
	const bool clash = key && ct_ply_own(s);

	for (const char *p = s; *p; p++) {
		unsigned char c = (unsigned char)*p;

		if (c == '\n')
			fprintf(f, "\\n");
		else if (c == '\\')
			fprintf(f, "\\\\");
		else if (c < ' ' || c == 127 || (key && (c == '=' || (clash && p == s))))
			fprintf(f, "\\x%02x", c);
		else
			fputc(c, f);
	}
}

static int make_header(char **text, size_t *length, const struct ct_gauss *g, struct ct_err *e)
{
	static const char *const columns[COLUMNS] = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0",
		"f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1",
		"rot_2", "rot_3", "density"};
	FILE *f;

	if (ct_stream_open(&f, text, length, e))
		return -1;
	fprintf(f, "ply\nformat binary_little_endian 1.0\n" CT_PLY_COMMENT CT_PLY_UNITS "=mm\n");
	fprintf(f,
		CT_PLY_COMMENT CT_PLY_ACTIVATION "=%s\n" CT_PLY_COMMENT CT_PLY_GAMMA
						 "=%.17g\n" CT_PLY_COMMENT "step=%zu\n",
		CT_WORD(CT_ACTIVATION_LIST, g->activation), g->gamma, g->step);
	if (g->grid[0]) {
		fprintf(f,
			CT_PLY_COMMENT CT_PLY_GRID "=%zu,%zu,%zu\n" CT_PLY_COMMENT CT_PLY_AFFINE
						   "=",
			g->grid[0], g->grid[1], g->grid[2]);
		for (int i = 0; i < 12; i++)
			fprintf(f, "%.17g%c", g->affine[i / 4][i % 4], i < 11 ? ',' : '\n');
	}
	for (size_t i = 0; i < g->meta.n; i++) {
		if (strcmp(g->meta.pair[i].key, CT_META_INPUT) == 0) /* of the file that was read */
			continue;
		fprintf(f, CT_PLY_COMMENT);
		put_escaped(f, g->meta.pair[i].key, true);
		fputc('=', f);
		put_escaped(f, g->meta.pair[i].value, false);
		fputc('\n', f);
	}
	fprintf(f, "element vertex %zu\n", g->n);
	for (int i = 0; i < COLUMNS; i++)
		fprintf(f, "property float %s\n", columns[i]);
	fprintf(f, "end_header\n");
	return ct_stream_close(f, text, e);
}

static float density(const struct ct_gauss *g, size_t i)
{
	return (float)ct_activation_apply(g->activation, g->gamma, (double)g->raw[i]);
}

static void make_row(float row[COLUMNS], const struct ct_gauss *g, size_t i, float most)
{
	/* colour = 0.5 + f_dc times the constant spherical harmonic */
	static const float warm[3] = {0.98f, 0.62f, 0.25f}, cold[3] = {0.25f, 0.55f, 0.98f};
	const float rho = density(g, i), *colour = rho < 0 ? cold : warm;
	float strength = most > 0 ? fabsf(rho) / most : 0;

	strength = fminf(fmaxf(strength, 0.001f), 0.999f);
	for (int a = 0; a < 3; a++) {
		row[a] = g->pos[a][i];
		row[3 + a] = 0;
		row[6 + a] = (colour[a] - 0.5f) / 0.28209479f;
		row[10 + a] = g->scale[a][i];
	}
	row[9] = logf(strength / (1 - strength));
	for (int a = 0; a < 4; a++)
		row[13 + a] = g->rot[a][i];
	row[17] = g->raw[i];
}

int ct_gauss_write(
	const char *path, const struct ct_gauss *g, const struct ct_env *env, struct ct_err *e)
{
	static const size_t row = COLUMNS;
	struct ct_out out = {0};
	float *block = NULL, most = 0;
	size_t n = 0;
	char *header;
	int rc = -1;

	if (make_header(&header, &n, g, e))
		return ct_blame(e, path);
	if (ct_alloc(&block, BLOCK, row * sizeof *block, e) || ct_out_open(&out, path, env, e))
		goto done;
	for (size_t i = 0; i < g->n; i++)
		most = fmaxf(most, fabsf(density(g, i)));
	rc = ct_put(&out, header, n, e);
	for (size_t i = 0; i < g->n && rc == 0; i += BLOCK) {
		const size_t rows = g->n - i < BLOCK ? g->n - i : BLOCK;

		for (size_t k = 0; k < rows; k++)
			make_row(block + k * row, g, i + k, most);
		rc = ct_put(&out, block, rows * row * sizeof *block, e);
	}
	if (rc == 0)
		rc = ct_out_commit(&out, e);
done:
	ct_out_abandon(&out);
	free(block);
	free(header);
	return rc;
}
