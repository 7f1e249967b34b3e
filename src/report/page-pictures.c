/* page-pictures.c: the pictures of the page of ct-report; see page.h.
 *
 * A picture is int16, row after row: each value less what its neighbours left, above and between
 * predict (the median of left, above and left + above - between), folded to a number that is not
 * negative, all low bytes and then all high bytes, deflated, in base64. The script takes it apart
 * again, and so windows HU, not grey. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/mem.h"
#include "formats/text.h"
#include "picture/montage.h"
#include "report/page.h"

#include <libdeflate.h>
#include <math.h>
#include <stdlib.h>

enum { SIDE = 512, SIDE_OVER = 256, MOST_PICTURES = 15, LEAST_PICTURES = 3, LEVEL = 9 };
#define PIXELS 4e6 /* of all slices of one volume: what a page holds */
#define BODY (-400.0)
#define BODY_SHARE 0.02 /* of a slice that shows some */

/* What of a slice is shown. */
enum kind { BEFORE, AFTER, STD, ERROR, KINDS };
static const char *const names[KINDS] = {"before", "after", "std", "error"};

/* Where the slices of a plane lie. */
struct cut {
	enum ct_montage_plane plane;
	size_t depth;                /* slices that there are */
	size_t n, at[MOST_PICTURES]; /* those that are shown */
	size_t step[2], size[2][2];  /* pixels to a side that become one; width, height: of slices,
				       of maps */
	double mm[2];                /* of such a pixel, across and down */
};

static int slice_of(
	struct ct_montage_slice *s, const struct ct_vol *v, const struct cut *c, size_t k)
{
	return ct_montage_slice_volume(s, v, c->plane,
		ct_montage_position(v, c->plane, ct_cell_centre((double)k) / (double)c->depth));
}

static double value(const struct ct_montage_slice *s, size_t r, size_t c)
{
	return (double)s->data[(ptrdiff_t)r * s->step[0] + (ptrdiff_t)c * s->step[1]];
}

/* Is there something of the patient in slice k? */
static bool shows(const struct ct_vol *v, const struct cut *c, size_t k)
{
	enum { EVERY = 4 };
	struct ct_montage_slice s;
	size_t seen = 0, body = 0;

	if (slice_of(&s, v, c, k))
		return false;
	for (size_t i = 0; i < s.n[0]; i += EVERY)
		for (size_t j = 0; j < s.n[1]; j += EVERY) {
			seen++;
			body += value(&s, i, j) > BODY;
		}
	return (double)body > BODY_SHARE * (double)seen;
}

/* Slices evenly spaced over what shows the patient, or over all. */
static void spread(struct cut *c, const struct ct_vol *v, size_t most)
{
	size_t from = 0, to = c->depth;

	while (from < to && !shows(v, c, from))
		from++;
	while (to > from && !shows(v, c, to - 1))
		to--;
	if (from == to) {
		from = 0;
		to = c->depth;
	}
	c->n = to - from < most ? to - from : most;
	for (size_t i = 0; i < c->n; i++)
		c->at[i] = from + (2 * i + 1) * (to - from) / (2 * c->n);
}

static size_t up(size_t a, size_t b)
{
	return (a + b - 1) / b;
}

/* The three planes, within what a page holds. */
static void cut_all(struct cut c[CT_MONTAGE_PLANES], const struct ct_vol *v)
{
	double pixels = 0, most;

	for (int p = 0; p < CT_MONTAGE_PLANES; p++) {
		struct ct_montage_slice s = {0};
		size_t side;

		c[p] = (struct cut){.plane = (enum ct_montage_plane)p, .depth = 1};
		slice_of(&s, v, &c[p], 0);
		side = s.n[0] > s.n[1] ? s.n[0] : s.n[1];
		c[p].depth = ct_vol_count(v) / (s.n[0] * s.n[1]);
		c[p].step[0] = up(side, SIDE);
		c[p].step[1] = up(side, SIDE_OVER);
		for (int k = 0; k < 2; k++) {
			c[p].size[k][0] = up(s.n[1], c[p].step[k]);
			c[p].size[k][1] = up(s.n[0], c[p].step[k]);
		}
		c[p].mm[0] = s.mm[1];
		c[p].mm[1] = s.mm[0];
		pixels += (double)(c[p].size[0][0] * c[p].size[0][1]);
	}
	most = fmin(fmax(floor(PIXELS / pixels), LEAST_PICTURES), MOST_PICTURES);
	for (int p = 0; p < CT_MONTAGE_PLANES; p++)
		spread(&c[p], v, (size_t)most);
}

