# SPDX-License-Identifier: Apache-2.0
# What each stage of the paper's chain is worth, on CTs of your own.
#
#   make -f examples/stages.mk VOLUMES='chest.nii.gz head.nii.gz' FACTORS='4 8' PROTOCOLS='P1 P3'
#
# cuts a cube from each, reduces it and prints a line for each row of ROWS, BASE:PROJECTIONS:FIT:
#   BASE         ct-upsample --method: cubic, the inversion (auto), or prior
#   PROJECTIONS  none: this stage is left out; ddnm: as measured, ct-ddnm of those of the base; truth: perfect,
#                those of the cube itself; published: ct-ddnm of those of the reduced cube, held to means
#   FIT          none: left out; gaussians: ct-nabgs and ct-compose, held to the reduced cube; voxels: ct-fuse;
#                published: ct-nabgs --paper; r2: R2-Gaussian, the whole volume from FDK; fdk: ct-fdk alone
# with the PSNR of its projections (dB of their largest value), and PSNR and SSIM (2-D, mean of three axes) of the
# volume in WINDOW. DDNM has options for ct-ddnm, as '-p mine.safetensors --expert t-start=60': the prior that is to
# be judged. A prior is worth the distance from its line to that of "none"; the line of "truth" is the most it can be.
# Files stay in OUT, and what was made is not made again.
VOLUMES =
CUBE = 64
FACTORS = 4
PROTOCOLS = P1
VIEWS = 100
WINDOW = -1024:3071
ITERATIONS = 5000
GAUSSIANS = 50000
ROWS = cubic:none:none cubic:published:published cubic:truth:published auto:none:none auto:ddnm:gaussians auto:ddnm:voxels \
	auto:truth:gaussians auto:truth:voxels prior:none:none prior:ddnm:gaussians prior:truth:gaussians
DDNM =
OUT = stages
SETTINGS = CUBE VIEWS WINDOW ITERATIONS GAUSSIANS DDNM
include $(dir $(lastword $(MAKEFILE_LIST)))scan.mk

CASES = $(foreach n,$(NAMES),$(foreach f,$(FACTORS),$(foreach p,$(PROTOCOLS),$(OUT)/$(n)/$(f)x-$(p))))
LINES = $(foreach c,$(CASES),$(foreach r,$(ROWS),$(c)/$(subst :,-,$(r)).row))

all: $(OUT)/table
	@cat $<
$(OUT)/table: $(LINES)
	@printf '%-28s %-6s %-6s %-10s %-10s %11s %7s %7s\n' scan case base made fit projections PSNR SSIM >$@
	@for f in $(LINES); do cat $$f; done >>$@

project = ct-project -q -f -n $(VIEWS) -w $(WINDOW)
fit = ct-nabgs -q -f -n $(ITERATIONS) -g $(GAUSSIANS)
# $(call db,TRUTH,OTHER): its PSNR in dB
db = ct-metrics $(3) $(1) $(2) | awk '$$1 == "psnr" {printf ($$2 == "inf" ? "%s" : "%.2f"), $$2}'

define case
$(1)/lr.nii: $(dir $(1))hr.nii
	@mkdir -p $$(@D)
	ct-degrade -q -f -x $(2) -p $(3) $$< $$@
$(1)/truth.exr: $(dir $(1))hr.nii
	@mkdir -p $$(@D)
	$$(project) $$< $$@
$(1)/lr.exr: $(1)/lr.nii
	$$(project) $$< $$@
$(foreach b,cubic auto prior,$(call base,$(1),$(b)))
$(foreach r,$(ROWS),$(call rows,$(1),$(subst :, ,$(r)),$(subst :,-,$(r)),$(2)x $(3)))
endef
# $(call base,FOLDER,METHOD)
define base
$(1)/$(2).nii: $(1)/lr.nii
	ct-upsample -q -f -m $(2) $$< $$@
$(1)/$(2)-none.exr: $(1)/$(2).nii
	$$(project) $$< $$@
$(1)/$(2)-ddnm.exr: $(1)/$(2)-none.exr $(call named,$(DDNM))
	ct-ddnm -q -f $$(DDNM) $$< $$@
$(1)/$(2)-truth.exr: $(1)/truth.exr
	cp $$< $$@.part && mv $$@.part $$@
$(1)/$(2)-published.exr: $(1)/lr.exr
	ct-ddnm -q -f --sigma-y=0.0015 $$< $$@
$(1)/$(2)-%-none.nii: $(1)/$(2).nii $(1)/$(2)-%.exr
	cp $$< $$@.part && mv $$@.part $$@
$(1)/$(2)-%-gaussians.nii: $(1)/$(2).nii $(1)/$(2)-%.exr
	$$(fit) -b $$< --lr $(1)/lr.nii $(1)/$(2)-$$*.exr $$@.ply
	ct-compose -q -f --consistent $(1)/lr.nii $$< $$@.ply $$@
$(1)/$(2)-%-voxels.nii: $(1)/$(2).nii $(1)/$(2)-%.exr
	ct-fuse -q -f $$< $(1)/lr.nii $(1)/$(2)-$$*.exr $$@
$(1)/$(2)-%-published.nii: $(1)/$(2).nii $(1)/$(2)-%.exr
	$$(fit) --paper -b $$< $(1)/$(2)-$$*.exr $$@.ply
	ct-compose -q -f $$< $$@.ply $$@
$(1)/$(2)-%-fdk.nii: $(1)/$(2).nii $(1)/$(2)-%.exr
	ct-fdk -q -f --grid $$< $(1)/$(2)-$$*.exr $$@
$(1)/$(2)-%-r2.nii: $(1)/$(2)-%-fdk.nii $(1)/$(2)-%.exr
	$$(fit) --paper -m full -a softplus -b $$< $(1)/$(2)-$$*.exr $$@.ply
	ct-compose -q -f $$< $$@.ply $$@

endef
# $(call rows,FOLDER,BASE PROJECTIONS FIT,its name,CASE)
define rows
$(1)/$(3).row: $(1)/$(3).nii $(1)/truth.exr
	@p=$$$$($$(call db,$(1)/truth.exr,$(1)/$(word 1,$(2))-$(word 2,$(2)).exr,)); \
	v=$$$$(ct-metrics -w $$(WINDOW) $(dir $(1))hr.nii $$< | awk '$$$$1 == "psnr" || $$$$1 == "ssim-r2" {printf "%.4f ", $$$$2}'); \
	set -- $(4) $(2) $$$$p $$$$v; \
	printf '%-28s %-2s %-3s %-6s %-10s %-10s %11s %7.2f %7.4f\n' $(notdir $(patsubst %/,%,$(dir $(1)))) "$$$$@" >$$@

endef
$(foreach n,$(NAMES),$(foreach f,$(FACTORS),$(foreach p,$(PROTOCOLS),$(eval $(call case,$(OUT)/$(n)/$(f)x-$(p),$(f),$(p))))))

.PHONY: all $(OUT)/table
.SECONDARY:
