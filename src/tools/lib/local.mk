# What commands share: the options of a scan and scanner files, and what corrects a base volume.
libct_a_SOURCES += src/tools/lib/geometry-opts.c src/tools/lib/geometry-opts.h
libct_a_SOURCES += src/tools/lib/geometry-json.c src/tools/lib/geometry-json.h
libct_a_SOURCES += src/tools/lib/evidence-files.c src/tools/lib/evidence-files.h
libct_a_SOURCES += src/tools/lib/said.c src/tools/lib/said.h
libct_a_SOURCES += src/tools/lib/ahead.c src/tools/lib/ahead.h
libct_a_SOURCES += src/tools/lib/prior-opts.c src/tools/lib/prior-opts.h
