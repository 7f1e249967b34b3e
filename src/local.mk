# One file a command, src/tools/ct-NAME.c; each has a man page, man/ct-NAME.1.in.
# bin_PROGRAMS += ct-NAME
# ct_NAME_SOURCES = src/tools/ct-NAME.c
bin_PROGRAMS += ct-degrade
ct_degrade_SOURCES = src/tools/ct-degrade.c
bin_PROGRAMS += ct-upsample
ct_upsample_SOURCES = src/tools/ct-upsample.c
bin_PROGRAMS += ct-metrics
ct_metrics_SOURCES = src/tools/ct-metrics.c
bin_PROGRAMS += ct-convert
ct_convert_SOURCES = src/tools/ct-convert.c src/tools/convert-in.c src/tools/convert-grid.c \
	src/tools/convert.h
if HAVE_VTK
ct_convert_LDADD = libctshim.a libct.a $(VTK_LIBS) $(CT_LIBS)
nodist_EXTRA_ct_convert_SOURCES = src/tools/link-with-cxx.cc
else
ct_convert_LDADD = $(LDADD)
endif
bin_PROGRAMS += ct-train
ct_train_SOURCES = src/tools/ct-train.c src/tools/train-data.c src/tools/train-data.h
if HAVE_OIIO
ct_train_LDADD = libctshim.a libct.a $(OIIO_LIBS) $(CT_LIBS)
nodist_EXTRA_ct_train_SOURCES = src/tools/link-with-cxx.cc
endif
libct_a_SOURCES += src/tools/scan-opts.c src/tools/scan-json.c src/tools/scan-opts.h
bin_PROGRAMS += ct-project
ct_project_SOURCES = src/tools/ct-project.c
bin_PROGRAMS += ct-phantom
ct_phantom_SOURCES = src/tools/ct-phantom.c
bin_PROGRAMS += ct-nabgs
ct_nabgs_SOURCES = src/tools/ct-nabgs.c
bin_PROGRAMS += ct-compose
ct_compose_SOURCES = src/tools/ct-compose.c
