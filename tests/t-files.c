/* The files of a run: which may be one and the same, what a file or folder holds, whose folder it
 * is.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include "cli/files.h"
#include "cli/keep.h"
#include "core/clock.h"
#include "core/meta.h"
#include "formats/hash.h"
#include "formats/temp.h"
#include "formats/io.h"
#include "scratch.h"

#include <fcntl.h>
#include <sys/wait.h>

struct params {
	const char *in, *in2, *out, *out2, *beside, *again;
	struct ct_list list;
	bool resume;
};
#define P struct params
#define CT_PARAMS P
static const struct ct_opt opts[] = {
	CT_ARG(in, CT_READS, "IN", ""),
	CT_FLAG(resume, 0, "resume", ""),
	CT_INPUT(in2, 0, "in2", "FILE", ""),
	CT_OUTPUT(out, 'o', "out", "FILE", CT_ENDS_STACK, ""),
	CT_OUTPUT(out2, 0, "out2", "FILE", CT_ENDS_IF(CT_IF(in2), "csv", CT_ENDS_VOLUME), ""),
	CT_OUTPUT_BESIDE(beside, 0, "beside", "FILE", "json", ""),
	CT_ARG_OUT(again, CT_REWRITES, "AGAIN", CT_ENDS_GAUSS, ""),
	CT_ARG_OUT(list, CT_READS_WRITES, "FILES", CT_ENDS_VOLUME "|mha", ""),
	CT_OPT_END,
};
static struct ct_err e;
static const struct ct_command command, dry_command = {.dry_run = true};
static const struct ct_io_rule force = {.force = true};
static const struct ct_env plain = {.command = &command}, dry = {.command = &dry_command},
			   forced = {.command = &command, .files = &force};

static bool clear(struct params p)
{
	e = (struct ct_err){0};
	return ct_files_check(opts, &p, &plain, &e) == 0;
}

/* Refused with these words? */
static bool refused(struct params p, enum ct_code code, const char *words)
{
	bool is = !clear(p) && e.code == code && strstr(e.msg, words);

	if (!is)
		printf("# %s\n", e.msg);
	return is;
}
#define LIST(...)                                                                                  \
	{                                                                                          \
		sizeof((const char *const[]){__VA_ARGS__}) / sizeof(char *), (const char *const[]) \
		{                                                                                  \
			__VA_ARGS__                                                                \
		}                                                                                  \
	}

static void test_apart(void)
{
	put_text("a", "a");
	put_text("b", "b");
	OK(clear((P){0}), "no files");
	OK(clear((P){.in = "a", .in2 = "a"}), "an input may be read twice");
	OK(clear((P){.in = "a", .out = "x", .out2 = "y", .again = "z"}), "new outputs");
	OK(refused((P){.in = "a", .out = "./a"}, CT_EOUTPUT,
		   "./a: would be written over a, an input of the same run"),
		"an output that is an input");
	OK(refused((P){.in = "b", .in2 = "a", .out = "a"}, CT_EOUTPUT,
		   "a: would be written over a, an input of the same run"),
		"whichever");
	OK(refused((P){.out = "x", .out2 = "x"}, CT_EOUTPUT,
		   "x: would be written over x, another output of the same run"),
		"two outputs");
	OK(refused((P){.out = "x", .again = "x"}, CT_EOUTPUT, "another output"), "of any kind");
	OK(refused((P){.again = "x", .out2 = "x"}, CT_EOUTPUT, "another output"), "in any order");
	OK(refused((P){.out = "b"}, CT_EOUTPUT, "b: exists"), "an output that is there");
	OK(refused((P){.out = "b", .resume = true}, CT_EOUTPUT, "b: exists"), "also with --resume");
	OK(refused((P){.again = "b"}, CT_EOUTPUT, "b: exists"), "a run's own one too");
	OK(clear((P){.again = "b", .resume = true}), "but for --resume");
	OK(ct_files_check(opts, &(P){.in = "a", .out = "a"}, &dry, &e) == 0,
		"nothing is asked of a dry run");
	OK(ct_files_check(opts, &(P){.out = "b"}, &forced, &e) == 0, "it may be there if forced");
}

static void test_list(void)
{
	OK(clear((P){.list = LIST("a")}), "a list of one is read");
	OK(clear((P){.list = LIST("a", "a", "x")}), "of a list the last is written");
	OK(refused((P){.list = LIST("a", "b")}, CT_EOUTPUT, "b: exists"), "and may not be there");
	OK(refused((P){.list = LIST("a", "b", "a")}, CT_EOUTPUT,
		   "a: would be written over a, an input of the same run"),
		"nor be one of those before");
	OK(clear((P){.list = LIST("a", "b"), .out = "x"}), "unless another row names the output");
	OK(refused((P){.list = LIST("a", "b"), .beside = "x"}, CT_EOUTPUT, "b: exists"),
		"which one beside it does not");
	OK(refused((P){.list = LIST("b", "a"), .out = "a"}, CT_EOUTPUT,
		   "a: would be written over a, an input of the same run"),
		"which none of the list is");
	OK(refused((P){.list = LIST("a", "-"), .out = "-", .out2 = "-"}, CT_EUSAGE,
		   "only one output can be standard output"),
		"one output is a stream");
	OK(refused((P){.in = "-", .list = LIST("-", "x")}, CT_EUSAGE,
		   "only one input can be standard input"),
		"and one input");
	OK(ct_files_check(opts, &(P){.list = LIST("-", "-", "x")}, &dry, &e) == -1 &&
			strstr(e.msg, "only one input"),
		"also of a dry run");
	OK(ct_files_check(opts, &(P){.in = "-", .out = "-"}, &dry, &e) == 0, "one of each serves");
}

