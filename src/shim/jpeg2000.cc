/* jpeg2000.cc: see jpeg2000.h. */
#include "config.h"
#include "shim/jpeg2000.h"

#ifdef HAVE_OPENJPEG
#include "series/slice.h"

#include <algorithm>
#include <memory>

#include <openjpeg.h>

namespace
{

struct Place {
	const Bytes &b;
	size_t at;
};

OPJ_SIZE_T read(void *to, OPJ_SIZE_T n, void *of)
{
	Place *p = static_cast<Place *>(of);
	const size_t got = std::min<size_t>(n, p->b.size() - p->at);

	std::copy_n(p->b.data() + p->at, got, static_cast<unsigned char *>(to));
	p->at += got;
	return got ? got : static_cast<OPJ_SIZE_T>(-1);
}

OPJ_OFF_T skip(OPJ_OFF_T n, void *of)
{
	Place *p = static_cast<Place *>(of);
	const OPJ_OFF_T left = static_cast<OPJ_OFF_T>(p->b.size() - p->at);

	if (n < 0 || left == 0)
		return -1;
	p->at += static_cast<size_t>(std::min(n, left));
	return std::min(n, left);
}

OPJ_BOOL seek(OPJ_OFF_T to, void *of)
{
	Place *p = static_cast<Place *>(of);

	if (to < 0 || static_cast<uint64_t>(to) > p->b.size())
		return OPJ_FALSE;
	p->at = static_cast<size_t>(to);
	return OPJ_TRUE;
}

template <class T> using Owned = std::unique_ptr<T, void (*)(T *)>;

Owned<opj_stream_t> stream_of(Place &p)
{
	Owned<opj_stream_t> s(opj_stream_create(1 << 16, OPJ_TRUE), opj_stream_destroy);

	if (!s)
		return s;
	opj_stream_set_user_data(s.get(), &p, nullptr);
	opj_stream_set_user_data_length(s.get(), p.b.size());
	opj_stream_set_read_function(s.get(), read);
	opj_stream_set_skip_function(s.get(), skip);
	opj_stream_set_seek_function(s.get(), seek);
	return s;
}

/* One component of that size, in numbers that take so many bits as DICOM stores them in? */
bool is_plain(const opj_image_t *image, size_t columns, size_t rows, int bits)
{
	if (image->numcomps != 1)
		return false;
	const opj_image_comp_t &c = image->comps[0];
	const int takes = c.prec <= 8 ? 8 : c.prec <= 16 ? 16 : 32;

	return c.w == columns && c.h == rows && takes == bits;
}

} // namespace

bool decode_jpeg2000(
	float *out, size_t columns, size_t rows, int bits, bool is_signed, const Bytes &stream)
{
	const ct_slice_bits how = {4, bits, is_signed, false};
	Place place = {stream, 0};
	const Owned<opj_stream_t> s = stream_of(place);
	const Owned<opj_codec_t> codec(opj_create_decompress(OPJ_CODEC_J2K), opj_destroy_codec);
	opj_dparameters_t with;
	opj_image_t *header = nullptr;

	opj_set_default_decoder_parameters(&with);
	if (!s || !codec || !opj_setup_decoder(codec.get(), &with) ||
		!opj_read_header(s.get(), codec.get(), &header))
		return false;
	const Owned<opj_image_t> image(header, opj_image_destroy);
	if (!is_plain(header, columns, rows, bits) || !opj_decode(codec.get(), s.get(), header) ||
		!opj_end_decompress(codec.get(), s.get()) ||
		!is_plain(header, columns, rows, bits) || !header->comps[0].data)
		return false;
	ct_slice_widen(columns * rows, out, header->comps[0].data, &how);
	return true;
}
#else
bool decode_jpeg2000(float *, size_t, size_t, int, bool, const Bytes &)
{
	return false;
}
#endif
