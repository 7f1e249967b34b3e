# SPDX-License-Identifier: Apache-2.0
# One file a command, src/tools/ct-NAME.c; each has a man page, man/ct-NAME.1.in.
# bin_PROGRAMS += ct-NAME
# ct_NAME_SOURCES = src/tools/ct-NAME.c
bin_PROGRAMS += ct-degrade
ct_degrade_SOURCES = src/tools/ct-degrade.c
bin_PROGRAMS += ct-upsample
ct_upsample_SOURCES = src/tools/ct-upsample.c src/tools/lib/libraries.cc
ct_upsample_LDADD = $(DICOM_LDADD)
bin_PROGRAMS += ct-metrics
ct_metrics_SOURCES = src/tools/ct-metrics.c
# What reads and writes CTs for the commands that take DICOM, and the module that does so for DICOM itself
# (src/dicom/module.h).
noinst_LIBRARIES += libctdicom.a
libctdicom_a_SOURCES = src/tools/convert-io.c \
	src/tools/convert.h src/dicom/form.c src/dicom/form.h src/dicom/sidecar.c src/dicom/sidecar.h src/dicom/open.c \
	src/dicom/module.h src/dicom/dicom.h src/tools/scan-read.c src/tools/scan-read.h
DICOM_SOURCES = src/dicom/module.c src/dicom/write.c src/dicom/series-set.c \
	src/dicom/account.c src/dicom/series-set.h src/dicom/inspect.c src/dicom/image.c src/dicom/image.h \
	src/dicom/policy.c src/dicom/derive.c src/dicom/radiograph.c
DICOM_LDADD = libctdicom.a libct.a $(CT_LIBS)
if HAVE_VTK
pkglibexec_PROGRAMS += ctsr-dicom.so
ctsr_dicom_so_SOURCES = $(DICOM_SOURCES) src/tools/lib/libraries.cc
ctsr_dicom_so_CPPFLAGS = $(AM_CPPFLAGS) -DCT_MODULE
ctsr_dicom_so_LDFLAGS = -shared $(AM_LDFLAGS)
ctsr_dicom_so_LDADD = libctdicom.a libctshim.a libct.a $(VTK_LIBS) $(CT_LIBS)
else
EXTRA_DIST += $(DICOM_SOURCES)
endif
bin_PROGRAMS += ct-convert
ct_convert_SOURCES = src/tools/ct-convert.c src/tools/convert-radiograph.c src/tools/convert-scan.c \
	src/tools/scan-source.c src/tools/scan-source.h src/tools/convert.h
ct_convert_LDADD = $(DICOM_LDADD)
if HAVE_OIIO
# Started by the commands, so that only who reads pictures waits for their libraries, or installs them.
pkglibexec_PROGRAMS += ct-picture
ct_picture_SOURCES = src/tools/picture.c src/tools/lib/libraries.cc
ct_picture_LDADD = libctshim.a libct.a $(OIIO_LIBS) $(CT_LIBS)
else
EXTRA_DIST += src/tools/picture.c
endif
if HAVE_HDF5
# The same for files of MATLAB and HDF5.
pkglibexec_PROGRAMS += ct-arrays
ct_arrays_SOURCES = src/tools/array-reader.c src/shim/arrays-file.c
ct_arrays_CPPFLAGS = $(AM_CPPFLAGS) $(HDF5_CFLAGS)
ct_arrays_LDADD = libct.a $(HDF5_LIBS) $(CT_LIBS)
else
EXTRA_DIST += src/tools/array-reader.c src/shim/arrays-file.c
endif
bin_PROGRAMS += ct-train
ct_train_SOURCES = src/tools/ct-train.c src/tools/train-loop.h src/tools/train-loop.c src/tools/lib/libraries.cc $(TRAIN_SOURCES)
bin_PROGRAMS += ct-project
ct_project_SOURCES = src/tools/ct-project.c
bin_PROGRAMS += ct-phantom
ct_phantom_SOURCES = src/tools/ct-phantom.c
bin_PROGRAMS += ct-ddnm
ct_ddnm_SOURCES = src/tools/ct-ddnm.c src/tools/ddnm-parts.h src/tools/ddnm-state.c \
	src/tools/ddnm-input.c src/tools/lib/libraries.cc
