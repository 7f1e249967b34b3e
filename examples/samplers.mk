# SPDX-License-Identifier: Apache-2.0
# The samplers of ct-ddnm on CTs of your own: what each makes of the same low-resolution projections.
#
#   make -f examples/samplers.mk VOLUMES='chest.nii.gz head.nii.gz'
#
# cuts a cube from each, reduces it, takes the projections of the reduced cube, as published, or with
# PIXEL=mean those of the cube itself with larger pixels, super-resolves them with each of SAMPLERS and
# prints a table: PSNR (dB) and SSIM of the projections against those of the cube, how far the means of
# their pixels are from what they were made of (root mean square, percent of the largest value), calls
# of the network and of its derivative a view, and seconds. `ddnm-near` and `none-near` begin with the
# projections of the refined cube instead. Options of a sampler: OPTIONS_gdp='--expert guidance=500'.
# Files stay in OUT. A call on 128^2 pixels takes about 0.1 s, and bird makes 1990 a view: hours for many
# views.
VOLUMES =
CUBE = 128
FACTOR = 4
PROTOCOL = P1
VIEWS = 4
PIXEL =
WINDOW = -512:3071
SAMPLERS = none ddnm ddnm+ simple ddim ddpm dpm-solver++ gdp bird-chain bird none-near ddnm-near
OUT = samplers
TIME = /usr/bin/time
SETTINGS = CUBE FACTOR PROTOCOL VIEWS PIXEL WINDOW $(sort $(filter OPTIONS_%,$(.VARIABLES)))
include $(dir $(lastword $(MAKEFILE_LIST)))scan.mk

ROWS = $(foreach s,$(SAMPLERS),$(foreach n,$(NAMES),$(OUT)/$(n)/$(s).row))

all: $(OUT)/table
	@cat $<

.SECONDARY:
.PHONY: all $(OUT)/table
$(OUT)/table: $(ROWS)
	@printf '%-36s %-14s %6s %7s %7s %6s %6s %8s\n' scan sampler PSNR SSIM error calls back seconds >$@
	@for n in $(NAMES); do for s in $(SAMPLERS); do \
		awk -v n=$$n -v s=$$s '{printf "%-36s %-14s %6.2f %7.4f %7.2f %6d %6d %8.1f\n", \
			n, s, $$1, $$2, $$3, $$4, $$5, $$6}' $(OUT)/$$n/$$s.row; done; done >>$@

# $*: OUT/NAME
%/lr.nii: %/hr.nii
	ct-degrade -q -f -x $(FACTOR) --protocol $(PROTOCOL) $< $@
%/up.nii: %/lr.nii
	ct-upsample -q -f -x $(FACTOR) $< $@
%/truth.exr: %/hr.nii
	ct-project -q -f -w $(WINDOW) -n $(VIEWS) $< $@
%/up.exr: %/up.nii
	ct-project -q -f -w $(WINDOW) -n $(VIEWS) $< $@
ifeq ($(PIXEL),)
%/low.exr: %/lr.nii
	ct-project -q -f -w $(WINDOW) -n $(VIEWS) $< $@
else
%/low.exr: %/hr.nii
	ct-project -q -f -w $(WINDOW) -n $(VIEWS) --coarsen $(FACTOR) --pixel $(PIXEL) $< $@
endif

# The numbers before and after "of" in what a dry run says: calls of the network, and of its derivative.
define row
%/$(1).row: %/truth.exr %/low.exr %/up.exr $(call named,$(OPTIONS_$(1)))
	@ct-ddnm --dry-run -x $(FACTOR) $(2) $$(OPTIONS_$(1)) $$*/low.exr $$@.exr | \
		awk -v v=$(VIEWS) '$$$$1 == "work" {n = $$$$2; if (split($$$$0, part, ", ") > 1) d = part[2] + 0; \
			print n / v, d / v}' >$$@.calls
	@$(TIME) -o $$@.time -f %e ct-ddnm -q -f -x $(FACTOR) $(2) $$(OPTIONS_$(1)) $$*/low.exr $$@.exr
	@ct-metrics --consistency $$*/low.exr $$*/truth.exr $$@.exr | \
		awk '/^(psnr|ssim-wang|residual-percent) / {printf "%s ", $$$$2} END {print ""}' >$$@.part
	@paste -d ' ' $$@.part $$@.calls $$@.time >$$@.all && rm $$@.part $$@.calls $$@.time && mv $$@.all $$@
endef
near = --init $$*/up.exr
$(foreach s,none ddnm ddnm+ simple ddim ddpm dpm-solver++ gdp bird,$(eval $(call row,$(s),--sampler $(s))))
$(eval $(call row,bird-chain,--sampler bird --expert gradient=chain))
$(eval $(call row,none-near,--sampler none $(near)))
$(eval $(call row,ddnm-near,--sampler ddnm --expert eta=0 --steps 2 --expert t-start=20 $(near)))
