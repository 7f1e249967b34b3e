/* What a file is, by its first bytes; each of our kinds by name, from a pipe and from standard
 * input.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "formats/any.h"
#include "formats/format.h"
#include "formats/io.h"
#include "tap.h"
#include "scratch.h"

#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static const struct ct_env force = {.files = &(const struct ct_io_rule){.force = true}};
static const char *const names[] = {
	[CT_KIND_VOLUME] = "v.nii",
	[CT_KIND_STACK] = "s.exr",
	[CT_KIND_GAUSS] = "g.ply",
	[CT_KIND_TENSORS] = "t.safetensors",
};

static const struct {
	const char *p;
	size_t n;
	enum ct_kind kind;
} magic[] = {{"\x76\x2f\x31\x01", 4, CT_KIND_STACK}, {"ply\n", 4, CT_KIND_GAUSS},
	{"ply\r", 4, CT_KIND_GAUSS}, {"\x1f\x8b", 2, CT_KIND_VOLUME},
	{"\x89PNG", 4, CT_KIND_PICTURE}, {"II*", 4, CT_KIND_PICTURE}, {"MM\0*", 4, CT_KIND_PICTURE},
	{"II+", 4, CT_KIND_PICTURE}, {"MM\0+", 4, CT_KIND_PICTURE},
	{"\xff\xd8\xff", 3, CT_KIND_PICTURE}, {"\x5c\x01\0\0", 4, CT_KIND_VOLUME},
	{"\x1c\x02\0\0", 4, CT_KIND_VOLUME}, {"\0\0\x01\x5c", 4, CT_KIND_VOLUME},
	{"\0\0\x02\x1c", 4, CT_KIND_VOLUME}};

static bool is_magic(const unsigned char *b, size_t n)
{
	for (size_t i = 0; i < sizeof magic / sizeof *magic; i++)
		if (magic[i].n == n && memcmp(magic[i].p, b, n) == 0)
			return true;
	return false;
}

/* It needs just these n bytes, each as it is: shorter or with any bit changed it is nothing, or
 * another of them. */
static int exactly(const unsigned char *p, size_t n, enum ct_kind kind)
{
	unsigned char b[64];
	int bad = 0;

	memset(b, 0xff, sizeof b);
	memcpy(b, p, n);
	bad += ct_signature_kind(b, n) != kind || ct_signature_kind(b, sizeof b) != kind;
	bad += ct_signature_kind(b, n - 1) != CT_KIND_UNKNOWN;
	for (size_t i = 0; i < 8 * n; i++) {
		b[i / 8] ^= (unsigned char)(1u << i % 8);
		bad += ct_signature_kind(b, n) != CT_KIND_UNKNOWN && !is_magic(b, n);
		b[i / 8] ^= (unsigned char)(1u << i % 8);
	}
	return bad == 0;
}

static void test_magic(void)
{
	for (size_t i = 0; i < sizeof magic / sizeof *magic; i++)
		OK(exactly((const unsigned char *)magic[i].p, magic[i].n, magic[i].kind),
			"%s by just the first %zu bytes, case %zu", ct_kind_name(magic[i].kind),
			magic[i].n, i);
}

static enum ct_kind with_header(uint64_t length, char first, size_t n)
{
	unsigned char b[16] = {0};

	for (int i = 0; i < 8; i++)
		b[i] = (unsigned char)(length >> 8 * i);
	b[8] = (unsigned char)first;
	return ct_signature_kind(b, n);
}

static void test_sniff(void)
{
	unsigned char b[140] = {0};
	int bad = 0;

	memcpy(b + 128, "DICM", 4);
	OK(ct_signature_kind(b, 132) == CT_KIND_DICOM && ct_signature_kind(b, 140) == CT_KIND_DICOM,
		"DICOM");
	OK(ct_signature_kind(b, 131) == CT_KIND_UNKNOWN, "not without its last letter");
	OK(with_header(2, '{', 9) == CT_KIND_TENSORS, "tensors");
	OK(with_header(UINT32_MAX, '{', 16) == CT_KIND_TENSORS, "with a long header");
	OK(with_header(348, '{', 9) == CT_KIND_TENSORS, "or of a length like NIfTI's");
	OK(with_header(2, '{', 8) == CT_KIND_UNKNOWN, "not without the brace");
	OK(with_header(2, '[', 9) == CT_KIND_UNKNOWN, "nor with another");
	OK(with_header(1, '{', 9) == CT_KIND_UNKNOWN, "nor a header that holds nothing");
	for (int bit = 32; bit < 64; bit++)
		bad += with_header(UINT64_C(1) << bit, '{', 9) != CT_KIND_UNKNOWN;
	OK(bad == 0, "nor one of four gigabytes");
	OK(strcmp(ct_kind_name(CT_KIND_GAUSS), "Gaussians") == 0, "a kind has a name");
}

/* One of each kind, told apart by what it holds. */
static void write_all(void)
{
	struct ct_any a = {0};
	struct ct_tensor *t;
	const size_t n[3] = {2, 3, 4}, dim = 5;

	must(ct_vol_alloc(&a.vol, n, &err) || ct_stack_alloc(&a.stack, 1, 2, 3, &err) ||
		ct_gauss_reserve(&a.gauss, 3, &err) ||
		ct_tensors_add(&a.tensors, "w", 1, &dim, &t, &err));
	for (size_t i = 0; i < 24; i++)
		a.vol.data[i] = (float)i;
	for (int i = 0; i < 3; i++)
		a.vol.affine[i][i] = 1;
	a.stack.view[0] = (struct ct_view){.source = {0, 100, 0}, .u = {1, 0, 0}, .v = {0, 0, -1}};
	memset(a.stack.data, 0, 6 * sizeof *a.stack.data);
	memset(t->data, 0, dim * sizeof *t->data);
	a.gauss.activation = CT_RELU;
	a.gauss.gamma = 1;
	must(ct_vol_write("v.nii", &a.vol, &force, &err) ||
		ct_stack_write("s.exr", &a.stack, &force, &err) ||
		ct_gauss_write("g.ply", &a.gauss, &force, &err) ||
		ct_tensors_write("t.safetensors", &a.tensors, false, &force, &err));
	ct_any_free(&a);
	OK(!a.vol.data && !a.stack.data && !a.gauss.raw && !a.tensors.t, "all is freed");
}

static bool holds(const struct ct_any *a, enum ct_kind kind, const char *name)
{
	const struct ct_meta *m = kind == CT_KIND_VOLUME  ? &a->vol.meta
				  : kind == CT_KIND_STACK ? &a->stack.meta
				  : kind == CT_KIND_GAUSS ? &a->gauss.meta
							  : &a->tensors.meta;
	const char *input = ct_meta_get(ct_any_meta(a), CT_META_INPUT);

	return a->kind == kind && ct_any_meta(a) == m && input &&
	       strncmp(input, name, strlen(name)) == 0 &&
	       !a->vol.data == (kind != CT_KIND_VOLUME) &&
	       !a->stack.data == (kind != CT_KIND_STACK) &&
	       !a->gauss.raw == (kind != CT_KIND_GAUSS) &&
	       !a->tensors.t == (kind != CT_KIND_TENSORS);
}

/* The bytes of a file into a fifo. */
static pid_t feed(const char *file)
{
	const pid_t child = fork();

	if (child)
		return child;
	execlp("sh", "sh", "-c", "exec cat \"$0\" >fifo", file, (char *)NULL);
	_exit(127);
}

static void test_read(enum ct_kind kind)
{
	struct ct_any a = {0};
	int status;
	pid_t child;

	OK(ct_any_read(names[kind], &a, &err) == 0 && holds(&a, kind, names[kind]), "%s, by name",
		names[kind]);
	ct_any_free(&a);
	OK(a.kind == CT_KIND_UNKNOWN, "and nothing more");
	child = feed(names[kind]);
	OK(ct_any_read("fifo", &a, &err) == 0 && holds(&a, kind, "fifo"), "from a pipe");
	ct_any_free(&a);
	waitpid(child, &status, 0);
	if (!freopen(names[kind], "rb", stdin))
		exit(99);
	OK(ct_any_read("-", &a, &err) == 0 && holds(&a, kind, "- "), "from standard input");
	ct_any_free(&a);
}

static void save(const char *path, const void *p, size_t n)
{
	FILE *f = fopen(path, "wb");

	if (!f || fwrite(p, 1, n, f) != n || fclose(f) != 0)
		exit(99);
}

/* By name and from standard input, with the words. */
static void refused(const char *path, const char *words)
{
	const char *const ways[] = {path, "-"};
	struct ct_any a = {0};
	char want[400];

	if (!freopen(path, "rb", stdin))
		exit(99);
	for (int i = 0; i < 2; i++) {
		err = (struct ct_err){0};
		snprintf(want, sizeof want, "%s: %s", ways[i], words);
		OK(ct_any_read(ways[i], &a, &err) == -1 && err.code == CT_EINPUT &&
				strcmp(err.msg, want) == 0,
			"refused: %s", err.msg);
	}
}

