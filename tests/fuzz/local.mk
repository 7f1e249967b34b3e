# A fuzz target for every reader, state and metadata: fuzz-x.c, corpus/x.tar. make check replays the corpus and
# mutates the seeds; scripts/fuzz.sh looks for more with libFuzzer.
FUZZ_DRIVER = tests/fuzz/driver.c tests/fuzz/driver.h tests/fuzz/mem-file.h tests/fuzz/seed-file.h tests/fuzz/volume.h tests/fuzz/weights.h \
	tests/fuzz/state-run.h
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
