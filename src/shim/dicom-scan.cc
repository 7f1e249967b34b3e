/* dicom-scan.cc: every file below some paths, and what it is. See dicom.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/apart.h"
#include "shim/dicom-tags.h"
#include "shim/dicom-file.h"
#include "shim/guard.h"
#include "shim/held.h"
#include "shim/outline.h"

#include <vtkDICOMItem.h>
#include <vtkNew.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <set>
#include <string>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

namespace
{

namespace fs = std::filesystem;

struct Found {
	std::vector<ct_file> file;
	std::vector<ct_slice> slice;
	std::set<std::string> folders;     /* been there */
	std::map<std::string, bool> kills; /* does its header kill the parser? of what was tried */
	Store store;

	~Found()
	{
		for (ct_file &f : file)
			std::free(f.path);
		for (ct_slice &s : slice)
			std::free(s.path);
	}
};

char *copy_of(const std::string &s)
{
	char *p = strdup(s.c_str());

	if (!p)
		throw std::bad_alloc();
	return p;
}

/* So that push_back cannot fail, once what it gets is allocated. */
template <class T> void room_for_one(std::vector<T> &v)
{
	if (v.size() == v.capacity())
		v.reserve(2 * v.size() + 8);
}

void note(Found &found, const std::string &path, ct_file_state state, const std::string &why = "",
	const std::string &series = "")
{
	ct_file f = {};

	f.state = state;
	std::snprintf(f.why, sizeof f.why, "%s", why.c_str());
	std::snprintf(f.series, sizeof f.series, "%s", series.c_str());
	room_for_one(found.file);
	f.path = copy_of(path);
	found.file.push_back(f);
}

/* What is parsed: a file, or a part of the store. */
struct Source {
	std::string shown; /* what it is called */
	const char *path;
	bool stored;
	uint64_t begin, size;
};

void add_picture(Found &found, const Source &from, vtkDICOMMetaData *m, const Outline &o)
{
	std::string wrong;
	const size_t frames = count_frames(m, &wrong);
	const std::string series = m->Get(DC::SeriesInstanceUID).AsString();

	if (wrong.empty() && (frames == 0 || frames > 1 << 16))
		return note(found, from.shown, CT_FILE_DAMAGED, "NumberOfFrames is absurd");
	const size_t groups = m->Get(DC::PerFrameFunctionalGroupsSequence).GetNumberOfValues();
	if (wrong.empty() && groups > 0 && groups != frames)
		wrong = "NumberOfFrames is " + std::to_string(frames) + ", but " +
			std::to_string(groups) + " functional groups say where frames lie";
	std::vector<ct_slice> all(wrong.empty() ? frames : 0);
	for (size_t k = 0; k < all.size() && wrong.empty(); k++)
		wrong = describe_frame(m, k, &all[k]);
	if (!wrong.empty())
		return note(found, from.shown, CT_FILE_DAMAGED, wrong, series);
	note(found, from.shown, CT_FILE_PICTURE, "", series);
	const double size = static_cast<double>(from.stored ? from.size : fs::file_size(from.path));
	for (ct_slice &s : all) {
		describe_bits(m, o, &s);
		s.pixels = static_cast<long long>(o.pixels);
		s.store = from.stored ? found.store.descriptor() + 1 : 0;
		s.begin = static_cast<long long>(from.begin);
		s.bytes = static_cast<long long>(from.size);
		s.on_disk = size / static_cast<double>(frames);
		room_for_one(found.slice);
		s.file = found.file.size() - 1;
		s.path = copy_of(from.shown);
		found.slice.push_back(s);
	}
}

/* A name as discs have it: in capitals, without a version or the ending that a copy got. */
std::string plain_name(std::string name)
{
	const size_t version = name.rfind(';');

	if (version != std::string::npos)
		name.resize(version);
	for (char &c : name)
		c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
	if (name.size() > 4 && name.compare(name.size() - 4, 4, ".DCM") == 0)
		name.resize(name.size() - 4);
	if (!name.empty() && name.back() == '.')
		name.pop_back();
	return name;
}

/* Names of folders, and of what lies in each by its plain name. */
using Listings = std::map<std::string, std::multimap<std::string, std::string>>;

