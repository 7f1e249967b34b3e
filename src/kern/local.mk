# Pure numerics.
libct_a_SOURCES += src/kern/survey.c src/kern/survey.h
libct_a_SOURCES += src/kern/montage.c src/kern/montage.h
