# SPDX-License-Identifier: Apache-2.0
# What the makefiles beside this one begin with: NAMES of VOLUMES, and OUT/NAME/hr.nii, a cube of CUBE^3 voxels of
# each, or as `cut` says; clipped to CLIP, LO:HI in HU, if that is set. $(gather) makes one table of ROWS, files of a line
# below the names of its columns.
#
# OUT is a folder of that makefile alone: new, empty, or made by it before, as OUT/made-by says. Another is refused, and so is
# one that was made with other values of SETTINGS, variables that what is in OUT follows from, or by another ct-sr.
# OUT/NAME/of says which files NAME was made of, and their times: of others what follows from it is made anew.
all:

# A step of a pipe that fails is a failure.
SHELL = bash
.SHELLFLAGS = -eo pipefail -c
.DELETE_ON_ERROR:
# Numbers have a point: some awks read and write those of the user's language.
export LC_ALL = C

quoted = '$(subst ','\'',$(1))'
# What make and the shell, or a table, read as something else. QUOTED=yes: the makefile takes it in OUT.
signs = '*[][:space:]"'\''`$$&;|<>()*?[{}\#%:\\~=,]*'
# $(call odd,NAME): does it have them?
odd = case $(1) in ('' | $$signs) true;; (*) false;; esac
allowed = is a name that make does not take: only letters, digits and -_.+@/
by := $(notdir $(firstword $(MAKEFILE_LIST)))
with := $(if $(SETTINGS),$(strip $(shell ct-sr --version) $(foreach s,$(SETTINGS) $(if $(CLIP),$(filter-out $(SETTINGS),CLIP)),$(s)=$($(s)))))
dry := $(findstring n,$(firstword -$(MAKEFLAGS)))
# Empty, or why OUT is refused.
unfit := $(shell out=$(call quoted,$(OUT)); with=$(call quoted,$(with)); signs=$(signs); \
	$(if $(QUOTED),,if $(call odd,$$out); then echo '$(allowed)'; exit; fi;) \
	ours() { [ "$$(sed 1q "$$out/made-by" 2>/dev/null)" = $(by) ]; }; holds=$$(ls -A "$$out" 2>&1) || :; \
	if [ ! -e "$$out" ] || [ -z "$$holds" ] || { [ "$$holds" = made-by ] && ours; }; then \
		$(if $(dry),exit;) \
		mkdir -p "$$out" && { echo $(by) && echo "$$with"; } >"$$out/made-by" || :; \
	fi; \
	if ! ours; then \
		echo 'holds files that are not of $(by), or cannot be made: name a folder that is new or empty'; \
	elif [ "$$(sed -n 2p "$$out/made-by")" != "$$with" ]; then \
		echo "was made with $$(sed -n 2p "$$out/made-by"), not $$with: name a folder that is new or empty"; \
	fi)
ifneq ($(unfit),)
$(error OUT=$(OUT) $(unfit))
endif

stem = $(patsubst %.nii,%,$(patsubst %.gz,%,$(notdir $(1:/=))))
ifneq ($(origin VOLUMES),undefined)
NAMES = $(foreach v,$(VOLUMES),$(call stem,$(v)))
ifneq ($(words $(NAMES)),$(words $(sort $(NAMES))))
$(error VOLUMES=$(VOLUMES) has two files of one name: give each another, since OUT/NAME is of one)
endif
unread := $(if $(VOLUMES),$(shell signs=$(signs); for v in $(foreach v,$(VOLUMES),$(call quoted,$(v))); do \
	if $(call odd,$$v); then echo "$$v $(allowed)"; \
	elif [ ! -e "$$v" ]; then echo "$$v: no file or folder of this name (make takes none with blanks)"; fi; done),name scans: files, or folders of DICOM)
ifneq ($(unread),)
$(error VOLUMES=$(VOLUMES): $(unread))
endif
endif
cut ?= --cube $(CUBE)

# $(call files_of,PATH): its files, their sizes and when they were changed, also if that is older than a result
files_of = find -L "$$(realpath -- $(1))" -printf '%p %s %T@\n' | LC_ALL=C sort
define scan
$(OUT)/$(call stem,$(1))/of: always
	@mkdir -p $$(@D)
	@$(call files_of,$(1)) >$$@.part
	@cmp -s $$@.part $$@ && rm $$@.part || mv $$@.part $$@
$(OUT)/$(call stem,$(1))/hr.nii: $(1:/=) $(OUT)/$(call stem,$(1))/of
	ct-convert -q -f $(cut) $$< $(if $(CLIP),- | ct-degrade -q -f -x 1 --clip=$(CLIP) - )$$@
endef
$(foreach v,$(VOLUMES),$(eval $(call scan,$(v))))
always:
.PHONY: always

# $(call named,OPTIONS): the files that they name: what follows from one that was changed is made anew
named = $(foreach f,$(wildcard $(subst =, ,$(1))),$(if $(wildcard $(f)/.),,$(f)))

define gather
@head -q -n 1 $(firstword $(ROWS)) >$@.part
@for f in $(ROWS); do tail -n 1 $$f; done >>$@.part
@mv $@.part $@
endef
