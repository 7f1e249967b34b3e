# SPDX-License-Identifier: Apache-2.0
# What a prior of slices adds, on CTs of your own that it was not trained on.
#
#   make -f examples/prior.mk VOLUMES='chest.nii.gz head.nii.gz' PRIOR=slices.safetensors
#
# cuts a cube from each, clips it to CLIP, reduces it as each of CASES says (PROTOCOL:FACTOR:NOISE: P1, P2,
# P3 or mean, which is the mean of coarse voxels; S or X,Y,Z; HU), refines it with the solver alone and with
# the prior, and prints a table: PSNR (dB) and SSIM (2-D, mean of three axes) in WINDOW of cubic
# interpolation, of the solver, of the prior's volume, and what the prior gains over both; false structures
# of the three (ct-metrics --structures --expert blob-sigma=1.5), the rise of their edges (mm, --edges) and the error of
# their texture deep in soft tissue (HU, deep-smooth-rmse-hu of --tissues); the prior's seconds.
# Files stay in OUT. CUBE is to be a multiple of the factors.
VOLUMES =
PRIOR =
CUBE = 128
CLIP = -512:3071
WINDOW = -512:3071
CASES = P1:4:0 P3:4:0 P1:4:15 P1:8:0
RESTORE =
OUT = prior
TIME = /usr/bin/time
SETTINGS = PRIOR CUBE CLIP WINDOW RESTORE
include $(dir $(lastword $(MAKEFILE_LIST)))scan.mk
ifeq ($(wildcard $(PRIOR)),)
$(error PRIOR=$(PRIOR): no file of this name: PRIOR is what ct-train --kind=slices made)
endif

sampled = $(if $(filter mean,$(1)),--sigma 0 --decimate mean,-p $(1))
part = $(word $(2),$(subst :, ,$(1)))
DIRS = $(foreach n,$(NAMES),$(foreach c,$(CASES),$(n)/$(subst :,-,$(c))))

all: $(OUT)/table
	@cat $<

$(OUT)/table: $(DIRS:%=$(OUT)/%/row)
	@{ printf '%-36s %-12s %13s %13s %13s %12s %12s %13s %17s %20s %7s\n' scan case cubic solver prior \
		'over cubic' 'over solver' false 'rise, mm' 'deep, HU' seconds; \
	for d in $(DIRS); do \
		awk -v n="$${d%/*}" -v c="$${d#*/}" '{printf "%-36s %-12s %6.2f %.4f %6.2f %.4f %6.2f %.4f %+5.2f %+.3f %+5.2f %+.3f %4d %4d %3d %5s %5s %5s %6s %6s %6s %7.1f\n", \
			n, c, $$1, $$2, $$6, $$7, $$11, $$12, $$11 - $$1, $$12 - $$2, $$11 - $$6, $$12 - $$7, \
			$$3, $$8, $$13, $$4, $$9, $$14, $$5, $$10, $$15, $$16}' $(OUT)/$$d/row; \
	done; } >$@

define reduce
$(OUT)/$(1)/$(subst :,-,$(2))/lr.nii: $(OUT)/$(1)/hr.nii
	@mkdir -p $$(@D)
	ct-degrade -q -f -x $(call part,$(2),2) $(call sampled,$(call part,$(2),1)) --noise $(call part,$(2),3) $$< $$@
$(OUT)/$(1)/$(subst :,-,$(2))/row: $(OUT)/$(1)/$(subst :,-,$(2))/lr.nii $(PRIOR)
	ct-upsample -q -f -m cubic $$< $$(@D)/cubic.nii
	ct-upsample -q -f $$< $$(@D)/solver.nii
	$(TIME) -o $$(@D)/time -f %e ct-upsample -m prior -q -f -p $(PRIOR) $(RESTORE) $$< $$(@D)/prior.nii
	@for m in cubic solver prior; do \
		ct-metrics -w $(WINDOW) --structures --expert blob-sigma=1.5 --edges --tissues $(OUT)/$(1)/hr.nii $$(@D)/$$$$m.nii | awk '{is[$$$$1] = $$$$2} \
			END {d = is["deep-smooth-rmse-hu"]; e = is["edge-rise-test-mm"]; print is["psnr"], is["ssim-r2"], is["structures-false"], \
			e ~ /^[0-9]/ ? sprintf("%.2f", e) : "-", d ~ /nan/ ? "-" : sprintf("%.2f", d)}'; \
	done | cat - $$(@D)/time | tr '\n' ' ' >$$@.part
	@mv $$@.part $$@
endef
$(foreach n,$(NAMES),$(foreach c,$(CASES),$(eval $(call reduce,$(n),$(c)))))

.PHONY: all $(OUT)/table
.SECONDARY:
