# What commands share: the options of a scan and scanner files, what corrects a base volume, and where
# their files are installed.
libct_a_SOURCES += src/tools/lib/geometry-opts.c src/tools/lib/geometry-opts.h
libct_a_SOURCES += src/tools/lib/geometry-json.c src/tools/lib/geometry-json.h
libct_a_SOURCES += src/tools/lib/evidence.c src/tools/lib/evidence.h
libct_a_SOURCES += src/tools/lib/installed.c src/tools/lib/installed.h
libct_a_SOURCES += src/tools/lib/said.c src/tools/lib/said.h
libct_a_SOURCES += src/tools/lib/ahead.c src/tools/lib/ahead.h
libct_a_SOURCES += src/tools/lib/prior-opts.c src/tools/lib/prior-opts.h
