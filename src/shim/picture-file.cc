/* picture-file.cc: see picture-file.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/picture-file.h"
#include "shim/guard.h"
extern "C" {
#include "core/inflate.h"
#include "core/mem.h"
}

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

namespace
{

const size_t most_pixels = (size_t)1 << 28; /* what a header may ask the library to allocate */

/* First line of the message. It must be fetched: OpenImageIO prints what is left at exit. */
std::string words(const std::string &own)
{
	std::string all = OIIO::geterror();

	if (!own.empty())
		all = own;
	return all.substr(0, all.find('\n'));
}

/* Number of colour channels in front: alpha and depth are not looked at. */
int colours(const OIIO::ImageSpec &s)
{
	int n = s.nchannels < 3 ? s.nchannels : 3;

	return s.alpha_channel >= 0 && s.alpha_channel < n ? s.alpha_channel : n;
}

/* Rows y to y + n of the picture. The library ends the program if tiles are read as rows. */
bool read_rows(OIIO::ImageInput &in, int y, int n, float *rows)
{
	const OIIO::ImageSpec &s = in.spec();

	y += s.y;
	if (s.tile_width)
		return in.read_tiles(0, 0, s.x, s.x + s.width, y, y + n, s.z, s.z + 1, 0,
			s.nchannels, OIIO::TypeFloat, rows);
	return in.read_scanlines(0, 0, y, y + n, 0, 0, s.nchannels, OIIO::TypeFloat, rows);
}

/* Is 0 white? The library sees to it if there are 8 bits. */
bool is_negative(const OIIO::ImageSpec &s)
{
	return (s.format == OIIO::TypeDesc::UINT16 || s.format == OIIO::TypeDesc::UINT32) &&
	       s.get_int_attribute("tiff:PhotometricInterpretation", 1) == 0;
}

/* What became 1: the largest value of integers, 1 itself of floats. */
double largest(const OIIO::TypeDesc &t)
{
	const int bits = 8 * (int)t.basesize() - (t.is_signed() ? 1 : 0);

	return t.is_floating_point() ? 1 : std::ldexp(1.0, bits) - 1;
}

int read_gray(const char *path, size_t *w, size_t *h, double *most, float **gray, ct_err *e)
{
	OIIO::ImageSpec hints;
	std::string text;

	hints.attribute("oiio:UnassociatedAlpha", 1); /* no multiplication by alpha */
	auto in = OIIO::ImageInput::open(path, &hints);
	if (!in && (text = words("")).find("find a format reader") != std::string::npos)
		text = "neither projections (EXR) nor a picture (PNG, TIFF, JPEG): ct-project makes "
		       "projections of a volume, ct-convert --scanner of an array of numpy";
	if (!in)
		return ct_fail(e, CT_EINPUT, "%s: %s", path, text.c_str());
	const OIIO::ImageSpec &s = in->spec();
	int used = colours(s);
	if (s.width < 1 || s.height < 1 || s.depth != 1 || used < 1 || s.deep)
		return ct_fail(e, CT_EINPUT, "%s: not a flat picture", path);
	if (s.format == OIIO::TypeDesc::DOUBLE) /* the library makes zeros of them */
		return ct_fail(e, CT_EINPUT, "%s: floats of 64 bits: save it in 32 bits", path);
	const size_t nw = (size_t)s.width, nh = (size_t)s.height;
	float *px = nullptr;
	if (nw > most_pixels / nh)
		return ct_fail(e, CT_EINPUT, "%s: a picture of %zux%zu is too large", path, nw, nh);
	if (ct_inflate_check(OIIO::Filesystem::file_size(path),
		    (uint64_t)nw * nh * (uint64_t)s.nchannels * sizeof *px, e))
		return ct_blame(e, path);
	if (ct_alloc(&px, nw * nh, sizeof *px, e))
		return ct_blame(e, path);
	std::unique_ptr<float, void (*)(void *)> owned(px, std::free);
	const bool negative = is_negative(s);
	const size_t band = s.tile_width ? std::min((size_t)s.tile_height, nh) : 1;
	std::vector<float> rows(nw * band * (size_t)s.nchannels);
	for (size_t y = 0; y < nh; y += band) {
		const size_t n = std::min(band, nh - y);

		if (!read_rows(*in, (int)y, (int)n, rows.data()))
			return ct_fail(e, CT_EINPUT, "%s: %s", path, words(in->geterror()).c_str());
		for (size_t i = 0; i < n * nw; i++) {
			double sum = 0;

			for (int c = 0; c < used; c++)
				sum += (double)rows[i * (size_t)s.nchannels + (size_t)c];
			px[y * nw + i] = (float)(negative ? 1 - sum / used : sum / used);
		}
	}
	if (in->seek_subimage(1, 0))
		return ct_fail(e, CT_EINPUT, "%s: holds several pictures, not one", path);
	in->geterror(); /* that there is none */
	*w = nw;
	*h = nh;
	*most = largest(s.format);
	*gray = owned.release();
	return 0;
}

} // namespace

int picture_file_read(
	const char *path, size_t *w, size_t *h, double *most, float **gray, struct ct_err *e)
{
	return guard(e, path, [&] { return read_gray(path, w, h, most, gray, e); });
}
