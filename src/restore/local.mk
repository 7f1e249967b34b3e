# The slice prior: what a volume lacks, learned and predicted on its slices.
libct_a_SOURCES += src/restore/patch.c src/restore/patch.h
libct_a_SOURCES += src/restore/slice-network.c src/restore/slice-network.h
libct_a_SOURCES += src/restore/learn.c src/restore/learn-begin.c src/restore/learn.h
libct_a_SOURCES += src/restore/example.c src/restore/example.h
libct_a_SOURCES += src/restore/predict.c src/restore/predict.h
libct_a_SOURCES += src/restore/volume-network.c src/restore/volume-network.h
libct_a_SOURCES += src/restore/block-weights.c src/restore/block-weights.h
libct_a_SOURCES += src/restore/steps.c src/restore/steps.h
libct_a_SOURCES += src/restore/slice-prior.c src/restore/restore.c src/restore/confidence.c src/restore/restore.h
