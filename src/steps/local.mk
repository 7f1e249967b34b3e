# The steps of the paper, each once, in memory: what the commands and the library run. They read and write no file.
libct_a_SOURCES += src/steps/window-rule.c src/steps/window-rule.h
libct_a_SOURCES += src/steps/evidence.c src/steps/evidence.h
libct_a_SOURCES += src/steps/step-fit.c src/steps/step-fit.h
libct_a_SOURCES += src/steps/step-compose.c src/steps/step-compose.h
libct_a_SOURCES += src/steps/step-project.c src/steps/step-project.h
libct_a_SOURCES += src/steps/step-ddnm.c src/steps/step-ddnm.h
libct_a_SOURCES += src/steps/step-compare.c src/steps/step-compare.h
libct_a_SOURCES += src/steps/step-degrade.c src/steps/step-degrade.h
libct_a_SOURCES += src/steps/step-reconstruct.c src/steps/step-reconstruct.h
libct_a_SOURCES += src/steps/step-fuse.c src/steps/step-fuse.h
libct_a_SOURCES += src/steps/step-field.c src/steps/step-field.h
libct_a_SOURCES += src/steps/step-paper.c src/steps/step-paper.h