ct_ddnm_LDADD = $(LDADD) $(PNG_LIBS)
bin_PROGRAMS += ct-sr
ct_sr_SOURCES = src/tools/ct-sr.c src/tools/sr-paper.c src/tools/sr-ahead.c src/tools/sr-keep.c src/tools/sr-result.c src/tools/sr-words.c src/tools/sr.h \
	src/tools/ddnm-state.c src/tools/ddnm-parts.h $(PAGE_SOURCES) src/tools/lib/libraries.cc
ct_sr_LDADD = $(DICOM_LDADD)
bin_PROGRAMS += ct-profile
ct_profile_SOURCES = src/tools/ct-profile.c
ct_profile_LDADD = $(DICOM_LDADD)
bin_PROGRAMS += ct-info
ct_info_SOURCES = src/tools/ct-info.c
ct_info_LDADD = $(DICOM_LDADD)
bin_PROGRAMS += ct-view
ct_view_SOURCES = src/tools/ct-view.c
ct_view_LDADD = $(LDADD) $(PNG_LIBS)
bin_PROGRAMS += ct-nabgs
ct_nabgs_SOURCES = src/tools/ct-nabgs.c
bin_PROGRAMS += ct-field
ct_field_SOURCES = src/tools/ct-field.c
bin_PROGRAMS += ct-fuse
ct_fuse_SOURCES = src/tools/ct-fuse.c
bin_PROGRAMS += ct-compose
ct_compose_SOURCES = src/tools/ct-compose.c
PAGE_SOURCES = src/tools/page-file.c src/tools/page-file.h
bin_PROGRAMS += ct-report
ct_report_SOURCES = src/tools/ct-report.c $(PAGE_SOURCES)
# The shipped priors, with their cards; their copies beside the programs serve a build folder.
pkgdata_DATA += src/prior/prior.safetensors src/prior/slices.safetensors src/prior/README.md
EXTRA_DIST += src/prior/prior.safetensors src/prior/slices.safetensors src/prior/arssr.safetensors \
	src/prior/make-prior.sh src/prior/make-superres.sh src/prior/make-slices.sh src/prior/README.md
# Small networks of super-resolution, which are not installed.
EXTRA_DIST += src/prior/rdn-4.safetensors src/prior/omni-4.safetensors src/prior/rdn-8.safetensors src/prior/omni-8.safetensors
noinst_DATA += prior.safetensors slices.safetensors
CLEANFILES += prior.safetensors slices.safetensors
prior.safetensors: src/prior/prior.safetensors
	$(AM_V_GEN)rm -f $@ && cp $(srcdir)/src/prior/prior.safetensors $@
slices.safetensors: src/prior/slices.safetensors
	$(AM_V_GEN)rm -f $@ && cp $(srcdir)/src/prior/slices.safetensors $@
bin_PROGRAMS += ct-fdk
ct_fdk_SOURCES = src/tools/ct-fdk.c

# src/core
libct_a_SOURCES += src/core/clock.c src/core/clock.h
libct_a_SOURCES += src/core/err.c src/core/err.h
libct_a_SOURCES += src/core/inflate.c src/core/inflate.h
libct_a_SOURCES += src/core/installed.c src/core/installed.h
libct_a_SOURCES += src/core/mem.c src/core/mem.h
libct_a_SOURCES += src/core/meta.c src/core/meta.h
libct_a_SOURCES += src/core/acquired.c src/core/acquired.h
libct_a_SOURCES += src/core/env.c src/core/env.h src/core/linear.h
libct_a_SOURCES += src/core/simd.c src/core/simd.h src/core/vec.h src/core/vec-exp.h src/core/vec-i16.h
libct_a_SOURCES += src/core/par.c src/core/par.h
libct_a_SOURCES += src/core/rng.c src/core/rng.h
libct_a_SOURCES += src/core/vol.c src/core/vol.h
libct_a_SOURCES += src/core/stack.c src/core/stack.h
libct_a_SOURCES += src/core/activation.c src/core/activation.h
libct_a_SOURCES += src/core/gauss.c src/core/gauss.h src/core/gauss-scene.c src/core/gauss-scene.h
libct_a_SOURCES += src/core/tensors.c src/core/tensors.h
libct_a_SOURCES += src/core/number.c src/core/number.h
libct_a_SOURCES += src/core/words.c src/core/words.h
libct_a_SOURCES += src/core/memory.c src/core/memory.h
libct_a_SOURCES += src/core/stream.c src/core/stream.h
libct_a_SOURCES += src/core/vec3.h src/core/order.h
libct_a_SOURCES += src/core/fourier.c src/core/fourier.h
SIMD_SOURCES += src/core/fourier-kernels.c

# src/cli
libct_a_SOURCES += src/cli/cli.c src/cli/cli.h src/cli/command.h
libct_a_SOURCES += src/cli/table.c src/cli/table.h src/cli/help.c
libct_a_SOURCES += src/cli/json.c src/cli/json.h src/cli/describe.c
libct_a_SOURCES += src/cli/complete.c
libct_a_SOURCES += src/cli/files.c src/cli/files.h
libct_a_SOURCES += src/cli/resume.c src/cli/resume.h
libct_a_SOURCES += src/cli/keep.c src/cli/keep.h
libct_a_SOURCES += src/cli/modes.c src/cli/modes.h
libct_a_SOURCES += src/cli/progress.c src/cli/progress.h
libct_a_SOURCES += src/cli/stop.c src/cli/stop.h
libct_a_SOURCES += src/cli/kept.c src/cli/kept.h
libct_a_SOURCES += src/cli/cost-report.c src/cli/cost-report.h

# src/solve
# Solvers of any linear operator (core/linear.h), and their passes over vectors.
libct_a_SOURCES += src/solve/passes.c src/solve/passes.h
libct_a_SOURCES += src/solve/fista.c src/solve/fista.h
libct_a_SOURCES += src/solve/trend.c src/solve/trend.h
SIMD_SOURCES += src/solve/adam.c src/solve/adam.h
libct_a_SOURCES += src/solve/trainer.c src/solve/trainer.h
SIMD_SOURCES += src/solve/vector.c src/solve/vector.h
libct_a_SOURCES += src/solve/jacobi.c src/solve/jacobi.h

# src/xray
# Rays through a volume: scans, projectors, phantoms, photons.
libct_a_SOURCES += src/xray/geometry.c src/xray/geometry.h
libct_a_SOURCES += src/xray/window.c src/xray/window.h
libct_a_SOURCES += src/xray/project.c src/xray/project.h
libct_a_SOURCES += src/xray/ray.c src/xray/ray.h
SIMD_SOURCES += src/xray/voxel-integral-siddon.c src/xray/voxel-integral-joseph.c
libct_a_SOURCES += src/xray/columns.c src/xray/columns.h
SIMD_SOURCES += src/xray/packet.c src/xray/packet.h
libct_a_SOURCES += src/xray/photons.c src/xray/photons.h
libct_a_SOURCES += src/xray/counts.c src/xray/counts.h
libct_a_SOURCES += src/xray/phantom.c src/xray/phantom-sets.c src/xray/phantom.h

# src/operator
# The operator D that makes a low-resolution CT: along an axis, and of three; its SVD; grids, frames, padding.
libct_a_SOURCES += src/operator/separable.c src/operator/separable.h
SIMD_SOURCES += src/operator/separable-rows.c
libct_a_SOURCES += src/operator/resample.c src/operator/resample.h
libct_a_SOURCES += src/operator/degrade.c src/operator/degrade.h
libct_a_SOURCES += src/operator/slice-profile.c src/operator/slice-profile.h
libct_a_SOURCES += src/operator/regrid.c src/operator/regrid.h
libct_a_SOURCES += src/operator/crop.c src/operator/crop.h
libct_a_SOURCES += src/operator/svd.c src/operator/svd.h
SIMD_SOURCES += src/operator/cosine-strip.c src/operator/turn.h
libct_a_SOURCES += src/operator/cosine.c src/operator/cosine.h
SIMD_SOURCES += src/operator/banded-strip.c
libct_a_SOURCES += src/operator/banded.c src/operator/banded.h
libct_a_SOURCES += src/operator/mirror.c src/operator/mirror.h
libct_a_SOURCES += src/operator/padding.c src/operator/padding.h

# src/inverse
# The inverse of D: data consistency, total variation, how many iterations.
libct_a_SOURCES += src/inverse/consistency.c src/inverse/consistency-planes.c src/inverse/consistency.h
libct_a_SOURCES += src/inverse/tv.c src/inverse/tv.h
SIMD_SOURCES += src/inverse/tv-row.c src/inverse/tv-row.h
libct_a_SOURCES += src/inverse/hessian-tv.c
SIMD_SOURCES += src/inverse/hessian-row.c src/inverse/hessian-row.h
libct_a_SOURCES += src/inverse/upsample.c src/inverse/upsample.h
libct_a_SOURCES += src/inverse/pilot.c src/inverse/pilot.h
libct_a_SOURCES += src/inverse/inversion.c src/inverse/inversion.h
libct_a_SOURCES += src/inverse/trial.c src/inverse/trial.h
libct_a_SOURCES += src/inverse/flat.c src/inverse/flat.h

# src/estimate
# What a scan does not say: its blur, its noise, its slices, what a scanner does; and the error to expect.
libct_a_SOURCES += src/estimate/frame.c src/estimate/frame.h
libct_a_SOURCES += src/estimate/operator.c src/estimate/operator.h
libct_a_SOURCES += src/estimate/assumed.c src/estimate/assumed.h
libct_a_SOURCES += src/estimate/scanner.c src/estimate/scanner.h
libct_a_SOURCES += src/estimate/soft.c src/estimate/soft.h
libct_a_SOURCES += src/estimate/slice-pair.c src/estimate/slice-pair.h
libct_a_SOURCES += src/estimate/slice-fit.c src/estimate/slice-fit.h
libct_a_SOURCES += src/estimate/edge-lines.c src/estimate/edge-lines.h
libct_a_SOURCES += src/estimate/profile.c src/estimate/profile.h
EXTRA_DIST += src/estimate/profile-network.bin
BUILT_SOURCES += src/estimate/profile-network.inc
CLEANFILES += src/estimate/profile-network.inc
src/estimate/profile-network.inc: src/estimate/profile-network.bin
	$(AM_V_GEN)$(MKDIR_P) $(@D) && od -An -v -t u1 $(srcdir)/src/estimate/profile-network.bin | \
		sed 's/ *\([0-9][0-9]*\)/\1,/g' >$@
libct_a_SOURCES += src/estimate/expected.c src/estimate/expected.h
libct_a_SOURCES += src/estimate/noise.c src/estimate/noise.h

# src/recon
# Projections to volumes: FDK, iterative solvers, the joint voxel solver.
libct_a_SOURCES += src/recon/joint.c src/recon/joint.h
libct_a_SOURCES += src/recon/fuse.c src/recon/fuse-state.c src/recon/fuse.h
libct_a_SOURCES += src/recon/ramp.c src/recon/ramp.h
SIMD_SOURCES += src/recon/ramp-row.c
libct_a_SOURCES += src/recon/backproject.c src/recon/backproject.h
SIMD_SOURCES += src/recon/backproject-line.c
SIMD_SOURCES += src/recon/backproject-row.c
libct_a_SOURCES += src/recon/fdk-weights.c src/recon/fdk-weights.h
libct_a_SOURCES += src/recon/upright.c src/recon/upright.h src/recon/centre.c src/recon/centre.h \
	src/recon/water.c src/recon/water.h
libct_a_SOURCES += src/recon/fdk.c src/recon/fdk.h
libct_a_SOURCES += src/recon/iterative.c src/recon/iterative.h
libct_a_SOURCES += src/recon/rof.c src/recon/rof.h
SIMD_SOURCES += src/recon/rof-row.c
libct_a_SOURCES += src/recon/scan-grid.c src/recon/scan-grid.h src/recon/reconstruct.c src/recon/reconstruct.h

