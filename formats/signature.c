/* signature.c: see signature.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/signature.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

/* A header of JSON, of a length that its first eight bytes say. */
static bool is_json(const unsigned char *data, size_t n, size_t at)
{
	(void)n;
	(void)at;
	return data[0] >= 2 || data[1] || data[2] || data[3];
}

/* "=" behind the field that a MetaImage begins with. */
static bool is_field(const unsigned char *data, size_t n, size_t at)
{
	while (at < n && (data[at] == ' ' || data[at] == '\t'))
		at++;
	return at < n && data[at] == '=';
}

/* A data set without a preamble, by its first element; one of group 2 is not empty. */
static bool is_bare(const unsigned char *data, size_t n, size_t at)
{
	(void)at;
	return n >= 8 && data[3] == 0 && (data[0] == 8 || data[4]);
}

static bool is_bare_big(const unsigned char *data, size_t n, size_t at)
{
	(void)at;
	return n >= 8 && isupper(data[4]) && isupper(data[5]);
}

#define R2 "R2-Gaussian", CT_KIND_GAUSS, false, "a pickle, as Gaussians of R2-Gaussian are"
#define DICOM "DICOM", CT_KIND_DICOM, false, "DICOM, of which ct-convert makes a volume"
#define TORCH "PyTorch", CT_KIND_TENSORS, true
#define VOLUME(format) format, CT_KIND_VOLUME, false, "a volume (" format ")"
#define PICTURE(format)                                                                            \
	format, CT_KIND_PICTURE, false,                                                            \
		"a picture (" format "): ct-convert --radiograph makes a stack of it"
#define FOREIGN(format, what) format, CT_KIND_OTHER, false, what
#define ARCHIVE(format) format, CT_KIND_OTHER, true, "an archive (" format ")"
static const struct ct_signature all[] = {
	{"EXR", CT_KIND_STACK, false, "projections (EXR)", 0, 4, "\x76\x2f\x31\x01", NULL},
	{"PLY", CT_KIND_GAUSS, false, "Gaussians (PLY)", 0, 4, "ply\n", NULL},
	{"PLY", CT_KIND_GAUSS, false, "Gaussians (PLY)", 0, 4, "ply\r", NULL},
	{"NIfTI", CT_KIND_VOLUME, false, "compressed (gzip), as volumes are", 0, 2, "\x1f\x8b",
		NULL},
	{VOLUME("NRRD"), 0, 7, "NRRD000", NULL},
	{VOLUME("MetaImage"), 0, 10, "ObjectType", is_field},
	{VOLUME("MetaImage"), 0, 5, "NDims", is_field},
	{VOLUME("MetaImage"), 0, 7, "Comment", is_field},
	{TORCH, "a zip, as networks of PyTorch are", 0, 4, "PK\3\4", NULL},
	{FOREIGN("numpy", "an array of numpy: ct-convert --scanner reads projections; of a volume "
			  "make NIfTI, as nibabel or ctsr.write do in Python"),
		0, 6, "\x93NUMPY", NULL},
	{FOREIGN("HDF5",
		 "HDF5: ct-convert --projections reads scans of Data Exchange; make NIfTI of a "
		 "volume, as h5py and nibabel do in Python"),
		0, 4, "\x89HDF", NULL},
	{FOREIGN("MATLAB",
		 "a file of MATLAB: ct-convert --projections reads a sinogram; make NIfTI of a "
		 "volume, as niftiwrite does in MATLAB"),
		0, 6, "MATLAB", NULL},
	{FOREIGN("netCDF", "netCDF, as MINC is: make NIfTI of it, as mnc2nii does"), 0, 3, "CDF",
		NULL},
	{FOREIGN("VTK", "VTK: make MetaImage of it, as 3D Slicer or ParaView do"), 0, 10,
		"# vtk Data", NULL},
	{FOREIGN("VTK", "VTK: make MetaImage of it, as 3D Slicer or ParaView do"), 0, 14,
		"<?xml version=", NULL},
	{FOREIGN("Amira", "Amira: make NRRD of it, as 3D Slicer does"), 0, 7, "# Amira", NULL},
	{FOREIGN("FITS", "FITS: make NIfTI of it, as astropy and nibabel do in Python"), 0, 9,
		"SIMPLE  =", NULL},
	{FOREIGN("Varian",
		 "projections of Varian (XIM): make .npy of them, for ct-convert --scanner"),
		0, 6, "VMS.XI", NULL},
	{FOREIGN("PDF", "a document (PDF)"), 0, 5, "%PDF-", NULL},
	{FOREIGN("7z", "an archive (7z): unpack it"), 0, 6, "7z\xbc\xaf\x27\x1c", NULL},
	{FOREIGN("RAR", "an archive (RAR): unpack it"), 0, 4, "Rar!", NULL},
	{ARCHIVE("bzip2"), 0, 3, "BZh", NULL},
	{ARCHIVE("xz"), 0, 5, "\3757zXZ", NULL},
	{ARCHIVE("zstd"), 0, 4, "\x28\xb5\x2f\xfd", NULL},
	/* its first 128 bytes are anything, often a TIFF header */
	{DICOM, 128, 4, "DICM", NULL},
	{PICTURE("PNG"), 0, 4, "\x89PNG", NULL},
	{PICTURE("TIFF"), 0, 4, "II*\0", NULL},
	{PICTURE("TIFF"), 0, 4, "MM\0*", NULL},
	{PICTURE("TIFF"), 0, 4, "II+\0", NULL}, /* of more than 4 GB, or that may be */
	{PICTURE("TIFF"), 0, 4, "MM\0+", NULL},
	{PICTURE("JPEG"), 0, 3, "\xff\xd8\xff", NULL},
	{"safetensors", CT_KIND_TENSORS, false, "a network (safetensors)", 4, 5, "\0\0\0\0{",
		is_json},
	{TORCH, "a network of PyTorch before 1.6", 0, 4, "\x80\2\x8a\n", NULL},
	{R2, 0, 3, "\x80\2}", NULL},
	{R2, 0, 3, "\x80\3}", NULL},
	{R2, 0, 3, "\x80\4\x95", NULL},
	{R2, 0, 3, "\x80\5\x95", NULL},
	{TORCH, "an archive (tar)", 257, 5, "ustar", NULL},
	/* sizeof_hdr of either version and byte order */
	{VOLUME("NIfTI"), 0, 4, "\x5c\x01\0\0", NULL},
	{VOLUME("NIfTI"), 0, 4, "\x1c\x02\0\0", NULL},
	{VOLUME("NIfTI"), 0, 4, "\0\0\x01\x5c", NULL},
	{VOLUME("NIfTI"), 0, 4, "\0\0\x02\x1c", NULL},
	/* without a preamble: an element of group 2 or 8 */
	{DICOM, 0, 2, "\2\0", is_bare},
	{DICOM, 0, 2, "\10\0", is_bare},
	{DICOM, 0, 3, "\0\10\0", is_bare_big},
};

