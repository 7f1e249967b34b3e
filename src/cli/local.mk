libct_a_SOURCES += src/cli/cli.c src/cli/cli.h
libct_a_SOURCES += src/cli/table.c src/cli/table.h src/cli/help.c src/cli/help.h
libct_a_SOURCES += src/cli/files.c src/cli/files.h
libct_a_SOURCES += src/cli/resume.c src/cli/resume.h
libct_a_SOURCES += src/cli/parse.c
libct_a_SOURCES += src/cli/progress.c src/cli/progress.h
libct_a_SOURCES += src/cli/chain.c src/cli/chain.h
libct_a_SOURCES += src/cli/cost.c src/cli/cost.h
