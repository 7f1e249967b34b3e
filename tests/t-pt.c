/* Checkpoints of PyTorch: what torch.save writes, made byte by byte; damaged and hostile ones.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "formats/format.h"
#include "formats/any.h"
#include "pt-make.h"
#include "scratch.h"
#include "tap.h"
#include "tools/lib/prior-opts.h"
#include "nn/unet.h"

static struct archive a;
static struct bytes k;

static int read_bytes(const unsigned char *data, size_t n, struct ct_tensors *w)
{
	struct ct_any any = {0};
	int rc;

	err = (struct ct_err){0};
	rc = ct_format_read_bytes(&ct_format_pytorch, data, n, "x.pt", &any, &err);
	*w = any.tensors;
	if (rc && (w->t || w->meta.n))
		OK(0, "leaves nothing behind");
	return rc;
}

static bool holds(const struct ct_tensors *w, const char *name, size_t n, const float *x)
{
	const struct ct_tensor *t = ct_tensors_find(w, name);

	return t && ct_tensor_count(t) == n && memcmp(t->data, x, n * sizeof *x) == 0;
}

/* Every type, in a dictionary with attributes, as torch.save of a network's state. */
static void types(void)
{
	static const struct {
		const char *type;
		size_t bytes;
		unsigned char data[16];
	} is[] = {{"Float", 4, {0, 0, 0xc0, 0x3f, 0, 0, 0, 0xc0}}, {"Half", 2, {0, 0x3e, 0, 0xc0}},
		{"BFloat16", 2, {0xc0, 0x3f, 0, 0xc0}},
		{"Double", 8, {0, 0, 0, 0, 0, 0, 0xf8, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0xc0}},
		{"Long", 8, {3, 0, 0, 0, 0, 0, 0, 0, 254, 255, 255, 255, 255, 255, 255, 255}},
		{"Int", 4, {3, 0, 0, 0, 254, 255, 255, 255}}, {"Short", 2, {3, 0, 254, 255}},
		{"Char", 1, {3, 254}}, {"Byte", 1, {3, 254}}, {"Bool", 1, {1, 0}}};
	static const float want[][2] = {{1.5f, -2}, {1.5f, -2}, {1.5f, -2}, {1.5f, -2}, {3, -2},
		{3, -2}, {3, -2}, {3, -2}, {3, 254}, {1, 0}};
	enum { N = sizeof is / sizeof *is };
	struct ct_tensors w = {0};

	a.n = a.b.n = a.dir.n = k.n = 0;
	op(&k, "\x80\2ccollections\nOrderedDict\n)Rq\1(");
	for (size_t i = 0; i < N; i++) {
		char name[9] = {(char)('0' + i)};

		word(&k, is[i].type);
		tensor(&k, (struct part){is[i].type, name, 2, 0, 1, {2}, {1}});
	}
	op(&k, "u}");
	word(&k, "_metadata");
	op(&k, "h\1sb.");
	for (size_t i = 0; i < N; i++) {
		char name[30];

		snprintf(name, sizeof name, "folder/data/%zu", i);
		member(&a, name, is[i].data, 2 * is[i].bytes);
	}
	member(&a, "folder/data.pkl", k.data, k.n);
	member(&a, "folder/byteorder", "little", 6);
	member(&a, "folder/version", "3\n", 2);
	finish(&a);
	OK(read_bytes(a.b.data, a.b.n, &w) == 0 && w.n == N, "all types %s", err.msg);
	for (size_t i = 0; i < N && w.n == N; i++)
		OK(strcmp(w.t[i].name, is[i].type) == 0 && holds(&w, is[i].type, 2, want[i]), "%s",
			is[i].type);
	OK(strncmp(ct_meta_get(&w.meta, "input"), "x.pt xxh3:", 10) == 0, "and a hash");
	ct_tensors_free(&w);
}

