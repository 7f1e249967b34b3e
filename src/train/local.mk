# What ct-train learns from, and its networks in training; of ct-train alone, as it needs readers of pictures.
TRAIN_SOURCES = src/train/subject.h src/train/data.c src/train/data.h \
	src/train/pictures.c src/train/slices.c \
	src/train/volumes.c
