# Pure numerics.
libct_a_SOURCES += src/kern/scan.c src/kern/scan.h
libct_a_SOURCES += src/kern/window.c src/kern/window.h
libct_a_SOURCES += src/kern/project.c src/kern/project.h
libct_a_SOURCES += src/kern/phantom.c src/kern/phantom-sets.c src/kern/phantom.h
