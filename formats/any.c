/* any.c: the list of all formats; see any.h. */
#include "config.h"
#include "formats/any.h"

#include <stdio.h>
#include <sys/stat.h>

static int sniff_dicom(const unsigned char *data, size_t n)
{
	return n >= 132 && memcmp(data + 128, "DICM", 4) == 0 ? CT_SNIFF_PLACE : CT_SNIFF_NO;
}

static int sniff_picture(const unsigned char *data, size_t n)
{
	static const struct {
		const char *magic;
		size_t n;
	} known[] = {{"\x89PNG", 4}, {"II*", 4}, {"MM\0*", 4}, {"\xff\xd8\xff", 3}};

	if (sniff_dicom(data, n)) /* its first 128 bytes are anything, often a TIFF header */
		return CT_SNIFF_NO;
	for (size_t i = 0; i < sizeof known / sizeof *known; i++)
		if (n >= known[i].n && memcmp(data, known[i].magic, known[i].n) == 0)
			return CT_SNIFF_MAGIC;
	return CT_SNIFF_NO;
}

static const struct ct_format dicom = {.name = "DICOM",
	.kind = CT_KIND_DICOM,
	.refuse = "DICOM; ct-convert makes a volume of a series",
	.sniff = sniff_dicom};
static const struct ct_format picture = {
	.name = "picture", .kind = CT_KIND_PICTURE, .refuse = "a picture", .sniff = sniff_picture};

static const struct ct_format *const formats[] = {&dicom, &picture, &ct_format_nifti,
	&ct_format_metaimage, &ct_format_nrrd, &ct_format_exr, &ct_format_ply,
	&ct_format_safetensors, &ct_format_pytorch, NULL};

enum ct_kind ct_any_sniff(const unsigned char *data, size_t n)
{
	const struct ct_format *is = ct_format_find(formats, data, n);

	return is ? is->kind : CT_KIND_UNKNOWN;
}

size_t ct_any_head(unsigned char head[static CT_SNIFF], const char *path)
{
	struct stat st;
	FILE *f = stat(path, &st) == 0 && S_ISREG(st.st_mode) ? fopen(path, "rb") : NULL;
	const size_t n = f ? fread(head, 1, CT_SNIFF, f) : 0;

	if (f)
		fclose(f);
	return n;
}

bool ct_any_is_stack(const char *path)
{
	unsigned char head[CT_SNIFF];
	struct stat st;
	size_t n;

	if (strcmp(path, "-") == 0)
		return true;
	n = ct_any_head(head, path);
	if (n)
		return ct_format_exr.sniff(head, n) != CT_SNIFF_NO;
	return stat(path, &st) != 0 || !S_ISREG(st.st_mode) || st.st_size > 0; /* no empty file */
}

int ct_any_check_picture(const char *path, struct ct_err *e)
{
	unsigned char head[CT_SNIFF];
	const enum ct_kind kind = ct_any_sniff(head, ct_any_head(head, path));

	return kind == CT_KIND_UNKNOWN || kind == CT_KIND_PICTURE
		       ? 0
		       : ct_fail(e, CT_EINPUT,
				 "%s: neither projections (EXR) nor a picture, but of the kind %s",
				 path, ct_kind_name(kind));
}

int ct_any_read(const char *path, struct ct_any *a, struct ct_err *e)
{
	return ct_format_read(formats, path, a, e);
}
