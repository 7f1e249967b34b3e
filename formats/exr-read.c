/* exr-read.c: projections from OpenEXR; layout in exr.h. OpenEXRCore, a C library, reads headers
 * and tables, exr-write.c has what is in the chunks.
 *
 * Parts may come in any order (the number at the end of the name sorts them), FLOAT or HALF,
 * channel Y or the only one, and "deviation" of all parts, ZIP, ZIPS or not compressed.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "core/number.h"
#include "core/inflate.h"
#include "core/mem.h"
#include "core/order.h"
#include "formats/ends.h"
#include "formats/exr.h"
#include "formats/format.h"
#include "formats/any.h"
#include "formats/voxels.h"

#include <jansson.h>
#include <math.h>
#include <openexr.h>
#include <stdio.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum {
	MOST_PAIRS = 1 << 14, /* of metadata, of all parts */
	/* Deflate packs 1032 to 1 at best: a header that promises more lies. */
	MOST_RATIO = 1100,
	/* Largest picture, and largest array the library may ask for while it reads one. */
	MOST_SIDE = 1 << 20,
	MOST_ALLOC = 1 << 30,
};

struct part {
	int index; /* in the file */
	size_t h, w;
	int y0;          /* its first row */
	uint64_t number; /* at the end of its name */
	char name[64];   /* for messages */
};

/* The user_data of the context. */
struct reader {
	exr_context_t c;
	const unsigned char *data; /* the whole file */
	size_t bytes;
	char msg[200];     /* the library's first complaint */
	exr_result_t code; /* of that */
	struct part *part;
	size_t n, pairs; /* parts; metadata that were looked at */
	struct ct_err *e;
};

static int64_t get(exr_const_context_t c, void *user, void *to, uint64_t n, uint64_t at,
	exr_stream_error_func_ptr_t complain)
{
	const struct reader *d = user;

	(void)c;
	(void)complain;
	if (at >= d->bytes)
		return 0;
	if (n > d->bytes - at)
		n = d->bytes - at;
	memcpy(to, d->data + at, n);
	return (int64_t)n;
}

static int64_t size(exr_const_context_t c, void *user)
{
	(void)c;
	return (int64_t)((const struct reader *)user)->bytes;
}

/* The library trusts some counts of the file; what is absurd gets no memory. */
static void *limited(size_t bytes)
{
	return bytes > MOST_ALLOC ? NULL : malloc(bytes ? bytes : 1);
}

/* Keeps the first message, so that nothing is printed. */
static void complaint(exr_const_context_t c, exr_result_t code, const char *msg)
{
	void *user = NULL;
	struct reader *d;

	if (!c || exr_get_user_data(c, &user) != EXR_ERR_SUCCESS || !user)
		return;
	d = user;
	if (d->msg[0])
		return;
	d->code = code;
	snprintf(d->msg, sizeof d->msg, "%s",
		msg && *msg ? msg : exr_get_default_error_message(code));
}

/* Of a part, or NULL. */
static int lib_fail(struct reader *d, const struct part *p, exr_result_t r)
{
	if (d->msg[0])
		r = d->code;
	ct_fail(d->e, r == EXR_ERR_OUT_OF_MEMORY ? CT_ENOMEM : CT_EINPUT, "%s",
		d->msg[0] ? d->msg : exr_get_default_error_message(r));
	return p ? ct_blame(d->e, p->name) : -1;
}

static int open_file(struct reader *d, const char *name)
{
	exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
	exr_result_t r;

	init.error_handler_fn = complaint;
	init.alloc_fn = limited;
	init.free_fn = free;
	init.user_data = d;
	init.read_fn = get;
	init.size_fn = size;
	init.max_image_width = init.max_image_height = MOST_SIDE;
	init.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
	r = exr_start_read(&d->c, name, &init);
	return r == EXR_ERR_SUCCESS ? 0 : lib_fail(d, NULL, r);
}

CT_ORDER_BY(by_number, struct part, number, index)

