libct_a_SOURCES += src/cli/cli.c src/cli/cli.h
libct_a_SOURCES += src/cli/parse.c
libct_a_SOURCES += src/cli/progress.c src/cli/progress.h
libct_a_SOURCES += src/cli/chain.c src/cli/chain.h
libct_a_SOURCES += src/cli/cost.c src/cli/cost.h
