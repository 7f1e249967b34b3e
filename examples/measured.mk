# SPDX-License-Identifier: Apache-2.0
# Scans that somebody else measured: the Helsinki Tomography Challenge 2022, and the tooth of tomopy.
#
#   git clone https://github.com/EricOldgren/KEX---CT-reconstruction kex    # data/HTC2022/TestData: *_full.mat and the like
#   git clone https://github.com/tomopy/tomopy                              # source/tomopy/data/tooth.h5
#   make -f examples/measured.mk HTC=kex/data/HTC2022/TestData TOOTH=tomopy/source/tomopy/data/tooth.h5
#
# Four minutes of CPU time. With `challenge` at the end: OUT/scores, a line of each of the 21 phantoms of the challenge, with
# the arc of its level, 90 to 30 degrees, and a picture of three; 16 minutes of CPU time more. With `joint`:
# OUT/joint-scores, the figures of 90 views beside a coarser CT, of each.
#
# In OUT/table: of each phantom the correlation of ct-fdk with the FBP of the organisers on their grid, in the circle
# of 250 pixels; then of arcs of VIEWS views (every half degree) the score of the challenge, Matthews' coefficient
# of the segmentation (Otsu's threshold) against that of the organisers of the full scan, by CGLS and by TV.
# Then what --water=auto does to cupping: density of the plastic within and without, and of holes. Then both figures of 90
# views of the full turn, on 256x256: the full scan (truth), the CT that is 8 times coarser, made of it and upsampled (up),
# and ct-fdk (fdk), ct-fdk -m tv (tv), ct-fuse (fuse) and ct-nabgs (nabgs) of the views. ct-nabgs knows no fan, so that is
# read as a cone of one row.
# OUT/*-arcs.png and *-joint.png show both. In OUT/scores: the correlation of ct-fdk of all views with the FBP of the
# organisers, the scores of their segmentation of the arc, and of ct-fdk -m tv of it; OUT/challenge.png shows three.
# doc/measured.md says what was found. Needs Python with nibabel and SciPy.
HTC =
TOOTH =
PHANTOMS = 01a
VIEWS = 181 121 61
TV = 1
JOINT = truth up fdk tv fuse nabgs
OUT = measured
PYTHON = python3
HERE := $(dir $(lastword $(MAKEFILE_LIST)))
SCORE = $(PYTHON) $(HERE)measured.py
SETTINGS = HTC TOOTH TV VIEWS JOINT
ifeq ($(HTC)$(if $(PHANTOMS),,none),)
$(error HTC=FOLDER: where are the .mat files of the challenge?)
endif
include $(HERE)scan.mk

all: $(OUT)/table $(foreach p,$(PHANTOMS),$(OUT)/$(p)-arcs.png $(OUT)/$(p)-joint.png)
	@cat $<

$(OUT)/table: $(foreach p,$(PHANTOMS),$(OUT)/$(p)-full.nii $(OUT)/$(p)-water.nii $(foreach n,$(VIEWS),$(OUT)/$(p)-tv-$(n).nii $(OUT)/$(p)-cgls-$(n).nii)) \
		$(foreach p,$(PHANTOMS),$(foreach m,$(JOINT),$(OUT)/$(p)-joint-$(m).nii)) $(if $(TOOTH),$(OUT)/tooth.nii)
	@for p in $(PHANTOMS); do $(SCORE) correlate $(HTC)/htc2022_$${p}_recon_fbp.mat $(OUT)/$$p-full.nii; \
		$(SCORE) segment $(HTC)/htc2022_$${p}_recon_fbp_seg.mat $(OUT)/$$p-cgls-*.nii $(OUT)/$$p-tv-*.nii; \
		$(SCORE) cupping $(HTC)/htc2022_$${p}_recon_fbp_seg.mat $(OUT)/$$p-full.nii $(OUT)/$$p-water.nii; \
		$(SCORE) correlate $(HTC)/htc2022_$${p}_recon_fbp.mat $(JOINT:%=$(OUT)/$$p-joint-%.nii); \
		$(SCORE) segment $(HTC)/htc2022_$${p}_recon_fbp_seg.mat $(JOINT:%=$(OUT)/$$p-joint-%.nii); done >$@.part
	@mv $@.part $@

# The pixels of the organisers, and twice as large ones.
draw = ct-view -p axial -l -o $@
$(OUT)/%-arcs.png: $(foreach n,$(VIEWS),$(OUT)/%-cgls-$(n).nii $(OUT)/%-tv-$(n).nii)
	@rm -f $@ && $(draw) -w 0:.045 $^
$(OUT)/%-joint.png: $(foreach m,$(JOINT),$(OUT)/%-joint-$(m).nii)
	@rm -f $@ && $(draw) -w -1000:800 $^

# The challenge itself: three phantoms a level, of each the views that its file of limited data has.
LEVELS = 1 2 3 4 5 6 7
DISCS = $(foreach l,$(LEVELS),0$(l)a 0$(l)b 0$(l)c)
SHOWN = 01b 04a 07a
challenge: $(OUT)/scores $(OUT)/challenge.png
	@cat $<
$(OUT)/challenge.png: $(foreach p,$(SHOWN),$(OUT)/$(p)-all.nii $(OUT)/$(p)-limited.nii)
	@rm -f $@ && $(draw) -w 0:.045 $^
$(OUT)/%-all.nii: $(OUT)/%-full.exr $(OUT)/grid256.nii
	ct-fdk -q -f --quantity density --grid $(OUT)/grid256.nii $< $@
$(OUT)/scores: $(foreach p,$(DISCS),$(OUT)/$(p)-full.nii $(OUT)/$(p)-limited.nii)
	@for p in $(DISCS); do seg=$(HTC)/htc2022_$${p}_recon_fbp_seg; \
		r=$$($(SCORE) correlate $(HTC)/htc2022_$${p}_recon_fbp.mat $(OUT)/$$p-full.nii); \
		s=$$($(SCORE) segment $$seg.mat $${seg}_limited.mat $(OUT)/$$p-limited.nii); \
		set -- $$p $$r $$s; echo $$1 $$3 $$6 $$8; done | awk '{n[$$1 + 0]++; r[$$1 + 0] += $$2; a[$$1 + 0] += $$3; b[$$1 + 0] += $$4; print} \
		END {for (l = 1; l in n; l++) printf "level %d: %.5f %.4f %.4f\n", l, r[l] / n[l], a[l] / n[l], b[l] / n[l]}' >$@.part
	@mv $@.part $@
# The last figures of each of the 21, and the means of each method.
joint: $(OUT)/joint-scores
	@cat $<
$(OUT)/joint-scores: $(foreach p,$(DISCS),$(foreach m,$(JOINT),$(OUT)/$(p)-joint-$(m).nii))
	@rm -f $@.all; for p in $(DISCS); do all="$(JOINT:%=$(OUT)/$$p-joint-%.nii)"; fbp=$(HTC)/htc2022_$${p}_recon_fbp; \
		$(SCORE) correlate $$fbp.mat $$all >$@.r && $(SCORE) segment $${fbp}_seg.mat $$all >$@.s && paste $@.r $@.s >>$@.all || exit; done
	@awk '{sub(/.*\//, "", $$1); sub(/-joint-/, " ", $$1); sub(/\.nii/, "", $$1); print $$1, $$2, $$5; \
			split($$1, is, " "); m = is[2]; if (!(m in n)) order[++k] = m; n[m]++; r[m] += $$2; s[m] += $$5} \
		END {for (i = 1; i <= k; i++) {m = order[i]; printf "mean of %d %s %.5f %.4f\n", n[m], m, r[m] / n[m], s[m] / n[m]}}' $@.all >$@.part
	@rm $@.r $@.s $@.all && mv $@.part $@
$(OUT)/%-limited.exr:
	@mkdir -p $(OUT)
	ct-convert -q -f --projections auto --mu-water .046 $(HTC)/htc2022_$*_limited.mat $@
$(OUT)/%-limited.nii: $(OUT)/%-limited.exr $(OUT)/grid256.nii
	ct-fdk -q -f -m tv -n 200 --nonnegative --tv $(TV) --quantity density --grid $(OUT)/grid256.nii $< $@

$(OUT)/grid%.nii:
	@mkdir -p $(OUT) && head -c $$(($* * $*)) /dev/zero >$@.raw
	mm=$$(awk 'BEGIN { print .2 * 410.66 / 553.74 * 512 / $* }') && \
	ct-convert -q -f --raw $*x$*x1:u8:$$mm,$$mm,.2 --orient RAS $@.raw $@ && rm $@.raw
