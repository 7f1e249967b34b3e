/* Small files that ask for much: time and memory stay within what the file is worth. A limit on the
 * processor's time ends the test where time grows with the square of a count.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "bound.h"
#include "core/mem.h"
#include "core/stack.h"
#include "core/tensors.h"
#include "core/vol.h"
#include "formats/format.h"
#include "formats/any.h"
#include "core/inflate.h"
#include "formats/io.h"
#include "nifti-make.h"
#include "tap.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#ifdef __SANITIZE_ADDRESS__ /* ten times as slow */
enum { SECONDS = 300 };
#else
enum { SECONDS = 15 };
#endif
enum { FREE_PARTS = CT_INFLATE_FREE >> 26 };

static struct ct_err e;

/* An int32, as NIfTI and the host have it. */
static void word(FILE *f, int32_t x)
{
	fwrite(&x, sizeof x, 1, f);
}

/* A NIfTI file of n voxels along each axis, with so many extensions of 4000 pairs. */
static void write_nifti(FILE *f, int side, int extensions)
{
	const double rows[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
	const int one[3] = {1, 1, 1};
	struct made m = {0};
	char *ext = NULL;
	size_t n = 0;
	FILE *s = open_memstream(&ext, &n);

	for (int k = 0; k < extensions; k++) {
		const long at = ftell(s);

		word(s, 0);
		word(s, 6);
		fputc('{', s);
		for (int i = 0; i < 4000; i++)
			fprintf(s, "%s\"ct:key.%d.%d\":\"\"", i ? "," : "", k, i);
		fputc('}', s);
		while (ftell(s) % 16)
			fputc(0, s);
		fflush(s);
		put_int(&(struct made){1, false, (unsigned char *)ext, n}, (size_t)at, 4,
			(int32_t)(ftell(s) - at));
	}
	fclose(s);
	make(&m, 1, false, 16, 4, one, n);
	for (size_t k = 1; k <= 3; k++)
		put_dim(&m, k, side);
	put_codes(&m, 0, 1);
	put_srow(&m, rows);
	fwrite(m.p, 1, 348, f);
	word(f, extensions > 0);
	fwrite(ext, 1, n, f);
	free(ext);
	free(m.p);
}

static void test_pairs(void)
{
	FILE *f = fopen("pairs.nii", "wb");
	struct ct_vol v = {0};

	write_nifti(f, 1, 250);
	word(f, 0);
	fclose(f);
	OK(ct_vol_read("pairs.nii", &v, &e) == -1 && e.code == CT_EINPUT && strstr(e.msg, "pairs"),
		"a million pairs in extensions: %s", e.msg);
}

static void test_tensors(void)
{
	struct ct_tensors w = {0};
	uint64_t n;
	char *header = NULL;
	size_t size;
	FILE *s = open_memstream(&header, &size), *f = fopen("empty.safetensors", "wb");

	for (int i = 0; i < 65000; i++)
		fprintf(s,
			"%s\"some.long.name.of.a.tensor.%d\":{\"dtype\":\"F32\",\"shape\":[0],"
			"\"data_offsets\":[0,0]}",
			i ? "," : "{", i);
	fputc('}', s);
	fclose(s);
	n = size;
	fwrite(&n, sizeof n, 1, f);
	fwrite(header, 1, size, f);
	fclose(f);
	free(header);
	OK(ct_tensors_read("empty.safetensors", &w, &e) == 0 && w.n == 65000,
		"65000 tensors without numbers are read");
	ct_tensors_free(&w);
}

#ifndef BOUND_NONE
/* What reading the tensors ends with, where there is little memory. */
static enum ct_code with_little(const char *path)
{
	struct ct_tensors w = {0};
	pid_t child = fork();
	int got = -1;

	if (child == 0) {
		e = (struct ct_err){0};
		if (!bound_memory(40) || (ct_tensors_read(path, &w, &e) == 0))
			_exit(99);
		_exit((int)e.code);
	}
	waitpid(child, &got, 0);
	return WIFEXITED(got) ? (enum ct_code)WEXITSTATUS(got) : CT_OK;
}

/* A header of so many bytes, with the n numbers that there are. */
static void write_header(const char *path, uint64_t bytes, int n)
{
	FILE *f = fopen(path, "wb");

	fwrite(&bytes, sizeof bytes, 1, f);
	fprintf(f, "{\"x\":[1");
	for (int i = 1; i < n; i++)
		fprintf(f, ",1");
	fprintf(f, "]}");
	fclose(f);
}

/* Memory is what fails, not the file, from a pipe too; and a short file asks for none. */
static void test_little(void)
{
	enum { MANY = 2000000 };

	write_header("short.safetensors", 100000000, 1);
	OK(with_little("short.safetensors") == CT_EINPUT, "a short file with a long header");
	write_header("long.safetensors", 2 * MANY + 7, MANY);
	OK(with_little("long.safetensors") == CT_ENOMEM, "a header that memory fails for");
	if (!freopen("long.safetensors", "rb", stdin))
		exit(99);
	OK(with_little("-") == CT_ENOMEM, "from standard input, too");
}
#endif

static void test_keys(void)
{
	struct ct_stack s = {0}, t = {0};
	struct ct_env env = {.files = &(const struct ct_io_rule){.force = true}};
	char *ply = NULL, key[100];
	size_t size;
	FILE *f;
	struct ct_any any = {0};

	must(ct_stack_alloc(&s, 1, 1, 1, &err));
	s.view[0] = (struct ct_view){.source = {0, 100, 0}, .u = {1, 0, 0}, .v = {0, 0, -1}};
	for (int i = 0; i < 17000; i++) {
		snprintf(key, sizeof key, "a.key.that.does.not.fit.a.name.%d", i);
		must(ct_meta_set(&s.meta, key, "", &err));
	}
	must(ct_stack_write("keys.exr", &s, &env, &err));
	OK(ct_stack_read("keys.exr", &t, &e) == -1 && e.code == CT_EINPUT && strstr(e.msg, "16384"),
		"17000 keys of a stack: %s", e.msg);
	ct_stack_free(&s);
	f = open_memstream(&ply, &size);
	fprintf(f, "ply\nformat binary_little_endian 1.0\n");
	for (int i = 0; i < 5000; i++)
		fprintf(f, "comment ct:same=%d\n", i);
	fprintf(f, "element vertex 0\nend_header\n");
	fclose(f);
	OK(ct_format_read_bytes(&ct_format_ply, (unsigned char *)ply, size, "x.ply", &any, &e) ==
				-1 &&
			strstr(e.msg, "comments"),
		"5000 comments of one key: %s", e.msg);
	free(ply);
}

/* A gzip member that becomes 64 MiB of zeros. */
static unsigned char *zeros(size_t *n)
{
	const size_t size = (size_t)1 << 26;
	unsigned char *in = calloc(size, 1), *out = malloc(1 << 20);
	z_stream z = {.next_in = in, .avail_in = (uInt)size, .next_out = out, .avail_out = 1 << 20};

	if (!in || !out || deflateInit2(&z, 1, Z_DEFLATED, 31, 9, Z_DEFAULT_STRATEGY) != Z_OK ||
		deflate(&z, Z_FINISH) != Z_STREAM_END)
		exit(99);
	*n = z.total_out;
	deflateEnd(&z);
	free(in);
	return out;
}

static void write_bomb(const char *path, int side)
{
	size_t n;
	unsigned char *part = zeros(&n);
	FILE *f = fopen(path, "wb");
	gzFile head;

	fclose(f);
	f = tmpfile();
	write_nifti(f, side, 0);
	rewind(f);
	head = gzopen(path, "wb");
	for (int c; (c = fgetc(f)) != EOF;)
		gzputc(head, c);
	gzclose(head);
	fclose(f);
	f = fopen(path, "ab");
	for (int i = 0; i <= FREE_PARTS; i++)
		fwrite(part, 1, n, f);
	fclose(f);
	free(part);
}

static int status(const char *command)
{
	const int rc = system(command);

	return WIFEXITED(rc) ? WEXITSTATUS(rc) : -1;
}

static void test_bombs(void)
{
	struct ct_vol v = {0};
	struct rusage use;

	write_bomb("large.nii.gz", 700);
	write_bomb("tail.nii.gz", 4);
	OK(ct_vol_read("large.nii.gz", &v, &e) == -1 && e.code == CT_EINPUT &&
			strstr(e.msg, "--expand"),
		"a volume of a gigabyte in a small file: %s", e.msg);
	OK(ct_vol_read("tail.nii.gz", &v, &e) == -1 && e.code == CT_EINPUT &&
			strstr(e.msg, "--expand"),
		"a gigabyte behind a small volume: %s", e.msg);
	getrusage(RUSAGE_SELF, &use);
	OK(use.ru_maxrss < 400 << 10, "in %ld MiB", use.ru_maxrss >> 10);
	OK(status("ct-convert tail.nii.gz a.nii 2>/dev/null") == 3, "a command refuses it");
	OK(status("ct-convert --expand 0 tail.nii.gz a.nii") == 0, "and takes it if told to");
	OK(ct_inflate_check(1, CT_INFLATE_FREE, &e) == 0 &&
			ct_inflate_check(CT_INFLATE_FREE, 100 * CT_INFLATE_FREE, &e) == 0 &&
			ct_inflate_check(CT_INFLATE_FREE, 101 * CT_INFLATE_FREE, &e) == -1,
		"what is usual is no bomb");
}

static void test_views(void)
{
	FILE *text = fopen("scan.json", "w");
	struct ct_stack s = {0};

	OK(ct_stack_alloc(&s, CT_MAX_VIEWS + 1, 1, 1, &e) == -1 && e.code == CT_EINPUT,
		"a stack of too many views: %s", e.msg);
	fprintf(text, "{\"mode\":\"cone\",\"DSO\":1000,\"DSD\":1500,\"nDetector\":[4,4],"
		      "\"sDetector\":[40,40],\"nVoxel\":[4,4,4],\"sVoxel\":[16,16,16],"
		      "\"numTrain\":65536}");
	fclose(text);
	OK(status("ct-phantom --size 4x4x4 --spacing 4 cube cube.nii && "
		  "ct-project --scanner scan.json cube.nii cube.exr 2>says") == 3 &&
			status("grep -q 'numTrain of 65536' says") == 0,
		"more views than any scan has");
}

int main(void)
{
	char root[] = "/tmp/t-hostile.XXXXXX", clean[64];
	const struct rlimit limit = {SECONDS, SECONDS};

	if (!mkdtemp(root) || chdir(root) || setrlimit(RLIMIT_CPU, &limit))
		return 99;
#ifndef BOUND_NONE
	test_little();
#endif
	test_pairs();
	test_tensors();
	test_keys();
	test_bombs();
	test_views();
	snprintf(clean, sizeof clean, "rm -r %s", root);
	return system(clean) ? 99 : tap_done();
}
