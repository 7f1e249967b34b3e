/* DICOM files that lie in others: what cannot be opened leaves no descriptor, and closes no other.
 * SPDX-License-Identifier: Apache-2.0
 */
#include "config.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
extern "C" {
#include "tap.h"
}
#include "shim/pixels.h"

#include <exception>

#include <fcntl.h>
#include <unistd.h>

/* The lowest that is free. */
static int descriptor()
{
	return open("/dev/null", O_RDONLY | O_CLOEXEC);
}

static bool is_open(int fd)
{
	return fcntl(fd, F_GETFD) >= 0;
}

template <class F> static bool throws(F f)
{
	try {
		f();
	} catch (const std::exception &) {
		return true;
	}
	return false;
}

/* Bytes of a store, and more of them than it has. */
static void held(const Store &store)
{
	const int before = descriptor();
	char got[4] = "";

	close(before);
	{
		const Held h(store.descriptor(), 2, 3);
		FILE *f = fopen(h.path(), "r");

		OK(f && fread(got, 1, 4, f) == 3 && std::strcmp(got, "cde") == 0, "its bytes");
		if (f)
			fclose(f);
	}
	OK(throws([&] { const Held h(store.descriptor(), 2, 9); }), "more than there are");
	OK(!is_open(before), "leave nothing open");
}

/* A file, then one that is not whole: the descriptor of the first may be another's by then. */
static void again(const Store &store)
{
	char self[] = "/proc/self/exe";
	ct_slice good = {}, bad = {};
	int other;

	good.path = bad.path = self;
	bad.store = store.descriptor() + 1;
	bad.bytes = 99;
	{
		PixelFile p;

		p.open(good, &err);
		OK(throws([&] { p.open(bad, &err); }), "one that is not whole");
		other = descriptor();
	}
	OK(is_open(other), "closes no file of another");
	close(other);
}

int main()
{
	Store store;

	store.add("abcdef", 6);
	held(store);
	again(store);
	return tap_done();
}
