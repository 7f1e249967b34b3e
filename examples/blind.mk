# SPDX-License-Identifier: Apache-2.0
# What not knowing the operator costs, on CTs of your own: cubic interpolation, ct-sr that is given how the
# scan was made, and ct-sr that estimates it.
#
#   make -f examples/blind.mk VOLUMES='chest.nii.gz head.nii.gz'
#
# cuts a cube from each, reduces it as each of CASES says, and refines it in three ways. `blind` gets the
# voxels rounded to 16 bits, without a word of metadata. In OUT it leaves blind.csv, a line a result, with
# all that ct-metrics --harm says, and blind.txt, the table: PSNR and SSIM, false structures, the error and the
# banding inside soft tissue, and what blind loses. Python makes both; it needs no modules.
#
# A case is KIND-FACTOR, or KIND-FACTOR-iNN: the cube gets 15 HU of noise, is interpolated (linear) along z from slices
# NN/10 voxels apart, as many public scans were, and is the truth. NN/10 divides CUBE. P1, P1n, P3, P3n: a protocol of ct-degrade along every axis. mean, meann: means of
# FACTOR slices, n with 15 HU of noise. gNN, gNNn: slices of a Gaussian profile, sigma NN % of the thickness.
VOLUMES =
# Every factor of CASES divides it.
CUBE = 120
CASES = P1-4 P1n-4 P3-4 P1-2 P1-3 mean-2 mean-3 mean-4 meann-5 mean-8 g30-4 g37-4 g37n-5 g45-4
QUALITY = balanced
WINDOW = -1024:3071
OUT = blind
PYTHON = python3
HERE := $(dir $(lastword $(MAKEFILE_LIST)))
SETTINGS = CUBE QUALITY WINDOW
include $(dir $(lastword $(MAKEFILE_LIST)))scan.mk

comma = ,
kind = $(firstword $(subst -, ,$(1)))
times = $(word 2,$(subst -, ,$(1)))
soft = $(word 3,$(subst -, ,$(1)))
truth = hr$(addprefix -,$(call soft,$(1))).nii
protocol = $(filter P%,$(1))
factor = $(if $(call protocol,$(1)),$(call times,$(1)),1$(comma)1$(comma)$(call times,$(1)))
percent = $(patsubst g%,%,$(patsubst %n,%,$(call kind,$(1))))
noise = $(if $(filter P1n P3n meann g%n,$(call kind,$(1))),--noise 15)
gauss = --sigma 0,0,$$$$(awk 'BEGIN {print $(call percent,$(1)) / 100 * $(call times,$(1))}') --decimate point
degrade = $(if $(call protocol,$(1)),-p $(call kind,$(1)),$(if $(filter mean%,$(call kind,$(1))),--sigma 0 --decimate mean,$(call gauss,$(1))) $(call noise,$(1)))
cubic = ct-upsample -m cubic
known = ct-sr -Q $(QUALITY)
blind = ct-sr -Q $(QUALITY)
RUNS = cubic known blind
ROWS = $(foreach n,$(NAMES),$(foreach c,$(CASES),$(foreach r,$(RUNS),$(OUT)/$(n)/$(c)/$(r).csv)))

all: $(OUT)/blind.txt
	@cat $<

$(OUT)/blind.csv: $(ROWS)
	$(gather)

$(OUT)/blind.txt: $(OUT)/blind.csv
	@$(PYTHON) $(HERE)blind.py table $< >$@.part
	@mv $@.part $@

define reduce
$(OUT)/$(1)/$(2)/lr.nii: $(OUT)/$(1)/$(call truth,$(2))
	@mkdir -p $$(@D)
	ct-degrade -q -f -x $(call factor,$(2)) $(call degrade,$(2)) $$< $$@
$(OUT)/$(1)/$(2)/bare.nii: $(OUT)/$(1)/$(2)/lr.nii
	@$(PYTHON) $(HERE)blind.py bare $$< $$@
endef
$(foreach n,$(NAMES),$(foreach c,$(CASES),$(eval $(call reduce,$(n),$(c)))))

# the truth of cases -iNN
define soften
$(OUT)/$(1)/hr-i$(2).nii: $(OUT)/$(1)/hr.nii
	ct-degrade -q -f -x 1 --sigma 0 --noise 15 $$< $$(@D)/noisy-$(2).nii
	ct-degrade -q -f -x 1,1,$(3) --sigma 0 --decimate point $$(@D)/noisy-$(2).nii $$(@D)/apart-$(2).nii
	ct-upsample -q -f -m linear -x 1,1,$(3) $$(@D)/apart-$(2).nii $$(@D)/soft-$(2).nii
	@$(PYTHON) $(HERE)blind.py bare $$(@D)/soft-$(2).nii $$@
	@rm $$(@D)/noisy-$(2).nii $$(@D)/apart-$(2).nii $$(@D)/soft-$(2).nii
endef
tenths = $(shell LC_ALL=C awk 'BEGIN {print $(1) / 10}')
$(foreach n,$(NAMES),$(foreach i,$(sort $(foreach c,$(CASES),$(patsubst i%,%,$(call soft,$(c))))),$(eval $(call soften,$(n),$(i),$(call tenths,$(i))))))

# RUN of CASE of SCAN, a line of CSV beside the names of its columns
define refine
$(OUT)/$(1)/$(2)/$(3).csv: $(OUT)/$(1)/$(2)/$(if $(filter known,$(3)),lr,bare).nii
	$($(3)) -q -f -x $(call factor,$(2)) $$< $$(@:.csv=.nii)
	@ct-metrics --harm --csv -x $(call factor,$(2)) -w $(WINDOW) $(OUT)/$(1)/$(call truth,$(2)) $$(@:.csv=.nii) >$$(@:.csv=.metrics)
	@{ printf 'scan,case,run,'; head -n 1 $$(@:.csv=.metrics); printf '$(1),$(2),$(3),'; tail -n 1 $$(@:.csv=.metrics); } >$$@.part
	@rm $$(@:.csv=.nii)
	@mv $$@.part $$@
endef
$(foreach n,$(NAMES),$(foreach c,$(CASES),$(foreach r,$(RUNS),$(eval $(call refine,$(n),$(c),$(r))))))

.PHONY: all $(OUT)/blind.csv