# Density is attenuation in 1/mm; the plastic stands for water.
$(OUT)/%.exr:
	@mkdir -p $(OUT)
	ct-convert -q -f --projections auto --mu-water .046 \
		$(if $(filter full,$(lastword $(subst -, ,$*))),,--views 0:$(lastword $(subst -, ,$*))) \
		$(HTC)/htc2022_$(firstword $(subst -, ,$*))_full.mat $@
$(OUT)/%-water.exr:
	@mkdir -p $(OUT)
	ct-convert -v -f --projections auto --water auto --mu-water .046 $(HTC)/htc2022_$*_full.mat $@
$(OUT)/%-water.nii: $(OUT)/%-water.exr $(OUT)/grid512.nii
	ct-fdk -q -f --quantity density --grid $(OUT)/grid512.nii $< $@
$(OUT)/%-full.nii: $(OUT)/%-full.exr $(OUT)/grid512.nii
	ct-fdk -q -f --quantity density --grid $(OUT)/grid512.nii $< $@
define arc
$(OUT)/%-tv-$(1).nii: $(OUT)/%-$(1).exr $(OUT)/grid256.nii
	ct-fdk -q -f -m tv -n 200 --nonnegative --tv $(TV) --quantity density --grid $(OUT)/grid256.nii $$< $$@
$(OUT)/%-cgls-$(1).nii: $(OUT)/%-$(1).exr $(OUT)/grid256.nii
	ct-fdk -q -f -m cgls -n 15 --quantity density --grid $(OUT)/grid256.nii $$< $$@
endef
$(foreach n,$(VIEWS),$(eval $(call arc,$(n))))
# 90 views beside a coarser CT, in HU.
$(OUT)/cone.json:
	@mkdir -p $(OUT)
	awk 'BEGIN { printf "{\"unit\": \"mm\", \"mode\": \"cone\", \"DSO\": 410.66, \"DSD\": 553.74, \"nDetector\": [1, 560],"; \
		printf "\"dDetector\": [0.2, 0.2], \"angles\": ["; for (k = 0; k < 721; k++) printf "%s%g", k ? "," : "", k / 2; print "]}" }' >$@
$(OUT)/%-joint.exr: $(OUT)/cone.json
	ct-convert -q -f --projections integral --scanner $< --mu-water .046 --views 0:720:8 $(HTC)/htc2022_$*_full.mat $@
$(OUT)/%-joint-truth.nii: $(OUT)/%-full.exr $(OUT)/grid256.nii
	ct-fdk -q -f --grid $(OUT)/grid256.nii $< $@
$(OUT)/%-joint-lr.nii: $(OUT)/%-joint-truth.nii
	ct-degrade -q -f -x 8,8,1 $< $@
$(OUT)/%-joint-up.nii: $(OUT)/%-joint-lr.nii
	ct-upsample -q -f $< $@
$(OUT)/%-joint-fdk.nii: $(OUT)/%-joint.exr $(OUT)/grid256.nii
	ct-fdk -q -f --grid $(OUT)/grid256.nii $< $@
$(OUT)/%-joint-tv.nii: $(OUT)/%-joint.exr $(OUT)/grid256.nii
	ct-fdk -q -f -m tv -n 200 --nonnegative --tv $(TV) --grid $(OUT)/grid256.nii $< $@
$(OUT)/%-joint-fuse.nii: $(OUT)/%-joint-up.nii $(OUT)/%-joint-lr.nii $(OUT)/%-joint.exr
	ct-fuse -q -f --resume $^ $@
$(OUT)/%-joint-nabgs.nii: $(OUT)/%-joint-up.nii $(OUT)/%-joint-lr.nii $(OUT)/%-joint.exr
	ct-nabgs -q -f --resume -n 5000 -g 16000 -b $< --lr $(word 2,$^) $(word 3,$^) $(@:nii=ply)
	ct-compose -f $< $(@:nii=ply) $@
$(OUT)/tooth.nii: $(TOOTH)
	@mkdir -p $(OUT)
	ct-convert -q -f --projections auto $< $(OUT)/tooth.exr
	ct-fdk -v -f --find-centre --quantity density $(OUT)/tooth.exr $@
.PHONY: all challenge joint $(OUT)/table $(OUT)/scores $(OUT)/joint-scores
.SECONDARY:
