/* ctsr.h: super-resolution of computed tomography (CT) as a library.
 * SPDX-License-Identifier: Apache-2.0
 * libctsr refines a CT scan to a finer grid: it inverts the blur and the sampling of the scanner,
 * and can then add the detail that a network, trained on slices of other CTs, predicts. Blurred and
 * sampled again, the result gives the scan. It also runs the steps of the paper: it projects
 * volumes, super-resolves the projections, fits Gaussians to them and composes these with a volume.
 * The commands call the same functions, with the same results and errors. ctsr(3) has a program.
 *
 * UNITS AND AXES
 *
 * Lengths are millimetres, angles degrees. Values of a volume are Hounsfield units (HU) unless its
 * metadata key "quantity" says otherwise. World axes are RAS+ as in NIfTI: +x points to the
 * patient's right, +y to the front, +z to the head. Voxel (i,j,k) of a volume of n0 x n1 x n2
 * voxels is data[(k*n1 + j)*n0 + i]. The 3x4 affine maps indices to mm; whole indices are the
 * centres of voxels.
 *
 * ERRORS
 *
 * A function that can fail returns 0, or -1 and fills in *e, whose message is one English line. e
 * may be NULL. On failure, what a function was to create is NULL. The library prints nothing, ends
 * no process, installs no signal handler and reads no environment variable.
 *
 * THREADS
 *
 * Threads may call at the same time if no two of them change the same object. Global are only the
 * level of the processor's vectors, and a list of the temporary files that are being written. A
 * call joins its own threads before it returns. Any number of threads gives the same bytes.
 *
 * VERSIONS
 *
 * The library follows semantic versioning. Objects are opaque. Structs that a caller fills begin
 * with their size; the other members are 0 by default: ctsr_context c = {.size = sizeof c}. Where
 * that is not so ctsr_..._init sets the defaults and the size. Later versions add members at the
 * end, whose default keeps the old behaviour: what was built for libctsr.so.0 runs with later ones.
 */
#ifndef CTSR_H
#define CTSR_H
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifdef __GNUC__
#define CTSR_API __attribute__((visibility("default")))
#else
#define CTSR_API
#endif

/* ------------------------------------------------------------------------------------ version */
#define CTSR_VERSION_MAJOR 0
#define CTSR_VERSION_MINOR 1
#define CTSR_VERSION_PATCH 0
/* Version of the library that runs, "0.1.0". Static text. */
CTSR_API const char *ctsr_version(void);

/* ------------------------------------------------------------------------------------- errors */
/* Codes. They are the exit statuses of the commands, too. */
enum ctsr_code {
	CTSR_OK = 0,
	CTSR_FAILED = 1,    /* for another reason */
	CTSR_USAGE = 2,     /* an argument or option is wrong */
	CTSR_INPUT = 3,     /* a file or its content is wrong */
	CTSR_OUTPUT = 4,    /* a file cannot be written */
	CTSR_GEOMETRY = 5,  /* grids or geometries that do not fit, or make no sense */
	CTSR_NUMBER = 6,    /* NaN or infinity in the input, or divergence */
	CTSR_MEMORY = 7,    /* not enough memory, or another resource */
	CTSR_CANCELLED = 75 /* the progress callback asked for it */
};

/* Owned by the caller; needs no initialisation and no release. After success it is unchanged. */
typedef struct ctsr_error {
	int code; /* of enum ctsr_code */
	char message[508];
} ctsr_error;

/* ------------------------------------------------------------------------------------ context */
/* How a call runs. Every function that takes a context takes NULL too: all defaults. */
typedef struct ctsr_context {
	size_t size;
	unsigned threads; /* 0 (default): one for each processor that the process may use */
	int overwrite;    /* 1: writers replace a file that is there; default 0: CTSR_OUTPUT */
	uint64_t seed;    /* of all random numbers; default 0 */
	int verbose;      /* what log gets: 0 (default) what commands print, 1 more, 2 everything */
	/* Steps done of total (0: not known) of the work `what`. Return 1 to cancel the call, which
	 * then fails with CTSR_CANCELLED; else 0. Called from one thread at a time, not always the
	 * caller's. Default NULL. */
	int (*progress)(void *user, const char *what, size_t done, size_t total);
	/* One line of text. level: 0 warning, 1 information, 2 detail. Default NULL. */
	void (*log)(void *user, int level, const char *text);
	void *user;          /* handed to the callbacks */
	const char *history; /* a line for the metadata key "history"; NULL (default): none */
} ctsr_context;

/* ------------------------------------------------------------------------------------ volumes */
/* A volume of 32-bit floats on a grid, with metadata: pairs of a key and a text. */
typedef struct ctsr_volume ctsr_volume;

/* New volume of size[0] x size[1] x size[2] voxels. data NULL: all zero. Else the voxels are memory
 * of the caller, only read here, which must live as long as *v. affine NULL: 1 mm voxels from the
 * origin. CTSR_USAGE for a size of 0; CTSR_INPUT for one that overflows; CTSR_GEOMETRY for an
 * affine that is not finite, has no extent or is sheared; CTSR_MEMORY. */
CTSR_API int ctsr_volume_new(ctsr_volume **v, const size_t size[3], const double affine[3][4],
	float *data, ctsr_error *e);
/* A volume of int16 numbers: a copy, slope*data + intercept. DICOM's rescale values. */
CTSR_API int ctsr_volume_from_int16(ctsr_volume **v, const size_t size[3],
	const double affine[3][4], const int16_t *data, double slope, double intercept,
	ctsr_error *e);
/* NULL is legal. Memory of the caller is left alone. */
CTSR_API void ctsr_volume_free(ctsr_volume *v);
/* The voxels, valid until v is freed. The caller may change them. size, affine (or NULL) <- number
 * of voxels along each axis, and the affine. */
CTSR_API float *ctsr_volume_data(const ctsr_volume *v, size_t size[3], double affine[3][4]);
/* data[n0*n1*n2] <- voxels, rounded, ties to even. CTSR_NUMBER if one does not fit. */
CTSR_API int ctsr_volume_to_int16(const ctsr_volume *v, int16_t *data, ctsr_error *e);
/* Value of a metadata key (ct-formats(5)), valid until they change; NULL: no such key. */
CTSR_API const char *ctsr_volume_get(const ctsr_volume *v, const char *key);
/* Key number i, from 0 on, or NULL behind the last. */
CTSR_API const char *ctsr_volume_key(const ctsr_volume *v, size_t i);
/* Set a key; value NULL removes it. CTSR_USAGE for an empty key; CTSR_MEMORY. */
CTSR_API int ctsr_volume_set(ctsr_volume *v, const char *key, const char *value, ctsr_error *e);
/* values[n] <- volume at the n points (mm, RAS+), linear between voxel centres; NaN where a point
 * is outside the centres of the outermost voxels. CTSR_GEOMETRY if the affine has no inverse. */
CTSR_API int ctsr_volume_sample(
	float *values, const ctsr_volume *v, size_t n, const double (*points)[3], ctsr_error *e);

/* ---------------------------------------------------------------------------- files of volumes */
/* A file format. A static link holds only the formats that a program names. */
typedef struct ctsr_format ctsr_format;
CTSR_API const ctsr_format *ctsr_nifti(void);     /* NIfTI-1, NIfTI-2; .nii, .nii.gz */
CTSR_API const ctsr_format *ctsr_nrrd(void);      /* NRRD; .nrrd, .nhdr */
CTSR_API const ctsr_format *ctsr_metaimage(void); /* MetaImage; .mha, .mhd */
/* All that the library reads; a list of one's own ends with NULL, too. */
CTSR_API const ctsr_format *const *ctsr_formats_all(void);
/* Read a file of one of these formats, by its content. What x.json beside x.nii says of the scanner
 * is metadata. "-" is standard input. CTSR_INPUT; CTSR_GEOMETRY for a grid; CTSR_MEMORY. */
CTSR_API int ctsr_volume_read(
	ctsr_volume **v, const char *path, const ctsr_format *const *formats, ctsr_error *e);
/* Write a file: int16 if all voxels are integers that fit, else float32. The file appears under its
 * name when it is whole. "-" is standard output. CTSR_USAGE if the name has another ending than
 * those of the format; CTSR_NUMBER; CTSR_OUTPUT; CTSR_MEMORY. */