# src/quality
# What is measured: PSNR, SSIM, differences, edges, harm, the data residual.
libct_a_SOURCES += src/quality/ssim.c src/quality/ssim.h src/quality/ms-ssim.c src/quality/ms-ssim.h
SIMD_SOURCES += src/quality/ssim-tile.c src/quality/ssim-block.c src/quality/ssim-block-real.h src/quality/ssim-kernels.h
libct_a_SOURCES += src/quality/difference.c src/quality/difference.h
libct_a_SOURCES += src/quality/data-residual.c src/quality/data-residual.h
libct_a_SOURCES += src/quality/edges.c src/quality/edges.h
libct_a_SOURCES += src/quality/metrics.c src/quality/metrics.h
libct_a_SOURCES += src/quality/calibration.c src/quality/calibration.h
libct_a_SOURCES += src/quality/structures.c src/quality/structures.h
libct_a_SOURCES += src/quality/isosurface.c src/quality/isosurface.h src/quality/surface-error.c src/quality/surface-error.h
libct_a_SOURCES += src/quality/fsc.c src/quality/fsc.h
libct_a_SOURCES += src/quality/hfen.c src/quality/hfen.h
libct_a_SOURCES += src/quality/tissue.c src/quality/tissue.h
libct_a_SOURCES += src/quality/banding.c src/quality/banding.h
libct_a_SOURCES += src/quality/compare.c src/quality/compare.h

# src/nn
# The networks: layers over oneDNN, its graph and plan.
libct_a_SOURCES += src/nn/dnn.c src/nn/dnn.h src/nn/dnn-impl.h
libct_a_SOURCES += src/nn/conv.c src/nn/conv.h
libct_a_SOURCES += src/nn/product.c src/nn/product.h
libct_a_SOURCES += src/nn/dense.c src/nn/dense.h
SIMD_SOURCES += src/nn/dense-kernels.c src/nn/dense-kernels.h
SIMD_SOURCES += src/nn/layers.c src/nn/layers.h
SIMD_SOURCES += src/nn/norm.c src/nn/norm.h
SIMD_SOURCES += src/nn/pointwise.c src/nn/pointwise.h
SIMD_SOURCES += src/nn/spatial.c src/nn/spatial.h
libct_a_SOURCES += src/nn/window-attention.c src/nn/window-attention.h
libct_a_SOURCES += src/nn/attention.c src/nn/attention.h
libct_a_SOURCES += src/nn/arch.c src/nn/arch.h
libct_a_SOURCES += src/nn/graph.c src/nn/graph.h src/nn/build.c src/nn/build.h
libct_a_SOURCES += src/nn/rdn.c src/nn/rdn.h src/nn/omni.c src/nn/omni.h
libct_a_SOURCES += src/nn/arena.c src/nn/arena.h
libct_a_SOURCES += src/nn/unet.c src/nn/unet.h
libct_a_SOURCES += src/nn/plan.c src/nn/plan-run.c src/nn/plan-impl.h

# src/diffusion
# The diffusion prior: schedules, measurement operators, samplers, training.
libct_a_SOURCES += src/diffusion/measurement.c src/diffusion/measurement.h
libct_a_SOURCES += src/diffusion/schedule.c src/diffusion/schedule.h
libct_a_SOURCES += src/diffusion/sampler.h src/diffusion/draw.c src/diffusion/draw.h
libct_a_SOURCES += src/diffusion/ddnm.c src/diffusion/ddim.c src/diffusion/bird.c
libct_a_SOURCES += src/diffusion/patches.c src/diffusion/patches.h
libct_a_SOURCES += src/diffusion/train.c src/diffusion/train.h
libct_a_SOURCES += src/diffusion/sample-views.c src/diffusion/sample-views.h
libct_a_SOURCES += src/diffusion/prior.c src/diffusion/prior.h

# src/restore
# The slice prior: what a volume lacks, learned and predicted on its slices.
libct_a_SOURCES += src/restore/patch.c src/restore/patch.h
libct_a_SOURCES += src/restore/slice-network.c src/restore/slice-network.h
libct_a_SOURCES += src/restore/learn.c src/restore/learn-begin.c src/restore/learn.h
libct_a_SOURCES += src/restore/example.c src/restore/example.h
libct_a_SOURCES += src/restore/predict.c src/restore/predict.h
libct_a_SOURCES += src/restore/volume-network.c src/restore/volume-network.h
libct_a_SOURCES += src/restore/block-weights.c src/restore/block-weights.h
libct_a_SOURCES += src/restore/steps.c src/restore/steps.h
libct_a_SOURCES += src/restore/slice-prior.c src/restore/restore.c src/restore/confidence.c src/restore/restore.h

