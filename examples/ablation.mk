# SPDX-License-Identifier: Apache-2.0
# The second stage on CTs of your own: what each way to use super-resolved projections gives.
#
#   make -f examples/ablation.mk VOLUMES='chest.nii.gz head.nii.gz'
#
# cuts a cube from each, reduces it, and takes projections from three sources: `truth`, those of the
# cube itself, the most that any prior could give; `prior`, ct-ddnm from those of the refined
# volume; `paper`, ct-ddnm from pure noise. Then it prints
#   a table of PSNR (dB), SSIM (2-D, mean of three axes) in WINDOW, seconds and Gaussians for
#     cubic, tv            no projections: what ct-upsample makes
#     fdk                  ct-fdk of the projections
#     r2gs                 Gaussians of the whole volume, softplus, that begin from fdk (R2-Gaussian)
#     prelu softplus relu sine  the published residual on cubic, with each activation
#     gaussians, voxels    the residual on tv, with the low-resolution CT held: ours
#   (WINDOW=-512:3071 is the published one, which takes every lung out of the figures),
#   and the part of the residual's energy that N Gaussians of the residual on tv capture from `truth`.
# Files stay in OUT. An hour or two for a cube of 128^3 on two cores.
VOLUMES =
CUBE = 128
FACTOR = 4
PROTOCOL = P1
VIEWS = 100
WINDOW = -1024:3071
SOURCES = truth prior paper
METHODS = cubic tv fdk r2gs prelu softplus relu sine gaussians voxels
COUNTS = 1000 5000 20000 50000 100000
ITERATIONS = 5000
OUT = ablation
TIME = /usr/bin/time
include $(dir $(lastword $(MAKEFILE_LIST)))scan.mk

ROWS = $(foreach n,$(NAMES),$(foreach s,$(SOURCES),$(foreach m,$(METHODS),$(OUT)/$(n)/$(s)-$(m).row)))
CURVES = $(foreach n,$(NAMES),$(foreach c,$(COUNTS),$(OUT)/$(n)/count-$(c).row) $(OUT)/$(n)/truth-voxels.row)

all: table curve
	@cat $(OUT)/table $(OUT)/curve

.PHONY: all table curve
.SECONDARY:
table: $(OUT)/table
curve: $(OUT)/curve

$(OUT)/table: $(ROWS)
	@printf '%-36s %-6s %-10s %8s %7s %8s %9s\n' scan from method PSNR SSIM seconds Gaussians >$@
	@for n in $(NAMES); do for s in $(SOURCES); do for m in $(METHODS); do \
		awk -v n=$$n -v s=$$s -v m=$$m '{printf "%-36s %-6s %-10s %8.3f %7.4f %8.1f %9s\n", \
			n, s, m, $$1, $$2, $$3, $$4}' $(OUT)/$$n/$$s-$$m.row; done; done; done >>$@

