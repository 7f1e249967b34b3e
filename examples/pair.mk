# SPDX-License-Identifier: Apache-2.0
# What ctsr does for you: two reconstructions of one scan of yours, in thick and in thin slices, the thin ones as the truth.
#
#   make -f examples/pair.mk THICK=scan-5mm/ THIN=scan-1mm/ OUT=pair
#
# THICK and THIN are folders of DICOM, or files (NIfTI; one file of each series if a folder holds both). Both must have one
# frame of reference and the same voxels in plane; nothing is registered. Both are cropped to what both cover. THICK
# is refined to the slices of THIN by cubic interpolation and by ct-sr, and where ct-profile can measure the slice profile on
# the pair also by ct-sr --profile (PROFILE=no leaves it out): that one has seen the truth, and is the best to expect.
# OUT gets pair.md, the table, and pair.html, the page of ct-sr --report: PSNR as it is and after both were
# averaged in plane by a Gaussian of 1 and 2 pixels, sharpness, false and missed structures, the error of surfaces at SURFACES
# (HU), and the predicted error beside the measured one. The noise of THIN counts as error: rows "less noise"
# take it off, as ct-info measures it. OPTIONS are those of ct-sr. Python makes the table; it needs no modules.
THICK =
THIN =
OUT = pair
OPTIONS =
PROFILE = yes
SURFACES = 250,-500
WINDOW = -1024:3071
PYTHON = python3
export THICK THIN OPTIONS
here := $(dir $(lastword $(MAKEFILE_LIST)))
include $(here)scan.mk
py := $(here)pair.py
RUNS = cubic sr $(if $(filter yes,$(PROFILE)),profile)
PARTS = all 1 2
fit = eval "$$(cat $(OUT)/fit)";

all: $(OUT)/pair.md
	@cat $<

# Other inputs, options or another ctsr make all anew; other SURFACES or another WINDOW the figures.
renew = @cmp -s $@.part $@ && rm $@.part || mv $@.part $@
$(OUT)/inputs: always
	@for f in "$$THICK" "$$THIN"; do [ -e "$$f" ] || { echo "pair.mk: '$$f': no file or folder: THICK and THIN are two series of one scan" >&2; exit 2; }; done
	@{ ct-sr --version && printf '%s\n' "$$OPTIONS" && ls -lLR --full-time -- "$$THICK" "$$THIN"; } >$@.part
	$(renew)
$(OUT)/asked: $(OUT)/inputs always
	@echo '$(SURFACES) $(WINDOW)' >$@.part
	$(renew)

$(OUT)/thick-all.nii: $(OUT)/inputs
	@ct-convert -q -f --reorient=LPS -- "$$THICK" $@
$(OUT)/thin-all.nii: $(OUT)/inputs
	@ct-convert -q -f --reorient=LPS -- "$$THIN" $@
$(OUT)/fit: $(OUT)/thick-all.nii $(OUT)/thin-all.nii
	@$(PYTHON) $(py) fit $^ >$@.part
	@mv $@.part $@
$(OUT)/thick.nii $(OUT)/thin.nii: $(OUT)/%.nii: $(OUT)/fit
	@$(fit) ct-convert -q -f --crop="$$$*" $(OUT)/$*-all.nii $@

$(OUT)/cubic-fine.nii: $(OUT)/thick.nii
	@$(fit) ct-upsample -q -f -m cubic -x "1,1,$$factor" $< $@
$(OUT)/sr-fine.nii: $(OUT)/thick.nii
	@$(fit) ct-sr -q -f $(OPTIONS) -x "1,1,$$factor" --confidence=$(OUT)/std-fine.nii --report=$(OUT)/pair.html $< $@
$(OUT)/std-fine.nii: $(OUT)/sr-fine.nii
	@touch $@
# Empty, with the reason beside it, where the pair does not let it be measured.
$(OUT)/profile.txt: $(OUT)/thick.nii $(OUT)/thin.nii
	@if ct-info $< | grep '^  factor ' >/dev/null; then echo 'pair.mk: THICK says how it was made: no profile was measured' >$(OUT)/profile.log; : >$@; \
	else ct-profile -f $^ $@ 2>$(OUT)/profile.log || : >$@; fi
$(OUT)/profile-fine.nii: $(OUT)/thick.nii $(OUT)/profile.txt
	@$(fit) ct-sr -q -f $(OPTIONS) -x "1,1,$$factor" --profile=$(OUT)/profile.txt $< $@

# On the slices of THIN. Interpolation must not bring a predicted error below 0.
clipped = - | ct-degrade -q -f -x 1 --sigma 0 --clip=.01:1e5 -
define on_thin
$(OUT)/$(1)-on.nii: $(OUT)/$(1)-fine.nii $(OUT)/thin.nii
	@ct-convert -q -f --type=f32 --grid=$(OUT)/thin.nii $$< $(if $(filter std,$(1)),$(clipped)) $$@
endef
$(foreach r,cubic sr profile std,$(eval $(call on_thin,$(r))))

# Figures of RUN: all of them, and PSNR after averaging.
averaged = ct-degrade -q -f -x 1 --sigma $(1),$(1),0
define judge
$(OUT)/$(1)-all.json: $(OUT)/$(1)-on.nii $(OUT)/thin.nii $(OUT)/asked $(if $(filter sr,$(1)),$(OUT)/std-on.nii)
	@$$(fit) ct-metrics --json --harm --surface=$(SURFACES) -x "1,1,$$$$factor" -w $(WINDOW) $(if $(filter sr,$(1)),--uncertainty=$(OUT)/std-on.nii) \
		$(OUT)/thin.nii $$< >$$@.part
	@mv $$@.part $$@
$(OUT)/$(1)-1.json $(OUT)/$(1)-2.json: $(OUT)/$(1)-%.json: $(OUT)/$(1)-on.nii $(OUT)/thin-%.nii $(OUT)/asked
	@$$(call averaged,$$*) $$< $(OUT)/$(1)-$$*.nii
	@ct-metrics --json --ssim=none -w $(WINDOW) $(OUT)/thin-$$*.nii $(OUT)/$(1)-$$*.nii >$$@.part
	@rm $(OUT)/$(1)-$$*.nii
	@mv $$@.part $$@
endef
$(foreach r,cubic sr profile,$(eval $(call judge,$(r))))
$(OUT)/thin-1.nii $(OUT)/thin-2.nii: $(OUT)/thin-%.nii: $(OUT)/thin.nii
	@$(call averaged,$*) $< $@
$(OUT)/noise.json: $(OUT)/thin.nii
	@ct-info --operator --json $< >$@.part
	@mv $@.part $@

figures = $(foreach r,$(1),$(PARTS:%=$(OUT)/$(r)-%.json))
# The profile's are made only if there is one.
$(OUT)/pair.md: $(call figures,cubic sr) $(OUT)/noise.json $(if $(filter yes,$(PROFILE)),$(OUT)/profile.txt) always
	@if [ '$(PROFILE)' = yes ] && [ -s $(OUT)/profile.txt ]; then $(MAKE) -s -f $(firstword $(MAKEFILE_LIST)) OUT=$(OUT) $(call figures,profile); fi
	@$(PYTHON) $(py) table $(OUT) $(filter yes,$(PROFILE)) >$@.part
	@mv $@.part $@

always:
.PHONY: all always
