/* MetaImage and NRRD: types, orders, compression, where voxels lie, and what is refused.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/headed.h"
#include "formats/io.h"
#include "headed-make.h"
#include "scratch.h"

#include <math.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static struct ct_err e;
static const struct ct_env force = {
	.tool = "ct-test", .files = &(const struct ct_io_rule){.force = true}};

static int parse(const void *p, size_t n, const char *name, struct ct_vol *v)
{
	struct ct_any a = {0};
	int rc;

	e = (struct ct_err){0};
	rc = ct_format_read_bytes(&ct_format_nrrd, p, n, name, &a, &e); /* or MetaImage */
	*v = a.vol;
	return rc;
}

static bool is_right(const struct ct_vol *v)
{
	static const double want[3][4] = {{0, 0, -4, -10}, {-2, 0, 0, -20}, {0, 3, 0, 30}};
	const char *window = ct_meta_get(&v->meta, "window");
	bool ok = v->n[0] == 4 && v->n[1] == 3 && v->n[2] == 2 &&
		  memcmp(v->affine, want, sizeof want) == 0 && window &&
		  strcmp(window, "-1:\n2\\") == 0 && !ct_meta_get(&v->meta, CT_META_NIFTI_CODE);

	for (size_t k = 0; k < HEADED_VOXELS && ok; k++)
		ok = (double)v->data[k] == headed_value(k);
	return ok;
}

static void test_types(void)
{
	unsigned char p[2000];
	char first[80] = "";
	size_t hashes = 0, files = 0;

	for (int nrrd = 0; nrrd < 2; nrrd++)
		for (size_t t = 0; t < HEADED_TYPES; t++) {
			bool ok = true;

			for (int how = 0; how < 4; how++) {
				const size_t n = headed_file(p, sizeof p, nrrd, t, how & 1,
					how & 2 ? 15 + (nrrd ? 16 : 0) : 0);
				struct ct_vol v = {0};

				ok = ok && parse(p, n, "x", &v) == 0 && is_right(&v) &&
				     ct_signature_kind(p, n < CT_SNIFF ? n : CT_SNIFF) ==
					     CT_KIND_VOLUME;
				if (v.data && !*first)
					snprintf(first, sizeof first, "%s",
						ct_meta_get(&v.meta, "input"));
				hashes +=
					v.data && strcmp(ct_meta_get(&v.meta, "input"), first) == 0;
				files++;
				ct_vol_free(&v);
			}
			OK(ok, "%s: %s, both orders, packed or not", nrrd ? "NRRD" : "MetaImage",
				headed_types[t].type);
		}
	OK(hashes == files, "what says the same has the same hash");
}

static void test_prefixes(void)
{
	unsigned char p[2000];
	struct ct_vol v = {0};

	for (int how = 0; how < 4; how++) {
		const size_t n = headed_file(p, sizeof p, how & 1, 2, false, how & 2 ? 31 : 0);
		size_t bad = 0;

		for (size_t k = 1; k < n; k++)
			bad += parse(p, k, "x", &v) == 0 || e.code != CT_EINPUT || v.data;
		OK(bad == 0, "no part of a file is taken: %d", how);
		p[n] = 'x';
		OK(how & 2 ? parse(p, n + 1, "x", &v) == 0
			   : parse(p, n + 1, "x", &v) && strstr(e.msg, "longer than its header"),
			"one more byte");
		ct_vol_free(&v);
		p[n - 6] ^= 1;
		OK(!(how & 2) || (parse(p, n, "x", &v) && strstr(e.msg, "compressed data")),
			"a wrong check sum is refused");
		ct_vol_free(&v);
	}
}

#define MHA "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\n"
#define MHB MHA "ElementSpacing = 1 1 1\n"
#define NRA "NRRD0004\ndimension: 3\ntype: uchar\nsizes: 4 3 2\n"
#define NRB NRA "encoding: raw\nspacings: 1 1 1\n"
#define MH2                                                                                        \
	"ObjectType = Image\nNDims = 2\nDimSize = 6 4\nElementType = MET_UCHAR\n"                  \
	"ElementSpacing = 2 3\n"
