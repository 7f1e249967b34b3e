libct_a_SOURCES += formats/io.c formats/io.h
libct_a_SOURCES += formats/format.h
libct_a_SOURCES += formats/hash.c formats/hash.h
libct_a_SOURCES += formats/exr.c formats/exr.h
libct_a_SOURCES += formats/exr-read.c
libct_a_SOURCES += formats/exr-write.c
libct_a_SOURCES += formats/exr-zip.c formats/exr-zip.h
libct_a_SOURCES += formats/half.c formats/half.h