/* Parts of one storage, in any order. */
static void strides(void)
{
	static const float x[6] = {0, 1, 2, 3, 4, 5};
	static const struct {
		const char *name;
		struct part p;
		size_t n;
		float want[6];
	} is[] = {{"whole", {"Float", "s", 6, 0, 2, {2, 3}, {3, 1}}, 6, {0, 1, 2, 3, 4, 5}},
		{"transposed", {"Float", "s", 6, 0, 2, {3, 2}, {1, 3}}, 6, {0, 3, 1, 4, 2, 5}},
		{"column", {"Float", "s", 6, 1, 2, {2, 1}, {3, 1}}, 2, {1, 4}},
		{"row", {"Float", "s", 6, 3, 1, {3}, {1}}, 3, {3, 4, 5}},
		{"last", {"Float", "s", 6, 5, 0, {0}, {0}}, 1, {5}},
		{"any stride of one", {"Float", "s", 6, 2, 2, {1, 2}, {77, 1}}, 2, {2, 3}},
		{"none", {"Float", "s", 6, 6, 2, {0, 4}, {4, 1}}, 0, {0}},
		{"repeated", {"Float", "s", 6, 4, 2, {2, 2}, {0, 1}}, 4, {4, 5, 4, 5}}};
	enum { N = sizeof is / sizeof *is };
	struct ct_tensors w = {0};

	a.n = a.b.n = a.dir.n = k.n = 0;
	op(&k, "\x80\2}(");
	for (size_t i = 0; i < N; i++) {
		word(&k, is[i].name);
		tensor(&k, is[i].p);
	}
	op(&k, "u.");
	member(&a, "a/data.pkl", k.data, k.n);
	member(&a, "a/data/s", x, sizeof x);
	finish(&a);
	OK(read_bytes(a.b.data, a.b.n, &w) == 0 && w.n == N, "parts of a storage %s", err.msg);
	for (size_t i = 0; i < N && w.n == N; i++)
		OK(holds(&w, is[i].name, is[i].n, is[i].want) && w.t[i].rank == is[i].p.rank, "%s",
			is[i].name);
	ct_tensors_free(&w);
}

/* A pickle in the place of the dictionary of the simple archive. */
static int read_pickle(const struct bytes *pickle, struct ct_tensors *w)
{
	static const float x[2] = {1.5f, -2};

	a.n = a.b.n = a.dir.n = 0;
	member(&a, "data.pkl", pickle->data, pickle->n);
	member(&a, "data/0", x, sizeof x);
	finish(&a);
	return read_bytes(a.b.data, a.b.n, w);
}

/* Where the dictionary of tensors is found, and what may be beside it. */
static void places(void)
{
	static const char *const names[] = {"state_dict", "model", "model_state_dict", "ema"};
	static const float want[2] = {1.5f, -2};
	struct ct_tensors w = {0};

	for (size_t i = 0; i < 4; i++) {
		k.n = 0;
		op(&k, "\x80\2}(");
		word(&k, "epoch");
		op(&k, "K\3");
		word(&k, "optimizer");
		op(&k, "}(");
		word(&k, "lr");
		op(&k, "G");
		little(&k, 0, 8);
		word(&k, "betas");
		op(&k, "](K\1M\1\1eK\7]\x88\x85"
		       "au"); /* lists, a key that is no word */
		word(&k, names[i]);
		op(&k, "}");
		word(&k, "w");
		tensor(&k, two);
		op(&k, "su.");
		OK(read_pickle(&k, &w) == 0 && w.n == 1 && holds(&w, "w", 2, want), "in %s %s",
			names[i], err.msg);
		ct_tensors_free(&w);
	}
	k.n = 0;
	op(&k, "\x80\2}(");
	for (size_t i = 0; i < 2; i++) {
		word(&k, names[3 * i]);
		op(&k, "}");
		word(&k, "w");
		tensor(&k, two);
		op(&k, "s");
	}
	op(&k, "u.");
	OK(read_pickle(&k, &w) == -1 && strstr(err.msg, "more than one dictionary"), "%s", err.msg);
	/* in protocol 4 all words are short, and remembered in order; a parameter of a tensor */
	k.n = 0;
	op(&k, "\x80\4\x95");
	little(&k, 99, 8);
	op(&k, "}\x94\x8c\1w\x94\x8c\14torch._utils\x94\x8c\22_rebuild_parameter\x94\x93");
	tensor(&k, two);
	op(&k, "\x88\x8c\13collections\x8c\13OrderedDict\x93)R\x87Rsr");
	little(&k, 70, 4);
	op(&k, "j");
	little(&k, 70, 4);
	op(&k, "b.");
	OK(read_pickle(&k, &w) == 0 && w.n == 1 && holds(&w, "w", 2, want), "protocol 4 %s",
		err.msg);
	ct_tensors_free(&w);
}

