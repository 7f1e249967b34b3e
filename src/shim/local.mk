# The only C++: each library behind a small C header. A tool that uses one is linked as C++:
#   ct_x_LDADD = libctshim.a libct.a $(OIIO_LIBS) $(VTK_LIBS) $(CT_LIBS)
#   ct_x_SOURCES += src/tools/lib/libraries.cc
noinst_LIBRARIES += libctshim.a
libctshim_a_SOURCES = src/shim/guard.h
libctshim_a_CPPFLAGS = $(AM_CPPFLAGS) $(OIIO_CFLAGS) $(VTK_CPPFLAGS)
SHIM_OIIO = src/shim/picture-file.h src/shim/picture-file.cc
SHIM_VTK = src/shim/dicom-file.h src/shim/dicom-file.cc src/shim/dicom-scan.cc src/shim/dicom-tags.h src/shim/dicom-tags.cc \
	src/shim/held.h src/shim/held.cc src/shim/dicom-write.cc src/shim/fragments.h \
	src/shim/fragments.cc src/shim/apart.h src/shim/apart.cc src/shim/pixels.h src/shim/pixels.cc \
	src/shim/outline.h src/shim/outline.cc src/shim/pixel-tags.h src/shim/pixel-tags.cc
EXTRA_DIST += $(SHIM_OIIO) $(SHIM_VTK)
if HAVE_OIIO
libctshim_a_SOURCES += $(SHIM_OIIO)
endif
if HAVE_VTK
libctshim_a_SOURCES += $(SHIM_VTK)
endif
# Pictures without that library: by the program ct-picture, which links it.
libct_a_SOURCES += src/shim/image-read.c src/shim/image-read.h
