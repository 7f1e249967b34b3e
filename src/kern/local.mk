# Pure numerics.
libct_a_SOURCES += src/tools/survey.c src/tools/survey.h
libct_a_SOURCES += src/tools/montage.c src/tools/montage.h