CTSR_API int ctsr_volume_write(const ctsr_volume *v, const char *path, const ctsr_format *format,
	const ctsr_context *c, ctsr_error *e);

/* ----------------------------------------------------------------------------------- operators */
/* How a low-resolution CT is made: Gaussian blur, sampling, noise. */
enum ctsr_decimate {
	CTSR_SINC = 0,  /* band-limited, then sampled */
	CTSR_POINT = 1, /* sampled at points */
	CTSR_MEAN = 2   /* averaged over cells, as thick slices are */
};

typedef struct ctsr_operator {
	size_t size;
	double factor[3]; /* along each axis, 1 to 1024, need not be whole; 0 (default): 1 */
	double sigma[3];  /* of the blur, in fine voxels, 0 to 16 times the factor; default 0 */
	int decimate;     /* of enum ctsr_decimate; default CTSR_SINC */
	double noise;     /* standard deviation of white noise, HU, of the coarse CT; default 0 */
	/* Of ctsr_degrade alone, as ct-degrade(1) has them; elsewhere they are CTSR_USAGE. */
	const char *protocol;   /* in whose place are sigma, decimate, noise, unless 0; see said */
	const char *profile;    /* of slices: a shape, or lines "MM WEIGHT" */
	double slice_thickness; /* of slices, mm; 0 (default): the spacing of the coarse CT */
	double clip[2];         /* HU, first; 0, 0 (default): not */
	int said; /* those count though 0: sum of 1 sigma, 2 decimate, 4 noise; default 0 */
} ctsr_operator;

/* *o, its size set, <- the operator that the metadata name. CTSR_INPUT for none, or a wrong one. */
CTSR_API int ctsr_operator_get(ctsr_operator *o, const ctsr_volume *v, ctsr_error *e);
/* Measure the operator of a low-resolution CT: blur on its edges, noise where it is flat. Where one
 * axis alone is refined that has too few, slices count as thick as far apart. Size and factor of
 * *o must be set. CTSR_NUMBER; CTSR_INPUT for too few edges. */
CTSR_API int ctsr_estimate_operator(
	ctsr_operator *o, const ctsr_volume *v, const ctsr_context *c, ctsr_error *e);
/* *out <- low-resolution CT. Its metadata name the operator. Noise is drawn from the context's
 * seed. CTSR_USAGE for a number out of range, CTSR_INPUT for a profile; CTSR_GEOMETRY for an axis
 * shorter than its factor; CTSR_NUMBER; CTSR_MEMORY. As ct-degrade(1). */
CTSR_API int ctsr_degrade(ctsr_volume **out, const ctsr_volume *in, const ctsr_operator *o,
	const ctsr_context *c, ctsr_error *e);

/* ---------------------------------------------------------------------------- super-resolution */
/* Interpolation, regularised inversion, and the inversion with a learned prior on top. */
enum ctsr_method {
	/* the mean of TV and HTV that suits the scan; CTSR_BSPLINE without an operator */
	CTSR_AUTO = 0,
	CTSR_LINEAR = 1,
	CTSR_CUBIC = 2,
	CTSR_BSPLINE = 3,
	CTSR_LANCZOS = 4,
	CTSR_SINC_INTERPOLATION = 5,
	CTSR_DC = 6,    /* B-spline, made consistent with the scan */
	CTSR_TV = 7,    /* least total variation */
	CTSR_HTV = 8,   /* least second-order variation */
	CTSR_PRIOR = 9, /* CTSR_AUTO, and the detail that the slice prior predicts */
	CTSR_ARSSR = 10 /* a network of the whole volume, which prior_file names */
};

enum ctsr_preset {
	CTSR_FAST = 0,    /* slices across one axis */
	CTSR_BALANCED = 1 /* slices across all axes, and a second pass where the first added much */
};

