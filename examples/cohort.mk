# A folder of scans, one ct-sr each, and a table of what came out and what it took.
#
#   make -f examples/cohort.mk SCANS=scans OUT=fine OPTIONS='-x 1,1,4'
#
# A scan is a file .nii or .nii.gz, or a folder of DICOM; its name has no blanks. For each OUT gets NAME.nii.gz,
# and at the end cohort.csv and cohort.md: size of the result, factor, wall seconds, peak memory (MiB), PSNR
# (dB) where TRUTH has a file of the same name, and else the data residual (HU RMS), if it is known how the scan was
# made. A scan that cannot be done is in the table as failed, with the
# reason in OUT/NAME.log, and holds up no other. Killed, or with more scans, the same command goes on. make -j is fine,
# but then seconds are not those of a free machine; THREADS says how many each may take. CONFIDENCE=yes also makes
# the predicted error, OUT/NAME.std.nii.gz, and REPORT=yes a page to look at, OUT/NAME.html (ct-sr(1)); a scan of which
# one of these cannot be made has failed.
SCANS = scans
TRUTH =
OUT = cohort
OPTIONS =
THREADS = 0
CONFIDENCE =
REPORT =
TIME = /usr/bin/time

stem = $(patsubst %.nii,%,$(patsubst %.gz,%,$(notdir $(1))))
FOUND = $(patsubst %/,%,$(wildcard $(SCANS)/*.nii $(SCANS)/*.nii.gz $(SCANS)/*/))
NAMES = $(sort $(foreach s,$(FOUND),$(call stem,$(s))))
truth = $(firstword $(wildcard $(foreach e,.nii .nii.gz,$(TRUTH)/$(1)$(e))))

all: $(OUT)/cohort.md
	@cat $<

$(OUT)/cohort.md: $(OUT)/cohort.csv
	@awk -F, '{gsub(/"/, ""); line = "|"; for (i = 1; i <= NF; i++) line = line " " $$i " |"; print line} \
		NR == 1 {for (line = "|"; i-- > 1;) line = line "---|"; print line}' $< >$@.part && mv $@.part $@

$(OUT)/cohort.csv: $(NAMES:%=$(OUT)/%.row)
	@{ echo 'scan,size,factor,seconds,memory-mib,psnr-db,residual-rms-hu'; \
		for n in $(NAMES); do cat $(OUT)/$$n.row 2>/dev/null || echo "\"$$n\",failed,,,,,"; done; } \
		>$@.part && mv $@.part $@

beside = $(if $(CONFIDENCE),--confidence=$(1).std.nii.gz) $(if $(REPORT),--report=$(1).html)
define scan
$(OUT)/$(call stem,$(1)).nii.gz: $(1)
	@mkdir -p $(OUT)
	-@$(TIME) -o $$@.time -f '%e %M' ct-sr -f -t $(THREADS) $(OPTIONS) $(call beside,$(OUT)/$(call stem,$(1))) \
		$(1) $$@ \
		>$(OUT)/$(call stem,$(1)).log 2>&1 || \
		{ rm -f $$@.time; echo "$(1): $$$$(tail -n 2 $(OUT)/$(call stem,$(1)).log | head -n 1)" >&2; }
endef
$(foreach s,$(FOUND),$(eval $(call scan,$(s))))

# What ct-sr said of it: sizes, factors, data residual.
$(OUT)/%.row: $(OUT)/%.nii.gz
	-@test -f $<.time && { \
		psnr=; [ -z '$(call truth,$*)' ] || \
			psnr=$$(ct-metrics $(call truth,$*) $< | awk '$$1 == "psnr" {print $$2}'); \
		awk -v n='$*' -v psnr="$$psnr" -v took="$$(tail -n 1 $<.time)" '/^ct-sr: [0-9x]+ to / { \
			size = $$4; factor = $$5; sub(",$$", "", size); gsub(",", "x", factor); \
			if (factor !~ /x/) factor = factor "x" factor "x" factor; \
			if (match($$0, /data residual [^ ]*/)) residual = substr($$0, RSTART + 14, RLENGTH - 14)} \
			END {split(took, t, " "); printf "\"%s\",%s,%s,%.1f,%.0f,%s,%s\n", n, size, factor, t[1], \
				t[2] / 1024, psnr, psnr == "" ? residual : ""}' $(OUT)/$*.log >$@.part && \
		mv $@.part $@ && rm -f $<.time; }

.PHONY: all $(OUT)/cohort.csv
