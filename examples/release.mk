# SPDX-License-Identifier: Apache-2.0
# How much of what the paper compares with is registration, on CTs of your own: interpolation as in its
# released programs, and the same at its place.
#
#   make -f examples/release.mk VOLUMES='chest.nii.gz head.nii.gz'
#
# cuts the middle out of each, at most MOST voxels along an axis, clips it from below as the release does, and
# reduces it as the release does (ct-degrade -p release: a Gaussian of one voxel, then every S-th voxel from the
# first one on). In OUT/table: PSNR (dB, of the range from -512 HU to the largest value) and SSIM (Wang 2004) of
#
#   zoom     what the release enlarges by, scipy.ndimage.zoom(order=1), which lays the first and the last voxel
#            of both grids upon each other, though no voxel of the CT lies there
#   zoom-3   its "cubic": the same of order 3, without a prefilter
#   cubic    cubic interpolation (Keys) at the place that the samples have
#   ct-sr    ct-sr with its defaults, likewise
#
# doc/release.md says what was found. Needs Python with nibabel and SciPy.
VOLUMES =
MOST = 192
FACTORS = 4 8
OUT = release
PYTHON = python3
HERE := $(dir $(lastword $(MAKEFILE_LIST)))
METHODS = zoom zoom-3 cubic ct-sr
CLIP = -512:100000
cut = --crop=$$$$($(PYTHON) $(HERE)release.py cut $$< $(MOST) 8)
SETTINGS = MOST
include $(HERE)scan.mk

ROWS = $(foreach n,$(NAMES),$(foreach f,$(FACTORS),$(foreach m,$(METHODS),$(OUT)/$(n)/$(f)x/$(m).row)))

all: $(OUT)/table
	@cat $<

$(OUT)/table: $(ROWS)
	@{ printf '%-34s %6s' scan factor; for m in $(METHODS); do printf ' %14s' $$m; done; echo; \
	for n in $(NAMES); do for f in $(FACTORS); do \
		printf '%-34s %6s' $$n $$f; \
		for m in $(METHODS); do awk '{printf " %7.2f %.4f", $$1, $$2}' $(OUT)/$$n/$${f}x/$$m.row; done; echo; \
	done; done; } >$@.part
	@mv $@.part $@

define refine
$(OUT)/%/$(1)x/lr.nii: $(OUT)/%/hr.nii
	@mkdir -p $$(@D)
	ct-degrade -q -f -x $(1) -p release $$< $$@
$(OUT)/%/$(1)x/zoom.nii: $(OUT)/%/$(1)x/lr.nii
	@$(PYTHON) $(HERE)release.py zoom $$< $$(@D)/../hr.nii 1 $$@
$(OUT)/%/$(1)x/zoom-3.nii: $(OUT)/%/$(1)x/lr.nii
	@$(PYTHON) $(HERE)release.py zoom $$< $$(@D)/../hr.nii 3 $$@
$(OUT)/%/$(1)x/cubic.nii: $(OUT)/%/$(1)x/lr.nii
	ct-convert -q -f --grid=$$(@D)/../hr.nii $$< $$@
$(OUT)/%/$(1)x/ct-sr.nii: $(OUT)/%/$(1)x/lr.nii
	ct-sr -q -f $$< - | ct-convert -q -f --grid=$$(@D)/../hr.nii - $$@
endef
$(foreach f,$(FACTORS),$(eval $(call refine,$(f))))

$(OUT)/%.row: $(OUT)/%.nii
	@hr=$(@D)/../hr.nii; top=$$($(PYTHON) $(HERE)release.py top $$hr); \
	ct-metrics -w -512:$$top --ssim wang $$hr $< >$@.part
	@awk '$$1 == "psnr" {p = $$2} $$1 ~ /^ssim/ {s = $$2} END {print p, s}' $@.part >$@ && rm $@.part

.PHONY: all $(OUT)/table
.SECONDARY:
