# SPDX-License-Identifier: Apache-2.0
# Plain C and shell tests that print TAP.
TEST_EXTENSIONS = .sh
LOG_DRIVER = env AM_TAP_AWK='$(AWK)' $(SHELL) $(top_srcdir)/build-aux/tap-driver.sh
SH_LOG_DRIVER = $(LOG_DRIVER)
SH_LOG_COMPILER = /bin/sh
AM_TESTS_ENVIRONMENT = LC_ALL=C; PATH='$(abs_top_builddir)':$$PATH; srcdir='$(abs_top_srcdir)'; builddir='$(abs_top_builddir)'; \
	CT_TOOLS='$(bin_PROGRAMS)'; unset CT_THREADS OMP_NUM_THREADS; \
	export LC_ALL PATH srcdir builddir CT_TOOLS;
TESTS = $(check_PROGRAMS) $(dist_check_SCRIPTS)
# What takes long, and is no part of make check: see tests/long/all.sh and scripts/fuzz.sh. To choose:
#   make check-long PARTS='kill=1000 full=100'    make fuzz FUZZ='--seconds 600 exr'
check-long: all tests/t-pt
	builddir=. $(SHELL) $(top_srcdir)/tests/long/all.sh $(PARTS)
# ct-sr of scans at the limits, a table: tests/extremes.py; ROWS names some of them.
check-extremes: all
	PATH='$(abs_top_builddir)':$$PATH python3 $(top_srcdir)/tests/extremes.py $(ROWS)
fuzz:
	$(SHELL) $(top_srcdir)/scripts/fuzz.sh $(FUZZ)
.PHONY: check-long check-extremes fuzz
EXTRA_DIST += tests/extremes.py
EXTRA_DIST += tests/long/all.sh tests/long/lib.sh tests/long/kill.sh tests/long/full.sh \
	tests/long/peak.sh tests/long/memory.sh tests/long/two.sh tests/long/sanitize.sh tests/long/threads.sh tests/long/fuzz.sh \
	tests/long/network.sh tests/long/network.py tests/long/train.sh tests/long/cluster.sh tests/long/conda.sh tests/long/faults.sh tests/long/fault.c tests/long/io-faults.sh tests/long/io-fault.c
EXTRA_DIST += tests/tap.sh tests/tap.h tests/numbers.h tests/alarm.h
check_PROGRAMS += tests/t-core
tests_t_core_SOURCES = tests/t-core.c
dist_check_SCRIPTS += tests/t-believed.sh tests/t-locale.sh
EXTRA_DIST += tests/t-numbers.py
EXTRA_DIST += tests/fits.py
check_PROGRAMS += tests/t-containers tests/t-difference tests/t-frames tests/t-free tests/t-upsample tests/t-tv-steps
check_PROGRAMS += tests/t-pilot
tests_t_pilot_SOURCES = tests/t-pilot.c
check_PROGRAMS += tests/t-rehearsal
tests_t_rehearsal_SOURCES = tests/t-rehearsal.c tests/slice-make.h
check_PROGRAMS += tests/t-scanner
tests_t_scanner_SOURCES = tests/t-scanner.c
check_PROGRAMS += tests/t-refine
tests_t_refine_SOURCES = tests/t-refine.c tests/slice-make.h
check_PROGRAMS += tests/t-confidence
tests_t_confidence_SOURCES = tests/t-confidence.c tests/slice-make.h
tests_t_containers_SOURCES = tests/t-containers.c
tests_t_difference_SOURCES = tests/t-difference.c
tests_t_frames_SOURCES = tests/t-frames.c
tests_t_free_SOURCES = tests/t-free.c
tests_t_upsample_SOURCES = tests/t-upsample.c
check_PROGRAMS += tests/t-expected
tests_t_expected_SOURCES = tests/t-expected.c
tests_t_tv_steps_SOURCES = tests/t-tv-steps.c
dist_check_SCRIPTS += tests/t-source.sh tests/t-site.sh
check_PROGRAMS += tests/t-any tests/t-io tests/t-raw
tests_t_raw_SOURCES = tests/t-raw.c tests/nifti-make.h
tests_t_any_SOURCES = tests/t-any.c tests/scratch.h
tests_t_io_SOURCES = tests/t-io.c
check_PROGRAMS += tests/t-nifti-parts tests/t-nifti-blocks
tests_t_nifti_blocks_SOURCES = tests/t-nifti-blocks.c tests/nifti-make.h
tests_t_nifti_parts_SOURCES = tests/t-nifti-parts.c tests/nifti-make.h
check_PROGRAMS += tests/t-headed
tests_t_headed_SOURCES = tests/t-headed.c tests/headed-make.h tests/scratch.h
check_PROGRAMS += tests/t-nifti
tests_t_nifti_SOURCES = tests/t-nifti.c tests/nifti-make.h
check_PROGRAMS += tests/t-resample
tests_t_resample_SOURCES = tests/t-resample.c tests/separable-pair.h
check_PROGRAMS += tests/t-degrade
tests_t_degrade_SOURCES = tests/t-degrade.c tests/separable-pair.h
check_PROGRAMS += tests/t-metrics
tests_t_metrics_SOURCES = tests/t-metrics.c tests/ssim-plain.h
check_PROGRAMS += tests/t-ssim-volume tests/t-edges tests/t-structures
tests_t_structures_SOURCES = tests/t-structures.c
tests_t_ssim_volume_SOURCES = tests/t-ssim-volume.c tests/ssim-plain.h
tests_t_edges_SOURCES = tests/t-edges.c
check_PROGRAMS += tests/t-splat
tests_t_splat_SOURCES = tests/t-splat.c tests/gaussian-plain.h

