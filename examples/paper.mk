# SPDX-License-Identifier: Apache-2.0
# The published tables on CTs of your own, beside the published figures.
#
#   make -f examples/paper.mk VOLUMES='chest.nii.gz head.nii.gz'
#
# cuts a cube from each, clips it to the published window, reduces it by FACTORS (P1 of ct-degrade: a
# Gaussian, then sinc, as the paper says, which gives no width; P2 has that of its release at 4x), and prints
# for each: table 1, whole methods; table 2, what super-resolves projections, behind it the published
# residual of Gaussians; table 3, what makes a volume of the super-resolved projections, and activations of the
# Gaussians. PSNR (dB) and SSIM (Wang 2004, 2-D, mean of three axes) are means over VOLUMES in that window; the
# published ones are of the ten test scans of UHRCT.
#
# What is comparable: the form of the operator, the window, the measures, the order of the rows, and what a row gains over
# trilinear and cubic. What is not: the scans, which are others and smaller (512^3 there), and what was trained,
# on far fewer and smaller pictures; so the figures themselves are not. Neural fields get BUDGET, CPU seconds or
# iterations (ct-field --budget), where the published ones took hours on a GPU; NETWORK, as 4x64, makes those of
# nerf and cunerf smaller. Supervised networks are read from WEIGHTS, files as src/prior/README.md makes them:
# rdn-4, omni-4, rdn-8, omni-8 and arssr, .safetensors. CPU seconds, a mean, and MiB, the largest, are of all
# commands behind a row.
#
# Each row is ct-sr --paper but for what its name says; ctsr is ct-sr as it is. Files stay in OUT, and what was
# made is not made again. At the published size, 100 views of 128^2 pixels, a cube of 128^3 takes about an hour
# on two cores without neural fields and bird, which gets BIRD chains: the 100 published ones take a day.
VOLUMES =
CUBE = 128
FACTORS = 4 8
VIEWS = 100
STEPS = 50
ITERATIONS = 5000
GAUSSIANS = 50000
BUDGET = 300s
NETWORK =
WEIGHTS = $(dir $(lastword $(MAKEFILE_LIST)))../src/prior
BIRD = 10
OUT = paper
WINDOW = -512:3071
CLIP = $(WINDOW)

# method and published PSNR, SSIM: 4x, 8x
TABLE1 = trilinear:24.56:.8877:21.14:.8125 cubic:24.61:.8783:21.46:.8013 nerf:20.86:.6745:18.92:.5797 \
	cunerf:25.25:.8459:21.04:.7572 arssr:22.78:.8936:21.10:.8336 paper:25.42:.8957:21.96:.8172 ctsr
TABLE2 = bilinear:24.57:.8244:21.34:.8015 rdn:23.78:.6410:21.41:.6946 omni:22.74:.5621:20.56:.5992 \
	bird:20.18:.8111:19.62:.7845 gdp:22.84:.8485:21.00:.8075 paper:25.42:.8957:21.96:.8172
TABLE3 = fdk:21.88:.5375:19.39:.4337 naf:24.23:.8559:21.66:.7982 sax-nerf:24.81:.8719:21.40:.7826 \
	r2-gs:24.89:.8839:21.25:.8056 softplus:24.71:.8790:21.61:.8022 relu:24.62:.8784:21.57:.8021 \
	sine:25.19:.8475:21.26:.7208 paper:25.42:.8957:21.96:.8172
TIME = /usr/bin/time
weights := $(realpath $(WEIGHTS))
SETTINGS = CUBE VIEWS STEPS ITERATIONS GAUSSIANS BUDGET NETWORK weights BIRD WINDOW CLIP
include $(dir $(lastword $(MAKEFILE_LIST)))scan.mk

method = $(firstword $(subst :, ,$(1)))
METHODS = $(sort $(foreach r,$(TABLE1) $(TABLE2) $(TABLE3),$(call method,$(r))))
ROWS = $(foreach n,$(NAMES),$(foreach f,$(FACTORS),$(foreach m,$(METHODS),$(OUT)/$(n)/$(f)x/$(m).row)))