typedef struct ctsr_superres_options {
	size_t size;
	int method;        /* of enum ctsr_method; default CTSR_PRIOR */
	int preset;        /* of enum ctsr_preset, for CTSR_PRIOR; default CTSR_BALANCED */
	double factor[3];  /* times finer; 0: as in the metadata, else slices as in plane, else 2 */
	double spacing[3]; /* or voxel size of the result, mm; 0 (default): by the factor */
	/* How the scan was made; the default of each is unknown: what the metadata say, else sinc;
	 * noise is measured. A contradiction with the metadata is CTSR_USAGE. */
	double sigma[3]; /* in new voxels; NaN (default): unknown; x, NaN, NaN: axes refined */
	int decimate;    /* of enum ctsr_decimate; -1 (default): unknown */
	double noise;    /* HU; NaN (default): unknown */
	int estimate;    /* default 1: measure an unknown operator; 0: CTSR_USAGE to invert it */
	const char *prior_file; /* slice prior, safetensors; NULL (default): the installed one */
	double memory;    /* bytes that the call may use, input and result included; what needs more
			   * is refined in slabs: 0.1 HU RMS off, or noise/200. 0 (default): free */
	int iterations;   /* of CTSR_TV and CTSR_HTV, at most; default 300 */
	double tolerance; /* they stop when one moves less, HU RMS; default 0.1 */
	const ctsr_volume *start; /* begin with it, on the grid of the result; or NULL */
	double slice_thickness;   /* in place of both along the slice axis, mm; NaN (default) */
	const char *profile; /* of slices: a shape or file of ct-sr --profile; NULL (default) */
	double denoise; /* share of the noise to take off, 0 (default: the scan's own stays) to 1 */
	int trust;      /* 1: take the estimate as measured; default 0 */
	const char *units; /* of the values: auto, hu or other, as ct-sr --units; NULL: auto */
} ctsr_superres_options;

/* What was done. The caller sets size = sizeof, the library fills in as much as fits. */
typedef struct ctsr_superres_report {
	size_t size;
	int method;                 /* of the inversion or interpolation, of enum ctsr_method */
	int prior;                  /* 1: the prior added detail */
	double factor[3], sigma[3]; /* of the operator that was inverted, as in ctsr_operator */
	int decimate;
	double noise;
	double residual; /* RMS of the result, degraded again, minus the scan, HU; NaN: unknown */
	double added;    /* RMS of what the prior added, HU */
	size_t iterations, slabs; /* slabs: 1 as a whole */
	char why_not[160];        /* if the prior was asked for and added nothing: why */
	double off, back;         /* noise that was taken off, and that was kept, HU RMS */
} ctsr_superres_report;

CTSR_API void ctsr_superres_options_init(ctsr_superres_options *o, size_t size);
/* *out <- the CT on the finer grid over the same field of view. *error, unless error is NULL, <-
 * its predicted error: one standard deviation of each voxel, HU. report may be NULL. o NULL: all
 * defaults. CTSR_USAGE for options that contradict, are out of range or do nothing with the method;
 * CTSR_INPUT for a prior that is missing or broken and, unless units says what they are, values
 * that are not HU; CTSR_NUMBER for one that is not finite; CTSR_MEMORY also if the bound is too
 * small; CTSR_CANCELLED. Methods: ct-upsample(1). */
CTSR_API int ctsr_superres(ctsr_volume **out, ctsr_volume **error, ctsr_superres_report *report,
	const ctsr_volume *in, const ctsr_superres_options *o, const ctsr_context *c,
	ctsr_error *e);

/* With the defaults of ct-upsample(1): CTSR_AUTO, and nothing is measured. */
CTSR_API void ctsr_upsample_options_init(ctsr_superres_options *o, size_t size);
CTSR_API int ctsr_upsample(ctsr_volume **out, ctsr_volume **error, ctsr_superres_report *report,
	const ctsr_volume *in, const ctsr_superres_options *o, const ctsr_context *c,
	ctsr_error *e);

/* --------------------------------------------------------------------------------- projections */
/* X-ray projections with the geometry of every view: line integrals, density x mm, where density =
 * (HU - LO)/(HI - LO) of the metadata key "window" "LO:HI". */
typedef struct ctsr_projections ctsr_projections;

enum ctsr_beam { CTSR_CONE = 0, CTSR_PARALLEL = 1, CTSR_FAN = 2 };