static void refused(const char *words)
{
	struct ct_tensors w = {0};
	int rc = read_bytes(a.b.data, a.b.n, &w);

	OK(rc == -1 && err.code == CT_EINPUT && strncmp(err.msg, "x.pt: ", 6) == 0 &&
			strstr(err.msg, words),
		"refused: %s", err.msg);
	if (rc == 0)
		printf("# wanted: %s\n", words);
	ct_tensors_free(&w);
}

/* The simple archive with a lie. */
#define LIE(words, ...)                                                                            \
	do {                                                                                       \
		const __typeof__(lie) truth = lie;                                                 \
		lie = (__typeof__(lie)){__VA_ARGS__};                                              \
		simple(&a, two);                                                                   \
		lie = truth;                                                                       \
		refused(words);                                                                    \
	} while (0)

static void hostile_archives(void)
{
	static const float want[2] = {1.5f, -2};
	struct ct_tensors w = {0};

	lie.wide = 1;
	simple(&a, two);
	lie.wide = 0;
	OK(read_bytes(a.b.data, a.b.n, &w) == 0 && holds(&w, "w", 2, want), "64 bits %s", err.msg);
	ct_tensors_free(&w);
	LIE("compressed by method 8", .method = 8);
	LIE("encrypted", .flags = 1);
	LIE("several volumes", .disk = 1);
	LIE("several volumes", .disk = 1, .wide = 1);
	LIE("a/data.pkl: CRC", .crc = 1);
	LIE("stored, but", .packed = 1);
	LIE("4294967243 bytes at 0 in a file", .size = UINT32_MAX - 200, .wide = 1);
	LIE("in a file of", .size = INT64_MAX, .wide = 1);
	LIE("in a file of", .at = INT64_MAX, .wide = 1);
	LIE("members of", .size = 150);
	LIE("is not where the directory says", .at = 1);
	LIE("is not where the directory says", .local = 1);
	LIE("no 64-bit size or place", .wide = 2);
	LIE("no 64-bit end", .wide = 3);
	LIE("ends inside its directory", .dir = 1000);
	LIE("ends inside its directory", .dir = INT64_MAX, .wide = 1);
	LIE("entry 0 of the directory is none", .dir = 1);
	LIE("entry 2 of the directory is none", .count = 1, .bytes = 46, .wide = 1);
	LIE("a directory of 2 members", .bytes = -60);
	LIE("a directory of 131073 members", .count = 131071, .bytes = 131073 * 46, .wide = 1);
	LIE("a directory of", .count = INT64_MAX, .wide = 1);
	a.n = a.b.n = a.dir.n = 0;
	member(&a, "a/data.pkl", "}.", 2);
	member(&a, "a/data.pkl", "}.", 2);
	finish(&a);
	refused("a/data.pkl: is there twice");
	a.n = a.b.n = a.dir.n = 0;
	member(&a, "a/data.pkl", "}.", 2);
	member(&a, "b/data.pkl", "}.", 2);
	finish(&a);
	refused("no dictionary of tensors");
	a.n = a.b.n = a.dir.n = 0;
	lie.size = 100;
	member(&a, "a/data.pkl", "}.", 2);
	lie.size = 0;
	finish(&a);
	refused("a/data.pkl: ends behind the end");
	a.n = a.b.n = a.dir.n = 0;
	member(&a, "a/xdata.pkl", "}.", 2);
	finish(&a);
	refused("a zip without");
	a.n = a.b.n = a.dir.n = 0;
	finish(&a);
	refused("a zip without");
	a.n = a.b.n = a.dir.n = 0;
	member(&a, "a/data.pkl", "}.", 2);
	member(&a, "a/byteorder", "big", 3);
	finish(&a);
	refused("byteorder");
	simple(&a, two);
	put(&a.b, "x", 1);
	refused("no directory at the end");
}