static bool has(const struct ct_page *p, enum kind k)
{
	return k == STD ? p->std.name != NULL : k == ERROR ? p->truth.name != NULL : true;
}

/* A number with one digit that is not smaller. */
static double round_up(double x)
{
	const double ten = pow(10, floor(log10(fmax(x, 1))));
	const double m = x / ten;

	return ten * (m <= 1 ? 1 : m <= 2 ? 2 : m <= 5 ? 5 : 10);
}

/* The error that is drawn red: twice the RMS of the body. */
static double most_of(const struct ct_page *p, enum kind k)
{
	double sum = 0, n = 0;

	for (int t = CT_PAGE_LUNG; t < CT_PAGE_TISSUES; t++) {
		const struct ct_page_class *c = &p->tissue[t];
		const double rms = k == STD ? c->expected : c->actual;

		if (c->voxels == 0)
			continue;
		sum += (double)c->voxels * rms * rms;
		n += (double)c->voxels;
	}
	return round_up(n > 0 ? 2 * sqrt(sum / n) : 1);
}

void ct_page_write_meta(FILE *f, const struct ct_page *p)
{
	static const char *const letters[CT_MONTAGE_PLANES] = {"[\"R\",\"L\",\"A\",\"P\"]",
		"[\"R\",\"L\",\"S\",\"I\"]", "[\"A\",\"P\",\"S\",\"I\"]"};
	struct cut cut[CT_MONTAGE_PLANES];

	cut_all(cut, &p->hr.vol);
	fprintf(f, "{\"planes\":[");
	for (int k = 0; k < CT_MONTAGE_PLANES; k++) {
		const struct cut *c = &cut[k];

		fprintf(f,
			"%s\n{\"name\":\"%s\",\"size\":[%zu,%zu],\"over\":[%zu,%zu],\"mm\":[%.9g,%.9g],"
			"\"letters\":%s,\"at\":[",
			k ? "," : "", CT_WORD(CT_MONTAGE_PLANE_LIST, k), c->size[0][0],
			c->size[0][1], c->size[1][0], c->size[1][1], c->mm[0], c->mm[1],
			letters[k]);
		for (size_t i = 0; i < c->n; i++)
			fprintf(f, "%s%.4f", i ? "," : "",
				ct_montage_position(&p->hr.vol, c->plane,
					ct_cell_centre((double)c->at[i]) / (double)c->depth));
		fprintf(f, "]}");
	}
	fprintf(f, "],\n\"most\":{");
	for (int k = STD, n = 0; k <= ERROR; k++)
		if (has(p, (enum kind)k))
			fprintf(f, "%s\"%s\":%g", n++ ? "," : "", names[k],
				most_of(p, (enum kind)k));
	fprintf(f, "}}\n");
}

static int predicted(const int16_t *v, size_t w, size_t x, size_t y)
{
	const int left = x ? v[-1] : y ? v[-(ptrdiff_t)w] : 0;
	const int above = y ? v[-(ptrdiff_t)w] : left;
	const int between = x && y ? v[-(ptrdiff_t)w - 1] : left;
	const int most = left > above ? left : above, least = left > above ? above : left;

	return between >= most ? least : between <= least ? most : left + above - between;
}

/* The bytes of a picture, low ones and then high ones. */
static int split(unsigned char *plain, const float *x, size_t w, size_t h, struct ct_err *e)
{
	const size_t n = w * h;
	int16_t *v;

	if (ct_alloc(&v, n, sizeof *v, e))
		return -1;
	for (size_t i = 0; i < n; i++)
		v[i] = (int16_t)lrintf(fminf(fmaxf(x[i], -32768), 32767));
	for (size_t y = 0; y < h; y++)
		for (size_t at = 0; at < w; at++) {
			const size_t i = y * w + at;
			const int16_t miss = (int16_t)(v[i] - predicted(&v[i], w, at, y));
			const uint16_t code =
				(uint16_t)(2 * (uint16_t)miss ^ (miss < 0 ? 0xffff : 0));

			plain[i] = (unsigned char)(code & 255);
			plain[n + i] = (unsigned char)(code >> 8);
		}
	free(v);
	return 0;
}

