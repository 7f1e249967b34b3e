# What commands share: the options of a scan and scanner files, what corrects a base volume, and where
# their files are installed.
libct_a_SOURCES += src/tools/lib/scan-opts.c src/tools/lib/scan-opts.h
libct_a_SOURCES += src/tools/lib/scan-json.c src/tools/lib/scan-json.h
libct_a_SOURCES += src/tools/lib/evidence.c src/tools/lib/evidence.h
libct_a_SOURCES += src/tools/lib/brick.c src/tools/lib/brick.h
libct_a_SOURCES += src/tools/lib/expect.c src/tools/lib/expect.h
libct_a_SOURCES += src/tools/lib/expect-prior.c src/tools/lib/expect-prior.h
libct_a_SOURCES += src/tools/lib/lowres.c src/tools/lib/lowres.h
libct_a_SOURCES += src/tools/lib/std.c src/tools/lib/std.h
libct_a_SOURCES += src/tools/lib/installed.c src/tools/lib/installed.h
