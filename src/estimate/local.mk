# What a scan does not say: its blur, its noise, its slices, what a scanner does; and the error to expect.
libct_a_SOURCES += src/estimate/operator.c src/estimate/operator.h
libct_a_SOURCES += src/estimate/assumed.c src/estimate/assumed.h
libct_a_SOURCES += src/estimate/scanner.c src/estimate/scanner.h
libct_a_SOURCES += src/estimate/slice-pair.c src/estimate/slice-pair.h
libct_a_SOURCES += src/estimate/slice-fit.c src/estimate/slice-fit.h
libct_a_SOURCES += src/estimate/edge-lines.c src/estimate/edge-lines.h
libct_a_SOURCES += src/estimate/profile.c src/estimate/profile.h
EXTRA_DIST += src/estimate/profile-network.bin
BUILT_SOURCES += src/estimate/profile-network.inc
CLEANFILES += src/estimate/profile-network.inc
src/estimate/profile-network.inc: src/estimate/profile-network.bin
	$(AM_V_GEN)$(MKDIR_P) $(@D) && od -An -v -t u1 $(srcdir)/src/estimate/profile-network.bin | \
		sed 's/ *\([0-9][0-9]*\)/\1,/g' >$@
libct_a_SOURCES += src/estimate/expected.c src/estimate/expected.h
libct_a_SOURCES += src/estimate/noise.c src/estimate/noise.h
