/* geometry-json.c: scanner files of R2-Gaussian (and of TIGRE's names) in JSON.
 *
 * The keys stand at the top or in an object "scanner":
 *   DSO, DSD            source to isocentre, to detector
 *   nDetector           [rows, columns] or one number
 *   sDetector           size [v, u] or one number; or dDetector, that of a pixel
 *   sVoxel, offOrigin   size of the volume [x, y, z] and offset of its centre from the isocentre;
 *                       nVoxel  its voxels, of which dVoxel is the size if there is no sVoxel
 *   offDetector         [u, v], v up
 *   totalAngle, startAngle  degrees;   numTrain  number of views;   mode  cone | parallel
 *   unit                mm | cm | m, of all lengths
 * and of our own, for what a measured scan needs:
 *   tilt                of the detector in its plane, u towards v, degrees
 *   offSource           [u, v] of the source, v up
 *   angles              of every view, degrees, in place of totalAngle and startAngle
 *   vectors             of every view twelve numbers, as of ASTRA's cone_vec: source, centre of the
 *                       detector, u, v, each x, y, z; of a parallel beam the first three point
 * along the rays; in place of DSO, DSD, sizes of pixels and all offsets Without that lengths are in
 * a unit of the file's own: the one in which sVoxel is the size of our volume (its largest extent);
 * without sVoxel, or without a volume, they are mm. randomAngle, rotDetector, COR  only if they say
 * nothing: false, zeros Keys of these programs that do not place rays are passed over; any other is
 * an error. SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/mem.h"
#include "core/vec3.h"
#include "formats/io.h"
#include "tools/lib/geometry-json.h"

#include <jansson.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct reader {
	const char *path;
	const json_t *o;
};

/* n numbers of a key, or one for all: 0; 1 if it is not there; -1. */
static int numbers(const struct reader *r, const char *key, size_t n, double *x, struct ct_err *e)
{
	const json_t *v = json_object_get(r->o, key);

	if (!v || json_is_null(v))
		return 1;
	if (json_is_array(v) && json_array_size(v) != n)
		return ct_fail(e, CT_EINPUT, "%s: %s has %zu numbers, not %zu", r->path, key,
			json_array_size(v), n);
	for (size_t i = 0; i < n; i++) {
		const json_t *item = json_is_array(v) ? json_array_get(v, i) : v;

		if (!json_is_number(item) || !isfinite(json_number_value(item)))
			return ct_fail(e, CT_EINPUT, "%s: %s is not a number", r->path, key);
		x[i] = json_number_value(item);
	}
	return 0;
}

/* Offsets: one number does not say along which axis, but for 0. */
static int offsets(const struct reader *r, const char *key, size_t n, double *x, struct ct_err *e)
{
	const json_t *v = json_object_get(r->o, key);

	return json_is_number(v) && json_number_value(v) != 0
		       ? ct_fail(e, CT_EINPUT, "%s: %s is one number, not %zu", r->path, key, n)
		       : numbers(r, key, n, x, e);
}

/* All but the first PLACES and ABSENT place no rays. */
static const char *const keys[] = {"DSO", "DSD", "nDetector", "sDetector", "dDetector", "nVoxel",
	"sVoxel", "dVoxel", "offOrigin", "offDetector", "totalAngle", "startAngle", "numTrain",
	"mode", "unit", "tilt", "offSource", "angles", "vectors", "randomAngle", "rotDetector",
	"COR", "accuracy", "filter", "noise", "possion_noise", "gaussian_noise", "numVal",
	"convert", "normalize", "rescale_slope", "rescale_intercept"};
enum { KEYS = sizeof keys / sizeof *keys, PLACES = 19, ABSENT = 3 };

static bool says_nothing(const json_t *v)
{
	for (size_t i = 0; json_is_array(v) && i < json_array_size(v); i++)
		if (!says_nothing(json_array_get(v, i)))
			return false;
	return json_is_array(v) || json_is_null(v) || json_is_false(v) ||
	       (json_is_number(v) && json_number_value(v) == 0);
}