static bool name_part(struct part *p, exr_const_context_t c)
{
	const char *name = NULL, *end;

	if (exr_get_name(c, p->index, &name) != EXR_ERR_SUCCESS || !name || !*name) {
		snprintf(p->name, sizeof p->name, "part %d", p->index);
		return false;
	}
	snprintf(p->name, sizeof p->name, "part '%.50s'", name);
	for (end = name + strlen(name); end > name && end[-1] >= '0' && end[-1] <= '9';)
		end--;
	if (!*end || strlen(end) > 18)
		return false;
	return ct_number_u64(&p->number, end);
}

/* The parts by the number in their names if all have one, else as they come. */
static int list_parts(struct reader *d)
{
	bool numbered = true;
	int count = 0;

	if (exr_get_count(d->c, &count) != EXR_ERR_SUCCESS || count < 1)
		return ct_fail(d->e, CT_EINPUT, "EXR file without parts");
	d->n = (size_t)count;
	if (ct_alloc0(&d->part, d->n, sizeof *d->part, d->e))
		return -1;
	for (size_t k = 0; k < d->n; k++) {
		d->part[k].index = (int)k;
		numbered &= name_part(&d->part[k], d->c);
	}
	for (size_t k = 0; k < d->n && !numbered; k++)
		d->part[k].number = 0;
	qsort(d->part, d->n, sizeof *d->part, by_number);
	return 0;
}

/* Size of a part's data window; flat scanlines only. */
static int part_size(struct reader *d, struct part *p)
{
	exr_storage_t storage = EXR_STORAGE_SCANLINE;
	exr_attr_box2i_t box;
	exr_result_t r = exr_get_storage(d->c, p->index, &storage);
	int64_t nh, nw;

	if (r == EXR_ERR_SUCCESS)
		r = exr_get_data_window(d->c, p->index, &box);
	if (r != EXR_ERR_SUCCESS)
		return lib_fail(d, p, r);
	if (storage != EXR_STORAGE_SCANLINE)
		return ct_fail(d->e, CT_EINPUT,
			"%s holds tiles or deep pixels; only flat scanlines are read", p->name);
	nw = (int64_t)box.max.x - box.min.x + 1;
	nh = (int64_t)box.max.y - box.min.y + 1;
	if (nw < 1 || nh < 1 || nw > MOST_SIDE || nh > MOST_SIDE)
		return ct_fail(d->e, CT_EINPUT, "%s: a picture of %lldx%lld", p->name,
			(long long)nw, (long long)nh);
	p->h = (size_t)nh;
	p->w = (size_t)nw;
	p->y0 = box.min.y;
	return 0;
}

/* One string attribute, or NULL. */
static const char *get_string(const struct reader *d, int part, const char *name)
{
	const exr_attribute_t *a = NULL;

	if (exr_get_attribute_by_name(d->c, part, name, &a) != EXR_ERR_SUCCESS || !a ||
		a->type != EXR_ATTR_STRING || !a->string)
		return NULL;
	return a->string->str;
}

/* n (1 or 3) finite numbers of a string "x,y,z"; also of the numeric types another program
 * may have written. */
static int get_numbers(
	struct reader *d, const struct part *p, const char *name, size_t n, double *v)
{
	const exr_attribute_t *a = NULL;
	bool good = true;

	if (exr_get_attribute_by_name(d->c, p->index, name, &a) != EXR_ERR_SUCCESS || !a)
		return ct_fail(d->e, CT_EINPUT, "%s has no attribute %s: no projection geometry",
			p->name, name);
	if (a->type == EXR_ATTR_STRING && a->string && a->string->str)
		good = ct_words_numbers(a->string->str, ',', n, false, v);
	else if (n == 1 && a->type == EXR_ATTR_DOUBLE)
		v[0] = a->d;
	else if (n == 1 && a->type == EXR_ATTR_FLOAT)
		v[0] = (double)a->f;
	else if (n == 3 && a->type == EXR_ATTR_V3D && a->v3d)
		memcpy(v, a->v3d->arr, 3 * sizeof *v);
	else
		good = false;
	for (size_t i = 0; i < n && good; i++)
		good = isfinite(v[i]);
	if (!good)
		return ct_fail(d->e, CT_EINPUT, "%s: attribute %s is not %s", p->name, name,
			n == 1 ? "a finite number" : "three finite numbers x,y,z");
	return 0;
}

