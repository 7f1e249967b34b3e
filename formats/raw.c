/* raw.c: see raw.h. */
#include "config.h"
#include "formats/hash.h"
#include "formats/io.h"
#include "formats/raw.h"
#include "formats/source.h"

#include <stdio.h>
#include <string.h>

int ct_raw_type(const char *word, enum ct_voxel *type, bool *big, struct ct_err *e)
{
#define NAME(value, word) {word, value},
	static const struct ct_voxel_name names[] = {CT_RAW_LIST(NAME){NULL, 0}};
	const size_t len = strcspn(word, ":");

	*big = strcmp(word + len, ":be") == 0;
	if ((*big || word[len] == '\0' || strcmp(word + len, ":le") == 0) &&
		ct_voxel_named(type, names, word, len))
		return 0;
	return ct_fail(e, CT_EUSAGE,
		"--raw: '%s' is not one of" CT_RAW_LIST(CT_WORD_SPACE) ", with :be if big-endian",
		word);
}

int ct_raw_axes(const char *option, const char *word, int world[3], int sign[3], struct ct_err *e)
{
	static const char letters[] = "RLAPSI";
	int seen = 0;

	for (int d = 0; d < 3 && strlen(word) == 3; d++) {
		const char *at = strchr(letters, word[d]);

		if (at) {
			world[d] = (int)(at - letters) / 2;
			sign[d] = (at - letters) % 2 ? -1 : 1;
			seen |= 1 << world[d];
		}
	}
	if (seen != 7)
		return ct_fail(e, CT_EUSAGE,
			"--%s: '%s' is not three letters such as LPS, one each of R/L, A/P and S/I",
			option, word);
	return 0;
}

void ct_raw_place(struct ct_vol *v, const struct ct_raw *how)
{
	double centre[3];

	memset(v->affine, 0, sizeof v->affine);
	for (int d = 0; d < 3; d++)
		v->affine[how->world[d]][d] = how->sign[d] * how->spacing[d];
	ct_vol_centre(v, centre);
	for (int r = 0; r < 3; r++)
		v->affine[r][3] = 0 - centre[r];
}

int ct_raw_read(const char *path, const struct ct_raw *how, struct ct_vol *v, struct ct_err *e)
{
	const struct ct_stored stored = {how->type, how->big, how->slope, how->inter};
	FILE *f = NULL;
	int rc = -1;

	if (ct_io_open(path, &f, e))
		return -1;
	if (ct_vol_alloc(v, how->n, e))
		goto out;
	ct_raw_place(v, how);
	if (ct_vol_check_grid(v, e) || ct_source_whole(f, &stored, ct_vol_count(v), v->data,
					       "its dimensions and type say", e))
		goto out;
	rc = ct_meta_input(&v->meta, path, 2,
		(const struct ct_piece[]){{v->affine, sizeof v->affine},
			{v->data, ct_vol_count(v) * sizeof *v->data}},
		e);
out:
	ct_io_close(f);
	if (rc) {
		ct_vol_free(v);
		ct_blame(e, path);
	}
	return rc;
}
