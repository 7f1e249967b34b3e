# Rays through a volume: scans, projectors, phantoms, photons.
libct_a_SOURCES += src/xray/geometry.c src/xray/geometry.h
libct_a_SOURCES += src/xray/window.c src/xray/window.h
libct_a_SOURCES += src/xray/project.c src/xray/project.h
libct_a_SOURCES += src/xray/ray.c src/xray/ray.h
SIMD_SOURCES += src/xray/voxel-integral-siddon.c src/xray/voxel-integral-joseph.c
libct_a_SOURCES += src/xray/columns.c src/xray/columns.h
SIMD_SOURCES += src/xray/packet.c src/xray/packet.h
libct_a_SOURCES += src/xray/photons.c src/xray/photons.h
libct_a_SOURCES += src/xray/phantom.c src/xray/phantom-sets.c src/xray/phantom.h