check_PROGRAMS += tests/t-mixture tests/t-extreme
tests_t_extreme_SOURCES = tests/t-extreme.c tests/gaussian-plain.h
tests_t_mixture_SOURCES = tests/t-mixture.c tests/gaussian-plain.h
dist_check_SCRIPTS += tests/t-ct-degrade.sh
dist_check_SCRIPTS += tests/t-ct-prior.sh
dist_check_SCRIPTS += tests/t-ct-metrics.sh
check_PROGRAMS += tests/t-centre
tests_t_centre_SOURCES = tests/t-centre.c
check_PROGRAMS += tests/t-phantom
tests_t_phantom_SOURCES = tests/t-phantom.c
check_PROGRAMS += tests/t-orbit
tests_t_orbit_SOURCES = tests/t-orbit.c
check_PROGRAMS += tests/t-fuse
tests_t_fuse_SOURCES = tests/t-fuse.c
check_PROGRAMS += tests/t-geometry
tests_t_geometry_SOURCES = tests/t-geometry.c
check_PROGRAMS += tests/t-columns
tests_t_columns_SOURCES = tests/t-columns.c
check_PROGRAMS += tests/t-matched
tests_t_matched_SOURCES = tests/t-matched.c tests/pinv.h
check_PROGRAMS += tests/t-ddnm
tests_t_ddnm_SOURCES = tests/t-ddnm.c tests/pinv.h tests/gold-net.h
check_PROGRAMS += tests/t-samplers
tests_t_samplers_SOURCES = tests/t-samplers.c tests/pinv.h
check_PROGRAMS += tests/t-slices tests/t-slice-values
tests_t_slice_values_SOURCES = tests/t-slice-values.c
tests_t_slices_SOURCES = tests/t-slices.c
dist_check_SCRIPTS += tests/t-convert.sh tests/t-dicom.sh tests/t-dicom-out.sh tests/t-series.sh tests/t-series-kinds.sh
EXTRA_DIST += tests/t-convert.py tests/t-dicom.py tests/t-dicom-out.py tests/exr.py tests/t-python.py \
	tests/describe.py tests/dicom.py tests/t-series.py tests/t-series-kinds.py tests/t-pixels.py tests/htj2k.zip