#define MH4                                                                                        \
	"ObjectType = Image\nNDims = 4\nDimSize = 4 3 2 1\nElementType = MET_UCHAR\n"              \
	"ElementSpacing = 2 3 4 .5\n"
#define NR(dimension, sizes)                                                                       \
	"NRRD0004\ndimension: " dimension "\ntype: uchar\nencoding: raw\nsizes: " sizes "\n"
#define HERE "ElementDataFile = LOCAL\n"

/* The header without the lines whose field a later line says. */
static const char *last_of_each(char out[static 2000], const char *header)
{
	char *to = out;

	for (const char *line = header, *next; *line; line = next) {
		const size_t key = strcspn(line, "=:\n");
		bool again = false;

		next = line + strcspn(line, "\n");
		next += *next == '\n';
		for (const char *at = next; key && *at && line[key] != '\n' && !again; at++)
			again = (at[-1] == '\n') && strncmp(at, line, key + 1) == 0;
		if (!again)
			to = stpncpy(to, line, (size_t)(next - line));
	}
	*to = '\0';
	return out;
}

static void test_refused(void)
{
	static const struct {
		const char *header, *words;
		enum ct_code code;
	} bad[] = {{"ObjectType = Image\nNDims = 5\n" HERE,
			   "NDims: 5 is not read here, only 2 to 4", CT_EINPUT},
		{"ObjectType = Image\nNDims = 1\n" HERE, "NDims: 1 is not read here", CT_EINPUT},
		{MHB "NDims = 4\n" HERE, "DimSize: '4 3 2' is not 4 numbers", CT_EINPUT},
		{MHB "NDims = 4\nDimSize = 4 3 1 2\n" HERE,
			"DimSize: axis 4 is none of space and not single", CT_EINPUT},
		{MHB "NDims = 4\nDimSize = 4 3 2 1\n" HERE, "ElementSpacing: '1 1 1' is not 4",
			CT_EINPUT},
		{MHB "NDims = 2\nDimSize = 6 4\n" HERE, "ElementSpacing: '1 1 1' is more than 2",
			CT_EINPUT},
		{MH2 "TransformMatrix = 1 1 1 1\n" HERE, "", CT_EGEOM},
		{MH2 "TransformMatrix = 1 0 0 0 1 0 0 0 1\n" HERE, "is more than 4 numbers",
			CT_EINPUT},
		{"ObjectType = Tube\n" HERE, "ObjectType: 'Tube'", CT_EINPUT},
		{"ObjectType = 0\n" HERE, "ObjectType: '0'", CT_EINPUT},
		{MHA HERE, "has no ElementSpacing", CT_EINPUT},
		{MHA "ElementSpacing = 1 nan 1\n" HERE,
			"ElementSpacing: '1 nan 1' is not 3 numbers", CT_EINPUT},
		{MHA "ElementSpacing = 1 0 1\n" HERE, "ElementSpacing: 0 is no distance", CT_EGEOM},
		{MHA "ElementSpacing = 1 1\n" HERE, "is not 3 numbers", CT_EINPUT},
		{MHA "ElementSpacing = 1 1 1 1\n" HERE, "is more than 3 numbers", CT_EINPUT},
		{MHB "BinaryData = False\n" HERE, "BinaryData: 'False'", CT_EINPUT},
		{MHB "ElementNumberOfChannels = 3\n" HERE, "ElementNumberOfChannels: '3'",
			CT_EINPUT},
		{MHB "ElementToIntensityFunctionSlope = 2\n" HERE, "FunctionSlope: '2'", CT_EINPUT},
		{MHB "DistanceUnits = cm\n" HERE, "DistanceUnits: 'cm'", CT_EINPUT},
		{MHB "TransformMatrix = 1 0 0 0 1 0 0 0 0\n" HERE, "", CT_EGEOM},
		{MHB "TransformMatrix = 1 .5 0 0 1 0 0 0 1\n" HERE, "", CT_EGEOM},
		{MHB "Offset = 0 0 inf\n" HERE, "Offset: '0 0 inf'", CT_EINPUT},
		{MHB "HeaderSize = -2\n" HERE, "HeaderSize: -2", CT_EINPUT},
		{MHB "HeaderSize = 4\nCompressedData = True\n" HERE, "of compressed data",
			CT_EINPUT},
		{MHB "HeaderSize = 1.5\n" HERE, "HeaderSize: 1.5", CT_EINPUT},
		{MHB "CompressedData = maybe\n" HERE,
			"CompressedData: 'maybe' is neither True nor False", CT_EINPUT},
		{MHB "BinaryDataByteOrderMSB = Tr\n" HERE,
			"BinaryDataByteOrderMSB: 'Tr' is neither", CT_EINPUT},
		{MHB "BinaryDataByteOrderMSB = False\nElementByteOrderMSB = True\n" HERE,
			"ElementByteOrderMSB: is not what BinaryDataByteOrderMSB says", CT_EINPUT},
		{NRB "line skip: .5\n\n", "line skip: 0.5", CT_EINPUT},
		{NRB "byte skip: 1.5\n\n", "byte skip: 1.5", CT_EINPUT},
		{NRB "data file: LIST\nx1.raw\nx2.raw\n", "LIST: voxels in several files",
			CT_EINPUT},
		{MHB "HeaderSize = 1e300\n" HERE, "HeaderSize: 1e+300", CT_EINPUT},
		{MHB "HeaderSize = -1\nDimSize = 8 5 2\n" HERE, "truncated file", CT_EINPUT},
		{NRA "spacings: 1 1 1\nencoding: gzip\nbyte skip: -1\n\n", "byte skip: -1",
			CT_EINPUT},
		{NRB "byte skip: 1e300\n\n", "byte skip: 1e+300", CT_EINPUT},
		{NRB "data file: a:=b\n\n", "a:=b: No such file", CT_EINPUT},
		{MHB "ElementType = MET_LONG\n" HERE, "ElementType: MET_LONG is no number",
			CT_EINPUT},
		{MHB "DimSize = 4 3 -2\n" HERE, "DimSize: -2 is no number of voxels", CT_EINPUT},
		{MHB "DimSize = 4 3 1.5\n" HERE, "DimSize: 1.5 is no number", CT_EINPUT},
		{MHB "DimSize = 4 3 4294967296\n" HERE, "is no number of voxels", CT_EINPUT},
		{MHB "DimSize = 2147483647 2147483647 2147483647\n" HERE, "", CT_EINPUT},
		{MHB "DimSize = 40000 40000 1000\n" HERE, "truncated file", CT_EINPUT},
		{MHB "ElementDataFile = LIST\n", "LIST: voxels in several files", CT_EINPUT},
		{MHB "ElementDataFile = LIST 2D\n", "LIST", CT_EINPUT},
		{MHB "ElementDataFile = x.%03d 1 3 1\n", "a pattern", CT_EINPUT},
		{MHB "ElementDataFile = ../x.raw\n", "is no file beside the header", CT_EINPUT},
		{MHB "ElementDataFile = /etc/passwd\n", "is no file beside the header", CT_EINPUT},
		{MHB "ElementDataFile = ..\n", "is no file beside the header", CT_EINPUT},
		{MHB "ElementDataFile =\n", "'' is no file beside the header", CT_EINPUT},
		{MHB "ElementDataFile = none.raw\n", "none.raw: No such file", CT_EINPUT},
		{MHB "ElementDataFile = folder\n", "folder: is no file of voxels", CT_EINPUT},
		{MHB "ElementDataFile = pipe\n", "pipe: is no file of voxels", CT_EINPUT},
		{MHB "ElementDataFile = short.raw\n", "short.raw: truncated file", CT_EINPUT},
		{MHB "HeaderSize = -1\nElementDataFile = short.raw\n", "short.raw: truncated file",
			CT_EINPUT},
		{MHB "HeaderSize = 20\nElementDataFile = long.raw\n", "long.raw: truncated file",
			CT_EINPUT},
		{MHB "ElementDataFile = long.raw\n", "longer than its header says", CT_EINPUT},
		{MHB, "has no ElementDataFile", CT_EINPUT},
		{MHB "nonsense\n" HERE, "'nonsense' is no field", CT_EINPUT},
		{"hello\n", "not a NIfTI file, nor MetaImage or NRRD", CT_EINPUT},
		{"Commentary = x\n", "not a NIfTI file", CT_EINPUT},
		{"NRRD0004\ndimension: 5\n\n", "dimension: 5 is not read here, only 2 to 4",
			CT_EINPUT},
		{NR("1", "24") "spacings: 1\n\n", "dimension: 1 is not read here", CT_EINPUT},
		{NR("2", "24 1") "kinds: domain list\nspacings: 1 1\n\n", "only one of them is",
			CT_EINPUT},
		{NR("4", "4 3 1 2") "spacings: 1 1 1 1\n\n",
			"sizes: axis 4 is none of space and not single", CT_EINPUT},
		{NR("4", "1 4 3 2") "spacings: 1 1 1 1\n\n", "sizes: axis 4 is none", CT_EINPUT},
		{NR("4", "4 3 2") "spacings: 1 1 1 1\n\n", "sizes: axis 4 is none", CT_EINPUT},
		{NR("4", "2 4 3 1") "kinds: list domain domain domain\n\n",
			"sizes: axis 1 is none of space and not single", CT_EINPUT},
		{NR("4", "1 4 3 1") "kinds: list domain domain time\nspacings: 1 1 1 1\n\n",
			"kinds: 'time' is not read here", CT_EINPUT},
		{NR("4", "1 4 3 2") "space: LPS\nspace directions: none (1,0,0) (0,1,0)\n\n",
			"is not 9 numbers", CT_EINPUT},
		{NR("2", "6 4") "space directions: (1,0,0) (0,1,0)\n\n", "is more than 4 numbers",
			CT_EINPUT},
		{NR("2", "6 4") "space: LPS\nspace directions: (1,0,0) (1,0,0)\n\n", "", CT_EGEOM},
		{"NRRD0004\n\n", "has no dimension", CT_EINPUT},
		{NRB "kinds: vector domain domain\n\n",
			"sizes: axis 1 is none of space and not single", CT_EINPUT},
		{NRB "units: \"mm\" \"cm\" \"mm\"\n\n", "units: 'cm'", CT_EINPUT},
		{NRB "encoding: ascii\n\n", "encoding: 'ascii'", CT_EINPUT},
		{NRB "encoding: bzip2\n\n", "encoding: 'bzip2'", CT_EINPUT},
		{NRA "spacings: 1 1 1\n\n", "has no encoding", CT_EINPUT},
		{NRA "encoding: raw\n\n", "neither space directions nor spacings", CT_EINPUT},
		{NRA "encoding: raw\nspacings: 1 nan 1\n\n", "is not 3 numbers", CT_EINPUT},
		{NRA "encoding: raw\nspacings: 1 -1 1\n\n", "spacings: -1 is no distance",
			CT_EGEOM},
		{NRB "space directions: (1,0,0) (0,1,0) (0,0,1)\n\n", "without a space", CT_EINPUT},
		{NRB "space: scanner-xyz\n\n", "space: 'scanner-xyz'", CT_EINPUT},
		{NRB "space: LPS\nspace directions: none (0,1,0) (0,0,1)\n\n",
			"sizes: axis 1 is none of space", CT_EINPUT},
		{NRB "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,1,0)\n\n", "", CT_EGEOM},
		{NRB "type: block\n\n", "type: block is no number", CT_EINPUT},
		{NRB "type: short\n\n", "endian: '' is neither", CT_EINPUT},
		{NRB "byte skip: -2\n\n", "byte skip: -2", CT_EINPUT},
		{NRB "line skip: -1\n\n", "line skip: -1", CT_EINPUT},
		{NRB "data file: LIST\n\n", "data file: LIST", CT_EINPUT},
		{NRB "datafile: x%d.raw 1 2 1\n\n", "a pattern", CT_EINPUT},
		{NRB "data file: a/b\n\n", "is no file beside the header", CT_EINPUT},
		{NRB "sizes: 0 3 2\n\n", "sizes: 0 is no number", CT_EINPUT},
		{NRB "what\n\n", "'what' is no field", CT_EINPUT},
		{NRB, "no empty line ends it", CT_EINPUT}};

	put_text("short.raw", "0123456789012345678901");
	put_text("long.raw", "01234567890123456789012345678901234");
	mkdir("folder", 0700);
	mkfifo("pipe", 0600);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		char p[2100], header[2000];
		struct ct_vol v = {0};
		/* 24 bytes behind those that are whole */
		const int n = snprintf(p, sizeof p, "%s%.*s", last_of_each(header, bad[i].header),
			strstr(bad[i].header, "LOCAL") || strstr(bad[i].header, "\n\n") ? 24 : 0,
			"abcdefghijklmnopqrstuvwx");
		const bool ok = parse(p, (size_t)n, "x", &v) == -1 && e.code == bad[i].code &&
				strncmp(e.msg, "x: ", 3) == 0 && strstr(e.msg, bad[i].words) &&
				!v.data && !v.meta.pair;

		OK(ok, "refused: %s", *bad[i].words ? bad[i].words : "its grid");
		if (!ok)
			printf("# %d %s\n", e.code, e.msg);
		ct_vol_free(&v);
	}
}

