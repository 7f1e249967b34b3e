libct_a_SOURCES += formats/io.c formats/io.h
libct_a_SOURCES += formats/format.h
libct_a_SOURCES += formats/hash.c formats/hash.h
