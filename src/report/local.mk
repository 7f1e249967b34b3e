# What a person reads of files: the page of ct-report, what a file holds, sheets of slices.
libct_a_SOURCES += src/report/page.c src/report/page.h src/report/page-cards.c src/report/page-measure.c
libct_a_SOURCES += src/report/page-pictures.c
libct_a_SOURCES += src/report/report.c src/report/report.h src/report/survey.c
libct_a_SOURCES += src/report/sheet.c src/report/sheet.h src/report/labels.c
pkgdata_DATA += src/report/report.html
EXTRA_DIST += src/report/report.html
noinst_DATA += report.html
CLEANFILES += report.html
report.html: src/report/report.html
	$(AM_V_GEN)rm -f $@ && cp $(srcdir)/src/report/report.html $@