static bool taken(const char *header, size_t bytes)
{
	struct ct_vol v = {0};
	char p[2000];
	const int n = snprintf(
		p, sizeof p, "%s%.*s", header, (int)bytes, "abcdefghijklmnopqrstuvwxyzabcdefgh");
	const bool ok =
		parse(p, (size_t)n, "far/../x", &v) == 0 && v.data[0] == 'a' && v.data[23] == 'x';

	if (!ok)
		printf("# %s\n", e.msg);
	ct_vol_free(&v);
	return ok;
}

static void test_taken(void)
{
	struct ct_vol v = {0};

	mkdir("far", 0700);
	put_text("beside.raw", "a\nb\n12abcdefghijklmnopqrstuvwx");
	OK(taken(MHB HERE, 24), "without a place");
	OK(taken(MHB
		   "Comment = = :\nDistanceUnits = ?\nElementToIntensityFunctionSlope = 1.0\n" HERE,
		   24),
		"what says nothing");
	OK(taken(NRB "\n", 24) && taken(NRB "units: \"mm\" \"mm\" \"\"\nspace:=x\n\n", 24),
		"NRRD too");
	OK(taken("NRRD0004\r\ndimension: 3\r\ntype: uchar\r\nsizes: 4 3 2\r\nencoding: raw\r\n"
		 "spacings: 1 1 1\r\n\r\n",
		   24),
		"with the line ends of other systems");
	OK(taken(MHB "HeaderSize = 6\nElementDataFile = beside.raw\n", 0),
		"a file beside it, and what to skip");
	OK(taken(MHB "HeaderSize = -1\nElementDataFile = beside.raw\n", 0), "all but its end");
	OK(taken(NRB "line skip: 2\nbyte skip: 2\ndata file: beside.raw\n", 0), "lines and bytes");
	OK(taken(NRB "byte skip: -1\ndata file: beside.raw\n\n", 0), "also its end");
	e = (struct ct_err){0};
	OK(parse(MHB "ElementDataFile = beside.raw\n", strlen(MHB) + 29, "-", &v) == -1 &&
			strstr(e.msg, "nothing is beside standard input"),
		"but not of a stream");
}