static int get_geometry(struct reader *d, struct ct_stack *s, size_t k)
{
	const struct part *p = &d->part[k];
	const char *word = get_string(d, p->index, "ct:beam");
	struct ct_view *v = &s->view[k];
	int beam;

	if (!word)
		return ct_fail(d->e, CT_EINPUT,
			"%s has no attribute ct:beam: no projection geometry", p->name);
	if (ct_words_take(&beam, CT_WORDS(CT_BEAM_LIST), "beam", word, d->e))
		return ct_blame(d->e, p->name);
	if (k && beam != (int)s->beam)
		return ct_fail(d->e, CT_EINPUT, "%s has a %s beam, %s a %s beam", p->name, word,
			d->part[0].name, CT_WORD(CT_BEAM_LIST, s->beam));
	s->beam = (enum ct_beam)beam;
	return ct_err_any(get_numbers(d, p, "ct:angleDeg", 1, &v->angle) ||
			  get_numbers(d, p, "ct:source", 3, v->source) ||
			  get_numbers(d, p, "ct:detCentre", 3, v->centre) ||
			  get_numbers(d, p, "ct:detU", 3, v->u) ||
			  get_numbers(d, p, "ct:detV", 3, v->v));
}

/* The first value of a key stays. */
static int take_pair(struct reader *d, struct ct_meta *m, const char *key, const char *value)
{
	if (++d->pairs > MOST_PAIRS)
		return ct_fail(d->e, CT_EINPUT, "over %d metadata", MOST_PAIRS);
	return !*key || ct_meta_get(m, key) ? 0 : ct_meta_set(m, key, value, d->e);
}

/* Keys of the JSON object. */
static int get_rest(struct reader *d, const char *text, struct ct_meta *m)
{
	json_error_t why;
	json_t *all = json_loads(text, 0, &why), *value;
	const char *key;
	int rc = 0;

	if (!json_is_object(all)) {
		json_decref(all);
		return ct_fail(d->e, CT_EINPUT, "attribute " CT_EXR_META " is not a JSON object");
	}
	json_object_foreach (all, key, value)
		if (rc == 0 && json_is_string(value))
			rc = take_pair(d, m, key, json_string_value(value));
	json_decref(all);
	return rc;
}

static int get_meta(struct reader *d, int part, struct ct_meta *m)
{
	const char *text = get_string(d, part, CT_EXR_VERSION);
	const exr_attribute_t *a;
	long long version;
	int32_t n = 0;

	if (text && !ct_number_whole(&version, text, 0, CT_EXR_VERSION_NOW))
		return ct_fail(d->e, CT_EINPUT,
			CT_EXR_VERSION " %.20s is newer than this program, or no number", text);
	if (exr_get_attribute_count(d->c, part, &n) != EXR_ERR_SUCCESS)
		return 0;
	for (int32_t i = 0; i < n; i++) {
		const char *key;

		if (exr_get_attribute_by_index(d->c, part, EXR_ATTR_LIST_FILE_ORDER, i, &a) !=
				EXR_ERR_SUCCESS ||
			a->type != EXR_ATTR_STRING || !a->string || !a->string->str ||
			strncmp(a->name, CT_EXR_PREFIX, sizeof CT_EXR_PREFIX - 1) != 0 ||
			ct_exr_reserved(a->name))
			continue;
		key = a->name + sizeof CT_EXR_PREFIX - 1;
		if (take_pair(d, m, key, a->string->str))
			return -1;
	}
	text = get_string(d, part, CT_EXR_META);
	return text ? get_rest(d, text, m) : 0;
}

/* Where the pixels of a part are: layout[] of one row of a chunk. */
struct layout {
	size_t row, at,
		beside; /* bytes of a row of all channels; where ours, where deviations begin */
	bool half, has, has_half; /* ours are HALF; there are deviations; they are HALF */
	size_t rows;              /* of a chunk */
};