# src/arssr
# ArSSR: volumes on any finer grid, by a network of the whole volume.
libct_a_SOURCES += src/arssr/arssr.c src/arssr/arssr.h
libct_a_SOURCES += src/arssr/encoder.c src/arssr/encoder.h
libct_a_SOURCES += src/arssr/decoder.c src/arssr/decoder.h
libct_a_SOURCES += src/arssr/arssr-train.c src/arssr/arssr-train.h
libct_a_SOURCES += src/arssr/arssr-volume.c src/arssr/arssr-volume.h
SIMD_SOURCES += src/arssr/arssr-kernels.c src/arssr/arssr-kernels.h

# src/refine
# A CT on a finer grid: what is known of it, which method, how much memory, what it costs; and the call.
libct_a_SOURCES += src/refine/rest.c src/refine/rest.h
libct_a_SOURCES += src/refine/damp.c src/refine/damp.h
libct_a_SOURCES += src/refine/slabs.c src/refine/slabs.h
libct_a_SOURCES += src/refine/rehearsal.c src/refine/rehearsal.h
libct_a_SOURCES += src/refine/refine.c src/refine/choose.c src/refine/run.c src/refine/refine-cost.c src/refine/refine-say.c src/refine/refine.h

# src/series
# Slices of DICOM series: files, groups, order, grids; no DICOM in here.
libct_a_SOURCES += src/series/slice.c src/series/slice.h
libct_a_SOURCES += src/series/header.c src/series/header.h
libct_a_SOURCES += src/series/series.c src/series/series.h
libct_a_SOURCES += src/series/layout.c src/series/layout.h src/series/slice-order.c
libct_a_SOURCES += src/series/scales.c src/series/scales.h
libct_a_SOURCES += src/series/gaps.c src/series/moments.c src/series/moments.h

# src/picture
# Pictures of volumes: slices, projections, colours, letters.
libct_a_SOURCES += src/picture/montage.c src/picture/montage.h
libct_a_SOURCES += src/picture/canvas.c src/picture/canvas.h

# src/report
# What a person reads of files: the page of ct-report, what a file holds, sheets of slices.
libct_a_SOURCES += src/report/page.c src/report/page.h src/report/page-cards.c src/report/page-measure.c
libct_a_SOURCES += src/report/page-pictures.c
libct_a_SOURCES += src/report/report.c src/report/report.h src/report/survey.c
libct_a_SOURCES += src/report/sheet.c src/report/sheet.h src/report/labels.c
pkgdata_DATA += src/report/report.html
EXTRA_DIST += src/report/report.html
noinst_DATA += report.html
CLEANFILES += report.html
report.html: src/report/report.html
	$(AM_V_GEN)rm -f $@ && cp $(srcdir)/src/report/report.html $@

# src/train
# What ct-train learns from, and its networks in training; of ct-train alone, as it needs readers of pictures.
TRAIN_SOURCES = src/train/subject.h src/train/data.c src/train/data.h \
	src/train/pictures.c src/train/slices.c \
	src/train/volumes.c

# src/steps
# The steps of the paper, each once, in memory: what the commands and the library run. They read and write no file.
libct_a_SOURCES += src/steps/window-rule.c src/steps/window-rule.h
libct_a_SOURCES += src/steps/evidence.c src/steps/evidence.h
libct_a_SOURCES += src/steps/step-fit.c src/steps/step-fit.h
libct_a_SOURCES += src/steps/step-compose.c src/steps/step-compose.h
libct_a_SOURCES += src/steps/step-project.c src/steps/step-project.h
libct_a_SOURCES += src/steps/step-ddnm.c src/steps/step-ddnm.h
libct_a_SOURCES += src/steps/step-compare.c src/steps/step-compare.h
libct_a_SOURCES += src/steps/step-degrade.c src/steps/step-degrade.h
libct_a_SOURCES += src/steps/step-reconstruct.c src/steps/step-reconstruct.h
libct_a_SOURCES += src/steps/step-fuse.c src/steps/step-fuse.h
libct_a_SOURCES += src/steps/step-field.c src/steps/step-field.h
libct_a_SOURCES += src/steps/step-paper.c src/steps/step-paper.h

