# SPDX-License-Identifier: Apache-2.0
# What time buys, on CTs of your own: seconds and memory against accuracy and false structures.
#
#   make -f examples/trade.mk VOLUMES='chest.nii.gz head.nii.gz'
#
# cuts a cube from each, reduces it as each of CASES says, refines it by each of RUNS, and leaves in OUT
# trade.csv, a line a result: scan, case, run, CPU seconds, seconds, peak memory (MiB) and all that
# ct-metrics --harm and --surface=SURFACES say, structures of BLOBS voxels; trade.txt, means over the scans, and which runs are on the front: no other is as
# fast and as good by PSNR, SSIM, false structures and the error deep in soft tissue; and trade.svg, which
# draws that. The last two take Python with matplotlib. A result is a rule: what was made is not made again,
# and make -j is fine, but that seconds are then those of a busy machine.
#
# A case is a protocol of ct-degrade, FACTOR times along every axis, or thick: means of FACTOR slices.
# A run is a method of ct-upsample, or a word of ct-sr --quality, or paper or release, and any options of
# that command, :NAME=VALUE each, or :steps=N, calls of the network a view, of what goes by way of projections, or
# :threads=N. PROJECTIONS adds runs of PROJECT, VIEWS:STEPS:GAUSSIANS:ITERATIONS each; THREADS makes every run with
# each of these numbers of threads. A grid is a list of them; hours, at the published numbers:
#
#   PROJECTIONS="$(for v in 32 100; do for s in 10 50; do for g in 10000 50000; do echo $v:$s:$g:5000; done; done; done)"
VOLUMES =
CUBE = 128
FACTOR = 4
CASES = P1 P1n P3 P3n thick
RUNS = cubic bspline dc draft fast balanced
PROJECT = paper
PROJECTIONS =
THREADS =
WINDOW = -1024:3071
BLOBS = 1.5,3,6
SURFACES = 250,-500
OUT = trade
TIME = /usr/bin/time
PYTHON = python3
HERE := $(dir $(lastword $(MAKEFILE_LIST)))
SETTINGS = CUBE FACTOR WINDOW BLOBS SURFACES
include $(dir $(lastword $(MAKEFILE_LIST)))scan.mk

parts = $(subst :, ,$(1))
plain = $(subst :,_,$(subst =,-,$(1)))
# Of a run by way of projections some are keys of --expert.
keys = $(if $(filter paper release,$(firstword $(call parts,$(1)))),$(filter views=% iterations=% gaussians=%,$(call parts,$(1))))
empty =
space = $(empty) $(empty)
options = $(addprefix --,$(filter-out steps=% threads=% $(call keys,$(1)),$(wordlist 2,99,$(call parts,$(1))))) \
	$(if $(call keys,$(1)),--expert $(subst $(space),$(comma),$(strip $(call keys,$(1)))))
said = $(patsubst $(1)=%,%,$(filter $(1)=%,$(call parts,$(2))))
factor = $(if $(filter thick,$(1)),1$(comma)1$(comma)$(FACTOR),$(FACTOR))
comma = ,
METHODS = linear cubic bspline lanczos sinc dc tv htv
command = $(if $(filter $(METHODS),$(1)),ct-upsample -m $(1),$(if $(filter paper release,$(1)),ct-sr --$(1),ct-sr -Q $(1)))
way = $(PROJECT):views=$(word 1,$(1)):steps=$(word 2,$(1)):gaussians=$(word 3,$(1)):iterations=$(word 4,$(1))
SINGLE = $(RUNS) $(foreach p,$(PROJECTIONS),$(call way,$(call parts,$(p))))
GRID = $(if $(THREADS),$(foreach r,$(SINGLE),$(THREADS:%=$(r):threads=%)),$(SINGLE))
ROWS = $(foreach n,$(NAMES),$(foreach c,$(CASES),$(foreach r,$(GRID),$(OUT)/$(n)/$(c)/$(call plain,$(r)).csv)))

all: $(OUT)/trade.txt
	@cat $<

$(OUT)/trade.csv: $(ROWS)
	$(gather)

$(OUT)/trade.txt: $(OUT)/trade.csv
	@$(PYTHON) $(HERE)trade.py $< $(OUT)/trade.svg >$@.part
	@mv $@.part $@

define reduce
$(OUT)/$(1)/$(2)/lr.nii: $(OUT)/$(1)/hr.nii
	@mkdir -p $$(@D)
	ct-degrade -q -f -x $(call factor,$(2)) $(if $(filter thick,$(2)),--sigma 0 --decimate mean,-p $(2)) $$< $$@
endef
$(foreach n,$(NAMES),$(foreach c,$(CASES),$(eval $(call reduce,$(n),$(c)))))

# COMMAND IN OUT OPTIONS..., or with other steps, which ct-sr leaves to its presets, the commands that it would run
run = $(call command,$(firstword $(call parts,$(1)))) $(options)
with_steps = mkdir -p $(3).work && $(run) $(4) --keep $(3).work --dry-run $(2) $(3) | \
	sed "s/ --steps=[0-9]*//; s/^ct-ddnm /&--steps=$(call said,steps,$(1)) /" | sh -e >/dev/null; rm -r $(3).work
refined = $(if $(call said,steps,$(1)),$(with_steps),$(run) $(4) $(2) $(3))

# RUN of CASE of SCAN, a line of CSV beside the names of its columns
define refine
$(OUT)/$(1)/$(2)/$(call plain,$(3)).csv: $(OUT)/$(1)/$(2)/lr.nii $(call named,$(wordlist 2,99,$(call parts,$(3))))
	$(addprefix CT_THREADS=,$(call said,threads,$(3))) $(TIME) -o $$(@:.csv=.time) -f '%U %S %e %M' \
		$(SHELL) $(.SHELLFLAGS) '$(call refined,$(3),$$<,$$(@:.csv=.nii),-q -f -x $(call factor,$(2)))'
	@ct-metrics --harm --surface=$(SURFACES) --csv --expert blob-sigma=$(BLOBS) -w $(WINDOW) $(OUT)/$(1)/hr.nii $$(@:.csv=.nii) >$$(@:.csv=.metrics)
	@{ printf 'scan,case,run,cpu-s,seconds,peak-mib,'; head -n 1 $$(@:.csv=.metrics); \
		awk '{printf "$(1),$(2),$(3),%.2f,%.2f,%.1f,", $$$$1 + $$$$2, $$$$3, $$$$4 / 1024}' $$(@:.csv=.time); \
		tail -n 1 $$(@:.csv=.metrics); } >$$@.part
	@mv $$@.part $$@
endef
$(foreach n,$(NAMES),$(foreach c,$(CASES),$(foreach r,$(GRID),$(eval $(call refine,$(n),$(c),$(r))))))

.PHONY: all $(OUT)/trade.csv
