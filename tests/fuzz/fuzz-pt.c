/* Hostile checkpoints of PyTorch: the reader must refuse or give sound tensors, and leave nothing
 * behind. Half of the inputs are an archive; the others, which begin with P, are its pickle, which
 * the CRC would protect there, beside one storage of eight bytes.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "driver.h"
#include "../pt-make.h"

const int fuzz_rounds = 1500;

static struct archive made;

static void pickle(const uint8_t *data, size_t size)
{
	static const float x[2] = {1.5f, -2};

	made.n = made.b.n = made.dir.n = 0;
	member(&made, "data.pkl", data, size);
	member(&made, "data/0", x, sizeof x);
	finish(&made);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	if (size == 0 || size > sizeof made.b.data / 2)
		return 0;
	if (data[0] == 'P' && (size == 1 || data[1] != 'K')) {
		pickle(data + 1, size - 1);
		weights_look(made.b.data, made.b.n, &ct_format_pytorch);
	} else {
		weights_look(data, size, &ct_format_pytorch);
	}
	return 0;
}

/* An archive of either kind, and pickles: a nested one with all that may be beside tensors, one of
 * protocol 4. */
size_t fuzz_seed(size_t k, unsigned char **data)
{
	static struct bytes b;

	if (k > 3)
		return 0;
	b.n = 0;
	if (k < 2) {
		lie.wide = k == 1;
		simple(&made, two);
		lie.wide = 0;
		put(&b, made.b.data, made.b.n);
	} else if (k == 2) {
		op(&b, "P\x80\2ccollections\nOrderedDict\n)Rq\1(");
		word(&b, "lr");
		op(&b, "G");
		little(&b, 0, 8);
		op(&b, "K\7]\x88\x85"
		       "aM\1\1](NNe");
		word(&b, "model");
		op(&b, "}q\2(");
		word(&b, "w");
		tensor(&b, (struct part){"Float", "0", 2, 0, 2, {1, 2}, {1, 1}});
		word(&b, "v");
		tensor(&b, (struct part){"Float", "0", 2, 1, 0, {0}, {0}});
		op(&b, "uu}");
		word(&b, "_metadata");
		op(&b, "h\2sb.");
	} else {
		op(&b, "P\x80\4\x95");
		little(&b, 99, 8);
		op(&b, "}\x94\x8c\1w\x94\x8c\14torch._utils\x94\x8c\22_rebuild_parameter\x94\x93");
		tensor(&b, two);
		op(&b, "\x88\x8c\13collections\x8c\13OrderedDict\x93)R\x87Rs.");
	}
	*data = malloc(b.n);
	if (!*data)
		exit(99);
	memcpy(*data, b.data, b.n);
	return b.n;
}