static int put_picture(FILE *f, const float *x, size_t w, size_t h, struct ct_err *e)
{
	struct libdeflate_compressor *z = libdeflate_alloc_compressor(LEVEL);
	const size_t room = z ? libdeflate_zlib_compress_bound(z, 2 * w * h) : 0;
	unsigned char *plain = NULL, *packed = NULL;
	char *text = NULL;
	size_t bytes = 0;

	if (z && ct_alloc(&plain, w * h, 2, e) == 0 && ct_alloc(&packed, room, 1, e) == 0 &&
		ct_alloc(&text, CT_TEXT_BASE64(room), 1, e) == 0 && split(plain, x, w, h, e) == 0)
		bytes = libdeflate_zlib_compress(z, plain, 2 * w * h, packed, room);
	if (bytes) {
		ct_text_base64(text, packed, bytes);
		fputs(text, f);
	}
	free(plain);
	free(packed);
	free(text);
	if (z)
		libdeflate_free_compressor(z);
	return bytes ? 0 : ct_fail(e, CT_ENOMEM, "no memory");
}

/* Slice k of one kind, less pixels if it is too large: their mean, or of errors its square. */
static void gather(
	float *to, const struct ct_page *p, const struct cut *c, enum kind kind, size_t k)
{
	const struct ct_vol *v = kind == BEFORE ? &p->before
				 : kind == STD  ? &p->std.vol
						: &p->hr.vol;
	const bool map = kind >= STD;
	const size_t step = c->step[map], w = c->size[map][0], h = c->size[map][1];
	struct ct_montage_slice s, minus;

	slice_of(&s, v, c, k);
	if (kind == ERROR)
		slice_of(&minus, &p->truth.vol, c, k);
	for (size_t y = 0; y < h; y++) {
		for (size_t x = 0; x < w; x++) {
			double sum = 0, n = 0;

			for (size_t i = y * step; i < (y + 1) * step && i < s.n[0]; i++)
				for (size_t j = x * step; j < (x + 1) * step && j < s.n[1]; j++) {
					const double is = value(&s, i, j) -
							  (kind == ERROR ? value(&minus, i, j) : 0);

					sum += map ? is * is : is;
					n += 1;
				}
			to[y * w + x] = (float)(map ? sqrt(sum / n) : sum / n);
		}
	}
}

/* The largest value along the lines across the plane. */
static void gather_most(
	float *to, float *one, const struct ct_page *p, const struct cut *c, enum kind kind)
{
	const size_t n = c->size[0][0] * c->size[0][1];

	gather(to, p, c, kind, 0);
	for (size_t k = 1; k < c->depth; k++) {
		gather(one, p, c, kind, k);
		for (size_t i = 0; i < n; i++)
			to[i] = fmaxf(to[i], one[i]);
	}
}

static int put_kind(
	FILE *f, const struct ct_page *p, const struct cut *c, enum kind kind, struct ct_err *e)
{
	const size_t *size = c->size[kind >= STD], pixels = size[0] * size[1];
	const size_t n = kind >= STD ? c->n : c->n + 1; /* the last is the maximum */
	float *x;
	int rc = 0;

	if (ct_alloc(&x, 2 * pixels, sizeof *x, e))
		return -1;
	for (size_t k = 0; k < n && rc == 0; k++) {
		fprintf(f, "<script type=\"text/plain\" id=\"%s-%s-",
			CT_WORD(CT_MONTAGE_PLANE_LIST, c->plane), names[kind]);
		fprintf(f, k < c->n ? "%zu\">" : "mip\">", k);
		if (k < c->n)
			gather(x, p, c, kind, c->at[k]);
		else
			gather_most(x, x + pixels, p, c, kind);
		rc = put_picture(f, x, size[0], size[1], e);
		fprintf(f, "</script>\n");
	}
	free(x);
	return rc;
}

int ct_page_write_pictures(
	FILE *f, const struct ct_page *p, const struct ct_env *env, struct ct_err *e)
{
	struct cut cut[CT_MONTAGE_PLANES];

	cut_all(cut, &p->hr.vol);
	for (int k = 0; k < CT_MONTAGE_PLANES; k++)
		for (int kind = 0; kind < KINDS; kind++) {
			ct_progress(env, "pictures", (size_t)(k * KINDS + kind),
				CT_MONTAGE_PLANES * KINDS);
			if (ct_check_stop(env, e) ||
				(has(p, (enum kind)kind) &&
					put_kind(f, p, &cut[k], (enum kind)kind, e)))
				return -1;
		}
	ct_progress(env, "pictures", CT_MONTAGE_PLANES * KINDS, CT_MONTAGE_PLANES * KINDS);
	return 0;
}