/* Of small ones under it a large pixel is the central ray, the mean, or they cut at its Nyquist. */
enum ctsr_pixel { CTSR_PIXEL_POINT = 0, CTSR_PIXEL_MEAN = 1, CTSR_PIXEL_SINC = 2 };

/* Rays through boxes of constant density, exact, or through slices, linear. */
enum ctsr_integral { CTSR_SIDDON = 0, CTSR_JOSEPH = 1 };

/* A circle about world +z. View i is at start + i*arc/views degrees, at 0 the source at +x. */
typedef struct ctsr_geometry {
	size_t size;
	int beam; /* of enum ctsr_beam; default CTSR_CONE */
	size_t views, columns, rows;
	double arc, start;       /* degrees; default 180, 0 */
	double source_to_centre; /* mm */
	double source_to_detector;
	double pitch[2];   /* of pixels, mm; 0: they fill the detector of ct-project(1) */
	double offset[2];  /* of the detector's centre along columns and rows, mm */
	double centre[3];  /* isocentre, mm */
	double window[2];  /* HU of density 0, 1; default: as the metadata say, -1024, 3071 */
	int overshoot;     /* 1: do not clip what was clipped before it was reduced */
	size_t coarsen;    /* pixels so many times larger, and so many times fewer; default 1 */
	int pixel;         /* of enum ctsr_pixel, with coarsen; default CTSR_PIXEL_POINT */
	int method;        /* of enum ctsr_integral; default CTSR_SIDDON */
	double photons;    /* that are sent to a pixel, counted; 0 (default): no noise */
	double electronic; /* standard deviation of the electronics, in photons; default 0 */
	double water;      /* attenuation of water, 1/mm; default 0.02 */
} ctsr_geometry;

/* Pixel (row, column) lies at centre + (column - (columns-1)/2) u + (row - (rows-1)/2) v. */
typedef struct ctsr_view {
	double source[3], centre[3], u[3], v[3]; /* mm */
} ctsr_view;

/* Defaults for a volume: the published geometry, scaled to its size; 100 views. */
CTSR_API int ctsr_geometry_init(
	ctsr_geometry *g, size_t size, const ctsr_volume *around, ctsr_error *e);
/* Projections of any detector, all pixels zero. CTSR_GEOMETRY naming a view; CTSR_USAGE. */
CTSR_API int ctsr_projections_new(ctsr_projections **p, int beam, size_t views, size_t rows,
	size_t columns, const ctsr_view *view, ctsr_error *e);
CTSR_API void ctsr_projections_free(ctsr_projections *p);
/* OpenEXR, a part a view. CTSR_INPUT; CTSR_NUMBER of a write; CTSR_OUTPUT; CTSR_MEMORY. */
CTSR_API int ctsr_projections_read(ctsr_projections **p, const char *path, ctsr_error *e);
CTSR_API int ctsr_projections_write(
	const ctsr_projections *p, const char *path, const ctsr_context *c, ctsr_error *e);
/* Pixels [view][row][column], valid until p is freed; size (or NULL) <- views, rows, columns. */
CTSR_API float *ctsr_projections_data(const ctsr_projections *p, size_t size[3]);
/* Geometry of view i. CTSR_USAGE if there is none. */
CTSR_API int ctsr_projections_view(
	ctsr_view *view, const ctsr_projections *p, size_t i, ctsr_error *e);
/* *p <- line integrals of a volume in HU, or of density if its metadata say so. As ct-project(1).
 * CTSR_USAGE, also for a window other than the one that the metadata name; CTSR_INPUT for another
 * quantity and for values that cannot be HU; CTSR_GEOMETRY if the source is within the volume. */
CTSR_API int ctsr_project(ctsr_projections **p, const ctsr_volume *v, const ctsr_geometry *g,
	const ctsr_context *c, ctsr_error *e);
/* *v <- adjoint of ctsr_project on the grid of `like`, no window, for solvers of one's own. */
CTSR_API int ctsr_backproject(ctsr_volume **v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_context *c, ctsr_error *e);