# src/tools/lib
# What commands share: the options of a scan and scanner files, and what corrects a base volume.
libct_a_SOURCES += src/tools/lib/geometry-opts.c src/tools/lib/geometry-opts.h
libct_a_SOURCES += src/tools/lib/geometry-json.c src/tools/lib/geometry-json.h
libct_a_SOURCES += src/tools/lib/evidence-files.c src/tools/lib/evidence-files.h
libct_a_SOURCES += src/tools/lib/said.c src/tools/lib/said.h
libct_a_SOURCES += src/tools/lib/ahead.c src/tools/lib/ahead.h
libct_a_SOURCES += src/tools/lib/prior-opts.c src/tools/lib/prior-opts.h

# src/gs
# The fit of signed 3-D Gaussians.
libct_a_SOURCES += src/gs/fit-rule.c src/gs/fit.c src/gs/fit.h
libct_a_SOURCES += src/gs/fit-state.c src/gs/fit-cost.c
libct_a_SOURCES += src/gs/place.c src/gs/place.h
libct_a_SOURCES += src/gs/densify.c src/gs/densify.h
# A Gaussian, and its gradient.
libct_a_SOURCES += src/gs/gaussian.c src/gs/gaussian.h src/gs/gaussian-formulas.h
SIMD_SOURCES += src/gs/gaussian-kernels.c
# Projections and volumes of them.
libct_a_SOURCES += src/gs/gaussian-integral.h
libct_a_SOURCES += src/gs/splat.c src/gs/splat.h
SIMD_SOURCES += src/gs/rasterise.c src/gs/rasterise.h
libct_a_SOURCES += src/gs/mixture.c src/gs/mixture.h
# The loss.
libct_a_SOURCES += src/gs/loss.c src/gs/loss-tv.c src/gs/loss.h
libct_a_SOURCES += src/gs/loss-total.c src/gs/loss-total.h
libct_a_SOURCES += src/gs/loss-lowres.c src/gs/loss-lowres.h
SIMD_SOURCES += src/gs/loss-row.c
# The optimiser.
libct_a_SOURCES += src/gs/gaussian-adam.c src/gs/gaussian-adam.h

# src/field
# Neural fields, for comparison: encodings, networks, samples, their fit.
libct_a_SOURCES += src/field/encoding.c src/field/encoding.h
SIMD_SOURCES += src/field/encoding-level.c
libct_a_SOURCES += src/field/ray-attention.c src/field/ray-attention.h
SIMD_SOURCES += src/field/ray-attention-kernels.c
libct_a_SOURCES += src/field/network.c src/field/network.h
libct_a_SOURCES += src/field/field.c src/field/field.h
# Their fit: which points a measurement has, how they become a value, and the steps.
libct_a_SOURCES += src/field/samples.c src/field/samples.h src/field/render.c src/field/render.h
libct_a_SOURCES += src/field/block.c src/field/block.h
libct_a_SOURCES += src/field/field-fit.c src/field/field-fit.h src/field/field-fit-rule.c src/field/field-fit-state.c src/field/field-fit-volume.c
libct_a_SOURCES += src/field/field-fit-step.c src/field/field-fit-step.h src/field/field-fit-items.c

# src/ctsr
# The library that is installed: ctsr.h, libctsr.so, libctsr.a, ctsr.pc. The commands link libct.a, which
# holds the same objects and the command line's.
CTSR_SOVERSION = 0
LDCONFIG = PATH=$$PATH:/sbin:/usr/sbin ldconfig
CTSR_SONAME = libctsr.so.$(CTSR_SOVERSION)
CTSR_SHARED = $(CTSR_SONAME).1.0
lib_LIBRARIES = libctsr.a
include_HEADERS = src/ctsr/ctsr.h
libctsr_a_SOURCES = src/ctsr/ctsr-call.c src/ctsr/ctsr-impl.h src/ctsr/ctsr-volume.c src/ctsr/ctsr-file.c \
	src/ctsr/ctsr-formats.c src/ctsr/ctsr-nifti.c src/ctsr/ctsr-nrrd.c src/ctsr/ctsr-metaimage.c \
	src/ctsr/ctsr-operator.c src/ctsr/ctsr-superres.c src/ctsr/ctsr-projections.c src/ctsr/ctsr-gaussians.c src/ctsr/ctsr-compose.c src/ctsr/ctsr-ddnm.c \
	src/ctsr/ctsr-metrics.c src/ctsr/ctsr-reconstruct.c src/ctsr/ctsr-paper.c