/* Every key is known, and those that are not used say nothing. `root` is what the object lies in,
 * or the object. */
static int check_keys(const struct reader *r, const json_t *root, struct ct_err *e)
{
	const char *key;
	const json_t *v;

	json_object_foreach ((json_t *)(uintptr_t)r->o, key, v) {
		struct ct_words_guess g = {.word = key, .n = strlen(key)};
		char hint[CT_WORDS_HINT];
		size_t at = 0;

		while (at < KEYS && strcmp(key, keys[at]) != 0)
			at++;
		if (at < PLACES || at >= PLACES + ABSENT) {
			if (at < KEYS || (r->o == root && strcmp(key, "scanner") == 0))
				continue;
			for (size_t k = 0; k < PLACES; k++)
				ct_words_guess(&g, keys[k], strlen(keys[k]));
			return ct_fail(e, CT_EINPUT,
				"%s: the key %.40s is not known, see ct-scans(5)%s", r->path, key,
				ct_words_hint(hint, &g, ""));
		}
		if (!says_nothing(v))
			return ct_fail(e, CT_EINPUT,
				"%s: %s is not supported: expected none, false or zeros", r->path,
				key);
	}
	for (size_t k = 0; k < PLACES + ABSENT && r->o != root; k++)
		if (json_object_get(root, keys[k]))
			return ct_fail(e, CT_EINPUT,
				"%s: %s stands beside scanner: expected inside of it", r->path,
				keys[k]);
	return 0;
}

static int mode(
	struct ct_geometry *s, const struct reader *r, const struct ct_vol *grid, struct ct_err *e)
{
	const json_t *v = json_object_get(r->o, "mode");
	const char *word = json_string_value(v);
	int beam;

	if (!v || json_is_null(v))
		return 0;
	if (!word)
		return ct_fail(e, CT_EINPUT, "%s: mode is not a text", r->path);
	if (ct_words_take(&beam, CT_WORDS(CT_BEAM_LIST), "beam", word, e))
		return ct_blame(e, r->path);
	if (grid)
		ct_geometry_default(s, (enum ct_beam)beam, grid);
	s->beam = (enum ct_beam)beam;
	return 0;
}

#define UNIT_LIST(X) X(MM, "mm") X(CM, "cm") X(M, "m")
enum unit { UNIT_LIST(CT_WORD_VALUE) };
/* The length in mm of the unit that the file says: 0; 1 if it says none; -1. */
static int unit_of(double *mm, const struct reader *r, struct ct_err *e)
{
	static const double lengths[] = {[MM] = 1, [CM] = 10, [M] = 1000};
	const json_t *v = json_object_get(r->o, "unit");
	int place;

	if (!v || json_is_null(v))
		return 1;
	if (!json_is_string(v))
		return ct_fail(e, CT_EINPUT, "%s: unit is not a text", r->path);
	if (ct_words_take(&place, CT_WORDS(UNIT_LIST), "unit", json_string_value(v), e))
		return ct_blame(e, r->path);
	*mm = lengths[place];
	return 0;
}

/* The n counts of key[0], which may be given before, and the size of each: of key[1] all together,
 * or of key[2]; both agree where the file has all three. 0; 1 if there are no sizes; -1. */
static int cells(const struct reader *r, const char *const key[3], size_t n, double *count,
	double *mm, struct ct_err *e)
{
	const double hair = 1e-3; /* of rounded numbers */
	double each[3];
	const int counted = numbers(r, key[0], n, count, e);
	int got;

	if (counted < 0)
		return -1;
	for (size_t a = 0; a < n; a++)
		if (!(count[a] >= 1 && count[a] <= 1e6) || count[a] != floor(count[a]))
			return ct_fail(e, CT_EINPUT, "%s: %s of %g", r->path, key[0], count[a]);
	got = numbers(r, key[1], n, mm, e);
	for (size_t a = 0; a < n && got == 0; a++)
		mm[a] /= count[a];
	if (got)
		return got > 0 ? numbers(r, key[2], n, mm, e) : got;
	if ((got = numbers(r, key[2], n, each, e)) != 0 || counted != 0)
		return got < 0 ? -1 : 0;
	for (size_t a = 0; a < n; a++)
		if (!(fabs(each[a] - mm[a]) <= hair * fabs(mm[a])))
			return ct_fail(e, CT_EINPUT,
				"%s: %s says %g of each, but %s over %s is %g: one of them is wrong",
				r->path, key[2], each[a], key[1], key[0], mm[a]);
	return 0;
}