typedef struct ctsr_reconstruct_options {
	size_t size;
	const char *method;       /* in a word of ct-fdk(1); NULL (default): auto, FDK or FBP */
	const char *filter;       /* in another, of these two; NULL (default): ram-lak */
	double cutoff;            /* of the filter, 0 to 1; 0 (default): what the voxels can show */
	int parker;               /* 1: rays that a short scan sees twice count once */
	size_t iterations;        /* of the others; 0 (default): 30 of cgls, 100 of sirt and tv */
	double tolerance;         /* they stop at this |A x - b| / |b|, 0 to 1; default 0 */
	int nonnegative, density; /* 1: no density below 0, not of cgls; 1: the result is not HU */
	int integral;             /* of enum ctsr_integral; default CTSR_SIDDON */
	double tv;                /* weight of the total variation, HU; default 10 */
	size_t voxels;    /* without `like`: along the longest side; 0 (default): as projected */
	double window[2]; /* HU of density 0 and 1; NaN (default): what the metadata say */
} ctsr_reconstruct_options;
CTSR_API void ctsr_reconstruct_options_init(ctsr_reconstruct_options *o, size_t size);
/* *v <- a volume, HU, on the grid of `like`, or with NULL on that of the projected volume, or the
 * cube that all views see. As ct-fdk(1). CTSR_USAGE for what contradicts the projections or does
 * nothing with the method; CTSR_INPUT for another quantity; CTSR_GEOMETRY for a grid beside the
 * scan, and a scan that cannot be inverted so; CTSR_NUMBER. */
CTSR_API int ctsr_reconstruct(ctsr_volume **v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_reconstruct_options *o, const ctsr_context *c, ctsr_error *e);
/* The same with all defaults: FDK for cones (Feldkamp et al. 1984), FBP for parallel rays. */
CTSR_API int ctsr_fdk(ctsr_volume **v, const ctsr_projections *p, const ctsr_volume *like,
	const ctsr_context *c, ctsr_error *e);

typedef struct ctsr_ddnm_options {
	size_t size;
	/* How the prior is drawn from, and held to the projections, in a word of ct-ddnm(1): ddnm,
	 * ddnm+, simple, ddim, ddpm, dpm-solver++, gdp, bird, once, none; NULL (default): ddnm+, or
	 * once. */
	const char *sampler;
	size_t factor; /* finer, 2 to 64; 0 (default): as the projections, else the network, say */
	const char *prior_file; /* or network; NULL (default): the installed one */
	size_t steps;   /* calls a chain; 0 (default): 50, GDP 1000, BIRD 10; 1 of a refined CT */
	size_t samples; /* mean of so many a view; 0 (default): 1, 4 of a refined CT */
	int label;      /* class to draw; -1 (default): the prior is not conditioned */
	int pixel;      /* CTSR_PIXEL_MEAN or _SINC; -1 (default): as they say, else means */
	double eta;     /* noise that is drawn anew, 0 to 1; NaN (default): as published */
	double sigma_y; /* noise where the largest pixel is 1; NaN (default): 0.0015 */
	double norm;    /* value that the network sees as 1; 0 (default): the largest */
	const ctsr_projections *init; /* begin with these, of the geometry of the result; or NULL */
	int start; /* timestep of 1000 to begin from; -1 (default): 60 of init, 5 of a refined CT */
	size_t travel[2];  /* after every [0] steps go back, [1] times in all; 0 (default): never */
	double guidance;   /* of gdp; default 2000 */
	size_t iterations; /* of bird: chains; default 100 */
	double rate;       /* of bird; default 0.001 */
	int frozen;        /* of bird, 1: not through the network; default 0 */
	int first_channel; /* of a prior with colours, 1: the first, 0 (default): their mean */
} ctsr_ddnm_options;

CTSR_API void ctsr_ddnm_options_init(ctsr_ddnm_options *o, size_t size);
/* *out <- the projections on a detector that is `factor` times finer, with the same area; those of
 * a refined CT, which are as fine, with the detail of the prior. It carries the deviation of the
 * samples, if there are 2, as *deviation is, unless deviation is NULL. Noise is of the seed. As
 * ct-ddnm(1), and the same pixels. o NULL: all defaults. CTSR_USAGE for options that contradict
 * each other, the projections or the prior; CTSR_INPUT for a prior that is missing or broken, and
 * for another quantity; CTSR_GEOMETRY for a fan; CTSR_NUMBER; CTSR_CANCELLED; CTSR_MEMORY. */
