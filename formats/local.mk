libct_a_SOURCES += formats/io.c formats/io.h
libct_a_SOURCES += formats/format.h
libct_a_SOURCES += formats/hash.c formats/hash.h
libct_a_SOURCES += formats/format.c
libct_a_SOURCES += formats/nifti.c formats/nifti.h formats/nifti-impl.h
libct_a_SOURCES += formats/nifti-header.c formats/nifti-affine.c formats/nifti-ext.c
libct_a_SOURCES += formats/voxels.c formats/voxels.h
libct_a_SOURCES += formats/raw.c formats/raw.h
