/* dicom-file.cc: see dicom-file.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/dicom-file.h"
#include "shim/apart.h"
#include "shim/guard.h"
#include "shim/pixels.h"

#include <algorithm>

struct ct_dicom_source {
	const ct_slice *s;
	size_t n, processes;
	PixelFile file; /* the last one */
	Ahead ahead;    /* of slice `begin` on, `count` of them */
	size_t begin = 0, count = 0;

	int open(const ct_slice &of, ct_err *e)
	{
		return file.is_of(of) ? 0 : file.open(of, e);
	}
	int decode(size_t k, float *out, ct_err *e)
	{
		return open(s[k], e) ? -1 : file.read(s[k], out, e);
	}
	void make(size_t k);
	const float *made(size_t k);
};

namespace
{

enum { SHARE = 4, MOST = 1 << 25 }; /* pictures a process that are kept, bytes of all */

} // namespace

/* Slices from k on that are of its size. */
void ct_dicom_source::make(size_t k)
{
	const size_t area = s[k].columns * s[k].rows;
	const size_t room = std::max<size_t>(MOST / sizeof(float) / std::max<size_t>(area, 1), 1);

	begin = k;
	count = n - k;
	for (size_t i = 1; i < count; i++)
		if (s[k + i].columns != s[k].columns || s[k + i].rows != s[k].rows)
			count = i;
	ahead.make(count, area, processes, std::min(SHARE * processes, room),
		[&](size_t i, float *out, ct_err *e) { return decode(begin + i, out, e); });
}

/* Slice k, if it is ahead. */
const float *ct_dicom_source::made(size_t k)
{
	return k >= begin && k - begin < count ? ahead.get(k - begin) : nullptr;
}

extern "C" int ct_dicom_source_open(struct ct_dicom_source **src, const struct ct_slice *s,
	size_t n, size_t processes, struct ct_err *e)
{
	*src = nullptr;
	return guard(e, n ? s->path : "no slice", [&] {
		*src = new ct_dicom_source;
		(*src)->s = s;
		(*src)->n = n;
		(*src)->processes = std::max<size_t>(processes, 1);
		return 0;
	});
}

extern "C" void ct_dicom_source_close(struct ct_dicom_source *src)
{
	delete src;
}

extern "C" struct ct_dicom_bits ct_dicom_source_bits(const struct ct_dicom_source *src)
{
	return src->file.placed;
}

extern "C" int ct_dicom_source_read(
	struct ct_dicom_source *src, size_t k, float *out, struct ct_err *e)
{
	const struct ct_slice *s = &src->s[k];
	const size_t area = s->columns * s->rows;

	return guard(e, s->path, [&] {
		const float *px = src->made(k);

		if (!px && src->open(*s, e))
			return -1;
		if (!px && !src->file.foreign())
			return src->file.read(*s, out, e);
		if (!px && k - src->begin >= src->count && k + 1 < src->n) {
			src->make(k);
			px = src->made(k);
		}
		if (px) {
			std::copy_n(px, area, out);
			return 0;
		}
		src->count = 0; /* those behind it are made once more */
		return apart(out, area, s->path, e,
			[&](float *to, ct_err *why) { return src->decode(k, to, why); });
	});
}

extern "C" int ct_dicom_pixels(const struct ct_slice *s, float *out, struct ct_err *e)
{
	struct ct_dicom_source *src;
	int rc = ct_dicom_source_open(&src, s, 1, 1, e);

	if (rc == 0)
		rc = ct_dicom_source_read(src, 0, out, e);
	ct_dicom_source_close(src);
	return rc;
}