static void hostile_tensors(void)
{
	static const struct {
		struct part p;
		const char *words;
	} is[] = {{{"Float", "1", 2, 0, 1, {2}, {1}}, "there is no a/data/1"},
		{{"Float", "../data.pkl", 2, 0, 1, {2}, {1}}, "there is no a/data/../data.pkl"},
		{{"Float", "", 2, 0, 1, {2}, {1}}, "storage is no word"},
		{{"Float", "0", 3, 0, 1, {2}, {1}}, "has 8 bytes, not 3 numbers of 4"},
		{{"Double", "0", 2, 0, 1, {2}, {1}}, "has 8 bytes, not 2 numbers of 8"},
		{{"Float", "0", INT64_MAX, 0, 1, {2}, {1}}, "not 9223372036854775807 numbers"},
		{{"Double", "0", INT64_MAX, 0, 1, {2}, {1}}, "not 9223372036854775807 numbers"},
		{{"Float", "0", 2, 0, 1, {3}, {1}}, "size is more than"},
		{{"Float", "0", 2, 1, 1, {2}, {1}}, "lead out of"},
		{{"Float", "0", 2, 3, 1, {0}, {1}}, "lead out of"},
		{{"Float", "0", 2, INT64_MAX, 1, {2}, {1}}, "lead out of"},
		{{"Float", "0", 2, -1, 1, {2}, {1}}, "not a tensor with"},
		{{"Float", "0", 2, 0, 1, {2}, {2}}, "lead out of"},
		{{"Float", "0", 2, 0, 1, {2}, {INT64_MAX}}, "lead out of"},
		{{"Float", "0", 8, 0, 3, {2, 2, 2}, {INT64_MAX, INT64_MAX, INT64_MAX}},
			"overflows"},
		{{"Float", "0", 2, 0, 1, {2}, {-1}}, "not a tensor with"},
		{{"Float", "0", 2, 0, 1, {-2}, {1}}, "not a tensor with"},
		{{"Float", "0", 2, 0, 2, {INT64_MAX, 4}, {0, 0}}, "size overflows"},
		{{"Float", "0", 2, 0, 1, {INT64_MAX}, {0}}, "size is more than"},
		{{"Float", "0", 2, 0, 9, {1, 1, 1, 1, 1, 1, 1, 1, 2}, {1, 1, 1, 1, 1, 1, 1, 1, 1}},
			"too many sizes"},
		{{"Untyped", "0", 2, 0, 1, {2}, {1}}, "torch.UntypedStorage is nothing"}};
	static unsigned char many[1 << 14];

	for (size_t i = 0; i < sizeof is / sizeof *is; i++) {
		simple(&a, is[i].p);
		refused(is[i].words);
	}
	/* two views of one storage that do not agree on it, and so many that memory fills */
	k.n = 0;
	op(&k, "\x80\2}");
	word(&k, "v");
	tensor(&k, two);
	op(&k, "s");
	word(&k, "w");
	tensor(&k, (struct part){"Int", "0", 2, 0, 1, {2}, {1}});
	op(&k, "s.");
	read_pickle(&k, &(struct ct_tensors){0});
	refused("another type or length elsewhere");
	k.n = 0;
	op(&k, "\x80\2}");
	for (int i = 0; i < 8; i++) {
		char name[2] = {(char)('0' + i)};

		word(&k, name);
		tensor(&k, (struct part){"Byte", "0", sizeof many, 0, 1, {sizeof many}, {1}});
		op(&k, "s");
	}
	op(&k, ".");
	a.n = a.b.n = a.dir.n = 0;
	member(&a, "a/data.pkl", k.data, k.n);
	member(&a, "a/data/0", many, sizeof many);
	finish(&a);
	refused("tensor '1': with it the tensors hold more numbers");
	k.n = 0;
	op(&k, "\x80\2}");
	for (int i = 0; i < 2; i++) {
		word(&k, "w");
		tensor(&k, two);
		op(&k, "s");
	}
	op(&k, ".");
	read_pickle(&k, &(struct ct_tensors){0});
	refused("tensor 'w' is there twice");
}

