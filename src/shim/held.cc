/* held.cc: see held.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/inflate.h"
#include "shim/guard.h"
#include "shim/held.h"
#include "shim/outline.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <vector>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <unistd.h>
#include <zlib.h>
#ifdef HAVE_LIBARCHIVE
#include <archive.h>
#include <archive_entry.h>
#include <memory>
#endif

namespace
{

/* No fault of the archive. */
[[noreturn]] void fail(const std::string &what, int why = errno)
{
	errno = why;
	throw Lack(what);
}

} // namespace

Store::~Store()
{
	if (fd >= 0)
		close(fd);
}

void Store::add(const void *data, size_t n)
{
	const char *p = static_cast<const char *>(data);
	ct_err e = {};

	if (fd < 0) {
		std::error_code bad;
		const std::string folder = std::filesystem::temp_directory_path(bad).string();

		if (bad)
			fail("no TMPDIR to unpack in", bad.value());
		fd = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
		if (fd < 0)
			fail("TMPDIR " + folder);
	}
	if (ct_inflate_check(packed, end + n, &e))
		throw std::runtime_error(e.msg);
	while (n > 0) {
		const ssize_t done = pwrite(fd, p, n, static_cast<off_t>(end));

		if (done <= 0)
			fail("unpacking into TMPDIR");
		p += done;
		n -= static_cast<size_t>(done);
		end += static_cast<uint64_t>(done);
	}
}

int Store::release()
{
	const int was = fd;

	fd = -1;
	return was;
}

void Held::hold(int store, uint64_t begin, uint64_t size)
{
	off_t from = static_cast<off_t>(begin);

	fd = memfd_create("ctsr-held", MFD_CLOEXEC);
	if (fd < 0)
		fail("memory");
	name = "/proc/self/fd/" + std::to_string(fd);
	while (size > 0) {
		const ssize_t n = sendfile(fd, store, &from, std::min<uint64_t>(size, 1 << 30));

		if (n <= 0) {
			const int why = n < 0 ? errno : EIO;

			close(fd); /* who throws here is not destroyed */
			fail("memory", why);
		}
		size -= static_cast<uint64_t>(n);
	}
}

Held::Held(int store, uint64_t begin, uint64_t size)
{
	hold(store, begin, size);
}

Held::Held(const ct_slice &s)
{
	if (s.store)
		hold(s.store - 1, static_cast<uint64_t>(s.begin), static_cast<uint64_t>(s.bytes));
	else
		name = s.path;
}

Held::~Held()
{
	if (fd >= 0)
		close(fd);
}

#ifdef HAVE_LIBARCHIVE
namespace
{

std::string trouble_of(archive *a)
{
	return archive_error_string(a) ? archive_error_string(a) : "damaged archive";
}

void keep(archive *a, Member &m, Store &store)
{
	std::vector<unsigned char> block(1 << 16);
	size_t held = 0;
	la_ssize_t n;

	while (held < 4096 &&
		(n = archive_read_data(a, block.data() + held, block.size() - held)) > 0)
		held += static_cast<size_t>(n);
	m.dicom = begins_as_dicom(block.data(), held, std::max<size_t>(held, 132));
	m.zeros = std::all_of(
		block.data(), block.data() + held, [](unsigned char c) { return c == 0; });
	m.size = held;
	if (n >= 0 && m.dicom) {
		store.add(block.data(), held);
		while ((n = archive_read_data(a, block.data(), block.size())) > 0)
			store.add(block.data(), static_cast<size_t>(n));
		m.size = store.size() - m.begin;
	}
	if (n < 0)
		m.trouble = trouble_of(a);
}

} // namespace

bool unpack(const std::string &path, bool single, Store &store,
	const std::function<void(const Member &)> &each)
{
	const std::unique_ptr<archive, int (*)(archive *)> a(archive_read_new(), archive_read_free);
	archive_entry *entry;
	bool any = false;
	int rc;

	store.unpacks(std::filesystem::file_size(path));
	archive_read_support_filter_all(a.get());
	if (!single) {
		archive_read_support_format_zip(a.get());
		archive_read_support_format_tar(a.get());
	}
	archive_read_support_format_raw(a.get());
	if (archive_read_open_filename(a.get(), path.c_str(), 1 << 16) != ARCHIVE_OK) {
		each({"", trouble_of(a.get()), store.size(), 0, false, false});
		return true;
	}
	while ((rc = archive_read_next_header(a.get(), &entry)) == ARCHIVE_OK ||
		rc == ARCHIVE_WARN) {
		const bool raw = archive_format(a.get()) == ARCHIVE_FORMAT_RAW;
		const char *name = archive_entry_pathname(entry);
		Member m = {raw || !name ? "" : name, "", store.size(), 0, false, false};

		if (raw && archive_filter_count(a.get()) < 2)
			return false; /* not compressed: no archive */
		if (!raw && archive_entry_filetype(entry) != AE_IFREG)
			continue;
		any = true;
		keep(a.get(), m, store);
		each(m);
		if (!m.trouble.empty())
			return true;
	}
	if (rc == ARCHIVE_EOF || (!any && archive_filter_count(a.get()) < 2))
		return any;
	each({"", trouble_of(a.get()), store.size(), 0, false, false});
	return true;
}
#else
bool unpack(const std::string &, bool, Store &, const std::function<void(const Member &)> &)
{
	return false;
}
#endif

bool inflate_dicom(const char *path, Store &store)
{
	static const char deflated[] = "1.2.840.10008.1.2.1.99",
			  plain[] = "1.2.840.10008.1.2.1\0\0";
	std::vector<unsigned char> file, block(1 << 18);
	std::ifstream in(path, std::ios::binary);
	const Outline o = outline_of(path);
	const size_t begin = static_cast<size_t>(o.begin);
	z_stream z = {};
	int rc;

	if (o.syntax != deflated)
		return false;
	file.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
	if (file.size() < begin)
		throw std::runtime_error("it has become shorter");
	std::memcpy(&file[o.uid], plain, 22);
	store.unpacks(file.size());
	store.add(file.data(), begin);
	if (inflateInit2(&z, -15) != Z_OK)
		throw std::bad_alloc();
	z.next_in = file.data() + begin;
	z.avail_in = static_cast<uInt>(file.size() - begin);
	try {
		do {
			z.next_out = block.data();
			z.avail_out = static_cast<uInt>(block.size());
			rc = inflate(&z, Z_NO_FLUSH);
			store.add(block.data(), block.size() - z.avail_out);
		} while (rc == Z_OK && (z.avail_in > 0 || z.avail_out == 0));
	} catch (...) {
		inflateEnd(&z);
		throw;
	}
	inflateEnd(&z);
	if (rc != Z_STREAM_END)
		throw std::runtime_error("truncated: the deflated data end early");
	return true;
}
