# Pictures of volumes: slices, projections, surfaces, colours, letters.
libct_a_SOURCES += src/picture/montage.c src/picture/montage.h
libct_a_SOURCES += src/picture/colour.c src/picture/colour.h
libct_a_SOURCES += src/picture/text.c src/picture/text.h
libct_a_SOURCES += src/picture/mip.c src/picture/mip.h
libct_a_SOURCES += src/picture/surface.c src/picture/surface.h
