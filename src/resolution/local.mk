# The degradation D and its inverse: resampling, SVD, consistency, total variation, blur.
libct_a_SOURCES += src/resolution/separable.c src/resolution/separable.h
SIMD_SOURCES += src/resolution/separable-rows.c
libct_a_SOURCES += src/resolution/resample.c src/resolution/resample.h
libct_a_SOURCES += src/resolution/degrade.c src/resolution/degrade.h
libct_a_SOURCES += src/resolution/slice-profile.c src/resolution/slice-profile.h
libct_a_SOURCES += src/resolution/slice-pair.c src/resolution/slice-pair.h
libct_a_SOURCES += src/resolution/slice-fit.c src/resolution/slice-fit.h
libct_a_SOURCES += src/resolution/regrid.c src/resolution/regrid.h
libct_a_SOURCES += src/resolution/crop.c src/resolution/crop.h
libct_a_SOURCES += src/resolution/svd.c src/resolution/svd.h
SIMD_SOURCES += src/resolution/cosine-strip.c src/resolution/turn.h
libct_a_SOURCES += src/resolution/cosine.c src/resolution/cosine.h
SIMD_SOURCES += src/resolution/banded-strip.c
libct_a_SOURCES += src/resolution/banded.c src/resolution/banded.h
libct_a_SOURCES += src/resolution/consistency.c src/resolution/consistency-planes.c \
	src/resolution/consistency.h
libct_a_SOURCES += src/resolution/tv.c src/resolution/tv.h
SIMD_SOURCES += src/resolution/tv-row.c src/resolution/tv-row.h
libct_a_SOURCES += src/resolution/upsample.c src/resolution/upsample.h
libct_a_SOURCES += src/resolution/mirror.c src/resolution/mirror.h
libct_a_SOURCES += src/resolution/pilot.c src/resolution/pilot.h
libct_a_SOURCES += src/resolution/trial.c src/resolution/trial.h
libct_a_SOURCES += src/resolution/hessian-tv.c
SIMD_SOURCES += src/resolution/hessian-row.c src/resolution/hessian-row.h
libct_a_SOURCES += src/resolution/padding.c src/resolution/padding.h
libct_a_SOURCES += src/resolution/edge-lines.c src/resolution/edge-lines.h
libct_a_SOURCES += src/resolution/profile.c src/resolution/profile.h
EXTRA_DIST += src/resolution/profile-network.bin
BUILT_SOURCES += src/resolution/profile-network.inc
CLEANFILES += src/resolution/profile-network.inc
src/resolution/profile-network.inc: src/resolution/profile-network.bin
	$(AM_V_GEN)$(MKDIR_P) $(@D) && od -An -v -t u1 $(srcdir)/src/resolution/profile-network.bin | \
		sed 's/ *\([0-9][0-9]*\)/\1,/g' >$@
libct_a_SOURCES += src/resolution/expected.c src/resolution/expected.h
libct_a_SOURCES += src/resolution/noise.c src/resolution/noise.h
libct_a_SOURCES += src/resolution/flat.c src/resolution/flat.h