static void test_refusals(void)
{
	char dicom[400] = {0};
	struct ct_any a = {0};

	memcpy(dicom + 128, "DICM", 4);
	save("x", dicom, sizeof dicom);
	refused("x",
		"not a NIfTI, MetaImage, NRRD, EXR, PLY, R2-Gaussian, safetensors or PyTorch file, but DICOM, of which ct-convert makes a volume");
	save("x", "\x89PNG\r\n", 6);
	refused("x",
		"not a NIfTI, MetaImage, NRRD, EXR, PLY, R2-Gaussian, safetensors or PyTorch file, but a picture (PNG): ct-convert --radiograph makes a stack of it");
	save("x", "hello", 5);
	refused("x",
		"not a NIfTI, MetaImage, NRRD, EXR, PLY, R2-Gaussian, safetensors or PyTorch file");
	save("x", "", 0);
	refused("x",
		"not a NIfTI, MetaImage, NRRD, EXR, PLY, R2-Gaussian, safetensors or PyTorch file, but empty");
	OK(ct_any_read("none", &a, &err) == -1 && err.code == CT_EINPUT, "no file: %s", err.msg);
}

static void test_is_stack(void)
{
	OK(ct_any_is_stack("-"), "standard input is taken for a stack");
	OK(!ct_any_is_stack("v.nii"), "a volume is none");
	OK(ct_any_is_stack("s.exr"), "a stack is one");
	save("x", "\x76\x2f\x31", 3);
	OK(!ct_any_is_stack("x"), "three bytes are none");
	save("x", "", 0);
	OK(!ct_any_is_stack("x"), "an empty file is none");
	OK(ct_any_is_stack("fifo"), "a pipe is taken for one");
	OK(ct_any_is_stack("none"), "of no file the reader of stacks tells");
}

/* What steps hand on in memory is what a reader would make of the file between them. */

static const struct ct_env env = {
	.tool = "ct-t", .files = &(const struct ct_io_rule){.force = true}};

static bool same_meta(const struct ct_meta *a, const struct ct_meta *b)
{
	bool same = a->n == b->n;

	for (size_t i = 0; i < a->n && same; i++)
		same = strcmp(a->pair[i].key, b->pair[i].key) == 0 &&
		       strcmp(a->pair[i].value, b->pair[i].value) == 0;
	return same;
}

/* Metadata that no file keeps as they are: text that is no UTF-8, the name of what was read, a key
 * that is one of the format, and one that is too long for EXR. */
static void fill(struct ct_meta *m, const char *foreign)
{
	must(ct_meta_set(m, CT_META_INPUT, "x.nii xxh3:0", &err));
	must(ct_meta_set(m, "a key that is longer than the 31 characters", "v\n\xc3\xa4", &err));
	must(ct_meta_set(m, CT_META_HISTORY, "ct-a 1 a b\nct-b \\ 'c'", &err));
	must(ct_meta_set(m, "beam", "\xff latin \xe4", &err));
	must(ct_meta_set(m, "gamma", "a key of the format", &err));
	if (foreign)
		must(ct_meta_set(m, "nifti.ext.0", foreign, &err));
	must(ct_meta_set(m, "last", "", &err));
}

static bool volume(float step, const char *code, const char *foreign)
{
	const size_t n[3] = {3, 4, 5};
	struct ct_vol a = {.n = {0}}, b = {.n = {0}};
	bool same;

	must(ct_vol_alloc(&a, n, &err));
	for (int i = 0; i < 12; i++) /* oblique, of no float32 numbers */
		a.affine[i / 4][i % 4] =
			(double[]){0.6, -0.8, 0, 10.1, 0.8, 0.6, 0, -20.3, 0, 0, 1.7, 1.0 / 3}[i];
	for (size_t i = 0; i < ct_vol_count(&a); i++)
		a.data[i] = (float)i * step - 20;
	a.data[7] = -0.0f;
	fill(&a.meta, foreign);
	if (code)
		must(ct_meta_set(&a.meta, CT_META_NIFTI_CODE, code, &err));
	must(ct_vol_write("v.nii", &a, &env, &err));
	must(ct_vol_read("v.nii", &b, &err));
	must(ct_vol_as_read(&a, "elsewhere/v.nii", &err));
	same = memcmp(a.n, b.n, sizeof a.n) == 0 &&
	       memcmp(a.affine, b.affine, sizeof a.affine) == 0 &&
	       memcmp(a.data, b.data, ct_vol_count(&a) * sizeof *a.data) == 0 &&
	       same_meta(&a.meta, &b.meta);
	ct_vol_free(&a);
	ct_vol_free(&b);
	return same;
}

static bool stack(void)
{
	struct ct_stack a = {0}, b = {0};
	bool same;

	must(ct_stack_alloc(&a, 3, 4, 5, &err));
	for (size_t k = 0; k < 3; k++)
		a.view[k] = (struct ct_view){.source = {1000.1, (double)k / 3, 0},
			.centre = {-500, 1e-7, 0.1},
			.u = {0, 0.7, 0},
			.v = {0, 0, -0.7},
			.angle = 57.3 * (double)k};
	for (size_t i = 0; i < ct_stack_count(&a); i++)
		a.data[i] = (float)i * 0.1f - 2;
	fill(&a.meta, NULL);
	must(ct_stack_write("s.exr", &a, &env, &err));
	must(ct_stack_read("s.exr", &b, &err));
	must(ct_stack_as_read(&a, "s.exr", &err));
	same = a.views == b.views && a.h == b.h && a.w == b.w && a.beam == b.beam &&
	       memcmp(a.view, b.view, a.views * sizeof *a.view) == 0 &&
	       memcmp(a.data, b.data, ct_stack_count(&a) * sizeof *a.data) == 0 &&
	       same_meta(&a.meta, &b.meta);
	ct_stack_free(&a);
	ct_stack_free(&b);
	return same;
}

static bool gaussians(size_t n)
{
	struct ct_gauss a = {.activation = CT_PRELU,
				.gamma = 1.0 / 3,
				.step = 7,
				.grid = {3, 4, 5}},
			b = {0};
	bool same;

	must(ct_gauss_reserve(&a, n + 1, &err));
	a.n = n;
	for (size_t k = 0; k < CT_GAUSS_COLUMNS; k++)
		for (size_t i = 0; i < n; i++)
			a.column[k][i] = (float)(k + i) * 0.1f - 0.5f;
	for (int i = 0; i < 3; i++)
		a.affine[i][i] = 1.0 / 3;
	fill(&a.meta, NULL);
	must(ct_gauss_write("g.ply", &a, &env, &err));
	must(ct_gauss_read("g.ply", &b, &err));
	must(ct_gauss_as_read(&a, "g.ply", &err));
	same = a.n == b.n && a.gamma == b.gamma && a.step == b.step &&
	       a.activation == b.activation && memcmp(a.grid, b.grid, sizeof a.grid) == 0 &&
	       memcmp(a.affine, b.affine, sizeof a.affine) == 0 && same_meta(&a.meta, &b.meta);
	for (size_t k = 0; k < CT_GAUSS_COLUMNS && same; k++)
		same = n == 0 || memcmp(a.column[k], b.column[k], n * sizeof **a.column) == 0;
	ct_gauss_free(&a);
	ct_gauss_free(&b);
	return same;
}

static void test_errors(void)
{
	struct ct_err e = {0};
	struct ct_vol v = {.n = {0}};
	struct ct_stack s = {0};

	must(ct_vol_alloc(&v, (const size_t[3]){2, 2, 2}, &err));
	memset(v.data, 0, 8 * sizeof *v.data);
	v.affine[0][1] = 1;
	OK(ct_vol_as_read(&v, "v.nii", &e) == -1 && e.code == CT_EGEOM &&
			strncmp(e.msg, "v.nii: ", 7) == 0,
		"a volume that no file holds is refused as its writer does: %s", e.msg);
	ct_vol_free(&v);
	must(ct_stack_alloc(&s, 1, 2, 2, &err));
	memset(s.data, 0, 4 * sizeof *s.data);
	OK(ct_stack_as_read(&s, "s.exr", &e) == -1 && e.code == CT_EGEOM &&
			strncmp(e.msg, "s.exr: ", 7) == 0,
		"a stack that no file holds is refused as its writer does: %s", e.msg);
	ct_stack_free(&s);
}

static void t_as_read(void)
{
	scratch_begin();
	OK(volume(0.1f, NULL, NULL), "a volume of float32 is as its file is read");
	OK(volume(1, NULL, NULL), "a volume that is int16 in its file has one zero");
	OK(volume(0.1f, "2", "4 aGVsbG8A"),
		"codes and extensions of others come back as from a file");
	OK(volume(0.1f, "0", NULL), "a volume of no place has one afterwards, as from a file");
	OK(stack(), "a stack is as its file is read");
	OK(gaussians(50), "Gaussians are as their file is read");
	OK(gaussians(0), "a set of no Gaussians is as its file is read");
	test_errors();
}

int main(void)
{
	char dir[] = "/tmp/t-any.XXXXXX", clean[64];

	if (!mkdtemp(dir) || chdir(dir) || mkfifo("fifo", 0600))
		return 99;
	test_magic();
	test_sniff();
	write_all();
	for (int kind = CT_KIND_VOLUME; kind <= CT_KIND_TENSORS; kind++)
		test_read((enum ct_kind)kind);
	test_refusals();
	test_is_stack();
	snprintf(clean, sizeof clean, "rm -r %s", dir);
	t_as_read();
	return system(clean) ? 99 : tap_done();
}