const char *ct_kind_name(enum ct_kind kind)
{
	return CT_WORD(CT_KIND_LIST, kind);
}

const struct ct_signature *ct_signature_next(
	const struct ct_signature *last, const unsigned char *data, size_t n)
{
	for (const struct ct_signature *s = last ? last + 1 : all;
		s < all + sizeof all / sizeof *all; s++)
		if (n >= s->at + s->n && memcmp(data + s->at, s->magic, s->n) == 0 &&
			(!s->also || s->also(data, n, s->at + s->n)))
			return s;
	return NULL;
}

bool ct_signature_has(const char *format, const unsigned char *data, size_t n)
{
	const struct ct_signature *s = NULL;

	while ((s = ct_signature_next(s, data, n)))
		if (strcmp(s->format, format) == 0)
			return true;
	return false;
}

enum ct_kind ct_signature_kind(const unsigned char *data, size_t n)
{
	const struct ct_signature *s = ct_signature_next(NULL, data, n);

	return s ? s->kind : CT_KIND_UNKNOWN;
}

size_t ct_signature_read(unsigned char head[static CT_SNIFF], const char *path)
{
	struct stat st;
	FILE *f = stat(path, &st) == 0 && S_ISREG(st.st_mode) ? fopen(path, "rb") : NULL;
	const size_t n = f ? fread(head, 1, CT_SNIFF, f) : 0;

	if (f)
		fclose(f);
	return n;
}

enum ct_kind ct_signature_of(const char *path)
{
	unsigned char head[CT_SNIFF];

	return ct_signature_kind(head, ct_signature_read(head, path));
}
