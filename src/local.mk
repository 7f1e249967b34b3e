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
ct_convert_SOURCES = src/tools/ct-convert.c src/tools/convert-radiograph.c src/tools/convert.h
ct_convert_LDADD = $(DICOM_LDADD)
if HAVE_OIIO
# Started by the commands, so that only who reads pictures waits for their libraries, or installs them.
pkglibexec_PROGRAMS += ct-picture
ct_picture_SOURCES = src/tools/picture.c src/tools/lib/libraries.cc
ct_picture_LDADD = libctshim.a libct.a $(OIIO_LIBS) $(CT_LIBS)
else
EXTRA_DIST += src/tools/picture.c
endif
bin_PROGRAMS += ct-train
ct_train_SOURCES = src/tools/ct-train.c src/tools/train-loop.h src/tools/train-loop.c $(TRAIN_SOURCES)
bin_PROGRAMS += ct-project
ct_project_SOURCES = src/tools/ct-project.c
bin_PROGRAMS += ct-phantom
ct_phantom_SOURCES = src/tools/ct-phantom.c
bin_PROGRAMS += ct-ddnm
ct_ddnm_SOURCES = src/tools/ct-ddnm.c src/tools/ddnm-parts.h src/tools/ddnm-state.c \
	src/tools/ddnm-input.c
ct_ddnm_LDADD = $(LDADD) $(PNG_LIBS)
bin_PROGRAMS += ct-sr
ct_sr_SOURCES = src/tools/ct-sr.c src/tools/sr-paper.c src/tools/sr-keep.c src/tools/sr-result.c src/tools/sr-words.c src/tools/sr.h \
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