static int detector(struct ct_geometry *s, const struct reader *r, double unit, struct ct_err *e)
{
	static const char *const key[] = {"nDetector", "sDetector", "dDetector"};
	double n[2] = {(double)s->h, (double)s->w}, size[2];
	const int got = cells(r, key, 2, n, size, e);

	if (got)
		return got < 0 ? -1 : ct_fail(e, CT_EINPUT, "%s: no sDetector", r->path);
	s->h = s->beam == CT_FAN ? 1 : (size_t)n[0];
	s->w = (size_t)n[1];
	s->pitch[0] = size[1] * unit;
	s->pitch[1] = size[0] * unit;
	return 0;
}

/* Of which vectors say where they are. */
static int pixels(struct ct_geometry *s, const struct reader *r, struct ct_err *e)
{
	static const char *const placed[] = {"DSO", "DSD", "sDetector", "dDetector", "offOrigin",
		"offDetector", "totalAngle", "startAngle", "tilt", "offSource", "angles"};
	double n[2] = {(double)s->h, (double)s->w};

	for (size_t k = 0; k < sizeof placed / sizeof *placed; k++)
		if (json_object_get(r->o, placed[k]))
			return ct_fail(e, CT_EINPUT,
				"%s: %s stands beside vectors, which say it: expected one of them",
				r->path, placed[k]);
	if (numbers(r, "nDetector", 2, n, e) < 0)
		return -1;
	for (int a = 0; a < 2; a++)
		if (!(n[a] >= 1 && n[a] <= 1e6) || n[a] != floor(n[a]))
			return ct_fail(e, CT_EINPUT, "%s: nDetector of %g", r->path, n[a]);
	s->h = s->beam == CT_FAN ? 1 : (size_t)n[0];
	s->w = (size_t)n[1];
	return 0;
}

/* The volume that the file names, in mm about the world's origin; none, n = 0, without nVoxel. */
static int volume(struct ct_vol *v, const struct reader *r, struct ct_err *e)
{
	static const char *const key[] = {"nVoxel", "sVoxel", "dVoxel"};
	double n[3], mm[3], unit = 1;
	int got = unit_of(&unit, r, e) < 0 ? -1 : numbers(r, key[0], 3, n, e);

	if (got == 0)
		got = cells(r, key, 3, n, mm, e);
	if (got)
		return got < 0 ? -1 : 0;
	for (int a = 0; a < 3; a++) {
		if (!(mm[a] > 0))
			return ct_fail(e, CT_EINPUT, "%s: a voxel of %g mm", r->path, mm[a]);
		mm[a] *= unit;
		v->n[a] = (size_t)n[a];
		v->affine[a][a] = mm[a];
		v->affine[a][3] = -0.5 * mm[a] * (n[a] - 1);
	}
	return 0;
}

/* A list of a key, one item a view, of which there are s->views if `fixed`: 0; 1 if there is none.
 */
static int per_view(const json_t **list, struct ct_geometry *s, const struct reader *r,
	const char *key, bool fixed, struct ct_err *e)
{
	const json_t *v = json_object_get(r->o, key);
	const size_t n = json_array_size(v);

	*list = v;
	if (!v || json_is_null(v))
		return 1;
	if (!json_is_array(v) || n < 1 || n > CT_MAX_VIEWS)
		return ct_fail(e, CT_EINPUT, "%s: %s is no list of 1 to %d views", r->path, key,
			CT_MAX_VIEWS);
	if (fixed && n != s->views)
		return ct_fail(e, CT_EINPUT, "%s: %s is of %zu views, and numTrain %zu", r->path,
			key, n, s->views);
	s->views = n;
	return 0;
}

