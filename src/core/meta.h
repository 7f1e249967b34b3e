/* meta.h: what travels inside every file beside its numbers: key=value strings.
 *
 * The same list is a JSON object in a NIfTI extension, "ct:key" attributes in an EXR,
 * "comment ct:key=value" lines in a PLY, and __metadata__ in a safetensors file.
 *
 * All keys stand here, as type: meaning; who writes it. The code names no other, except for those
 * that are made up of parts:
 *   nifti.ext.N  a foreign NIfTI extension: "ECODE BASE64"; NIfTI
 *   run.NAME     in a state, what its run depends on (cli/resume.h)
 *   scalar.N     in the state of the joint solver, a number in hexadecimal; ct-fuse
 * and for the architecture of a prior, by the names of guided diffusion (nn/arch.c).
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_CORE_META_H
#define CT_CORE_META_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

struct ct_env;

/* text: one line a command that made the data, with its inputs: "ct-degrade 0.1.0 -x 4 in.nii
 * out.nii"; ct_meta_step */
#define CT_META_HISTORY "history"
/* "NAME xxh3:HEX": the file the list was read from, and its content; the readers, never
 * written */
#define CT_META_INPUT "input"
/* word: what the values are, CT_QUANTITY_...; none: HU, or line integrals; every command that
 * makes another */
#define CT_META_QUANTITY "quantity"
/* "LO:HI", HU: that map to density 0 and 1; ct_window_put; of a network of volumes ct_arssr_put */
#define CT_META_WINDOW "window"
/* integer: of the last step that drew numbers; ct-phantom, ct-project, ct-ddnm, ct-nabgs */
#define CT_META_SEED "seed"

/* "X,Y,Z": decimation of the low-resolution grid; ct_degrade_put */
#define CT_META_FACTOR "factor"
/* "X,Y,Z", high-resolution voxels: Gaussian of the degradation; ct_degrade_put */
#define CT_META_SIGMA "sigma"
/* word of CT_DECIMATE_LIST: ct_degrade_put */
#define CT_META_DECIMATE "decimate"
/* "yes": samples are the first voxels of their cells; ct_degrade_put */
#define CT_META_FIRST "first"
/* "AXIS FIRST STEP W,W,...", LR voxels: slice profile of an axis, in place of its sigma and
 * decimate; ct_slice_profile_put */
#define CT_META_PROFILE "profile"
/* number, HU: standard deviation of the noise that was added; ct-degrade */
#define CT_META_NOISE "noise"
/* "LO:HI", HU: that the CT was clipped to before its resolution was reduced; ct-degrade */
#define CT_META_CLIP "clip"
/* word of CT_UPSAMPLE_LIST, prior or field: what brought the data to the fine grid: the factor is
 * used up; ct_upsample, ct-field */
#define CT_META_UPSAMPLE "upsample"
/* text: what of the operator was measured, and how surely (estimate/assumed.h); ct_refine_run */
#define CT_META_ASSUMED "assumed"
/* text: how much was taken for noise, and whether it was kept (refine/rest.h); ct_refine_run */
#define CT_META_DENOISED "denoised"
/* word of CT_PHANTOM_LIST: ct-phantom */
#define CT_META_PHANTOM "phantom"

/* how those of a scan begin */
#define CT_META_SCAN "scan."
/* number, mm: source to isocentre; ct_geometry_fill */
#define CT_META_SCAN_DSO "scan.dso"
/* number, mm: source to detector; ct_geometry_fill */
#define CT_META_SCAN_DSD "scan.dsd"
/* number, degrees: that the views are spread over; ct_geometry_fill */
#define CT_META_SCAN_ARC "scan.arc"
/* number, degrees: angle of the first view; ct_geometry_fill */
#define CT_META_SCAN_START "scan.start"
/* "X,Y,Z", mm: isocentre; ct_geometry_fill */
#define CT_META_SCAN_ISO "scan.iso"
/* "X,Y,Z": voxels of the volume that was projected; ct_scan_grid_put */
#define CT_META_VOLUME_SIZE "volume.size"
/* 12 numbers, mm: its affine, row after row; ct_scan_grid_put */
#define CT_META_VOLUME_AFFINE "volume.affine"
/* word of CT_METHOD_LIST: projector; ct-project */
#define CT_META_METHOD "method"
/* word: yes: what the volume had beyond the window was projected too; ct-project */
#define CT_META_OVERSHOOT "overshoot"
/* integer: detector pixels that became one, along each side; ct-project */
#define CT_META_COARSEN "coarsen"
/* word: how: point, mean, sinc; ct-project */
#define CT_META_PIXEL "pixel"
/* number: sent to a pixel; ct-project */
#define CT_META_PHOTONS "photons"
/* number, photons: standard deviation of the electronics; ct-project */
#define CT_META_ELECTRONIC "electronic"
/* numbers: coefficients of the line integrals' first to fourth power; ct-convert --water */
#define CT_META_WATER "water"
/* number, 1/mm: attenuation of water; ct-project */
#define CT_META_MU_WATER "muWater"

/* word of CT_MEASUREMENT_LIST: of the measurement; ct-ddnm */
#define CT_META_OPERATOR "operator"
/* number: value that the network saw as 1; ct-ddnm */
#define CT_META_NORM "norm"
/* word: of the fit: residual, full; ct-nabgs */
#define CT_META_MODE "mode"

