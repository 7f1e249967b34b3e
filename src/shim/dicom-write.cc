/* dicom-write.cc: files out, and elements of others in; see dicom-file.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "shim/dicom-file.h"
#include "shim/dicom-tags.h"
#include "shim/guard.h"
#include "shim/held.h"

#include <vtkDICOMCompiler.h>
#include <vtkDICOMDictionary.h>
#include <vtkDICOMItem.h>
#include <vtkDICOMMetaData.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMSequence.h>
#include <vtkErrorCode.h>
#include <vtkNew.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

struct ct_dicom_file {
	std::string name;
	vtkNew<vtkDICOMMetaData> m;
	vtkNew<vtkDICOMCompiler> c;
};

namespace
{

vtkDICOMDictEntry entry(const std::string &keyword)
{
	vtkDICOMDictEntry found = vtkDICOMDictionary::FindDictEntry(keyword.c_str());

	if (!found.IsValid())
		throw std::runtime_error("no element is called " + keyword);
	return found;
}

vtkDICOMValue value_of(vtkDICOMVR vr, const std::string &text)
{
	if (vr == vtkDICOMVR::SQ)
		return vtkDICOMSequence(0);
	if (vr == vtkDICOMVR::AT)
		return vtkDICOMValue(vr, entry(text).GetTag());
	if (vr == vtkDICOMVR::XS) /* the pixels are signed */
		vr = vtkDICOMVR::SS;
	return vtkDICOMValue(vr, text);
}

/* Elements by keyword, and the items of sequences. */
struct Tree {
	std::map<std::string, std::string> text;
	std::map<std::string, std::vector<Tree>> items;

	/* "KEYWORD", or "SEQUENCE.ITEM.KEYWORD" of any depth. */
	void put(const std::string &path, const std::string &value)
	{
		const size_t dot = path.find('.');

		if (dot == std::string::npos) {
			text[path] = value;
			return;
		}
		std::vector<Tree> &in = items[path.substr(0, dot)];
		const size_t end = path.find('.', dot + 1), k = std::stoul(path.substr(dot + 1));

		if (in.size() <= k)
			in.resize(k + 1);
		in[k].put(path.substr(end + 1), value);
	}

	void put(const ct_header *h)
	{
		for (size_t i = 0; i < h->n; i++)
			put(h->element[i].path, h->element[i].text);
	}
};

/* Into the metadata of a file, or an item. */
template <class T> void fill(T *to, const Tree &tree)
{
	for (const auto &x : tree.text) {
		const vtkDICOMDictEntry known = entry(x.first);

		to->Set(known.GetTag(), value_of(known.GetVR(), x.second));
	}
	for (const auto &x : tree.items) {
		vtkDICOMSequence all(static_cast<unsigned>(x.second.size()));

		for (size_t i = 0; i < x.second.size(); i++) {
			vtkDICOMItem item;

			fill(&item, x.second[i]);
			all.SetItem(i, item);
		}
		to->Set(entry(x.first).GetTag(), vtkDICOMValue(all));
	}
}

int lost(const ct_dicom_file *f, ct_err *e)
{
	const bool full = f->c->GetErrorCode() == vtkErrorCode::OutOfDiskSpaceError;

	return ct_fail(e, CT_EOUTPUT, "%s: %s", f->name.c_str(),
		errno != 0 ? std::strerror(errno)
		: full     ? std::strerror(ENOSPC)
			   : "cannot be written");
}

} // namespace

extern "C" int ct_dicom_header(struct ct_header *h, const struct ct_slice *s, size_t n,
	const char *const *keyword, struct ct_err *e)
{
	return guard(e, s->path, [&] {
		vtkNew<vtkDICOMMetaData> m;
		vtkNew<vtkDICOMParser> p;
		const Held held(*s);

		if (!parse_header(held.path(), m, p))
			return ct_fail(e, CT_EINPUT, "%s: damaged DICOM file", s->path);
		for (size_t i = 0; i < n; i++) {
			const vtkDICOMValue &v = m->Get(entry(keyword[i]).GetTag());
			const std::string text = !v.IsValid() ? std::string()
						 : v.GetVR() == vtkDICOMVR(vtkDICOMVR::SQ)
							 ? std::to_string(v.GetNumberOfValues())
							 : v.AsString();

			if (!text.empty())
				ct_header_put(h, "", keyword[i], "%s", text.c_str());
		}
		return ct_header_check(h, e);
	});
}

extern "C" int ct_dicom_open(struct ct_dicom_file **out, const char *path, const char *name,
	const struct ct_header *all, const struct ct_header *own, const char *uid, struct ct_err *e)
{
	*out = nullptr;
	return guard(e, name, [&] {
		ct_dicom_file *f = new ct_dicom_file;
		vtkDICOMCompiler *c = f->c;
		Tree tree;

		*out = f;
		f->name = name;
		vtkObject::GlobalWarningDisplayOff();
		tree.put(all);
		tree.put(own);
		fill(f->m.Get(), tree);
		f->m->Set(DC::PixelData, vtkDICOMValue(vtkDICOMVR::OW)); /* follows */
		c->SetMetaData(f->m);
		c->SetFileName(path);
		c->SetSOPInstanceUID(f->m->Get(DC::SOPInstanceUID).GetCharData());
		c->SetSeriesInstanceUID(f->m->Get(DC::SeriesInstanceUID).GetCharData());
		c->SetStudyInstanceUID(f->m->Get(DC::StudyInstanceUID).GetCharData());
		c->SetImplementationClassUID(uid);
		c->SetImplementationVersionName("CTSR");
		errno = 0;
		c->WriteHeader();
		return c->GetErrorCode() != 0 ? lost(f, e) : 0;
	});
}

extern "C" int ct_dicom_put(struct ct_dicom_file *f, const int16_t *px, size_t n, struct ct_err *e)
{
	return guard(e, f->name.c_str(), [&] {
		errno = 0;
		f->c->WriteFrame(reinterpret_cast<const unsigned char *>(px),
			static_cast<vtkIdType>(n * sizeof *px));
		return f->c->GetErrorCode() != 0 ? lost(f, e) : 0;
	});
}

extern "C" int ct_dicom_close(struct ct_dicom_file *f, struct ct_err *e)
{
	int rc = 0;

	if (f)
		rc = guard(e, f->name.c_str(), [&] {
			errno = 0;
			f->c->Close();
			return f->c->GetErrorCode() != 0 ? lost(f, e) : 0;
		});
	delete f;
	return rc;
}