static int angles(struct ct_geometry *s, const struct reader *r, bool fixed, struct ct_err *e)
{
	const json_t *list;
	const int got = per_view(&list, s, r, "angles", fixed, e);

	if (got)
		return got < 0 ? -1 : 0;
	if (json_object_get(r->o, "totalAngle") || json_object_get(r->o, "startAngle"))
		return ct_fail(e, CT_EINPUT,
			"%s: angles stands beside totalAngle or startAngle: expected one of them",
			r->path);
	return ct_err_any(ct_alloc(&s->angle, s->views, sizeof *s->angle, e) ||
			  numbers(r, "angles", s->views, s->angle, e));
}

enum { DSO_MM = 1000 }; /* of parallel rays, where planes are of no meaning */

static int vectors(
	struct ct_geometry *s, const struct reader *r, double unit, bool fixed, struct ct_err *e)
{
	const json_t *list;
	const int got = per_view(&list, s, r, "vectors", fixed, e);

	if (got)
		return got;
	if (ct_alloc0(&s->view, s->views, sizeof *s->view, e))
		return -1;
	for (size_t k = 0; k < s->views; k++) {
		json_t *one = json_pack("{s:O}", "vectors", json_array_get(list, k));
		const struct reader it = {.path = r->path, .o = one};
		struct ct_view *v = &s->view[k];
		double x[12], length;
		const int bad = one ? numbers(&it, "vectors", 12, x, e) : 1;

		json_decref(one);
		if (bad)
			return bad < 0 ? -1
				       : ct_fail(e, CT_EINPUT, "%s: vectors of view %zu: none",
						 r->path, k);
		length = ct_vec3_length(x);
		for (int a = 0; a < 3; a++) {
			v->centre[a] = s->iso[a] + x[3 + a] * unit;
			v->source[a] = s->beam == CT_PARALLEL
					       ? v->centre[a] - DSO_MM * x[a] / length
					       : s->iso[a] + x[a] * unit;
			v->u[a] = x[6 + a] * unit;
			v->v[a] = x[9 + a] * unit;
		}
		v->angle = atan2(v->source[1] - s->iso[1], v->source[0] - s->iso[0]) * 180 / M_PI;
	}
	return 0;
}

/* In the unit of the file: 0; 1 if one is not there; -1. Parallel rays need none. */
static int distances(struct ct_geometry *s, const struct reader *r, double unit, struct ct_err *e)
{
	const bool parallel = s->beam == CT_PARALLEL;
	const double dso = s->dso, dsd = s->dsd;
	int near = numbers(r, "DSO", 1, &s->dso, e),
	    far = near < 0 ? -1 : numbers(r, "DSD", 1, &s->dsd, e);

	if (near > 0 && parallel)
		s->dso = dso / unit;
	if (far > 0 && parallel)
		s->dsd = dsd / unit;
	return near < 0 || far < 0 ? -1 : (near || far) && !parallel;
}

static int read_scan(
	struct ct_geometry *s, const struct reader *r, const struct ct_vol *grid, struct ct_err *e)
{
	double mm[3] = {0}, box[3], offset[3] = {0}, shift[2] = {0}, source[2] = {0}, views = 0,
	       most = 0, unit = 1;
	const double least = 3, hair = 0.02; /* mm of a scanner; of a volume */
	bool assumed = true;                 /* that they are mm */
	int got, said, counted;