CTSR_INTERNAL = $(filter-out src/cli/% src/report/% src/shim/% src/tools/%,$(libct_a_OBJECTS)) $(libct_a_LIBADD)
libctsr_a_LIBADD = $(CTSR_INTERNAL)
libctsr_a_DEPENDENCIES = $(CTSR_INTERNAL)
# The sanitizers' functions come from the program that is linked with it.
if SANITIZE
CTSR_DEFS =
else
CTSR_DEFS = -Wl,-z,defs
endif
$(CTSR_SHARED): libctsr.a $(libctsr_a_OBJECTS) src/ctsr/ctsr.symbols
	$(AM_V_CCLD)$(CC) $(AM_CFLAGS) $(CFLAGS) -shared -Wl,-soname,$(CTSR_SONAME) $(CTSR_DEFS) \
		$(AM_LDFLAGS) $(LDFLAGS) -o $@ $(libctsr_a_OBJECTS) libctsr.a $(CT_LIBS) $(LIBS)
$(CTSR_SONAME): $(CTSR_SHARED)
	$(AM_V_GEN)ln -sf $(CTSR_SHARED) $@
noinst_DATA += $(CTSR_SHARED) $(CTSR_SONAME)
CLEANFILES += $(CTSR_SHARED) $(CTSR_SONAME)
EXTRA_DIST += src/ctsr/ctsr.symbols
pkgconfigdir = $(libdir)/pkgconfig
pkgconfig_DATA = src/ctsr/ctsr.pc
install-shared: $(CTSR_SHARED)
	$(MKDIR_P) '$(DESTDIR)$(libdir)'
	$(INSTALL_DATA) $(CTSR_SHARED) '$(DESTDIR)$(libdir)'
	cd '$(DESTDIR)$(libdir)' && ln -sf $(CTSR_SHARED) $(CTSR_SONAME) && ln -sf $(CTSR_SONAME) libctsr.so
# The loader finds the library by its cache, which root alone can make, and no package's build should.
	@test -n '$(DESTDIR)' || test "$$(id -u)" != 0 || { echo ' LDCONFIG' '$(libdir)'; $(LDCONFIG) || :; }
install-library: install-shared install-libLIBRARIES install-includeHEADERS install-pkgconfigDATA
install-exec-local: install-shared
uninstall-local:
	cd '$(DESTDIR)$(libdir)' && rm -f $(CTSR_SHARED) $(CTSR_SONAME) libctsr.so
.PHONY: install-shared install-library

# src/shim
# The only C++: each library behind a small C header. A tool that uses one is linked as C++:
#   ct_x_LDADD = libctshim.a libct.a $(OIIO_LIBS) $(VTK_LIBS) $(CT_LIBS)
#   ct_x_SOURCES += src/tools/lib/libraries.cc
noinst_LIBRARIES += libctshim.a
libctshim_a_SOURCES = src/shim/guard.h
libctshim_a_CPPFLAGS = $(AM_CPPFLAGS) $(OIIO_CFLAGS) $(VTK_CPPFLAGS)
SHIM_OIIO = src/shim/picture-file.h src/shim/picture-file.cc
SHIM_VTK = src/shim/dicom-file.h src/shim/dicom-file.cc src/shim/dicom-scan.cc src/shim/dicom-tags.h src/shim/dicom-tags.cc \
	src/shim/held.h src/shim/held.cc src/shim/dicom-write.cc src/shim/fragments.h \
	src/shim/fragments.cc src/shim/apart.h src/shim/apart.cc src/shim/pixels.h src/shim/pixels.cc \
	src/shim/outline.h src/shim/outline.cc src/shim/pixel-tags.cc
EXTRA_DIST += $(SHIM_OIIO) $(SHIM_VTK)
if HAVE_OIIO
libctshim_a_SOURCES += $(SHIM_OIIO)
endif
if HAVE_VTK
libctshim_a_SOURCES += $(SHIM_VTK)
endif
# Pictures, and files of MATLAB and HDF5, without their libraries: by the programs that link them.
libct_a_SOURCES += src/shim/reader.c src/shim/reader.h
libct_a_SOURCES += src/shim/image-read.c src/shim/image-read.h
libct_a_SOURCES += src/shim/arrays.c src/shim/arrays.h