/* Instructions that are not known, or not where they are; what they would call. */
static void hostile_pickles(void)
{
	static const struct {
		const char *pickle, *words;
	} is[] = {{"", "ends without STOP"}, {"\x80\2}", "ends without STOP"},
		{".", "more or less than one"}, {"}}.", "more or less than one"},
		{"(}.", "more or less than one"}, {"}.", "no dictionary of tensors"},
		{"N.", "no dictionary of tensors"},
		{"cos\nsystem\nX\5\0\0\0", "GLOBAL at byte 0: os.system is nothing"},
		{"cposix\nsystem\n(", "posix.system"}, {"c__builtin__\neval\n", "__builtin__.eval"},
		{"ctorch\nload\n", "torch.load"}, {"cos\nsystem", "ends inside it"},
		{"(S'id'\nios\nsystem\n.", "0x53 at byte 1"}, {"(ios\nsystem\n.", "0x69 at byte 1"},
		{"o", "0x6f at byte 0"}, {"\x81", "0x81 at byte 0"}, {"\x92", "0x92"},
		{"\x82\1", "0x82"}, {"P0\n", "0x50"}, {"\x96", "0x96"}, {"0", "0x30 at"},
		{"2", "0x32"}, {"I1\n", "0x49 at"},
		{"\xff", "instruction 0xff at byte 0: a dictionary"}, {"Z", "0x5a"},
		{"h\1", "BINGET at byte 0: nothing is remembered"},
		{"}q\1h\2", "nothing is remembered there"}, {"q\1", "nothing is on the stack"},
		{"}r\xff\xff\xff\x7f", "remembers more"}, {"}r\xff\xff\xff\xff", "remembers more"},
		{"j\xff\xff\xff\xff", "nothing is remembered"}, {"\x94", "nothing is on the stack"},
		{"t", "TUPLE at byte 0: there is no mark"}, {"\x86", "too little is on the stack"},
		{"}(\x85", "too little is on the stack"}, {"u", "no mark"}, {"(u", "nothing is on"},
		{"}(Nu", "a key without"}, {"](NNu", "not of a dictionary"}, {"]NNs", "not of a"},
		{"s", "too little is on the stack"}, {"}(s", "too little is on"},
		{"}Na", "not to a list"}, {"}(Ne", "not to a list"}, {"e", "no mark"},
		{"a", "too little is on"}, {"]}b", "not of a dictionary"},
		{"b", "nothing is on the stack"}, {"R", "nothing is on the stack"},
		{"N)R", "not a function"},
		{"ccollections\nOrderedDict\nNR", "not a function and its arguments"},
		{"ccollections\nOrderedDict\n)\x85R", "an ordered dictionary of something"},
		{"ctorch\nFloatStorage\n)R", "not a function"},
		{"ctorch._utils\n_rebuild_tensor_v2\n)R", "not a tensor with"},
		{"ctorch._utils\n_rebuild_parameter\n}\x85R", "a parameter that is no tensor"},
		{"Q", "nothing is on the stack"}, {"NQ", "not a storage"}, {")Q", "not a storage"},
		{"(NNNNNtQ", "not a storage"}, {"\x93", "nothing is on"},
		{"NN\x93", "not of two words"},
		{"\x8c\2os\x8c\6system\x93", "STACK_GLOBAL at byte 12: os.system"},
		{"X\xff\xff\xff\xff", "ends inside it"}, {"X\x09\x09", "ends inside it"},
		{"\x8c\x09zz", "ends inside it"}, {"K", "BININT1 at byte 0: the pickle ends"},
		{"\x8a\x09zzzzzzzzz", "more than 8 bytes"}, {"\x8a\x08zz", "ends inside it"},
		{"(\x8c\7storageccollections\nOrderedDict\n\x8c\1"
		 "0\x8c\3cpuK\2tQ",
			"not a storage"},
		{"ctorch._utils\n_rebuild_tensor_v2\n((\x8c\7storagectorch\nFloatStorage\n\x8c\1"
		 "0\x8c\3cpuK\2tQK\1K\2\x85)\x89NtR",
			"too many sizes, or of other strides"},
		{"ctorch._utils\n_rebuild_tensor_v2\n((\x8c\7storagectorch\nFloatStorage\n\x8c\1"
		 "0\x8c\3cpuK\2tQ\x8a\1\xff))\x89NtR",
			"not a tensor with"},
		{"G123", "ends inside it"},
		{"\x95"
		 "123",
			"ends inside it"}};
	struct ct_tensors w = {0};

	for (size_t i = 0; i < sizeof is / sizeof *is; i++) {
		k.n = 0;
		op(&k, is[i].pickle);
		read_pickle(&k, &w);
		refused(is[i].words);
	}
	/* dictionaries in themselves end, and lists of lists are not kept */
	k.n = 0;
	op(&k, "}q\1(");
	for (int i = 0; i < 1000; i++) {
		word(&k, "model");
		op(&k, "h\1");
	}
	op(&k, "u.");
	read_pickle(&k, &w);
	refused("no dictionary of tensors");
}