	if (mode(s, r, grid, e) || (said = unit_of(&unit, r, e)) < 0)
		return -1;
	if (grid)
		ct_vol_spacing(grid, mm);
	for (int a = 0; grid && a < 3; a++)
		most = fmax(most, mm[a] * (double)grid->n[a]);
	got = numbers(r, "sVoxel", 3, box, e);
	if (got < 0)
		return -1;
	if (got == 0 && grid) {
		const double largest = fmax(fmax(box[0], box[1]), box[2]);

		if (said == 0 && !(fabs(largest * unit - most) <= hair * most))
			return ct_fail(e, CT_EINPUT,
				"%s: sVoxel is %g mm by its unit, but the volume is %g mm large: one "
				"of the two is wrong",
				r->path, largest * unit, most);
		unit = said == 0 ? unit : most / largest;
		assumed = false;
	}
	if (!(unit > 0 && isfinite(unit)))
		return ct_fail(e, CT_EINPUT, "%s: sVoxel is not positive", r->path);
	if ((counted = numbers(r, "numTrain", 1, &views, e)) < 0)
		return -1;
	if (counted == 0 && !(views >= 1 && views <= CT_MAX_VIEWS && views == floor(views)))
		return ct_fail(e, CT_EINPUT, "%s: numTrain of %g is not a number of views up to %d",
			r->path, views, CT_MAX_VIEWS);
	s->views = views != 0 ? (size_t)views : s->views;
	if ((got = vectors(s, r, unit, views != 0, e)) <= 0)
		return ct_err_any(got < 0 || pixels(s, r, e));
	if ((got = distances(s, r, unit, e)) != 0)
		return got < 0 ? -1 : ct_fail(e, CT_EINPUT, "%s: no DSO or DSD", r->path);
	if (assumed && said == 1 && s->beam != CT_PARALLEL && s->dso > 0 && s->dsd > 0 &&
		fmax(s->dso, s->dsd) < least)
		return ct_fail(e, CT_EINPUT,
			"%s: DSO %g and DSD %g are mm, and no scanner is so small; of metres say "
			"\"unit\": \"m\"",
			r->path, s->dso, s->dsd);
	if (offsets(r, "offOrigin", 3, offset, e) < 0 ||
		offsets(r, "offDetector", 2, shift, e) < 0 ||
		numbers(r, "totalAngle", 1, &s->arc, e) < 0 ||
		numbers(r, "startAngle", 1, &s->start, e) < 0 ||
		numbers(r, "tilt", 1, &s->tilt, e) < 0 ||
		offsets(r, "offSource", 2, source, e) < 0 || angles(s, r, views != 0, e) ||
		detector(s, r, unit, e))
		return -1;
	s->source[0] = source[0] * unit;
	s->source[1] = -source[1] * unit;
	s->dso *= unit;
	s->dsd *= unit;
	s->offset[0] = shift[0] * unit;
	s->offset[1] = -shift[1] * unit;
	for (int a = 0; a < 3; a++)
		s->iso[a] -= offset[a] * unit;
	return 0;
}

int ct_geometry_json_read(struct ct_geometry *s, const char *path, const struct ct_vol *grid,
	struct ct_vol *named, struct ct_err *e)
{
	struct reader r = {.path = path};
	unsigned char *text = NULL;
	json_error_t bad;
	json_t *root;
	size_t n;
	int rc;

	if (ct_slurp(path, &text, &n, e))
		return -1;
	root = json_loadb((const char *)text, n, JSON_REJECT_DUPLICATES, &bad);
	free(text);
	if (!json_is_object(root)) {
		json_decref(root);
		return ct_fail(e, CT_EINPUT, "%s: not a JSON object: line %d: %s", path,
			root ? 1 : bad.line, root ? "another value" : bad.text);
	}
	r.o = json_object_get(root, "scanner");
	if (!json_is_object(r.o))
		r.o = root;
	rc = ct_err_any(check_keys(&r, root, e) || read_scan(s, &r, grid, e) ||
			(named && volume(named, &r, e)));
	json_decref(root);
	if (rc) {
		free(s->angle);
		free(s->view);
		s->angle = NULL;
		s->view = NULL;
	}
	return rc;
}
