# The steps of the paper, each once, in memory: what the commands and the library run. They read and write no file.
libct_a_SOURCES += src/steps/window.c src/steps/window.h
libct_a_SOURCES += src/steps/evidence.c src/steps/evidence.h
libct_a_SOURCES += src/steps/fit.c src/steps/fit.h
libct_a_SOURCES += src/steps/compose.c src/steps/compose.h
libct_a_SOURCES += src/steps/project.c src/steps/project.h
libct_a_SOURCES += src/steps/ddnm.c src/steps/ddnm.h