/* Does it lie in the folder, by its name or one that is the same but for how discs write it?
 * `parts` of a path, from number `k` on. */
bool lies_in(
	const fs::path &folder, const std::vector<std::string> &parts, size_t k, Listings &seen)
{
	std::error_code bad;
	fs::path exact = folder;

	for (size_t i = k; i < parts.size(); i++)
		exact /= parts[i];
	if (k == parts.size() || fs::exists(fs::symlink_status(exact, bad)))
		return true;
	const bool is_new = seen.find(folder.string()) == seen.end();
	auto &names = seen[folder.string()];
	for (fs::directory_iterator all(folder, bad), end; is_new && !bad && all != end;
		all.increment(bad)) {
		const std::string name = all->path().filename().string();

		names.emplace(plain_name(name), name);
	}
	const auto alike = names.equal_range(plain_name(parts[k]));
	return std::any_of(alike.first, alike.second,
		[&](const auto &own) { return lies_in(folder / own.second, parts, k + 1, seen); });
}

/* Does a file that a directory lists lie there: below its folder or one above it, or with some of
 * the folders that it names left out? What is copied of an export keeps the directory, not the
 * root. */
bool lies_there(fs::path folder, const vtkDICOMValue &id, Listings &seen)
{
	const size_t n = id.GetNumberOfValues();

	if (n > 8) /* there are no longer ones (PS3.3 F.3.2.2) */
		return false;
	for (size_t up = 0; up < n; up++, folder /= "..")
		for (size_t left_out = 0; left_out < (up ? 1 : n); left_out++) {
			std::vector<std::string> parts;

			for (size_t k = left_out; k < n; k++)
				parts.push_back(id.GetString(static_cast<unsigned>(k)));
			if (lies_in(folder.empty() ? "." : folder, parts, 0, seen))
				return true;
		}
	return false;
}

/* Files that a DICOMDIR lists and that are not there. */
void add_missing(Found &found, const std::string &path, vtkDICOMMetaData *m)
{
	const vtkDICOMValue &records = m->Get(DC::DirectoryRecordSequence);
	const fs::path folder = fs::path(path).parent_path();
	std::string series;
	Listings seen;

	for (size_t i = 0; i < records.GetNumberOfValues(); i++) {
		const vtkDICOMItem &item = records.GetSequenceData()[i];
		const vtkDICOMValue &id = item.Get(DC::ReferencedFileID);
		fs::path file = folder;

		if (item.Get(DC::SeriesInstanceUID).IsValid())
			series = item.Get(DC::SeriesInstanceUID).AsString();
		for (size_t k = 0; k < id.GetNumberOfValues(); k++)
			file /= id.GetString(static_cast<unsigned>(k));
		if (id.GetNumberOfValues() > 0 && !lies_there(folder, id, seen))
			note(found, file.string(), CT_FILE_UNREADABLE,
				"listed in " + path + ", but not there", series);
	}
}

bool may_be_parsed(const std::string &path)
{
	const Outline o = outline_of(path.c_str());

	return o.dicom && o.trouble.empty();
}

/* Hostile headers end in an assertion of vtk-dicom; these are tried elsewhere, before. */
void try_headers(Found &found, const std::vector<std::string> &paths)
{
	const std::vector<bool> kills = deadly(paths.size(), [&](size_t i) {
		std::error_code bad;
		vtkNew<vtkDICOMMetaData> m;
		vtkNew<vtkDICOMParser> p;

		if (fs::is_regular_file(paths[i], bad) && may_be_parsed(paths[i]))
			parse_header(paths[i], m, p);
	});

	if (kills.size() != paths.size())
		throw std::bad_alloc();
	for (size_t i = 0; i < paths.size(); i++)
		found.kills[paths[i]] = kills[i];
}

/* `from` was not yet tried, if it lies in a store. */
bool is_deadly(Found &found, const Source &from)
{
	if (from.stored || found.kills.count(from.path) == 0)
		try_headers(found, {from.path});
	return found.kills[from.path];
}