/* A header takes no more memory than this, whatever it says. */
static void test_long(void)
{
	enum { FIELD = 200000 };
	struct ct_vol v = {0};
	char *p = malloc(8 * FIELD);
	size_t n = 0;

	if (!p)
		exit(99);
	n += (size_t)snprintf(p, 8 * FIELD, MHB);
	for (int k = 0; k < 6; k++) {
		n += (size_t)snprintf(p + n, 8 * FIELD - n, "Field%d = ", k);
		memset(p + n, 'a', FIELD);
		p[n + FIELD] = '\n';
		n += FIELD + 1;
	}
	OK(parse(p, n, "x", &v) == -1 && strstr(e.msg, "a header of more than"), "many bytes");
	memset(p + strlen(MHB), 'a', 2 * FIELD);
	OK(parse(p, n, "x", &v) == -1 && strstr(e.msg, "is no text"), "a line of too many");
	n = (size_t)snprintf(p, 8 * FIELD, MHB);
	for (int k = 0; k < 5000; k++)
		n += (size_t)snprintf(p + n, 8 * FIELD - n, "F%d = %d\n", k, k);
	OK(parse(p, n, "x", &v) == -1 && strstr(e.msg, "a header of more than"), "many fields");
	free(p);
}

/* Axis x of the spaces of NRRD, and of none. */
static void test_spaces(void)
{
	static const struct {
		const char *space;
		double x, y, at;
		bool placed;
	} all[] = {{"space: right-anterior-superior\n", 1, 2, 5, true},
		{"space: LAS\n", -1, 2, -5, true},
		{"space: left-posterior-superior\n", -1, -2, -5, true}, {"", 1, 2, 0, false}};

	for (size_t i = 0; i < 4; i++) {
		struct ct_vol v = {0};
		char p[600];
		const int n = snprintf(p, sizeof p,
			NRA "encoding: raw\n%s%s\nabcdefghijklmnopqrstuvwx", all[i].space,
			all[i].placed
				? "space directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (5,6,7)\n"
				: "spacings: 1 2 3\n");

		OK(parse(p, (size_t)n, "x", &v) == 0 && v.affine[0][0] == all[i].x &&
				v.affine[1][1] == all[i].y && v.affine[2][2] == 3 &&
				v.affine[0][3] == all[i].at &&
				!ct_meta_get(&v.meta, CT_META_NIFTI_CODE) == all[i].placed,
			"space %zu", i);
		ct_vol_free(&v);
	}
}