# Energy captured: 1 - |truth - x|^2 / |truth - base|^2, from the PSNRs of both.
$(OUT)/curve: $(CURVES)
	@printf '\n%-36s %10s %9s %8s\n' scan Gaussians captured seconds >$@
	@for n in $(NAMES); do for c in $(addprefix count-,$(COUNTS)) truth-voxels; do \
		cat $(OUT)/$$n/truth-tv.row $(OUT)/$$n/$$c.row | awk -v n=$$n -v c=$${c#*-} 'NR == 1 {b = $$1} \
		NR == 2 {printf "%-36s %10s %8.1f%% %8.1f\n", n, c, 100 * (1 - 10 ^ ((b - $$1) / 10)), $$3}'; \
		done; done >>$@

# $*: OUT/NAME
%/lr.nii: %/hr.nii
	ct-degrade -q -f -x $(FACTOR) --protocol $(PROTOCOL) $< $@
%/cubic.nii: %/lr.nii
	ct-upsample -q -f -x $(FACTOR) -m cubic $< $@
%/tv.nii: %/lr.nii
	ct-upsample -q -f -x $(FACTOR) $< $@
%/truth.exr: %/hr.nii
	ct-project -q -f -w $(WINDOW) -n $(VIEWS) $< $@
%/tv.exr: %/tv.nii
	ct-project -q -f -w $(WINDOW) -n $(VIEWS) $< $@
%/prior.exr: %/tv.nii %/tv.exr
	ct-project -q -f -w $(WINDOW) -n $(VIEWS) --coarsen $(FACTOR) --pixel sinc $< $@.lr.exr
	ct-ddnm -q -f -x $(FACTOR) --init $*/tv.exr $@.lr.exr $@ && rm $@.lr.exr
%/paper.exr: %/lr.nii
	ct-project -q -f -w $(WINDOW) -n $(VIEWS) $< $@.lr.exr
	ct-ddnm -q -f -x $(FACTOR) $@.lr.exr $@ && rm $@.lr.exr

# $(call row,COMMAND): its seconds, the PSNR and SSIM of the $@.nii that it makes, and the Gaussians in
# $@.ply if it makes one.
define row
@$(TIME) -o $@.time -f %e sh -ec '$(1)'
@ct-metrics -w $(WINDOW) $(@D)/hr.nii $@.nii | awk '$$1 == "psnr" || $$1 == "ssim-r2" {printf "%s ", $$2}' >$@.part
@n=-; [ ! -f $@.ply ] || n=$$(ct-info $@.ply | awk '$$1 == "gaussians" {print $$2; exit}'); \
	echo "$$(cat $@.time) $$n" >>$@.part; rm -f $@.time $@.nii $@.ply; mv $@.part $@
endef
fit = ct-nabgs -q -f -n $(ITERATIONS) -x $(FACTOR)
# published: activation and other options; ours: options; both of the projections $<
published = $(call row,$(fit) --paper $(1) --base $(@D)/cubic.nii $< $@.ply; \
	ct-compose -q -f $(@D)/cubic.nii $@.ply $@.nii)
ours = $(call row,$(fit) $(1) --lr $(@D)/lr.nii --base $(@D)/tv.nii $< $@.ply; \
	ct-compose -q -f --consistent $(@D)/lr.nii $(@D)/tv.nii $@.ply $@.nii)

define source
%/$(1)-cubic.row: %/cubic.nii
	$$(call row,cp $$< $$@.nii)
%/$(1)-tv.row: %/tv.nii
	$$(call row,cp $$< $$@.nii)
%/$(1)-fdk.row: %/$(1).exr
	$$(call row,ct-fdk -q -f --grid $$(@D)/hr.nii $$< $$@.nii)
%/$(1)-r2gs.row: %/$(1).exr
	$$(call row,ct-fdk -q -f --grid $$(@D)/hr.nii $$< $$@.fdk.nii; $(fit) --paper -m full -a softplus --base $$@.fdk.nii $$< $$@.ply; \
		ct-compose -q -f $$@.fdk.nii $$@.ply $$@.nii; rm $$@.fdk.nii)
%/$(1)-gaussians.row: %/$(1).exr %/tv.nii
	$$(call ours,)
%/$(1)-voxels.row: %/$(1).exr %/tv.nii
	$$(call row,ct-fuse -q -f $$(@D)/tv.nii $$(@D)/lr.nii $$< $$@.nii)
endef
define activation
%/$(1)-$(2).row: %/$(1).exr %/cubic.nii
	$$(call published,-a $(2))
endef
define count
%/count-$(1).row: %/truth.exr %/tv.nii
	$$(call ours,-g $(1) --expert max-gaussians=$(1))
endef
$(foreach s,$(SOURCES),$(eval $(call source,$(s))))
$(foreach s,$(SOURCES),$(foreach a,prelu softplus relu sine,$(eval $(call activation,$(s),$(a)))))
$(foreach c,$(COUNTS),$(eval $(call count,$(c))))
