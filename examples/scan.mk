# SPDX-License-Identifier: Apache-2.0
# What the makefiles beside this one begin with: NAMES of VOLUMES, and OUT/NAME/hr.nii, a cube of CUBE^3 voxels of
# each, or as `cut` says; clipped to CLIP, LO:HI in HU, if that is set. $(gather) makes one table of ROWS, files of a line
# below the names of its columns.
#
# OUT is a folder of that makefile alone: new, empty, or made by it before, as OUT/made-by says. Another is refused.
all:

by := $(notdir $(firstword $(MAKEFILE_LIST)))
own := $(shell out='$(subst ','\'',$(OUT))'; \
	if [ -n "$$out" ] && [ -z "$$(ls -A "$$out" 2>&1)" -o ! -e "$$out" ]; then \
		$(if $(findstring n,$(firstword -$(MAKEFLAGS))),echo yes; exit;) \
		mkdir -p "$$out" && echo $(by) >"$$out/made-by"; \
	fi; [ "$$(cat "$$out/made-by" 2>/dev/null)" = $(by) ] && echo yes)
ifneq ($(own),yes)
$(error OUT=$(OUT) holds files that are not of $(by), or cannot be made: name a folder that is new or empty)
endif

stem = $(patsubst %.nii,%,$(patsubst %.gz,%,$(notdir $(1))))
NAMES = $(foreach v,$(VOLUMES),$(call stem,$(v)))
ifneq ($(words $(NAMES)),$(words $(sort $(NAMES))))
$(error VOLUMES=$(VOLUMES) has two files of one name: give each another, since OUT/NAME is of one)
endif
cut ?= --cube $(CUBE)

define scan
$(OUT)/$(call stem,$(1))/hr.nii: $(1)
	@mkdir -p $$(@D)
	ct-convert -q -f $(cut) $$< $(if $(CLIP),- | ct-degrade -q -f -x 1 --clip=$(CLIP) - )$$@
endef
$(foreach v,$(VOLUMES),$(eval $(call scan,$(v))))

define gather
@head -q -n 1 $(firstword $(ROWS)) >$@.part
@for f in $(ROWS); do tail -n 1 $$f; done >>$@.part
@mv $@.part $@
endef
