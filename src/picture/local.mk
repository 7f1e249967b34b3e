# Pictures of volumes: slices, projections, colours, letters.
libct_a_SOURCES += src/picture/montage.c src/picture/montage.h
libct_a_SOURCES += src/picture/canvas.c src/picture/canvas.h