void add_dicom(Found &found, const Source &from)
{
	vtkNew<vtkDICOMMetaData> m;
	vtkNew<vtkDICOMParser> p;
	Outline o = outline_of(from.path);

	if (!o.trouble.empty())
		return note(found, from.shown, CT_FILE_DAMAGED, o.trouble);
	if (is_deadly(found, from))
		return note(found, from.shown, CT_FILE_DAMAGED, "its header kills the parser");
	/* what stands behind the pixels may be anything */
	const bool parsed =
		parse_header(from.path, m, p) ||
		(o.pixel_data != 0 && p->GetPixelDataFound() &&
			static_cast<uint64_t>(p->GetFileOffset()) >= o.pixels); /* of the error */
	const std::string series = m->Get(DC::SeriesInstanceUID).AsString();

	if (!parsed)
		Lack::check(from.path);
	if (!parsed)
		return note(
			found, from.shown, CT_FILE_DAMAGED, "its header cannot be read", series);
	if (!p->GetPixelDataFound()) {
		if (may_hold_picture(m))
			return note(found, from.shown, CT_FILE_DAMAGED, "its picture is missing",
				series);
		note(found, from.shown, CT_FILE_BARE, "", series);
		if (!from.stored)
			add_missing(found, from.shown, m);
		return;
	}
	if (o.pixel_data == 0) { /* other pictures, which PixelFile refuses */
		o.pixels = static_cast<uint64_t>(p->GetFileOffset());
		o.length = p->GetPixelDataVL();
	}
	std::string wrong;
	const size_t frames = count_frames(m, &wrong);
	ct_slice first = {};
	if (wrong.empty())
		wrong = describe_frame(m, 0, &first); /* Rows that are no number, not their bytes */
	if (wrong.empty())
		wrong = wrong_pixels(m, &o, static_cast<uint64_t>(p->GetFileSize()), frames);
	if (!wrong.empty())
		return note(found, from.shown, CT_FILE_DAMAGED, wrong, series);
	add_picture(found, from, m, o);
}

/* What is held and deflated is parsed once it is inflated, the rest as it is. */
void add_held(Found &found, const Source &from)
{
	const uint64_t end = found.store.size();

	if (!inflate_dicom(from.path, found.store))
		return add_dicom(found, from);
	const uint64_t size = found.store.size() - end;
	const Held plain(found.store.descriptor(), end, size);

	add_dicom(found, {from.shown, plain.path(), true, end, size});
}

/* The files in an archive; `single`: only of one file that is compressed. */
bool add_archive(Found &found, const std::string &path, bool single)
{
	return unpack(path, single, found.store, [&](const Member &m) {
		const std::string shown = m.name.empty() ? path : path + "/" + m.name;

		if (!m.trouble.empty())
			return note(found, shown, CT_FILE_DAMAGED, m.trouble);
		if (m.size == 0)
			return note(found, shown, CT_FILE_DAMAGED, "it is empty");
		if (!m.dicom)
			return note(found, shown, m.zeros ? CT_FILE_DAMAGED : CT_FILE_FOREIGN,
				m.zeros ? "it holds zeros" : "");
		const Held held(found.store.descriptor(), m.begin, m.size);

		add_held(found, {shown, held.path(), true, m.begin, m.size});
	});
}

/* The first bytes of a file, as many as there are up to the size of `head`: 0, or errno. */
int read_head(const std::string &path, std::vector<char> &head)
{
	const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
	size_t at = 0;
	int why = fd < 0 ? errno : 0;

	while (!why && at < head.size()) {
		const ssize_t n = read(fd, head.data() + at, head.size() - at);

		if (n == 0)
			break;
		if (n < 0 && errno != EINTR)
			why = errno;
		at += n > 0 ? static_cast<size_t>(n) : 0;
	}
	if (fd >= 0)
		close(fd);
	head.resize(at);
	return why;
}

/* Does a file that is no whole DICOM begin as one does: with its mark, or what is left of that, or
 * with an element of group 2 or 8 that no text begins with? */
bool begins_as_dicom(const std::vector<char> &head)
{
	enum { MARK = 128, SHORT = 512 };
	const size_t n = head.size();

	if (n > MARK && std::memcmp(head.data() + MARK, "DICM", std::min<size_t>(n - MARK, 4)) == 0)
		return n >= MARK + 4 || std::all_of(head.begin(), head.begin() + MARK,
						[](char c) { return c == 0; });
	return n >= 4 && n < SHORT && (head[0] == 2 || head[0] == 8) && head[1] == 0 &&
	       head[3] == 0;
}

