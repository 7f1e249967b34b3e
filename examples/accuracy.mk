# SPDX-License-Identifier: Apache-2.0
# Accuracy on CTs of your own: what every method of ct-upsample, and ct-sr, make of a scan that was reduced.
#
#   make -f examples/accuracy.mk VOLUMES='chest.nii.gz head.nii.gz'
#
# cuts a cube from each, reduces it, refines it again, and prints a table for each factor: PSNR (dB)
# and SSIM (2-D, mean of three axes) in WINDOW, the gain over cubic, false structures, bright and dark
# (ct-metrics --structures --expert blob-sigma=1.5), the error of texture deep in soft tissue (HU,
# deep-smooth-rmse-hu of --tissues), wall seconds, peak memory. Nothing
# is clipped but by that window: WINDOW=-1350:150 is the one that lungs are looked at in,
# WINDOW=-512:3071, the published one, takes them out of the figures. Files stay in OUT; make -j is
# fine, but then seconds are not those of a free machine.
VOLUMES =
CUBE = 128
FACTORS = 4 8
PROTOCOLS = P1 P2 P3
METHODS = linear cubic bspline sinc dc tv htv auto ct-sr
WINDOW = -1024:3071
OUT = accuracy
TIME = /usr/bin/time
SETTINGS = CUBE WINDOW
include $(dir $(lastword $(MAKEFILE_LIST)))scan.mk

CASES = $(foreach n,$(NAMES),$(foreach p,$(PROTOCOLS),$(foreach f,$(FACTORS),$(n)/$(p)x$(f))))
ROWS = $(foreach c,$(CASES),$(foreach m,$(sort cubic $(METHODS)),$(OUT)/$(c)/$(m).row))

all: $(OUT)/table
	@cat $<

$(OUT)/table: $(ROWS)
	@for f in $(FACTORS); do \
		printf '\n%sx, %s voxels\n' $$f '$(CUBE)^3'; \
		printf '%-36s %-4s %-8s %8s %7s %7s %7s %6s %7s %8s %5s\n' scan '' method PSNR SSIM gain gain \
			false deep seconds MiB; \
		for n in $(NAMES); do for p in $(PROTOCOLS); do \
			for m in $(METHODS); do \
				cat $(OUT)/$$n/$${p}x$$f/cubic.row $(OUT)/$$n/$${p}x$$f/$$m.row | \
				awk -v n=$$n -v p=$$p -v m=$$m 'NR == 1 {a = $$1; b = $$2} NR == 2 { \
					printf "%-36s %-4s %-8s %8.3f %7.4f %+7.2f %+7.3f %6d %7s %8.1f %5d\n", \
					n, p, m, $$1, $$2, $$1 - a, $$2 - b, $$3, $$4, $$5, $$6 / 1024}'; \
			done; \
		done; done; \
	done >$@

define reduce
$(OUT)/%/$(1)x$(2)/lr.nii: $(OUT)/%/hr.nii
	@mkdir -p $$(@D)
	ct-degrade -q -f -x $(2) --protocol $(1) $$< $$@
endef
$(foreach p,$(PROTOCOLS),$(foreach f,$(FACTORS),$(eval $(call reduce,$(p),$(f)))))

define refine
$(OUT)/$(1)/$(2).row: $(OUT)/$(1)/lr.nii $(OUT)/$(dir $(1))hr.nii
	@$(TIME) -o $$@.time -f '%e %M' $(if $(filter ct-sr,$(2)),ct-sr -q -f -x $(lastword $(subst x, ,$(1))),ct-upsample -q -f -m $(2)) $$< $$@.nii
	@ct-metrics -w $(WINDOW) --structures --expert blob-sigma=1.5 --tissues $(OUT)/$(dir $(1))hr.nii $$@.nii | \
		awk '{is[$$$$1] = $$$$2} END {d = is["deep-smooth-rmse-hu"]; printf "%s %s %s %s ", is["psnr"], \
			is["ssim-r2"], is["structures-false"], d ~ /nan/ ? "-" : sprintf("%.2f", d)}' | cat - $$@.time >$$@.part
	@rm $$@.nii $$@.time; mv $$@.part $$@
endef
$(foreach c,$(CASES),$(foreach m,$(sort $(METHODS) cubic),$(eval $(call refine,$(c),$(m)))))

.PHONY: all $(OUT)/table
.SECONDARY:
