# SPDX-License-Identifier: Apache-2.0
# Scans that somebody else measured: the Helsinki Tomography Challenge 2022, and the tooth of tomopy.
#
#   git clone https://github.com/EricOldgren/KEX---CT-reconstruction kex    # data/HTC2022/TestData: *_full.mat and the like
#   git clone https://github.com/tomopy/tomopy                              # source/tomopy/data/tooth.h5
#   make -f examples/measured.mk HTC=kex/data/HTC2022/TestData TOOTH=tomopy/source/tomopy/data/tooth.h5
#
# In OUT/table: of each phantom the correlation of ct-fdk with the FBP of the organisers on their grid, in the circle
# of 250 pixels; then of arcs of VIEWS views (every half degree) the score of the challenge, Matthews' coefficient
# of the segmentation (Otsu's threshold) against that of the organisers of the full scan, by CGLS and by TV.
# doc/measured.md says what was found. Needs Python with nibabel and SciPy.
HTC =
TOOTH =
PHANTOMS = 01a
VIEWS = 181 121 61
TV = 30
OUT = measured
PYTHON = python3
HERE := $(dir $(lastword $(MAKEFILE_LIST)))
SCORE = $(PYTHON) $(HERE)measured.py

all: $(OUT)/table
	@cat $<

$(OUT)/table: $(foreach p,$(PHANTOMS),$(OUT)/$(p)-full.nii $(foreach n,$(VIEWS),$(OUT)/$(p)-tv-$(n).nii $(OUT)/$(p)-cgls-$(n).nii)) \
		$(if $(TOOTH),$(OUT)/tooth.nii)
	@for p in $(PHANTOMS); do $(SCORE) correlate $(HTC)/htc2022_$${p}_recon_fbp.mat $(OUT)/$$p-full.nii; \
		$(SCORE) segment $(HTC)/htc2022_$${p}_recon_fbp_seg.mat $(OUT)/$$p-cgls-*.nii $(OUT)/$$p-tv-*.nii; done >$@.part
	@mv $@.part $@

# The pixels of the organisers, and twice as large ones.
$(OUT)/grid%.nii:
	@mkdir -p $(OUT) && head -c $$(($* * $*)) /dev/zero >$@.raw
	mm=$$(awk 'BEGIN { print .2 * 410.66 / 553.74 * 512 / $* }') && \
	ct-convert -q -f --raw $*x$*x1:u8:$$mm,$$mm,.2 --orient RAS $@.raw $@ && rm $@.raw
# Density is attenuation in 1/mm; the plastic stands for water.
$(OUT)/%.exr:
	@mkdir -p $(OUT)
	ct-convert -q --projections auto --mu-water .046 \
		$(if $(filter full,$(lastword $(subst -, ,$*))),,--views 0:$(lastword $(subst -, ,$*))) \
		$(HTC)/htc2022_$(firstword $(subst -, ,$*))_full.mat $@
$(OUT)/%-full.nii: $(OUT)/%-full.exr $(OUT)/grid512.nii
	ct-fdk -q --quantity density --grid $(OUT)/grid512.nii $< $@
define arc
$(OUT)/%-tv-$(1).nii: $(OUT)/%-$(1).exr $(OUT)/grid256.nii
	ct-fdk -q -m tv -n 60 --nonnegative --tv $(TV) --quantity density --grid $(OUT)/grid256.nii $$< $$@
$(OUT)/%-cgls-$(1).nii: $(OUT)/%-$(1).exr $(OUT)/grid256.nii
	ct-fdk -q -m cgls -n 15 --quantity density --grid $(OUT)/grid256.nii $$< $$@
endef
$(foreach n,$(VIEWS),$(eval $(call arc,$(n))))
$(OUT)/tooth.nii: $(TOOTH)
	@mkdir -p $(OUT)
	ct-convert -q -f --projections auto $< $(OUT)/tooth.exr
	ct-fdk -v --find-centre --quantity density $(OUT)/tooth.exr $@
.SECONDARY:
