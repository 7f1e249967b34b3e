# The library that is installed: ctsr.h, libctsr.so, libctsr.a, ctsr.pc. The commands link libct.a, which
# holds the same objects and the command line's.
CTSR_SOVERSION = 0
LDCONFIG = PATH=$$PATH:/sbin:/usr/sbin ldconfig
CTSR_SONAME = libctsr.so.$(CTSR_SOVERSION)
CTSR_SHARED = $(CTSR_SONAME).1.0
lib_LIBRARIES = libctsr.a
include_HEADERS = src/ctsr/ctsr.h
libctsr_a_SOURCES = src/ctsr/ctsr-call.c src/ctsr/ctsr-impl.h src/ctsr/ctsr-volume.c src/ctsr/ctsr-file.c \
	src/ctsr/ctsr-formats.c src/ctsr/ctsr-nifti.c src/ctsr/ctsr-nrrd.c src/ctsr/ctsr-metaimage.c \
	src/ctsr/ctsr-operator.c src/ctsr/ctsr-superres.c src/ctsr/ctsr-projections.c src/ctsr/ctsr-gaussians.c src/ctsr/ctsr-compose.c src/ctsr/ctsr-ddnm.c \
	src/ctsr/ctsr-metrics.c src/ctsr/ctsr-reconstruct.c
CTSR_INTERNAL = $(filter-out src/cli/% src/report/% src/shim/% src/tools/%,$(libct_a_OBJECTS)) $(libct_a_LIBADD)
libctsr_a_LIBADD = $(CTSR_INTERNAL)
libctsr_a_DEPENDENCIES = $(CTSR_INTERNAL)
# The sanitizers' functions come from the program that is linked with it.
if SANITIZE
CTSR_DEFS =
else
CTSR_DEFS = -Wl,-z,defs
endif
$(CTSR_SHARED): libctsr.a $(libctsr_a_OBJECTS) src/ctsr/ctsr.symbols
	$(AM_V_CCLD)$(CC) $(AM_CFLAGS) $(CFLAGS) -shared -Wl,-soname,$(CTSR_SONAME) $(CTSR_DEFS) \
		$(AM_LDFLAGS) $(LDFLAGS) -o $@ $(libctsr_a_OBJECTS) libctsr.a $(CT_LIBS) $(LIBS)
$(CTSR_SONAME): $(CTSR_SHARED)
	$(AM_V_GEN)ln -sf $(CTSR_SHARED) $@
noinst_DATA += $(CTSR_SHARED) $(CTSR_SONAME)
CLEANFILES += $(CTSR_SHARED) $(CTSR_SONAME)
EXTRA_DIST += src/ctsr/ctsr.symbols examples/superres.c
pkgconfigdir = $(libdir)/pkgconfig
pkgconfig_DATA = src/ctsr/ctsr.pc
install-shared: $(CTSR_SHARED)
	$(MKDIR_P) '$(DESTDIR)$(libdir)'
	$(INSTALL_DATA) $(CTSR_SHARED) '$(DESTDIR)$(libdir)'
	cd '$(DESTDIR)$(libdir)' && ln -sf $(CTSR_SHARED) $(CTSR_SONAME) && ln -sf $(CTSR_SONAME) libctsr.so
# The loader finds the library by its cache, which root alone can make, and no package's build should.
	@test -n '$(DESTDIR)' || test "$$(id -u)" != 0 || { echo ' LDCONFIG' '$(libdir)'; $(LDCONFIG) || :; }
install-library: install-shared install-libLIBRARIES install-includeHEADERS install-pkgconfigDATA
install-exec-local: install-shared
uninstall-local:
	cd '$(DESTDIR)$(libdir)' && rm -f $(CTSR_SHARED) $(CTSR_SONAME) libctsr.so
.PHONY: install-shared install-library