static bool named(P p, const char *refused)
{
	static const P defaults;
	const struct ct_tool tool = {.opts = opts, .defaults = &defaults};

	e = (struct ct_err){0};
	if (ct_files_names(&tool, &p, &e) == 0)
		return !refused;
	if (!refused || strcmp(e.msg, refused) != 0 || e.code != CT_EUSAGE)
		printf("# %s\n", e.msg);
	return refused && e.code == CT_EUSAGE && strcmp(e.msg, refused) == 0;
}

static void test_names(void)
{
	OK(named((P){.in = "a.png", .out = "x.exr", .out2 = "x.NII.gz", .again = "d.nii/x.ply"},
		   NULL),
		"names as they should be");
	OK(named((P){.out = "exr", .again = ".ply", .list = LIST("a", "x.y")}, NULL),
		"names that promise nothing");
	OK(named((P){.out = "x.nii"}, "x.nii: --out is written as .exr"), "one of another command");
	OK(named((P){.out2 = "x.gz"}, "x.gz: --out2 is written as .nii or .nii.gz"), "half of one");
	OK(named((P){.out2 = "x.csv", .in2 = "a"}, NULL), "a mode with an end of its own");
	OK(named((P){.out2 = "x.nii", .in2 = "a"}, "x.nii: --out2 is written as .csv"),
		"and no other");
	OK(named((P){.again = "x.dcm"}, "x.dcm: AGAIN is written as .ply or .pickle"),
		"an operand");
	OK(named((P){.list = LIST("a.dcm", "x.mha")}, NULL), "of a list the last");
	OK(named((P){.list = LIST("a.dcm", "x.Dcm")},
		   "x.Dcm: FILES is written as .nii, .nii.gz or .mha"),
		"whatever the case");
	OK(named((P){.list = LIST("a.dcm", "x.dcm"), .out = "x.exr"}, NULL), "if it is written");
}

static void test_more(void)
{
	const P p = {.in = "a", .out = "x"};

	OK(ct_files_apart(opts, &p, "y", &e) == 0, "one more file");
	OK(ct_files_apart(opts, &p, "./a", &e) &&
			strcmp(e.msg, "./a: would be written over a, an input of the same run") ==
				0,
		"%s", e.msg);
	OK(ct_files_apart(opts, &p, "x", &e) && e.code == CT_EOUTPUT &&
			strcmp(e.msg,
				"x: would be written over x, another output of the same run") == 0,
		"%s", e.msg);
}

/* Is what a path holds those bytes, by the hash? */
static bool holds(const char *path, const void *data, size_t bytes)
{
	const struct ct_env env = {0};
	char hex[CT_HASH_HEX], want[CT_HASH_HEX];

	must(ct_hash_file(hex, path, &env, &err));
	ct_hash_hex(want, bytes, data);
	return strcmp(hex, want) == 0;
}

static bool holds_nothing(const char *path)
{
	const struct ct_env env = {0};
	char hex[CT_HASH_HEX];

	return ct_hash_file(hex, path, &env, &e) == 0 && !*hex;
}

static void test_content(void)
{
	const size_t n = (5 << 19) + 3;
	unsigned char *big = malloc(n);
	volatile sig_atomic_t stop = 1;
	const struct ct_env stopped = {.stop = &stop};
	char hex[CT_HASH_HEX];

	if (!big || mkdir("f", 0777) || mkdir("f/k", 0777) || mkfifo("pipe", 0600) ||
		mkfifo("f/pipe", 0600) || mkdir("round", 0777) || symlink(".", "round/z"))
		exit(99);
	for (size_t i = 0; i < n; i++)
		big[i] = (unsigned char)(i * i >> 7);
	put_bytes("big", big, n);
	OK(holds("big", big, n), "the hash of a file is that of its bytes, however many");
	OK(holds("./b", "b", 1), "the hash of a file does not depend on its name");
	put_text("empty", "");
	OK(holds("empty", "", 0), "the hash of an empty file is that of no bytes");
	put_text("f/n", "n");
	put_text("f/a", "aa");
	put_text("f/k/z", "z");
	put_text("f/k/.h", "h");
	OK(holds("f", "aahzn", 5), "the hash of a folder is that of its files by their names");
	put_text("round/a", "x");
	OK(holds("round", "x", 1), "a link that leads back to its folder adds nothing to the hash");
	put_text("-", "x");
	OK(holds_nothing("-") && holds_nothing("none") && holds_nothing("pipe"),
		"what is no file that can be read twice has no hash");
	OK(ct_hash_file(hex, "big", &stopped, &e) == -1 && e.code == CT_ESTOP && !*hex &&
			ct_hash_file(hex, "f", &stopped, &e) == -1 && !*hex,
		"the hash of a file and of a folder is stopped on request");
	free(big);
}

int main(void)
{
	alarm(60); /* what would read a pipe waits */
	scratch_begin();
	test_apart();
	test_list();
	test_names();
	test_more();
	test_content();
	return tap_done();
}
