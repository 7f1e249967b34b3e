# Pictures of volumes: slices, slabs, surfaces, colours, letters.
libct_a_SOURCES += src/picture/montage.c src/picture/montage.h
libct_a_SOURCES += src/picture/colour.c src/picture/colour.h
libct_a_SOURCES += src/picture/text.c src/picture/text.h
libct_a_SOURCES += src/picture/slab.c src/picture/slab.h
libct_a_SOURCES += src/picture/surface.c src/picture/surface.h
