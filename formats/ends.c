/* ends.c: see ends.h. */
#include "config.h"
#include "formats/ends.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

bool ct_ends_match(const char *path, const char *ends)
{
	const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
	const size_t len = strlen(name);

	while (*ends) {
		const size_t n = strcspn(ends, "|");

		if (len > n + 1 && name[len - n - 1] == '.' &&
			strncasecmp(name + len - n, ends, n) == 0)
			return true;
		ends += n + (ends[n] == '|');
	}
	return false;
}

bool ct_ends_known(const char *path)
{
	return ct_ends_match(path, CT_ENDS_VOLUME
		"|" CT_ENDS_STACK "|" CT_ENDS_GAUSS "|" CT_ENDS_TENSORS "|" CT_ENDS_PICTURE
		"|" CT_ENDS_TABLE "|" CT_ENDS_PAGE
		"|dcm|dicom|ima|mha|mhd|nrrd|nhdr|hdr|img|mgz|mnc|vtk|vti|npy|npz|raw|mat"
		"|h5|hdf5|pt|pth|ckpt|onnx|pkl|jpg|jpeg|jp2|tif|tiff|bmp|gif|webp|pdf"
		"|json|xml|stl|obj|gz|zst|xz|bz2|zip|tar|tgz|7z");
}

void ct_ends_text(char *out, size_t room, const char *ends)
{
	size_t at = 0;

	*out = '\0';
	for (const char *join = ""; *ends && at < room;) {
		const size_t n = strcspn(ends, "|");

		at += (size_t)snprintf(out + at, room - at, "%s.%.*s", join, (int)n, ends);
		ends += n + (ends[n] == '|');
		join = strchr(ends, '|') ? ", " : " or ";
	}
}