all: $(OUT)/tables
	@cat $<

# $(call table,NUMBER,ROWS)
define table
for f in $(FACTORS); do \
	printf '\ntable $(1), %sx %21s %7s %7s %6s   %9s\n' $$f PSNR SSIM 'CPU s' MiB published; \
	for r in $(2); do \
		m=$${r%%:*}; said=$$(echo "$$r" | awk -F: -v f=$$f 'NF == 5 && (f == 4 || f == 8) {print $$(f / 2), $$(f / 2 + 1)}'); \
		[ "$$f" != 8 ] || said=$$(echo "$$r" | awk -F: 'NF == 5 {print $$4, $$5}'); \
		set -- $$(for n in $(NAMES); do cat $(OUT)/$$n/$${f}x/$$m.row; done | \
			awk '{p += $$1; s += $$2; t += $$3; if ($$4 > k) k = $$4} \
				END {printf "%.2f %.4f %.1f %.0f", p / NR, s / NR, t / NR, k}'); \
		printf '%-22s %12s %7s %7s %6s   %9s %7s\n' "$$m" "$$1" "$$2" "$$3" "$$4" $${said:-- -}; \
	done; \
done
endef

$(OUT)/tables: $(ROWS)
	@{ $(call table,1,$(TABLE1)); $(call table,2,$(TABLE2)); $(call table,3,$(TABLE3)); } >$@.part
	@mv $@.part $@

# Behind each method, files whose costs are its own.
PROJECTED = lr.exr cubic.nii cubic.exr
parts_fdk = lr.exr cubic.nii paper.exr
parts_naf = $(parts_fdk)
parts_sax-nerf = $(parts_fdk)
parts_r2-gs = $(parts_fdk) fdk.nii r2-gs.ply
$(foreach a,softplus relu sine,$(eval parts_$(a) = $(PROJECTED) paper.exr $(a).ply))
$(foreach m,paper bilinear rdn omni gdp bird,$(eval parts_$(m) = $(PROJECTED) $(m).exr $(m).ply))

timed = $(TIME) -f '%U %S %M' -o $@.time
project = $(timed) ct-project -q -f --views=$(VIEWS) --window=$(WINDOW) --overshoot
fit = $(timed) ct-nabgs -q -f --iterations=$(ITERATIONS) --gaussians=$(GAUSSIANS) --paper
field = $(timed) ct-field -q -f --budget=$(BUDGET)
define refine
$(OUT)/%/$(1)x/lr.nii: $(OUT)/%/hr.nii
	@mkdir -p $$(@D)
	ct-degrade -q -f -x $(1) -p P1 $$< $$@
$(OUT)/%/$(1)x/trilinear.nii: $(OUT)/%/$(1)x/lr.nii
	$$(timed) ct-upsample -q -f -m linear $$< $$@
$(OUT)/%/$(1)x/cubic.nii: $(OUT)/%/$(1)x/lr.nii
	$$(timed) ct-upsample -q -f -m cubic $$< $$@
$(OUT)/%/$(1)x/arssr.nii: $(OUT)/%/$(1)x/lr.nii $(WEIGHTS)/arssr.safetensors
	$$(timed) ct-upsample -q -f -m arssr --prior=$(WEIGHTS)/arssr.safetensors $$< $$@
$(OUT)/%/$(1)x/ctsr.nii: $(OUT)/%/$(1)x/lr.nii
	$$(timed) ct-sr -q -f -x $(1) $$< $$@
$(OUT)/%/$(1)x/cubic.exr: $(OUT)/%/$(1)x/cubic.nii
	$$(project) $$< $$@
$(OUT)/%/$(1)x/lr.exr: $(OUT)/%/$(1)x/lr.nii
	$$(project) $$< $$@
$(OUT)/%/$(1)x/paper.exr: $(OUT)/%/$(1)x/lr.exr
	$$(timed) ct-ddnm -q -f -x $(1) --steps=$(STEPS) --sigma-y=0.0015 $$< $$@
$(OUT)/%/$(1)x/bilinear.exr: $(OUT)/%/$(1)x/lr.exr
	$$(timed) ct-ddnm -q -f -x $(1) --sampler none $$< $$@