dist_check_SCRIPTS += tests/t-scans.sh
EXTRA_DIST += tests/t-scans.py
check_PROGRAMS += tests/t-exr tests/t-exr-parts
tests_t_exr_parts_SOURCES = tests/t-exr-parts.c
tests_t_exr_SOURCES = tests/t-exr.c tests/bound.h
check_PROGRAMS += tests/t-project
tests_t_project_SOURCES = tests/t-project.c
dist_check_SCRIPTS += tests/t-ct-project.sh
check_PROGRAMS += tests/t-safetensors
tests_t_safetensors_SOURCES = tests/t-safetensors.c
check_PROGRAMS += tests/t-pt
tests_t_pt_SOURCES = tests/t-pt.c tests/pt-make.h
dist_check_SCRIPTS += tests/t-torch.sh
EXTRA_DIST += tests/t-pt.py
check_PROGRAMS += tests/t-ply
tests_t_ply_SOURCES = tests/t-ply.c
check_PROGRAMS += tests/t-loss tests/t-gsfit tests/t-density
tests_t_density_SOURCES = tests/t-density.c
tests_t_loss_SOURCES = tests/t-loss.c tests/ssim-plain.h
tests_t_gsfit_SOURCES = tests/t-gsfit.c
check_PROGRAMS += tests/t-field-fit
tests_t_field_fit_SOURCES = tests/t-field-fit.c tests/field-tensors.h
dist_check_SCRIPTS += tests/t-ct-field.sh
dist_check_SCRIPTS += tests/t-nabgs.sh
check_PROGRAMS += tests/t-net-layers
tests_t_net_layers_SOURCES = tests/t-net-layers.c tests/differences.h
check_PROGRAMS += tests/t-super-layers
tests_t_super_layers_SOURCES = tests/t-super-layers.c tests/differences.h
check_PROGRAMS += tests/t-super-net
tests_t_super_net_SOURCES = tests/t-super-net.c tests/numbers.h
EXTRA_DIST += tests/supervised-torch.py
check_PROGRAMS += tests/t-unet tests/t-arch
tests_t_unet_SOURCES = tests/t-unet.c tests/gold-net.h
tests_t_arch_SOURCES = tests/t-arch.c
EXTRA_DIST += tests/gold/unet-a.safetensors tests/gold/unet-b.safetensors \
	tests/gold/ddnm-plain-x4.safetensors tests/gold/ddnm-plus-x4.safetensors \
	tests/gold/ddnm-plus-x8-noisy.safetensors tests/gold/ddnm-travel.safetensors
tests_t_training_SOURCES = tests/t-training.c
dist_check_SCRIPTS += tests/t-train.sh
check_PROGRAMS += tests/t-superres tests/t-training
tests_t_superres_SOURCES = tests/t-superres.c
check_PROGRAMS += tests/t-superres-runs tests/t-prior
tests_t_prior_SOURCES = tests/t-prior.c
tests_t_superres_runs_SOURCES = tests/t-superres-runs.c
check_PROGRAMS += tests/t-noise
tests_t_noise_SOURCES = tests/t-noise.c
# An index beyond the end of an array stops these.
if SANITIZE
BOUNDS =
else
BOUNDS = -fsanitize=bounds -fsanitize-undefined-trap-on-error
endif
check_PROGRAMS += tests/t-survey tests/t-montage tests/t-scan-grid
tests_t_survey_CFLAGS = $(AM_CFLAGS) $(BOUNDS)
tests_t_montage_CFLAGS = $(AM_CFLAGS) $(BOUNDS)
tests_t_scan_grid_CFLAGS = $(AM_CFLAGS) $(BOUNDS)
tests_t_scan_grid_SOURCES = tests/t-scan-grid.c src/recon/scan-grid.c
tests_t_survey_SOURCES = tests/t-survey.c src/report/survey.c
tests_t_montage_SOURCES = tests/t-montage.c src/picture/montage.c src/picture/canvas.c
dist_check_SCRIPTS += tests/t-examples.sh tests/t-page.sh tests/t-formats.sh
dist_check_SCRIPTS += tests/t-slice-profile.sh tests/t-ct-report.sh tests/t-info.sh tests/t-view.sh
tests_t_text_CFLAGS = $(AM_CFLAGS) $(BOUNDS)
if HAVE_OIIO
check_PROGRAMS += tests/t-image
tests_t_image_SOURCES = tests/t-image.c
nodist_EXTRA_tests_t_image_SOURCES = tests/link-with-cxx.cc
tests_t_image_LDADD = libctshim.a libct.a $(OIIO_LIBS) $(PNG_LIBS) $(CT_LIBS)
else
EXTRA_DIST += tests/t-image.c
endif
if HAVE_VTK
check_PROGRAMS += tests/t-apart tests/t-fragments tests/t-held
tests_t_apart_SOURCES = tests/t-apart.cc
tests_t_apart_LDADD = libctshim.a libct.a $(CT_LIBS)
tests_t_fragments_SOURCES = tests/t-fragments.cc
tests_t_fragments_LDADD = libctshim.a libct.a $(CT_LIBS)
tests_t_held_SOURCES = tests/t-held.cc
tests_t_held_LDADD = libctshim.a libct.a $(VTK_LIBS) $(CT_LIBS)
else
EXTRA_DIST += tests/t-apart.cc tests/t-fragments.cc tests/t-held.cc
endif
dist_check_SCRIPTS += tests/t-ct-ddnm.sh tests/t-sr.sh
dist_check_SCRIPTS += tests/t-all-tools.sh
check_PROGRAMS += tests/t-consistency tests/t-tv
tests_t_consistency_SOURCES = tests/t-consistency.c tests/separable-pair.h
tests_t_tv_SOURCES = tests/t-tv.c
check_PROGRAMS += tests/t-joint
tests_t_joint_SOURCES = tests/t-joint.c
dist_check_SCRIPTS += tests/t-ct-fuse.sh
dist_check_SCRIPTS += tests/t-ct-upsample.sh
check_PROGRAMS += tests/t-fdk tests/t-weights
tests_t_weights_SOURCES = tests/t-weights.c
tests_t_fdk_SOURCES = tests/t-fdk.c
dist_check_SCRIPTS += tests/t-ct-fdk.sh
dist_check_SCRIPTS += tests/t-cost.sh
# The vectors at each level.
if SIMD_LEVELS
check_PROGRAMS += tests/t-vec-v2 tests/t-vec-v3 tests/t-vec-v4
tests_t_vec_v2_SOURCES = tests/t-vec.c
tests_t_vec_v2_CFLAGS = $(AM_CFLAGS) -march=x86-64-v2 -DCT_SIMD_LEVEL=2
tests_t_vec_v3_SOURCES = tests/t-vec.c
tests_t_vec_v3_CFLAGS = $(AM_CFLAGS) -march=x86-64-v3 -DCT_SIMD_LEVEL=3
tests_t_vec_v4_SOURCES = tests/t-vec.c
tests_t_vec_v4_CFLAGS = $(AM_CFLAGS) -march=x86-64-v4 -DCT_SIMD_LEVEL=4
else
check_PROGRAMS += tests/t-vec-v1
tests_t_vec_v1_SOURCES = tests/t-vec.c
tests_t_vec_v1_CFLAGS = $(AM_CFLAGS) -DCT_SIMD_LEVEL=1
endif
# Every kernel at each level; with an argument, bench/b-kernels.sh.
check_PROGRAMS += tests/t-kernels tests/t-kernels-scan tests/t-kernels-model
tests_t_kernels_SOURCES = tests/t-kernels.c tests/kernels.h
tests_t_kernels_scan_SOURCES = tests/t-kernels-scan.c tests/kernels.h
tests_t_kernels_model_SOURCES = tests/t-kernels-model.c tests/kernels.h
check_PROGRAMS += tests/t-solve
tests_t_solve_SOURCES = tests/t-solve.c
dist_check_SCRIPTS += tests/t-sr-keep.sh tests/t-stop.sh tests/t-faults.sh
dist_check_SCRIPTS += tests/t-modes.sh
# A fuzz target for every reader, state and metadata: fuzz-x.c, corpus/x.tar. make check replays the corpus and
# mutates the seeds; scripts/fuzz.sh looks for more with libFuzzer.
FUZZ_DRIVER = tests/fuzz/driver.c tests/fuzz/driver.h tests/fuzz/fuzz-file.h tests/fuzz/state-run.h
EXTRA_DIST += tests/fuzz/corpus tests/fuzz/make-dicom.py scripts/fuzz.sh scripts/fuzz-corpus.sh
FUZZ_TARGETS =
check_PROGRAMS += $(FUZZ_TARGETS)
FUZZ_TARGETS += tests/fuzz/fuzz-nifti
tests_fuzz_fuzz_nifti_SOURCES = tests/fuzz/fuzz-nifti.c tests/nifti-make.h $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-exr
tests_fuzz_fuzz_exr_SOURCES = tests/fuzz/fuzz-exr.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-ply
tests_fuzz_fuzz_ply_SOURCES = tests/fuzz/fuzz-ply.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-safetensors
tests_fuzz_fuzz_safetensors_SOURCES = tests/fuzz/fuzz-safetensors.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-pt
tests_fuzz_fuzz_pt_SOURCES = tests/fuzz/fuzz-pt.c tests/pt-make.h $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-npy
tests_fuzz_fuzz_npy_SOURCES = tests/fuzz/fuzz-npy.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-raw
tests_fuzz_fuzz_raw_SOURCES = tests/fuzz/fuzz-raw.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-headed
tests_fuzz_fuzz_headed_SOURCES = tests/fuzz/fuzz-headed.c tests/headed-make.h $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-geometry-json
tests_fuzz_fuzz_geometry_json_SOURCES = tests/fuzz/fuzz-geometry-json.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-slice-profile
tests_fuzz_fuzz_slice_profile_SOURCES = tests/fuzz/fuzz-slice-profile.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-beside
tests_fuzz_fuzz_beside_SOURCES = tests/fuzz/fuzz-beside.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-meta
tests_fuzz_fuzz_meta_SOURCES = tests/fuzz/fuzz-meta.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-prior
tests_fuzz_fuzz_prior_SOURCES = tests/fuzz/fuzz-prior.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-arssr
tests_fuzz_fuzz_arssr_SOURCES = tests/fuzz/fuzz-arssr.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-state-ddnm
tests_fuzz_fuzz_state_ddnm_SOURCES = tests/fuzz/fuzz-state-ddnm.c src/tools/ddnm-state.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-state-field
tests_fuzz_fuzz_state_field_SOURCES = tests/fuzz/fuzz-state-field.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-state-fuse
tests_fuzz_fuzz_state_fuse_SOURCES = tests/fuzz/fuzz-state-fuse.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-state-nabgs
tests_fuzz_fuzz_state_nabgs_SOURCES = tests/fuzz/fuzz-state-nabgs.c $(FUZZ_DRIVER)
FUZZ_TARGETS += tests/fuzz/fuzz-state-train
tests_fuzz_fuzz_state_train_SOURCES = tests/fuzz/fuzz-state-train.c $(FUZZ_DRIVER)
if HAVE_VTK
FUZZ_TARGETS += tests/fuzz/fuzz-dicom
tests_fuzz_fuzz_dicom_SOURCES = tests/fuzz/fuzz-dicom.c $(FUZZ_DRIVER)
nodist_EXTRA_tests_fuzz_fuzz_dicom_SOURCES = tests/link-with-cxx.cc
tests_fuzz_fuzz_dicom_LDADD = libctshim.a libct.a $(VTK_LIBS) $(CT_LIBS)
else
EXTRA_DIST += tests/fuzz/fuzz-dicom.c
endif
if HAVE_OIIO
FUZZ_TARGETS += tests/fuzz/fuzz-image
tests_fuzz_fuzz_image_SOURCES = tests/fuzz/fuzz-image.c $(FUZZ_DRIVER)
nodist_EXTRA_tests_fuzz_fuzz_image_SOURCES = tests/link-with-cxx.cc
tests_fuzz_fuzz_image_LDADD = libctshim.a libct.a $(OIIO_LIBS) $(PNG_LIBS) $(CT_LIBS)
else
EXTRA_DIST += tests/fuzz/fuzz-image.c
endif
FUZZ_TARGETS += tests/fuzz/fuzz-slices
tests_fuzz_fuzz_slices_SOURCES = tests/fuzz/fuzz-slices.c $(FUZZ_DRIVER)
dist_check_SCRIPTS += tests/t-outputs.sh tests/t-python.sh tests/t-picture.sh
EXTRA_DIST += tests/t-picture.py
check_PROGRAMS += tests/t-hostile
tests_t_hostile_SOURCES = tests/t-hostile.c tests/nifti-make.h tests/bound.h
check_PROGRAMS += tests/t-fit-state tests/t-fit
tests_t_fit_state_SOURCES = tests/t-fit-state.c
tests_t_fit_SOURCES = tests/t-fit.c
check_PROGRAMS += tests/t-place tests/t-loss-total
tests_t_place_SOURCES = tests/t-place.c
tests_t_loss_total_SOURCES = tests/t-loss-total.c tests/gaussian-plain.h
check_PROGRAMS += tests/t-options
tests_t_options_SOURCES = tests/t-options.c tests/capture.h
check_PROGRAMS += tests/t-help
tests_t_help_SOURCES = tests/t-help.c tests/capture.h
check_PROGRAMS += tests/t-files
tests_t_files_SOURCES = tests/t-files.c tests/scratch.h
check_PROGRAMS += tests/t-kept
tests_t_kept_SOURCES = tests/t-kept.c tests/capture.h tests/scratch.h
check_PROGRAMS += tests/t-state
tests_t_state_SOURCES = tests/t-state.c tests/capture.h tests/scratch.h
check_PROGRAMS += tests/t-signals
tests_t_signals_SOURCES = tests/t-signals.c tests/scratch.h
check_PROGRAMS += tests/t-geometry-file
tests_t_geometry_file_SOURCES = tests/t-geometry-file.c tests/capture.h tests/scratch.h
check_PROGRAMS += tests/t-step-paper
tests_t_step_paper_SOURCES = tests/t-step-paper.c tests/scratch.h
check_PROGRAMS += tests/t-evidence
tests_t_evidence_SOURCES = tests/t-evidence.c tests/capture.h tests/scratch.h
check_PROGRAMS += tests/t-libraries
tests_t_libraries_SOURCES = tests/t-libraries.c tests/bound.h tests/capture.h src/tools/lib/libraries.cc
check_PROGRAMS += tests/t-restore
tests_t_restore_SOURCES = tests/t-restore.c tests/slice-make.h
check_PROGRAMS += tests/t-example
tests_t_example_SOURCES = tests/t-example.c tests/slice-make.h
check_PROGRAMS += tests/t-learn
tests_t_learn_SOURCES = tests/t-learn.c tests/numbers.h
check_PROGRAMS += tests/t-padding
tests_t_padding_SOURCES = tests/t-padding.c tests/numbers.h
check_PROGRAMS += tests/t-slice-fit
tests_t_slice_fit_SOURCES = tests/t-slice-fit.c tests/numbers.h
check_PROGRAMS += tests/t-patch
tests_t_patch_SOURCES = tests/t-patch.c tests/numbers.h tests/slice-make.h
check_PROGRAMS += tests/t-slice-prior
tests_t_slice_prior_SOURCES = tests/t-slice-prior.c tests/numbers.h
check_PROGRAMS += tests/t-volume-network
tests_t_volume_network_SOURCES = tests/t-volume-network.c tests/numbers.h tests/slice-make.h
EXTRA_DIST += tests/terminal.py
# The installed library.
check_PROGRAMS += tests/t-ctsr
tests_t_ctsr_SOURCES = tests/t-ctsr.c
tests_t_ctsr_LDADD = libctsr.a $(CT_LIBS)
dist_check_SCRIPTS += tests/t-library.sh
dist_check_SCRIPTS += tests/t-one-step.sh
noinst_PROGRAMS = tests/one-step examples/paper
examples_paper_SOURCES = examples/paper.c
examples_paper_CPPFLAGS = -I$(srcdir)/src/ctsr
examples_paper_LDADD = libctsr.a $(CT_LIBS)
tests_one_step_SOURCES = tests/one-step.c
tests_one_step_LDADD = libctsr.a $(CT_LIBS)
EXTRA_DIST += tests/one-step.py
check_PROGRAMS += tests/t-field-network
tests_t_field_network_SOURCES = tests/t-field-network.c tests/field-tensors.h
EXTRA_DIST += tests/field-torch.py
check_PROGRAMS += tests/t-arssr
tests_t_arssr_SOURCES = tests/t-arssr.c tests/numbers.h
dist_check_SCRIPTS += tests/t-ct-arssr.sh
EXTRA_DIST += tests/arssr-torch.py