/* One plane, and what is single beside two or three axes of space. */
static void test_dimensions(void)
{
	static const struct {
		const char *header;
		size_t n[3];
		double affine[3][4];
		bool placed;
	} all[] = {{MH2 "Offset = 5 6\nTransformMatrix = 0 1 -1 0\n" HERE, {6, 4, 1},
			   {{0, 3, 0, -5}, {-2, 0, 0, -6}, {0, 0, 1, 0}}, false},
		{MH2 HERE, {6, 4, 1}, {{-2, 0, 0, 0}, {0, -3, 0, 0}, {0, 0, 1, 0}}, false},
		{MH4 "Offset = 5 6 7 8\nTransformMatrix = 0 1 0 0 0 0 1 0 1 0 0 0 0 0 0 1\n" HERE,
			{4, 3, 2}, {{0, 0, -4, -5}, {-2, 0, 0, -6}, {0, 3, 0, 7}}, true},
		{NR("2", "6 4") "spacings: 2 3\nkinds: domain domain\n\n", {6, 4, 1},
			{{2, 0, 0, 0}, {0, 3, 0, 0}, {0, 0, 1, 0}}, false},
		{NR("2", "6 4") "space dimension: 2\nspace directions: (0,2) (3,0)\nspace origin: "
				"(5,6)\n\n",
			{6, 4, 1}, {{0, 3, 0, 5}, {2, 0, 0, 6}, {0, 0, -1, 0}}, false},
		{NR("2", "6 4") "space: LPS\nspace directions: (2,0,0) (0, 0, -3)\nspace origin: "
				"(5,6,7)\n\n",
			{6, 4, 1}, {{-2, 0, 0, -5}, {0, 0, -1, -6}, {0, -3, 0, 7}}, true},
		{NR("3", "1 6 4") "kinds: vector domain space\nspacings: nan 2 3\n\n", {6, 4, 1},
			{{2, 0, 0, 0}, {0, 3, 0, 0}, {0, 0, 1, 0}}, false},
		{NR("4", "4 3 2 1") "spacings: 1 2 3 nan\nunits: \"mm\" \"mm\" \"mm\" \"s\"\n\n",
			{4, 3, 2}, {{1, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 3, 0}}, false},
		{NR("4", "1 4 3 2") "space: RAS\nkinds: list domain domain domain\n"
				    "space directions: none (1,0,0) (0,2,0) (0,0,3)\nspace origin: "
				    "(5,6,7)\n\n",
			{4, 3, 2}, {{1, 0, 0, 5}, {0, 2, 0, 6}, {0, 0, 3, 7}}, true},
		{NR("4", "4 3 1 2") "space: RAS\n"
				    "space directions: (1,0,0) (0,2,0) none (0,0,3)\nspace origin: "
				    "(5,6,7)\n\n",
			{4, 3, 2}, {{1, 0, 0, 5}, {0, 2, 0, 6}, {0, 0, 3, 7}}, true}};

	for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
		struct ct_vol v = {0};
		char p[600];
		const int n = snprintf(p, sizeof p, "%sabcdefghijklmnopqrstuvwx", all[i].header);
		const bool ok = parse(p, (size_t)n, "x", &v) == 0 &&
				memcmp(v.n, all[i].n, sizeof v.n) == 0 &&
				memcmp(v.affine, all[i].affine, sizeof v.affine) == 0 &&
				!ct_meta_get(&v.meta, CT_META_NIFTI_CODE) == all[i].placed &&
				v.data[23] == 'x';

		OK(ok, "dimensions %zu: %s", i, e.msg);
		for (int r = 0; r < 3 && !ok && v.data; r++)
			printf("# %g %g %g %g\n", v.affine[r][0], v.affine[r][1], v.affine[r][2],
				v.affine[r][3]);
		ct_vol_free(&v);
	}
}

