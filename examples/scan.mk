# SPDX-License-Identifier: Apache-2.0
# What the makefiles beside this one begin with: NAMES of VOLUMES, and OUT/NAME/hr.nii, a cube of CUBE^3 voxels of
# each; clipped to CLIP, LO:HI in HU, if that is set. $(gather) makes one table of ROWS, files of a line below the names
# of its columns.
all:

stem = $(patsubst %.nii,%,$(patsubst %.gz,%,$(notdir $(1))))
NAMES = $(foreach v,$(VOLUMES),$(call stem,$(v)))

define scan
$(OUT)/$(call stem,$(1))/hr.nii: $(1)
	@mkdir -p $$(@D)
	ct-convert -q -f --cube $(CUBE) $$< $(if $(CLIP),- | ct-degrade -q -f -x 1 --clip=$(CLIP) - )$$@
endef
$(foreach v,$(VOLUMES),$(eval $(call scan,$(v))))

define gather
@head -q -n 1 $(firstword $(ROWS)) >$@.part
@for f in $(ROWS); do tail -n 1 $$f; done >>$@.part
@mv $@.part $@
endef
