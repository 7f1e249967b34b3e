# A page is mdoc prose with a line @OPTIONS@ that the tool's own option table fills.
man1_MANS += $(bin_PROGRAMS:%=man/%.1)
EXTRA_DIST += $(bin_PROGRAMS:%=man/%.1.in)
CLEANFILES += $(bin_PROGRAMS:%=man/%.1)
man/ct-%.1: man/ct-%.1.in ct-%$(EXEEXT)
	$(AM_V_GEN)$(MKDIR_P) man && ./ct-$*$(EXEEXT) --mdoc-options > $@-opt && \
	sed -e '/^@OPTIONS@$$/r $@-opt' -e '/^@OPTIONS@$$/d' $(srcdir)/man/ct-$*.1.in > $@-t && \
	rm -f $@-opt && mv $@-t $@
# What the shells offer, from the same table.
bashcompdir = $(datadir)/bash-completion/completions
zshcompdir = $(datadir)/zsh/site-functions
fishcompdir = $(datadir)/fish/vendor_completions.d
bashcomp_DATA = $(bin_PROGRAMS:%=complete/bash/%)
zshcomp_DATA = $(bin_PROGRAMS:%=complete/zsh/_%)
fishcomp_DATA = $(bin_PROGRAMS:%=complete/fish/%.fish)
CLEANFILES += $(bashcomp_DATA) $(zshcomp_DATA) $(fishcomp_DATA)
CT_COMPLETE = $(AM_V_GEN)$(MKDIR_P) $(@D) && ./ct-$*$(EXEEXT) --complete
complete/bash/ct-%: ct-%$(EXEEXT)
	$(CT_COMPLETE)=bash > $@-t && mv $@-t $@
complete/zsh/_ct-%: ct-%$(EXEEXT)
	$(CT_COMPLETE)=zsh > $@-t && mv $@-t $@
complete/fish/ct-%.fish: ct-%$(EXEEXT)
	$(CT_COMPLETE)=fish > $@-t && mv $@-t $@
dist_man5_MANS = man/ct-formats.5
dist_man3_MANS = man/ctsr.3
dist_man7_MANS = man/ct-pipeline.7 man/ct-glossary.7
