/* any.c: see any.h. */
#include "config.h"
#include "formats/any.h"
#include "formats/bytes.h"
#include "formats/format.h"
#include "formats/headed.h"
#include "formats/io.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static uint64_t little(const unsigned char *p, int n)
{
	uint64_t x = 0;

	while (n-- > 0)
		x = x << 8 | p[n];
	return x;
}

static uint32_t big(const unsigned char *p)
{
	return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}

bool ct_any_is_tar(const unsigned char *data, size_t n)
{
	return n >= 262 && memcmp(data + 257, "ustar", 5) == 0;
}

enum ct_kind ct_any_sniff(const unsigned char *data, size_t n)
{
	static const struct {
		const char *magic;
		size_t n;
		enum ct_kind kind;
	} known[] = {{"\x76\x2f\x31\x01", 4, CT_KIND_STACK}, {"ply\n", 4, CT_KIND_GAUSS},
		{"ply\r", 4, CT_KIND_GAUSS}, {"\x1f\x8b", 2, CT_KIND_VOLUME},
		{"\x89PNG", 4, CT_KIND_PICTURE}, {"II*", 4, CT_KIND_PICTURE},
		{"MM\0*", 4, CT_KIND_PICTURE}, {"\xff\xd8\xff", 3, CT_KIND_PICTURE},
		{"PK\3\4", 4, CT_KIND_TENSORS}, {"\x80\2\x8a\n", 4, CT_KIND_TENSORS}};

	for (size_t i = 0; i < sizeof known / sizeof *known; i++)
		if (n >= known[i].n && memcmp(data, known[i].magic, known[i].n) == 0)
			return known[i].kind;
	if (ct_headed_sniff(data, n))
		return CT_KIND_VOLUME;
	if (n >= 132 && memcmp(data + 128, "DICM", 4) == 0)
		return CT_KIND_DICOM;
	if (ct_any_is_tar(data, n))
		return CT_KIND_TENSORS; /* of PyTorch before 1.6, which its reader says */
	if (n >= 9 && data[8] == '{' && little(data, 8) >= 2 && little(data, 8) < UINT64_C(1) << 32)
		return CT_KIND_TENSORS;
	if (n >= 4 && (little(data, 4) == 348 || little(data, 4) == 540 || big(data) == 348 ||
			      big(data) == 540))
		return CT_KIND_VOLUME;
	return CT_KIND_UNKNOWN;
}

const char *ct_kind_name(enum ct_kind kind)
{
	return CT_WORD(CT_KIND_LIST, kind);
}

static int refuse(const char *path, enum ct_kind kind, struct ct_err *e)
{
	if (kind == CT_KIND_DICOM)
		return ct_fail(
			e, CT_EINPUT, "%s: DICOM; ct-convert makes a volume of a series", path);
	return ct_fail(e, CT_EINPUT, "%s: %s", path,
		kind == CT_KIND_PICTURE
			? "a picture"
			: "not a NIfTI, MetaImage, NRRD, EXR, PLY, safetensors or PyTorch file");
}

/* Standard input and other streams: in memory first. */
static int read_bytes(const char *path, struct ct_any *a, struct ct_err *e)
{
	unsigned char *data;
	FILE *f = NULL;
	size_t n;
	int rc = -1;

	if (ct_slurp(path, &data, &n, e))
		return -1;
	a->kind = ct_any_sniff(data, n);
	if (a->kind == CT_KIND_STACK)
		rc = ct_bytes_read_exr(data, n, path, &a->stack, e);
	else if (a->kind == CT_KIND_GAUSS)
		rc = ct_bytes_read_ply(data, n, path, &a->gauss, e);
	else if (a->kind != CT_KIND_VOLUME && a->kind != CT_KIND_TENSORS)
		refuse(path, a->kind, e);
	else if (!(f = fmemopen(data, n, "rb")))
		ct_fail(e, CT_ENOMEM, "%s: no memory", path);
	else
		rc = a->kind == CT_KIND_VOLUME ? ct_bytes_read_vol(f, path, &a->vol, e)
					       : ct_bytes_read_tensors(f, path, &a->tensors, e);
	if (f)
		fclose(f);
	free(data);
	return rc;
}

int ct_any_is_stack(const char *path, bool *stack, struct ct_err *e)
{
	unsigned char first[4];
	FILE *f;

	*stack = strcmp(path, "-") == 0;
	if (*stack)
		return 0;
	if (ct_io_open(path, &f, e))
		return -1;
	*stack = ct_any_sniff(first, fread(first, 1, sizeof first, f)) == CT_KIND_STACK;
	ct_io_close(f);
	return 0;
}

int ct_any_read(const char *path, struct ct_any *a, struct ct_err *e)
{
	unsigned char head[CT_SNIFF];
	struct stat st;
	size_t n;
	FILE *f;

	/* a fifo is opened once and read once */
	if (strcmp(path, "-") == 0 || (stat(path, &st) == 0 && !S_ISREG(st.st_mode)))
		return read_bytes(path, a, e);
	if (ct_io_open(path, &f, e))
		return -1;
	n = fread(head, 1, sizeof head, f);
	ct_io_close(f);
	a->kind = ct_any_sniff(head, n);
	switch (a->kind) {
	case CT_KIND_VOLUME: return ct_vol_read(path, &a->vol, e);
	case CT_KIND_STACK: return ct_stack_read(path, &a->stack, e);
	case CT_KIND_GAUSS: return ct_gauss_read(path, &a->gauss, e);
	case CT_KIND_TENSORS: return ct_tensors_read(path, &a->tensors, e);
	case CT_KIND_UNKNOWN:
	case CT_KIND_DICOM:
	case CT_KIND_PICTURE: break;
	}
	return refuse(path, a->kind, e);
}

void ct_any_free(struct ct_any *a)
{
	ct_vol_free(&a->vol);
	ct_stack_free(&a->stack);
	ct_gauss_free(&a->gauss);
	ct_tensors_free(&a->tensors);
	a->kind = CT_KIND_UNKNOWN;
}

const struct ct_meta *ct_any_meta(const struct ct_any *a)
{
	return a->kind == CT_KIND_STACK     ? &a->stack.meta
	       : a->kind == CT_KIND_GAUSS   ? &a->gauss.meta
	       : a->kind == CT_KIND_TENSORS ? &a->tensors.meta
					    : &a->vol.meta;
}