/* Channel Y or the only one, that of deviations, and the compression. */
static int find_channel(struct reader *d, const struct part *p, struct layout *l)
{
	const exr_attr_chlist_t *list = NULL;
	exr_compression_t codec = EXR_COMPRESSION_LAST_TYPE;
	bool found = false;

	*l = (struct layout){0};
	if (exr_get_channels(d->c, p->index, &list) != EXR_ERR_SUCCESS || !list ||
		list->num_channels < 1)
		return ct_fail(d->e, CT_EINPUT, "%s has no channels", p->name);
	for (int i = 0; i < list->num_channels; i++) { /* they lie in the order of the list */
		const exr_attr_chlist_entry_t *c = &list->entries[i];
		const bool ours = list->num_channels == 1 || strcmp(c->name.str, "Y") == 0;
		const bool beside = !ours && strcmp(c->name.str, CT_EXR_DEVIATION) == 0;
		const bool half = c->pixel_type == EXR_PIXEL_HALF;
		size_t other;
		bool any;

		if (c->x_sampling != 1 || c->y_sampling != 1)
			return ct_fail(d->e, CT_EINPUT, "%s: subsampled channel", p->name);
		if ((ours || beside) && !half && c->pixel_type != EXR_PIXEL_FLOAT)
			return ct_fail(
				d->e, CT_EINPUT, "%s: channel is not FLOAT or HALF", p->name);
		found = found || ours;
		l->has = l->has || beside;
		*(beside ? &l->beside : ours ? &l->at : &other) = l->row;
		*(beside ? &l->has_half : ours ? &l->half : &any) = half;
		l->row += p->w * (half ? 2 : 4);
	}
	if (!found)
		return ct_fail(d->e, CT_EINPUT, "%s has %d channels and none is named Y", p->name,
			list->num_channels);
	if (exr_get_compression(d->c, p->index, &codec) != EXR_ERR_SUCCESS ||
		(codec != EXR_COMPRESSION_NONE && codec != EXR_COMPRESSION_ZIPS &&
			codec != EXR_COMPRESSION_ZIP))
		return ct_fail(d->e, CT_EINPUT,
			"%s is neither ZIP nor ZIPS nor uncompressed; "
			"oiiotool -a --compression zip makes it so",
			p->name);
	l->rows = codec == EXR_COMPRESSION_ZIP ? 16 : 1;
	if (l->rows * l->row / MOST_RATIO > d->bytes)
		return ct_fail(d->e, CT_EINPUT, "%s: rows of %zu bytes in %zu cannot be", p->name,
			l->row, d->bytes);
	return 0;
}

/* Rows of the chunk at y of a part into bytes[rows][l->row]. */
static int get_chunk(struct reader *d, const struct part *p, int y, size_t rows,
	const struct layout *l, unsigned char *bytes)
{
	const size_t n = rows * l->row;
	unsigned char *packed = bytes + n, *scratch = packed + n;
	exr_chunk_info_t chunk;
	exr_result_t r = exr_read_scanline_chunk_info(d->c, p->index, y, &chunk);

	if (r == EXR_ERR_SUCCESS && (chunk.start_y != y || chunk.packed_size > n))
		r = EXR_ERR_BAD_CHUNK_LEADER;
	if (r == EXR_ERR_SUCCESS)
		r = exr_read_chunk(d->c, p->index, &chunk, packed);
	if (r == EXR_ERR_SUCCESS && ct_exr_zip_undo(bytes, n, packed, chunk.packed_size, scratch))
		r = EXR_ERR_CORRUPT_CHUNK;
	return r == EXR_ERR_SUCCESS ? 0 : lib_fail(d, p, r);
}

static void get_row(float *to, const unsigned char *from, size_t w, bool half)
{
	if (half)
		ct_voxels_float(w, to, CT_V_F16, from, 1, 0);
	else
		memcpy(to, from, w * sizeof *to);
}

