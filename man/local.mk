# SPDX-License-Identifier: Apache-2.0
# A page is mdoc prose with a line @OPTIONS@ that the tool's own option table fills.
man1_MANS += $(bin_PROGRAMS:%=man/%.1)
EXTRA_DIST += $(bin_PROGRAMS:%=man/%.1.in)
CLEANFILES += $(bin_PROGRAMS:%=man/%.1)
man/ct-%.1: man/ct-%.1.in ct-%$(EXEEXT)
	$(AM_V_GEN)$(MKDIR_P) man && ./ct-$*$(EXEEXT) --mdoc-options > $@-opt && \
	sed -e '/^@OPTIONS@$$/r $@-opt' -e '/^@OPTIONS@$$/d' $(srcdir)/man/ct-$*.1.in > $@-t && \
	rm -f $@-opt && mv $@-t $@
# What the shells ask for what they offer, which is from the same table.
bashcompdir = $(datadir)/bash-completion/completions
zshcompdir = $(datadir)/zsh/site-functions
fishcompdir = $(datadir)/fish/vendor_completions.d
bashcomp_DATA = $(bin_PROGRAMS:%=complete/bash/%)
zshcomp_DATA = $(bin_PROGRAMS:%=complete/zsh/_%)
fishcomp_DATA = $(bin_PROGRAMS:%=complete/fish/%.fish)
CLEANFILES += $(bashcomp_DATA) $(zshcomp_DATA) $(fishcomp_DATA)
EXTRA_DIST += src/cli/complete.bash src/cli/complete.zsh src/cli/complete.fish
CT_STUB = $(AM_V_GEN)$(MKDIR_P) $(@D) && sed 's/@TOOL@/ct-$*/g' $< > $@-t && mv $@-t $@
complete/bash/ct-%: src/cli/complete.bash
	$(CT_STUB)
complete/zsh/_ct-%: src/cli/complete.zsh
	$(CT_STUB)
complete/fish/ct-%.fish: src/cli/complete.fish
	$(CT_STUB)
dist_man5_MANS = man/ct-formats.5 man/ct-scans.5
dist_man3_MANS = man/ctsr.3
dist_man7_MANS = man/ct-pipeline.7 man/ct-glossary.7 man/ct-references.7 man/ct-release.7
