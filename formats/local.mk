libct_a_SOURCES += formats/io.c formats/io.h
libct_a_SOURCES += formats/format.h