/* Every beginning of a file, and every byte of it changed. */
static void damaged(void)
{
	struct ct_tensors w = {0};
	size_t n, taken = 0, wrong = 0;
	unsigned char *copy;

	simple(&a, two);
	n = a.b.n;
	for (size_t cut = 1; cut < n; cut++) {
		/* a copy that ends there, so that a byte behind it is noticed */
		copy = malloc(cut);
		if (!copy)
			exit(99);
		memcpy(copy, a.b.data, cut);
		if (read_bytes(copy, cut, &w) == 0)
			taken++;
		else
			wrong += err.code != CT_EINPUT || strncmp(err.msg, "x.pt: ", 6) != 0;
		ct_tensors_free(&w);
		free(copy);
	}
	OK(taken == 0 && wrong == 0, "cut at any of %zu bytes it is refused", n);
	for (size_t i = 0; i < n; i++)
		for (int bit = 0; bit < 8; bit++) {
			a.b.data[i] ^= (unsigned char)(1 << bit);
			if (read_bytes(a.b.data, n, &w) == 0)
				taken += !holds(&w, "w", 2, (const float[]){1.5f, -2});
			else
				wrong +=
					err.code != CT_EINPUT || strncmp(err.msg, "x.pt: ", 6) != 0;
			ct_tensors_free(&w);
			a.b.data[i] ^= (unsigned char)(1 << bit);
		}
	OK(taken == 0 && wrong == 0, "with any bit changed it is refused, or the same");
}

/* By content, whatever the name; older checkpoints are named. */
static void by_name(void)
{
	static const unsigned char old[] = "\x80\2\x8a\nl\xfc\x9c"
					   "F\xf9 j\xa8P\x19.";
	static unsigned char tar[512];
	struct ct_tensors w = {0};

	simple(&a, two);
	put_bytes("w.bin", a.b.data, a.b.n);
	OK(ct_tensors_read("w.bin", &w, &err) == 0 && w.n == 1, "from a file %s", err.msg);
	ct_tensors_free(&w);
	put_bytes("old.pt", old, sizeof old - 1);
	OK(ct_tensors_read("old.pt", &w, &err) == -1 && err.code == CT_EINPUT &&
			strstr(err.msg, "old.pt: a checkpoint of PyTorch before 1.6"),
		"%s", err.msg);
	memcpy(tar + 257, "ustar", 5);
	put_bytes("tar.pt", tar, sizeof tar);
	OK(ct_tensors_read("tar.pt", &w, &err) == -1 && err.code == CT_EINPUT &&
			strstr(err.msg, "before 1.6"),
		"in a tar, too");
	memcpy(tar + 257, "ustar  ", 7);
	put_bytes("tar.pt", tar, sizeof tar);
	OK(ct_tensors_read("tar.pt", &w, &err) == -1 && strstr(err.msg, "before 1.6"),
		"a tar as GNU writes it is told, too");
	put_bytes("none.pt", old, 0);
	OK(ct_tensors_read("none.pt", &w, &err) == -1 && err.code == CT_EINPUT, "%s", err.msg);
}

