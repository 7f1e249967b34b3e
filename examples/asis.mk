# SPDX-License-Identifier: Apache-2.0
# Scans as they come: does what ct-sr makes of a scan that nothing says anything about stay in its range?
#
#   make -f examples/asis.mk VOLUMES='chest.nii.gz head.nii.gz'
#   make -f examples/asis.mk VOLUMES=bone.nii.gz UNITS=other
#
# cuts a cube from the middle of each, at most CUBE^3 voxels and so many that the result has about RESULT^3, refines it by
# each of FACTORS (1,1,4 is one axis) with ct-sr of each QUALITY, and prints a table: by how much cubic interpolation and
# ct-sr leave the range of the cube, in % of it, below and above, and how much ct-sr differs from cubic, HU RMS. A row is
# wrong if ct-sr leaves the range by more than cubic and 10 % more. The last line says how many are, and the status.
# Rows stay in OUT: a quarter of a minute a scan on one core.
VOLUMES =
CUBE = 64
RESULT = 80
FACTORS = 1.01 1.02 1.05 1.1 1.2 1.5 2 3 4 6 8
QUALITY = draft
UNITS =
SR = ct-sr
OUT = asis
SETTINGS = CUBE RESULT UNITS SR
include $(dir $(lastword $(MAKEFILE_LIST)))scan.mk

UNIT = $(if $(UNITS),--units $(UNITS))
ROWS = $(foreach n,$(NAMES),$(foreach x,$(FACTORS),$(foreach q,$(QUALITY),$(OUT)/$(n)/$(subst $(comma),-,$(x))-$(q).row)))
comma := ,

all: $(OUT)/table
	@cat $<
	@grep -q ' 0 wrong$$' $<
.PHONY: all $(OUT)/table

$(OUT)/table: $(ROWS)
	@printf '%-44s %-10s %-9s %7s %7s %7s %7s %9s\n' scan factor quality cubic- cubic+ ct-sr- ct-sr+ differs >$@
	@cat $^ >>$@
	@awk 'NR > 1 {n++; bad += $$9 == "wrong"} END {print n + 0 " rows, " bad + 0 " wrong"}' $@ >$@.end
	@cat $@.end >>$@ && rm $@.end

range = ct-info $(1) | awk '$$1 == "min" || $$1 == "max" {print $$2}'
# $(call refine,SCAN,NAME,FACTOR,QUALITY)
define refine
$(OUT)/$(2)/$(subst $(comma),-,$(3))-$(4).row: $(1) $(OUT)/$(2)/of
	@n=$$$$(echo $(3) | tr , '\n' | awk -v c=$(CUBE) -v r=$(RESULT) '{p = NR == 1 ? $$$$1 : p * $$$$1} END \
		{p = NR == 1 ? $$$$1 : p ^ (1 / 3); n = int(r / p); print n < c ? n : c}') && \
	ct-convert -q -f $(UNIT) --cube $$$$n $$< $$@.in.nii
	@ct-upsample -q -f $(UNIT) -m cubic -x $(3) $$@.in.nii $$@.cubic.nii
	@$(SR) -q -f $(UNIT) -Q $(4) -x $(3) $$@.in.nii $$@.out.nii
	@{ for v in in cubic out; do $$(call range,$$@.$$$$v.nii); done; ct-metrics --ssim none $$@.cubic.nii $$@.out.nii | \
		awk '$$$$1 == "rmse-hu" {print $$$$2}'; } | awk '{x[NR] = $$$$1} END {r = x[2] - x[1]; if (r <= 0) r = 1; \
		a = 100 * (x[1] - x[3]) / r; b = 100 * (x[4] - x[2]) / r; c = 100 * (x[1] - x[5]) / r; d = 100 * (x[6] - x[2]) / r; \
		bad = NR < 7 || !(c <= (a > 0 ? a : 0) + 10.01 && d <= (b > 0 ? b : 0) + 10.01); \
		printf "%-44s %-10s %-9s %7.1f %7.1f %7.1f %7.1f %9.1f%s\n", "$(2)", "$(3)", "$(4)", a, b, c, d, x[7], bad ? " wrong" : ""}' >$$@.part
	@rm $$@.in.nii $$@.cubic.nii $$@.out.nii && mv $$@.part $$@
endef
$(foreach v,$(VOLUMES),$(foreach x,$(FACTORS),$(foreach q,$(QUALITY),$(eval $(call refine,$(v),$(call stem,$(v)),$(x),$(q))))))
