/* ends.h: how the names of files end.
 *
 * Readers go by content, never by name. A writer has one format, or takes the one that the name
 * asks for, and a name that ends otherwise would be a lie: cli/files.h refuses it. A list of ends
 * is "nii|nii.gz".
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_FORMATS_ENDS_H
#define CT_FORMATS_ENDS_H
#include <stdbool.h>
#include <stddef.h>

/* What the commands write. */
#define CT_ENDS_VOLUME "nii|nii.gz"
#define CT_ENDS_METAIMAGE "mha|mhd"
#define CT_ENDS_NRRD "nrrd|nhdr"
#define CT_ENDS_DICOM "dcm"
#define CT_ENDS_STACK "exr"
#define CT_ENDS_GAUSS "ply|pickle"
#define CT_ENDS_TENSORS "safetensors"
/* What PyTorch writes. */
#define CT_ENDS_TORCH "pt|pth|ckpt|bin"
#define CT_ENDS_PICTURE "png"
#define CT_ENDS_DRAWING "svg"
#define CT_ENDS_TABLE "csv"
#define CT_ENDS_REPORT "json"
#define CT_ENDS_PAGE "html"
#define CT_ENDS_TEXT "txt"

/* Does the name end in a dot and one of them, whatever the case, behind at least one character? */
bool ct_ends_match(const char *path, const char *ends);
/* Does it end as names of files do: a dot, a letter, letters and digits? Not "scan1.5" or "hr". */
bool ct_ends_any(const char *path);
/* ".nii or .nii.gz" */
void ct_ends_text(char *out, size_t room, const char *ends);

#endif