$(OUT)/%/$(1)x/gdp.exr: $(OUT)/%/$(1)x/lr.exr
	$$(timed) ct-ddnm -q -f -x $(1) --steps=$(STEPS) --sampler gdp $$< $$@
$(OUT)/%/$(1)x/bird.exr: $(OUT)/%/$(1)x/lr.exr
	$$(timed) ct-ddnm -q -f -x $(1) --sampler bird --expert iterations=$(BIRD) $$< $$@
$(foreach m,rdn omni,
$(OUT)/%/$(1)x/$(m).exr: $(OUT)/%/$(1)x/lr.exr $(WEIGHTS)/$(m)-$(1).safetensors
	$$(timed) ct-ddnm -q -f -x $(1) --prior=$(WEIGHTS)/$(m)-$(1).safetensors $$< $$@)
$(foreach m,paper bilinear rdn omni gdp bird,
$(OUT)/%/$(1)x/$(m).ply: $(OUT)/%/$(1)x/$(m).exr $(OUT)/%/$(1)x/cubic.exr $(OUT)/%/$(1)x/cubic.nii
	$$(fit) --factor=$(1) --base=$$(@D)/cubic.nii --base-projections=$$(@D)/cubic.exr $$< $$@)
$(foreach a,softplus relu sine,
$(OUT)/%/$(1)x/$(a).ply: $(OUT)/%/$(1)x/paper.exr $(OUT)/%/$(1)x/cubic.exr $(OUT)/%/$(1)x/cubic.nii
	$$(fit) --factor=$(1) --activation=$(a) --base=$$(@D)/cubic.nii --base-projections=$$(@D)/cubic.exr $$< $$@)
$(foreach m,paper bilinear rdn omni gdp bird softplus relu sine,
$(OUT)/%/$(1)x/$(m).nii: $(OUT)/%/$(1)x/$(m).ply
	$$(timed) ct-compose -q -f $$(@D)/cubic.nii $$< $$@)
$(OUT)/%/$(1)x/fdk.nii: $(OUT)/%/$(1)x/paper.exr $(OUT)/%/$(1)x/cubic.nii
	$$(timed) ct-fdk -q -f --grid=$$(@D)/cubic.nii $$< $$@
$(OUT)/%/$(1)x/r2-gs.ply: $(OUT)/%/$(1)x/paper.exr $(OUT)/%/$(1)x/fdk.nii
	$$(fit) --factor=$(1) --mode=full --activation=softplus --base=$$(@D)/fdk.nii $$< $$@
$(OUT)/%/$(1)x/r2-gs.nii: $(OUT)/%/$(1)x/r2-gs.ply
	$$(timed) ct-compose -q -f $$(@D)/fdk.nii $$< $$@
$(foreach m,nerf cunerf,
$(OUT)/%/$(1)x/$(m).nii: $(OUT)/%/$(1)x/lr.nii
	$$(field) --like=$(m) $(if $(NETWORK),--network=$(NETWORK)) $$< $$@)
$(foreach m,naf sax-nerf,
$(OUT)/%/$(1)x/$(m).nii: $(OUT)/%/$(1)x/paper.exr $(OUT)/%/$(1)x/cubic.nii
	$$(field) --like=$(m) --grid=$$(@D)/cubic.nii $$< $$@)
endef
$(foreach f,$(FACTORS),$(eval $(call refine,$(f))))

$(OUT)/%.row: $(OUT)/%.nii
	@ct-metrics -w $(WINDOW) --ssim wang $(@D)/../hr.nii $< >$@.part
	@cat $(addprefix $(@D)/,$(addsuffix .time,$(parts_$(notdir $*)) $(notdir $*).nii)) | \
		awk '{t += $$1 + $$2; if ($$3 > k) k = $$3} END {print t, k / 1024}' >>$@.part
	@awk '$$1 == "psnr" {p = $$2} $$1 ~ /^ssim/ {s = $$2} END {print p, s, $$1, $$2}' $@.part >$@ && rm $@.part

.PHONY: all $(OUT)/tables
.SECONDARY:
