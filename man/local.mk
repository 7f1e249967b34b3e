# A page is mdoc prose with a line @OPTIONS@ that the tool's own option table fills.
man1_MANS += $(bin_PROGRAMS:%=man/%.1)
EXTRA_DIST += $(bin_PROGRAMS:%=man/%.1.in)
CLEANFILES += $(bin_PROGRAMS:%=man/%.1)
man/ct-%.1: man/ct-%.1.in ct-%$(EXEEXT)
	$(AM_V_GEN)$(MKDIR_P) man && ./ct-$*$(EXEEXT) --mdoc-options > $@-opt && \
	sed -e '/^@OPTIONS@$$/r $@-opt' -e '/^@OPTIONS@$$/d' $(srcdir)/man/ct-$*.1.in > $@-t && \
	rm -f $@-opt && mv $@-t $@
dist_man5_MANS = man/ct-formats.5
dist_man7_MANS = man/ct-pipeline.7
