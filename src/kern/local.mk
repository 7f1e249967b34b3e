# Pure numerics.
libct_a_SOURCES += src/kern/box.c src/kern/box.h
libct_a_SOURCES += src/kern/matched.c src/kern/matched.h
libct_a_SOURCES += src/kern/operator.c src/kern/operator.h
libct_a_SOURCES += src/kern/survey.c src/kern/survey.h
libct_a_SOURCES += src/kern/montage.c src/kern/montage.h