CTSR_API int ctsr_ddnm(ctsr_projections **out, ctsr_projections **deviation,
	const ctsr_projections *in, const ctsr_ddnm_options *o, const ctsr_context *c,
	ctsr_error *e);

/* ----------------------------------------------------------------------------------- Gaussians */
/* A sum of signed 3-D Gaussians: density(x) = sum of a exp(-|R'(x - position)/sigma|^2 / 2). */
typedef struct ctsr_gaussians ctsr_gaussians;

typedef struct ctsr_gaussian {
	double position[3], sigma[3]; /* mm; standard deviations along the axes of R */
	double rotation[4];           /* R as a unit quaternion w, x, y, z */
	double density;               /* a */
} ctsr_gaussian;

typedef struct ctsr_fit_options {
	size_t size;
	size_t gaussians;     /* to begin with; 0 (default): 50000 */
	size_t max_gaussians; /* 0 (default): 500000 */
	size_t iterations;    /* of one view each; 0 (default): 5000 */
	double tolerance; /* end at this part of the error without Gaussians; default 0: never */
	int full;         /* 1: fit the whole volume, densities >= 0 not enforced; default 0:
			   * what the projections have beyond those of the base */
	const ctsr_projections *base_projections; /* NULL (default): computed. Not with full */
	const ctsr_projections *uncertainty; /* deviation of each pixel; NULL: what they carry */
	const ctsr_volume *lr; /* low-resolution CT that the sum must reduce to; or NULL */
	int paper;             /* 1: the published settings; default 0 */
} ctsr_fit_options;

/* *g <- Gaussians fitted to projections on top of a base volume (HU, or density if its metadata say
 * so). Projections whose metadata key "overshoot" is there are fitted on a base that is not cut to
 * the window, too. As ct-nabgs(1), and the same Gaussians. o NULL: all defaults. CTSR_USAGE;
 * CTSR_INPUT for another quantity, and for windows that differ; CTSR_GEOMETRY for a base that lies
 * beside the scan, and a fan; CTSR_NUMBER if it diverges; CTSR_CANCELLED; CTSR_MEMORY. */
CTSR_API int ctsr_gaussians_fit(ctsr_gaussians **g, const ctsr_projections *p,
	const ctsr_volume *base, const ctsr_fit_options *o, const ctsr_context *c, ctsr_error *e);
CTSR_API void ctsr_gaussians_free(ctsr_gaussians *g);
/* PLY as viewers of 3-D Gaussian splatting read it. */
CTSR_API int ctsr_gaussians_read(ctsr_gaussians **g, const char *path, ctsr_error *e);
CTSR_API int ctsr_gaussians_write(
	const ctsr_gaussians *g, const char *path, const ctsr_context *c, ctsr_error *e);
/* How many. out[n] <- those from `first` on, or as many as there are; NULL is legal if n is 0. */
CTSR_API size_t ctsr_gaussians_get(
	ctsr_gaussian *out, const ctsr_gaussians *g, size_t first, size_t n);
/* *v <- their density on the grid of `like`. CTSR_GEOMETRY; CTSR_MEMORY; CTSR_CANCELLED. */
CTSR_API int ctsr_gaussians_voxelise(ctsr_volume **v, const ctsr_gaussians *g,
	const ctsr_volume *like, const ctsr_context *c, ctsr_error *e);
/* *p <- their projections in the views of `like`, density x mm. CTSR_GEOMETRY for a fan. */
CTSR_API int ctsr_gaussians_project(ctsr_projections **p, const ctsr_gaussians *g,
	const ctsr_projections *like, const ctsr_context *c, ctsr_error *e);

typedef struct ctsr_compose_options {
	size_t size;
	double gain;      /* of the residual, -1e3 to 1e3; default 1 */
	double floor;     /* least value of the result, HU; NaN (default): LO of the window */
	double spacing;   /* mm of the voxels; NaN (default): the grid of the base */
	double window[2]; /* HU of density 0 and 1; NaN (default): what the metadata say */
	const ctsr_volume *residual; /* voxels to add, HU, in place of Gaussians; default NULL */
	const ctsr_volume *lr;       /* CT that the result is made to agree with; or NULL */
} ctsr_compose_options;

