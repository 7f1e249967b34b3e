# What commands share: the options of a scan.
libct_a_SOURCES += src/tools/lib/scan-opts.c src/tools/lib/scan-json.c src/tools/lib/scan-opts.h