/* `named` by the user: archives are opened, and not only what is compressed alone. */
void add_file(Found &found, const std::string &path, bool named)
{
	std::error_code bad;
	std::vector<char> head(4096);

	if (fs::is_regular_file(path, bad) && fs::file_size(path, bad) == 0)
		return note(found, path, CT_FILE_DAMAGED, "it is empty");
	if (access(path.c_str(), R_OK) != 0)
		return note(found, path, CT_FILE_UNREADABLE, std::strerror(errno));
	if (!fs::is_regular_file(path, bad))
		return note(found, path, CT_FILE_FOREIGN, "no file");
	Lack::check(path.c_str());
	if (const int why = read_head(path, head))
		return note(found, path, CT_FILE_UNREADABLE, std::strerror(why));
	if (outline_of(path.c_str()).dicom)
		return add_held(found, {path, path.c_str(), false, 0, 0});
	if (begins_as_dicom(head)) {
		note(found, path, CT_FILE_DAMAGED, "its header is cut off");
		found.file.back().marked = true;
		return;
	}
	if (std::all_of(head.begin(), head.end(), [](char c) { return c == 0; }))
		return note(found, path, CT_FILE_DAMAGED, "it holds zeros");
	if ((named || (head.size() > 2 && head[0] == '\x1f' && head[1] == '\x8b')) &&
		add_archive(found, path, !named))
		return;
	note(found, path, CT_FILE_FOREIGN);
}

void add(Found &found, const std::string &path, bool named)
{
	try {
		add_file(found, path, named);
	} catch (const std::runtime_error &x) { /* deflated data, or no room to unpack */
		note(found, path, CT_FILE_DAMAGED, x.what());
	}
}

void walk(Found &found, const std::string &folder, bool deep)
{
	std::error_code bad;
	std::vector<std::string> names;
	std::string real = fs::canonical(folder, bad).string();

	if (bad)
		real = folder;
	if (!found.folders.insert(real).second)
		return; /* a link led here once more */
	fs::directory_iterator all(folder, bad), end;
	if (bad && Lack::is(bad.value())) {
		errno = bad.value();
		throw Lack(folder);
	}
	if (bad)
		return note(found, folder + "/", CT_FILE_UNREADABLE, bad.message());
	for (; all != end && !bad; all.increment(bad))
		names.push_back(all->path().string());
	if (bad)
		note(found, folder + "/", CT_FILE_UNREADABLE, bad.message());
	std::sort(names.begin(), names.end()); /* a folder has no order */
	try_headers(found, names);
	for (const std::string &name : names)
		if (!fs::is_directory(name, bad))
			add(found, name, false);
		else if (deep && fs::path(name).filename().string().rfind(".ctsr-tmp-", 0) != 0)
			/* but what another command is at work on */
			walk(found, name, deep);
}

int scan(const char *path, bool deep, Found &found, ct_err *e)
{
	std::error_code bad;

	if (!fs::exists(fs::symlink_status(path, bad)))
		return ct_fail(e, CT_EINPUT, "%s: %s", path, std::strerror(ENOENT));
	if (fs::is_directory(path, bad))
		walk(found, path, deep);
	else
		add(found, path, true);
	return 0;
}

template <class T> T *hand_over(std::vector<T> &v)
{
	T *out = static_cast<T *>(std::calloc(v.size() + 1, sizeof(T)));

	if (!out)
		throw std::bad_alloc();
	std::copy(v.begin(), v.end(), out);
	return out;
}

} // namespace

extern "C" int ct_dicom_scan(
	const char *const *paths, size_t n, bool deep, struct ct_census *c, struct ct_err *e)
{
	*c = {};
	return guard(e, n ? paths[0] : "no path", [&] {
		Found found;

		for (size_t i = 0; i < n; i++)
			if (scan(paths[i], deep, found, e))
				return -1;
		c->file = hand_over(found.file);
		c->files = found.file.size();
		found.file.clear(); /* the paths have a new owner */
		c->slice = hand_over(found.slice);
		c->slices = found.slice.size();
		found.slice.clear();
		c->store = found.store.release() + 1;
		return 0;
	});
}
