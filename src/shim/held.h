/* held.h: DICOM files that lie in others: in archives, in gzip, deflated. (For the .cc files of
 * this folder only.) SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SHIM_HELD_H
#define CT_SHIM_HELD_H
#include "series/slice.h"

#include <cstdint>
#include <functional>
#include <string>

/* A file without a name, where what was unpacked lies one behind the other. Made when it is needed,
 * in TMPDIR; it is gone with the last descriptor. Throws std::runtime_error, also if it becomes
 * larger than what it comes from may (core/inflate.h). */
class Store
{
      public:
	Store() = default;
	Store(const Store &) = delete;
	Store &operator=(const Store &) = delete;
	~Store();
	void add(const void *data, size_t n);
	/* What is added next comes of a file of so many bytes. */
	void unpacks(uint64_t bytes)
	{
		packed += bytes;
	}
	uint64_t size() const
	{
		return end;
	}
	int descriptor() const
	{
		return fd;
	}
	/* The descriptor has a new owner. */
	int release();

      private:
	int fd = -1;
	uint64_t end = 0, packed = 0;
};

/* A name under which a library can open `size` bytes from `begin` of a store, as long as it lives.
 */
class Held
{
      public:
	Held(int store, uint64_t begin, uint64_t size);
	explicit Held(const ct_slice &s);
	Held(const Held &) = delete;
	Held &operator=(const Held &) = delete;
	~Held();
	const char *path() const
	{
		return name.c_str();
	}

      private:
	void hold(int store, uint64_t begin, uint64_t size);
	int fd = -1;
	std::string name;
};

/* What an archive's member is: its name, "" in a file that is compressed alone; its bytes in the
 * store, size 0 if it is empty; and false if its beginning is no DICOM, so that it was not kept. */
struct Member {
	std::string name, trouble; /* why it could not be unpacked, or empty */
	uint64_t begin, size;
	bool dicom, zeros;
};
/* All members of a zip, a tar or a compressed file, one after the other. `single`: of nothing but a
 * compressed file. False if it is no archive, or this build reads none. */
bool unpack(const std::string &path, bool single, Store &store,
	const std::function<void(const Member &)> &each);
/* A deflated DICOM file, inflated at the end of the store, as explicit little-endian. False if it
 * is not deflated; throws std::runtime_error if damaged. */
bool inflate_dicom(const char *path, Store &store);

#endif
