# Slices of DICOM series: files, groups, order, grids; no DICOM in here.
libct_a_SOURCES += src/series/slice.c src/series/slice.h
libct_a_SOURCES += src/series/header.c src/series/header.h
libct_a_SOURCES += src/series/series.c src/series/series.h
libct_a_SOURCES += src/series/layout.c src/series/layout.h src/series/slice-order.c
libct_a_SOURCES += src/series/scales.c src/series/scales.h
libct_a_SOURCES += src/series/gaps.c src/series/moments.c src/series/moments.h
