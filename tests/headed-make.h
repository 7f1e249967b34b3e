/* headed-make.h: files of MetaImage and NRRD, 4x3x2 voxels of any type, in memory.
 * SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_TESTS_HEADED_MAKE_H
#define CT_TESTS_HEADED_MAKE_H
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { HEADED_VOXELS = 24, HEADED_TYPES = 10 };

/* Voxel k of every file: fits all types. */
static double headed_value(size_t k)
{
	return (double)(k * 5 + 1);
}

static size_t put_value(unsigned char *p, const char *type, bool big, size_t k)
{
	const uint16_t probe = 1;
	const bool swap = big == (*(const unsigned char *)&probe == 1);
	const float f = (float)headed_value(k);
	const double d = headed_value(k);
	uint64_t i = (uint64_t)headed_value(k);
	const size_t n = strstr(type, "8")                              ? 1
			 : strstr(type, "16")                           ? 2
			 : strstr(type, "32") || strcmp(type, "f") == 0 ? 4
									: 8;
	unsigned char raw[8];

	if (*type == 'f')
		memcpy(raw, &f, 4);
	else if (*type == 'd')
		memcpy(raw, &d, 8);
	else
		for (size_t b = 0; b < n; b++)
			raw[*(const unsigned char *)&probe ? b : n - 1 - b] =
				(unsigned char)(i >> 8 * b);
	for (size_t b = 0; b < n; b++)
		p[b] = raw[swap ? n - 1 - b : b];
	return n;
}

static const struct {
	const char *type, *mha, *nrrd;
} headed_types[] = {{"i8", "MET_CHAR", "signed char"}, {"u8", "MET_UCHAR", "uint8"},
	{"i16", "MET_SHORT", "short"}, {"u16", "MET_USHORT", "unsigned short int"},
	{"i32", "MET_INT", "int32_t"}, {"u32", "MET_UINT", "uint"},
	{"i64", "MET_LONG_LONG", "longlong"}, {"u64", "MET_ULONG_LONG", "uint64"},
	{"f", "MET_FLOAT", "float"}, {"d", "MET_DOUBLE", "double"}};

/* Both headers describe one grid: axes along y, z, x of LPS, 2, 3, 4 mm. */
static size_t headed_file(unsigned char *p, size_t room, bool nrrd, size_t t, bool big, int packing)
{
	unsigned char voxels[HEADED_VOXELS * 8];
	z_stream z = {0};
	size_t n = 0, at;

	for (size_t k = 0; k < HEADED_VOXELS; k++)
		n += put_value(voxels + n, headed_types[t].type, big, k);
	if (nrrd)
		at = (size_t)snprintf((char *)p, room,
			"NRRD0005\n# a comment\r\nDimension: 3\ntype: %s\nsizes: 4 3 2\n"
			"space: LPS\nspace directions: (0,2,0) (0, 0, 3) (4,0,0)\n"
			"space origin: (10,20,30)\nkinds: domain space domain\nendian: %s\n"
			"encoding: %s\nother:=thing: x\nct:window:=-1:\\n2\\\\\nspaceunits: \"mm\" \"mm\" \"mm\"\n\n",
			headed_types[t].nrrd, big ? "big" : "little", packing ? "gzip" : "raw");
	else
		at = (size_t)snprintf((char *)p, room,
			"NDims = 3\r\nObjectType=Image\nBinaryDataByteOrderMSB = %s\n"
			"CompressedData = %s\nRotation = 0 1 0 0 0 1 1 0 0\nPosition = 10 20 30\n"
			"Other thing: 3\n\nElementSpacing = 2 3 4\nDimSize = 4 3 2\nElementType = %s\n"
			"ct-window = -1:\\n2\\\\\nElementDataFile = LOCAL\n",
			big ? "True" : "False", packing ? "True" : "False", headed_types[t].mha);
	if (!packing) {
		memcpy(p + at, voxels, n);
		return at + n;
	}
	z.next_in = voxels;
	z.avail_in = (uInt)n;
	z.next_out = p + at;
	z.avail_out = (uInt)(room - at);
	if (deflateInit2(&z, 6, Z_DEFLATED, packing, 8, 0) != Z_OK)
		exit(99);
	deflate(&z, Z_FINISH);
	deflateEnd(&z);
	return at + z.total_out;
}

#endif
