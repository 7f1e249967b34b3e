# Pictures of volumes: slices, projections, surfaces, colours, letters.
libct_a_SOURCES += src/picture/montage.c src/picture/montage.h src/picture/mip.c src/picture/surface.c
libct_a_SOURCES += src/picture/colour.c
libct_a_SOURCES += src/picture/text.c src/picture/text.h