/* "t-pt shapes WORDS": the tensors of a network; "t-pt read FILE": NAME SIZES and numbers;
 * "t-pt answer FILE WORDS CLASS SIDE": what the network says of a wave at timestep 300. */
static int tool(int argc, char **argv)
{
	const char *words = argc > 3 ? argv[3] : argv[2];
	struct ct_unet_arch arch;
	struct ct_graph g = {0};
	struct ct_tensors w = {0};
	struct ct_meta m = {0};
	struct ct_unet *net = NULL;
	struct ct_unet_plan *p = NULL;
	const double t = 300;
	float *x, *y;
	size_t side, pixels;

	if (strcmp(argv[1], "shapes") == 0) {
		ct_unet_arch_default(&arch);
		must(prior_arch_parse(&m, words, &err));
		must(prior_arch_set(&arch, &m, &err));
		must(ct_graph_build(&g, &arch, 512, 512, &err));
		for (size_t i = 0; i < g.n_param; i++) {
			printf("%s", g.param[i].name);
			for (size_t d = 0; d < g.param[i].rank; d++)
				printf(" %zu", g.param[i].dim[d]);
			printf("\n");
		}
		ct_graph_free(&g);
		ct_meta_free(&m);
		return 0;
	}
	if (ct_tensors_read(argv[2], &w, &err)) {
		fprintf(stderr, "%s\n", err.msg);
		return (int)err.code;
	}
	for (size_t i = 0; i < w.n && argc == 3; i++) {
		printf("%s [", w.t[i].name);
		for (size_t d = 0; d < w.t[i].rank; d++)
			printf("%s%zu", d ? ", " : "", w.t[i].dim[d]);
		printf("]");
		for (size_t j = 0; j < ct_tensor_count(&w.t[i]); j++)
			printf(" %.9g", (double)w.t[i].data[j]);
		printf("\n");
	}
	if (argc > 3) {
		side = strtoul(argv[5], NULL, 10);
		pixels = side * side;
		must(prior_arch_parse(&m, words, &err));
		must(prior_arch_add(&w.meta, &m, &err));
		must(ct_unet_alloc(&net, &w, &err));
		net->label = strtoul(argv[4], NULL, 10);
		must(ct_unet_plan_alloc(&p, net, side, side, false, &err));
		x = malloc(net->arch.in_channels * pixels * sizeof *x);
		y = malloc(net->arch.out_channels * pixels * sizeof *y);
		if (!x || !y)
			exit(99);
		for (size_t i = 0; i < net->arch.in_channels * pixels; i++)
			x[i] = sinf(0.37f * (float)i);
		must(ct_unet_forward(p, y, x, t, &err));
		for (size_t i = 0; i < net->arch.out_channels * pixels; i++)
			printf("%.9g\n", (double)y[i]);
		free(x);
		free(y);
		ct_unet_plan_free(p);
		ct_unet_free(net);
	}
	ct_meta_free(&m);
	ct_tensors_free(&w);
	return 0;
}

int main(int argc, char **argv)
{
	if (argc > 2)
		return tool(argc, argv);
	scratch_begin();
	types();
	strides();
	places();
	hostile_archives();
	hostile_tensors();
	hostile_pickles();
	damaged();
	by_name();
	scratch_end();
	return tap_done();
}