/* also: NULL, or where deviations go. */
static int get_pixels(struct reader *d, const struct part *p, float *to, float *also)
{
	unsigned char *bytes = NULL;
	struct layout l;
	int rc = 0;

	if (find_channel(d, p, &l))
		return -1;
	if (l.has != (also != NULL))
		return ct_fail(d->e, CT_EINPUT, "%s has %s channel " CT_EXR_DEVIATION ", unlike %s",
			p->name, l.has ? "a" : "no", d->part->name);
	if (ct_alloc(&bytes, l.rows * l.row, 3, d->e))
		return -1;
	for (size_t y = 0; rc == 0 && y < p->h; y += l.rows) {
		const size_t rows = p->h - y < l.rows ? p->h - y : l.rows;

		rc = get_chunk(d, p, p->y0 + (int)y, rows, &l, bytes);
		for (size_t i = 0; rc == 0 && i < rows; i++) {
			get_row(to + (y + i) * p->w, bytes + i * l.row + l.at, p->w, l.half);
			if (also)
				get_row(also + (y + i) * p->w, bytes + i * l.row + l.beside, p->w,
					l.has_half);
		}
	}
	free(bytes);
	return rc;
}

/* All parts must have the size of the first, and the file must be able to hold them. */
static int check_sizes(struct reader *d)
{
	const struct part *first = d->part;
	size_t count;

	for (struct part *p = d->part; p < d->part + d->n; p++) {
		if (part_size(d, p))
			return -1;
		if (p->h != first->h || p->w != first->w)
			return ct_fail(d->e, CT_EINPUT, "%s is %zux%zu, %s is %zux%zu", p->name,
				p->w, p->h, first->name, first->w, first->h);
	}
	if (__builtin_mul_overflow(first->h * first->w, d->n, &count) ||
		count / MOST_RATIO > d->bytes / 2) /* a pixel has two bytes at least */
		return ct_fail(d->e, CT_EINPUT, "%zu views of %zux%zu in %zu bytes cannot be", d->n,
			first->w, first->h, d->bytes);
	return ct_inflate_check(d->bytes, 2 * (uint64_t)count, d->e);
}

static int read_all(struct reader *d, struct ct_stack *s)
{
	struct layout l;

	if (list_parts(d) || check_sizes(d) ||
		ct_stack_alloc(s, d->n, d->part->h, d->part->w, d->e))
		return -1;
	for (size_t k = 0; k < d->n; k++)
		if (get_geometry(d, s, k) || get_meta(d, d->part[k].index, &s->meta))
			return -1;
	if (ct_stack_check(s, d->e) || find_channel(d, d->part, &l) ||
		(l.has && ct_alloc(&s->deviation, ct_stack_count(s), sizeof *s->deviation, d->e)))
		return -1;
	for (size_t k = 0; k < d->n; k++)
		if (get_pixels(d, &d->part[k], ct_stack_view(s, k),
			    l.has ? s->deviation + k * s->h * s->w : NULL))
			return -1;
	return 0;
}

static int read_stack(
	const unsigned char *data, size_t n, const char *name, struct ct_any *a, struct ct_err *e)
{
	struct reader d = {.data = data, .bytes = n, .e = e};
	const int rc = ct_err_any(open_file(&d, name) || read_all(&d, &a->stack) ||
				  ct_stack_sign(&a->stack, name, e));

	if (d.c)
		exr_finish(&d.c);
	free(d.part);
	return rc;
}

static int write_stack(const char *path, const struct ct_any *a, const struct ct_format_how *how,
	const struct ct_env *env, struct ct_err *e)
{
	(void)how;
	return ct_stack_write(path, &a->stack, env, e);
}

const struct ct_format ct_format_exr = {.name = "EXR",
	.kind = CT_KIND_STACK,
	.read_bytes = read_stack,
	.write = write_stack,
	.ends = CT_ENDS_STACK};

int ct_stack_read(const char *path, struct ct_stack *s, struct ct_err *e)
{
	static const struct ct_format *const list[] = {&ct_format_exr, NULL};
	struct ct_any a = {0};
	int rc = ct_format_read(list, path, &a, e);

	*s = a.stack;
	return rc;
}