CTSR_API void ctsr_compose_options_init(ctsr_compose_options *o, size_t size);
/* *out <- the CT, HU: the base (HU) in the window, and what Gaussians that were fitted on top of it
 * add. *added, unless added is NULL, <- that alone, HU, before gain and floor. As ct-compose(1),
 * and the same voxels. o NULL: all defaults. CTSR_USAGE; CTSR_INPUT for another quantity and for
 * values that cannot be HU; CTSR_GEOMETRY for a residual on another grid; CTSR_NUMBER;
 * CTSR_CANCELLED; CTSR_MEMORY. */
CTSR_API int ctsr_compose(ctsr_volume **out, ctsr_volume **added, const ctsr_volume *base,
	const ctsr_gaussians *g, const ctsr_compose_options *o, const ctsr_context *c,
	ctsr_error *e);

/* ----------------------------------------------------------------------------------- the paper */
typedef struct ctsr_paper_options {
	size_t size;
	size_t factor; /* of all axes, 2 to 16; 0 (default): what the metadata say, else 4 */
	size_t views, iterations, gaussians; /* 0 (default): as published */
	const char *prior_file;              /* of projections; NULL (default): the installed one */
	int release; /* 1: as its authors' programs; 0 (default): as the paper */
} ctsr_paper_options;
/* *out <- the CT by the published method, in HU of -512 to 3071: all its steps in one call. As
 * ct-sr --paper, and the same voxels. o NULL: all defaults. Codes of the steps. */
CTSR_API int ctsr_paper(ctsr_volume **out, const ctsr_volume *in, const ctsr_paper_options *o,
	const ctsr_context *c, ctsr_error *e);

/* ------------------------------------------------------------------------------------- metrics */
/* The caller sets size = sizeof, the library fills in as much as fits. */
typedef struct ctsr_metrics {
	size_t size;
	double psnr; /* dB, both clipped to the window; infinite if they are equal */
	double ssim; /* of slices, mean over three axes */
	double mae, rmse, bias, max; /* HU, not clipped: test - reference */
	double gradient[3];          /* HU/mm: error of steps between neighbours along each axis */
} ctsr_metrics;

typedef struct ctsr_consistency {
	size_t size;                /* as of ctsr_metrics */
	double max, p95, rms, mean; /* of D(fine) - coarse, HU */
} ctsr_consistency;

/* Compare a volume with a reference on the same grid, as ct-metrics(1). window: LO, HI in HU of
 * PSNR and SSIM; NULL: -512 to 3071. mask, or NULL: only where it is not 0. CTSR_INPUT for
 * quantities that differ, and without a window for values that cannot be HU; CTSR_GEOMETRY. */
CTSR_API int ctsr_compare(ctsr_metrics *m, const ctsr_volume *reference, const ctsr_volume *test,
	const ctsr_volume *mask, const double window[2], const ctsr_context *c, ctsr_error *e);
/* Compare projections with a reference of the same geometry: errors in density mm, not clipped,
 * SSIM (Wang et al. 2004) the mean of views, no gradient. range: of the data; 0: the largest pixel
 * of the reference. psnr[views], ssim[views], or NULL <- of each view. CTSR_USAGE; CTSR_INPUT for
 * quantities that differ; CTSR_GEOMETRY; CTSR_NUMBER. */
CTSR_API int ctsr_compare_projections(ctsr_metrics *m, double *psnr, double *ssim,
	const ctsr_projections *reference, const ctsr_projections *test, double range,
	const ctsr_context *c, ctsr_error *e);
/* How far a fine volume, degraded again, is from the coarse one. o NULL: the operator that the
 * metadata of `coarse` name, else that which ctsr_superres recorded in `fine`. CTSR_INPUT if there
 * is none; CTSR_GEOMETRY; CTSR_NUMBER. */
CTSR_API int ctsr_check_consistency(ctsr_consistency *m, const ctsr_volume *fine,
	const ctsr_volume *coarse, const ctsr_operator *o, const ctsr_context *c, ctsr_error *e);

#ifdef __cplusplus
}
#endif
#endif