/* text: names and hashes of what a prior was trained on; ct-train */
#define CT_META_DATASET "dataset"
/* text: of a prior; ct-train */
#define CT_META_LICENCE "licence"
/* text: from values to those that the network sees; ct-train */
#define CT_META_INTENSITY_MAP "intensity_map"
/* word of CT_NET_LIST (nn/arch.h): the network of a prior; a U-Net if it is not there */
#define CT_META_NET "net"
/* word: of the variances of a prior: linear; ct_train_result */
#define CT_META_BETA_SCHEDULE "beta_schedule"
/* integer: timesteps of a prior, 1000 if it is not there; those who publish one */
#define CT_META_DIFFUSION_STEPS "diffusion_steps"
/* integer: of a prior, or two in the state of a fit; ct_train_result, states */
#define CT_META_STEP "step"
/* numbers: the least held-out loss, its step, the last step that was judged, and how many since
 * were no better: in the state of a training; train_best_put */
#define CT_META_BEST "best"
/* number: rate of the average of the weights; ct_train_result */
#define CT_META_EMA "ema"

/* numbers in hexadecimal: in the state of a fit; ct_fit_state_pack */
#define CT_META_SCALARS "scalars"
/* integers: where the joint solver was, in its state; in that of a fit its end, and whether it is
 * whole; states */
#define CT_META_AT "at"
/* "X,Y,Z:X,Y,Z ...", RAS mm: middles of the DICOM slices on either side of a gap that was
 * interpolated; ct-convert */
#define CT_META_FILLED "filled"
/* 32 hexadecimal digits, XXH3: PatientID and FrameOfReferenceUID of the DICOM series; two CTs are
 * of one patient and space if they have the same; ct-convert */
#define CT_META_SPACE "space"
/* What DICOM said of the scanner; ct_acquired_put of the reader of DICOM, or of a sidecar: */
/* text: Manufacturer */
#define CT_META_DICOM_MAKER "dicom.maker"
/* text: ConvolutionKernel */
#define CT_META_DICOM_KERNEL "dicom.kernel"
/* "X,Y,Z", mm: SliceThickness, along the axis of the slices; 0 along the others, or not said */
#define CT_META_DICOM_THICKNESS "dicom.thickness"
/* "X,Y,Z", mm: between the voxels when that was read; 0: not known */
#define CT_META_DICOM_SPACING "dicom.spacing"
/* number, mm: SingleCollimationWidth */
#define CT_META_DICOM_COLLIMATION "dicom.collimation"
/* integer: qform_code and sform_code, if not 1; 0: there is neither; NIfTI */
#define CT_META_NIFTI_CODE "nifti.code"
/* text: what in the header of the NIfTI contradicts its sform; the reader, never written */
#define CT_META_NIFTI_DOUBT "nifti.doubt"

/* The values of quantity: of volumes HU, density, HU or density to be added; of stacks density x
 * mm, grey values in [0, 1], standard deviations. */
#define CT_QUANTITY_HU "hu"
#define CT_QUANTITY_OTHER "other" /* of no unit that is known here */
#define CT_QUANTITY_DENSITY "density"
#define CT_QUANTITY_RESIDUAL "residual"
#define CT_QUANTITY_LINE_INTEGRAL "lineIntegral"
#define CT_QUANTITY_INTENSITY "intensity"
#define CT_QUANTITY_DEVIATION "deviation"
#define CT_QUANTITY_ERROR "expected error" /* HU */

struct ct_meta {
	size_t n, cap;
	struct ct_pair {
		char *key, *value;
	} * pair; /* in order of insertion */
};

void ct_meta_free(struct ct_meta *m);
/* Value of a key, borrowed until the list changes, or NULL. */
const char *ct_meta_get(const struct ct_meta *m, const char *key);
/* Replace or append. CT_EINPUT for an empty key, CT_ENOMEM. */
int ct_meta_set(struct ct_meta *m, const char *key, const char *value, struct ct_err *e);
int ct_meta_setf(struct ct_meta *m, struct ct_err *e, const char *key, const char *fmt, ...)
	__attribute__((format(printf, 4, 5)));
void ct_meta_drop(struct ct_meta *m, const char *key);
/* Numbers "a,b,c" of a key into v: 0; 1 if there is no such key (v untouched); -1 with
 * CT_EINPUT naming the key if the value is not exactly n finite numbers. One number
 * stands for n equal ones. */
int ct_meta_numbers(
	const struct ct_meta *m, const char *key, size_t n, double *v, struct ct_err *e);
/* The noise, HU: 0; 1 if it is not said; CT_EINPUT unless it is from 0 to what a CT can have. */
int ct_meta_noise(const struct ct_meta *m, double *hu, struct ct_err *e);
/* CT_EINPUT, with the quantity, if the values are said to be none of HU; `other`: or those of no
 * unit that is known. */
int ct_meta_need_hu(const struct ct_meta *m, bool other, struct ct_err *e);
/* n <= 16 numbers that a float cannot hold, exact, as CT_META_SCALARS, and back: CT_EINPUT unless
 * there are so many, and finite. */
int ct_meta_put_scalars(struct ct_meta *m, size_t n, double *const *v, struct ct_err *e);
int ct_meta_get_scalars(const struct ct_meta *m, size_t n, double *const *v, struct ct_err *e);
/* The pairs of src into dst; copy: these alone. CT_ENOMEM. */
int ct_meta_add(struct ct_meta *dst, const struct ct_meta *src, struct ct_err *e);
int ct_meta_copy(struct ct_meta *dst, const struct ct_meta *src, struct ct_err *e);
/* Append this command to `history` of dst, with the names and hashes of the n lists `in`
 * (NULL entries are skipped) and the seed; drops "input". */
int ct_meta_step(struct ct_meta *dst, const struct ct_env *env, size_t n,
	const struct ct_meta *const *in, struct ct_err *e);

#endif
