/* slice.h: one picture of a DICOM series: what its header says, and what must hold of it.
 *
 * DICOM speaks of the patient in LPS+ millimetres.
 * SPDX-License-Identifier: Apache-2.0
 */
#ifndef CT_SERIES_SLICE_H
#define CT_SERIES_SLICE_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif

enum { CT_SLICE_TEXT = 72 }; /* bytes of a text, its end included */

/* What a file says of one picture. Texts are empty and numbers NaN, or 0 where they are integers,
 * if it does not say. */
struct ct_slice {
	char *path;  /* owned by whoever made the array */
	size_t file; /* its place in the census */
	int store;   /* descriptor + 1 of what holds it, if that is no file of its own, */
	long long begin, bytes; /* and where */
	size_t frame;           /* the picture's place in its file, from 0 */
	size_t frames;          /* pictures of the file */
	char series[CT_SLICE_TEXT], study[CT_SLICE_TEXT],
		object[CT_SLICE_TEXT],                       /* Series-, Study-, SOPInstanceUID */
		space[CT_SLICE_TEXT],                        /* FrameOfReferenceUID */
		patient[CT_SLICE_TEXT], name[CT_SLICE_TEXT]; /* PatientID, PatientName */
	char maker[CT_SLICE_TEXT],
		model[CT_SLICE_TEXT];            /* Manufacturer, its ManufacturerModelName */
	char posture[20];                        /* PatientPosition */
	char modality[20], about[CT_SLICE_TEXT]; /* SeriesDescription */
	char storage[CT_SLICE_TEXT], type[CT_SLICE_TEXT]; /* SOPClassUID, ImageType */
	char unit[20], kernel[CT_SLICE_TEXT];             /* RescaleType, ConvolutionKernel */
	char contrast[CT_SLICE_TEXT], stack[20];          /* ContrastBolusAgent, StackID */
	char index[40];            /* DimensionIndexValues, without those that say the place */
	char whole[CT_SLICE_TEXT]; /* ConcatenationUID of a file that is part of one, */
	int part, parts;           /* InConcatenationNumber, InConcatenationTotalNumber */
	size_t before;             /* ConcatenationFrameOffsetNumber */
	int number, instance, acquisition; /* SeriesNumber, InstanceNumber, AcquisitionNumber */
	int announced;                     /* ImagesInAcquisition */
	/* TemporalPosition, nominal phase of the heart in %, TriggerTime in ms, acquisition and
	 * content time in s of the day */
	double moment, phase, trigger, acquired, made;
	double kvp, thickness, tilt; /* kV, SliceThickness in mm, GantryDetectorTilt in degrees */
	double between, diameter;    /* SpacingBetweenSlices, ReconstructionDiameter in mm */
	double collimation;          /* SingleCollimationWidth in mm */
	size_t columns, rows, samples;
	double on_disk, claimed;    /* bytes of its part of the file, and of its numbers unpacked */
	char syntax[CT_SLICE_TEXT]; /* TransferSyntaxUID */
	long long pixels;           /* where the numbers of its file begin, in bytes */
	int allocated, stored, high; /* BitsAllocated, BitsStored; HighBit, or -1 */
	bool is_signed;
	bool overlaid;    /* bits that are not stored are of an overlay */
	bool lossy;       /* values are near to what they were */
	bool table;       /* has a ModalityLUTSequence */
	bool floats;      /* FloatPixelData or DoubleFloatPixelData */
	char colours[20]; /* PhotometricInterpretation */
	bool placed;      /* has position, orientation and pixel spacing */
	bool counted; /* its position is that of its file, and SpacingBetweenSlices times frame */
	double position[3]; /* of the centre of the first pixel, LPS mm */
	double across[3];   /* unit vector along a row: towards the next column */
	double down[3];     /* unit vector along a column: towards the next row */
	double pitch[2];    /* mm between columns, mm between rows */
	bool scaled;        /* has RescaleSlope and RescaleIntercept */
	double slope, intercept;
	bool padded;
	double padding[2]; /* stored values from, to that are no measurement */
	size_t rank, from; /* of ct_slice_sort, */
	double at;         /* set before it is called; from is filled in */
	bool hashed;       /* hash is that of its values */
	uint64_t hash[2];
};

/* How numbers are stored: in 1, 2 or 4 bytes each, little-endian, of which `bits` above the lowest
 * `shift` count. `base` is subtracted from them before they are rounded to floats. */
struct ct_slice_bits {
	size_t bytes;
	int bits;
	bool is_signed;
	int shift;
	double base; /* a whole number */
};

/* Where plane k of a grid lies: position, axes and pitch, i along a row and j down the columns. The
 * axes of the affine, RAS+, are at right angles (ct_vol_check_grid). */
void ct_slice_place(struct ct_slice *s, const double affine[3][4], size_t k);
/* The vector across x down. */
void ct_slice_normal(const struct ct_slice *s, double n[3]);
/* CT_EGEOM unless it is placed, by unit vectors at right angles and pixels that have a size;
 * CT_EINPUT unless it has one usable scale. */
int ct_slice_check(const struct ct_slice *s, struct ct_err *e);
/* Is b parallel to a, of the same matrix and pixel size? */
bool ct_slice_parallel(const struct ct_slice *a, const struct ct_slice *b);
/* How near, in mm, two slices are at one place: a thousandth, or as near as some of n slices in
 * order of `at` are, where that is no more than a quarter of the usual distance, and no zone of
 * slices that lie closer than others. `gap` is room for n; it gets the gaps in order of size. */
double ct_slice_near(const struct ct_slice *s, size_t n, double *gap);
/* Do the two lie as near as that? */
bool ct_slice_together(const struct ct_slice *a, const struct ct_slice *b, double near);
/* What a message calls the picture: its file, and of several in it which. */
enum { CT_SLICE_NAME = 300 };
const char *ct_slice_name(char out[CT_SLICE_NAME], const struct ct_slice *s);
/* Sort n slices by rank, in it by `at`, in that as they stand. */
void ct_slice_sort(struct ct_slice *s, size_t n);
/* How ImageType's value `k`, from 0, begins: is it `word`? */
bool ct_slice_is_type(const struct ct_slice *s, int k, const char *word);
/* What is subtracted from stored values, that floats hold what is left exactly, or nearly: that of
 * 0 HU, where they have 32 bits; else 0. */
double ct_slice_base(const struct ct_slice *s);
/* n stored values. */
void ct_slice_widen(size_t n, float *out, const void *in, const struct ct_slice_bits *how);
/* Stored values of a slice, less its base, to those that its scale makes of them; padding becomes
 * `none`. Lossy compression moves padding: there, what is nearer to padding than to any HU that CT
 * has is padding too. */
void ct_slice_scale(const struct ct_slice *s, float none, float *x);
/* A picture of X rays on a detector, by its modality? */
bool ct_slice_is_radiograph(const struct ct_slice *s);
/* CT_EINPUT, with the field that says so, unless the values are HU, by what they are called and how
 * they are scaled. */
int ct_slice_check_hu(const struct ct_slice *s, struct ct_err *e);
/* CT_EINPUT if stored values without a sign are as if they had one: some of them above 61440, none
 * from there down to 32768, padding and the largest aside. */
int ct_slice_check_sign(const struct ct_slice *s, const float *x, struct ct_err *e);

#ifdef __cplusplus
}
#endif
#endif