static void test_write(void)
{
	static const char *const name[] = {"w.mha", "w.mhd", "w.nrrd", "w.nhdr"},
				 *const beside[] = {NULL, "w.raw", NULL, "w.raw"};
	static const char odd[] = "x\nOffset = \\n:=#\xc3\xa9"; /* a key of another's file */
	struct ct_vol a = {0};

	if (ct_vol_alloc(&a, (const size_t[]){5, 4, 3}, &e))
		exit(99);
	memcpy(a.affine,
		(const double[3][4]){
			{.7, 0, 0, -1.1}, {0, .6, -1.6, 1e-7}, {0, .8, 1.2, 123456.789}},
		sizeof a.affine);
	for (int half = 0; half < 2; half++)
		for (int k = 0; k < 8; k++) {
			struct ct_vol b = {0};
			char *data;
			double far = 0;

			for (size_t i = 0; i < 60; i++)
				a.data[i] = (float)i * 17 - 500 + (half ? .25f : 0);
			ct_meta_set(&a.meta, "history", "one\ntwo \\n: = three:=", &e);
			ct_meta_set(&a.meta, odd, "9 9 9", &e);
			unlink("w.raw");
			e = (struct ct_err){0};
			OK(ct_headed_write(name[k / 2], &a, CT_NIFTI_AUTO, k & 1, &force, &e) ==
						0 &&
					ct_vol_read(name[k / 2], &b, &e) == 0 &&
					memcmp(a.data, b.data, 60 * sizeof *a.data) == 0,
				"%s comes back%s", name[k / 2], k & 1 ? ", compressed" : "");
			for (int r = 0; r < 3; r++)
				for (int c = 0; c < 4 && b.data; c++)
					far = fmax(far, fabs(a.affine[r][c] - b.affine[r][c]));
			OK(far < 1e-15 && b.data &&
					strcmp(ct_meta_get(&b.meta, "history"),
						"one\ntwo \\n: = three:=") == 0 &&
					ct_meta_get(&b.meta, odd) &&
					strcmp(ct_meta_get(&b.meta, odd), "9 9 9") == 0,
				"with its place and metadata: %g", far);
			OK(ct_headed_beside(&data, name[k / 2], false, &e) == 0 &&
					(data ? beside[k / 2] && strcmp(data, beside[k / 2]) == 0
					      : !beside[k / 2]) &&
					(access("w.raw", F_OK) == 0) == (beside[k / 2] && !(k & 1)),
				"in as many files");
			free(data);
			ct_vol_free(&b);
		}
	a.affine[0][1] = .5;
	OK(ct_headed_write("w.mha", &a, CT_NIFTI_AUTO, false, &force, &e) && e.code == CT_EGEOM,
		"what is sheared is not written");
	ct_vol_free(&a);
}

int main(void)
{
	alarm(60); /* what would read a pipe waits */
	scratch_begin();
	test_types();
	test_prefixes();
	test_refused();
	test_taken();
	test_long();
	test_spaces();
	test_dimensions();
	test_write();
	return tap_done();
}
