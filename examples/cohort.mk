# SPDX-License-Identifier: Apache-2.0
# A folder of scans, one ct-sr each, and a table of what came out and what it took.
#
#   make -f examples/cohort.mk SCANS=scans TRUTH=truths OUT=fine OPTIONS='-x 1,1,4'
#
# A scan is a file .nii or .nii.gz, or a folder of DICOM. For each OUT gets NAME.nii.gz, and at the end cohort.csv,
# cohort.md and cohort.svg: size of the result, factor, wall seconds, peak memory (MiB), and where TRUTH has a file of the
# same name PSNR (dB) of cubic interpolation and of the result, and SSIM; else the data residual (HU RMS), if it is known
# how the scan was made; then mean and standard deviation. A scan that cannot be done, or not be compared with its TRUTH, is
# in the table as failed, with the reason in OUT/NAME.log, and holds up no other. Killed, or with more scans, the same
# command goes on; with other OPTIONS or TRUTH, or another ct-sr, it makes all anew, and what is of a file that was changed.
# make -j is fine, but then seconds are not those of a free machine; THREADS says how many each may take. CONFIDENCE=yes also
# makes the predicted error, OUT/NAME.std.nii.gz, and REPORT=yes a page to look at, OUT/NAME.html (ct-sr(1)); a scan of which
# one of these cannot be made has failed.
SCANS = scans
TRUTH =
OUT = cohort
OPTIONS =
THREADS = 0
CONFIDENCE =
REPORT =
TIME = /usr/bin/time

# Names may hold blanks: files are no targets of make, which only runs the scans at the same time. What is up to date, the
# shell decides.
export SCANS TRUTH OUT OPTIONS
.ONESHELL:
here := $(dir $(lastword $(MAKEFILE_LIST)))
QUOTED = yes
include $(here)scan.mk
.SHELLFLAGS = -o pipefail -c
# OUT and TRUTH may lie among the scans.
list = for f in "$$SCANS"/*.nii "$$SCANS"/*.nii.gz "$$SCANS"/*/; do \
	[ ! -e "$$f" ] || [ "$$f" -ef "$$OUT" ] || [ "$$f" -ef "$$TRUTH" ] || printf '%s\n' "$${f%/}"; done
stem = name=$${scan\#\#*/}; name=$${name%.gz}; name=$${name%.nii}; to=$$OUT/$$name
JOBS := $(addprefix scan-,$(shell SCANS=$(call quoted,$(SCANS)); OUT=$(call quoted,$(OUT)); TRUTH=$(call quoted,$(TRUTH)); $(list) | awk '{print NR}'))

all: options $(JOBS)
	@$(list) | while IFS= read -r scan; do
		$(stem)
		cat "$$to.row" 2>/dev/null || printf '%s\tfailed\n' "$$name"
	done | sort -u >"$$OUT/rows" || exit
	for as in csv md svg; do
		awk -v as=$$as -f $(here)cohort.awk "$$OUT/rows" >"$$OUT/part" && mv "$$OUT/part" "$$OUT/cohort.$$as" || exit
	done
	rm -f "$$OUT/rows"
	cat "$$OUT/cohort.md"

options:
	@if [ -z "$(JOBS)" ]; then
		echo "$$SCANS: no scan: SCANS is a folder of .nii, .nii.gz or folders of DICOM" >&2
		exit 2
	elif [ -n "$$TRUTH" ] && [ ! -d "$$TRUTH" ]; then
		echo "$$TRUTH: no folder: TRUTH is one of .nii or .nii.gz with the names of SCANS" >&2
		exit 2
	fi
	odd=$$($(list) | awk -v FS='\n' 'index($$0, ENVIRON["SCANS"] "/") != 1 || /\t/ {print; exit}')
	if [ -n "$$odd" ]; then
		echo "$$odd: a scan with a tab or a line break in its name: give it another" >&2
		exit 2
	fi
	twice=$$($(list) | while IFS= read -r scan; do $(stem); printf '%s\n' "$$name" $(if $(CONFIDENCE),"$$name.std"); done | sort | uniq -d | head -n 1)
	if [ -n "$$twice" ]; then
		echo "$$SCANS: two scans are called $$twice: give each another name, since OUT/NAME.nii.gz is of one" >&2
		exit 2
	fi
	{ ct-sr --version && printf '%s\n' "$$OPTIONS" '$(CONFIDENCE) $(REPORT)' "$$TRUTH"; } >"$$OUT/options.part" || exit
	cmp -s "$$OUT/options.part" "$$OUT/options" && rm "$$OUT/options.part" || mv "$$OUT/options.part" "$$OUT/options"

$(JOBS): scan-%: options
	@scan=$$($(list) | sed -n '$*p')
	$(stem)
	truth=
	for f in "$$TRUTH/$$name.nii" "$$TRUTH/$$name.nii.gz"; do [ -z "$$TRUTH" ] || [ ! -e "$$f" ] || truth=$$f; done
	of=$$({ $(call files_of,"$$scan"); [ -z "$$truth" ] || $(call files_of,"$$truth"); } 2>&1 | cksum)
	[ -e "$$to.nii.gz" ] && [ "$$(cut -f 10 "$$to.row" 2>/dev/null)" = "$$of" ] && ! [ "$$OUT/options" -nt "$$to.nii.gz" ] && exit
	rm -f "$$to.row" "$$to.nii.gz"
	$(TIME) -o "$$to.time" -f '%e %M' ct-sr -f -t $(THREADS) $(OPTIONS) \
		$(if $(CONFIDENCE),"--confidence=$$to.std.nii.gz") $(if $(REPORT),"--report=$$to.html") \
		"$$scan" "$$to.nii.gz" >"$$to.log" 2>&1 && [ -e "$$to.nii.gz" ] || {
		rm -f "$$to.time"
		echo "$$scan: $$(grep -vE '^(Try |ct-sr: (warning|series [0-9]+): )' "$$to.log" | tail -n 1)" >&2
		exit 0
	}
	factor=$$(sed -n 's/^ct-sr: [0-9x]* to [0-9x]*, \([0-9.,]*\) times.*/\1/p' "$$to.log")
	: >"$$to.figures"
	if [ -n "$$truth" ]; then
		ct-metrics "$$truth" "$$to.nii.gz" 2>>"$$to.log" | awk '{print "result", $$0}' >>"$$to.figures" &&
			ct-upsample -q -f -t $(THREADS) -m cubic -x "$$factor" "$$scan" "$$to.cubic.nii" 2>>"$$to.log" &&
			ct-metrics "$$truth" "$$to.cubic.nii" 2>>"$$to.log" | awk '{print "cubic", $$0}' >>"$$to.figures" || {
			rm -f "$$to.time" "$$to.figures" "$$to.cubic.nii"
			echo "$$scan: $$(tail -n 1 "$$to.log")" >&2
			exit 0
		}
		rm -f "$$to.cubic.nii"
	fi
	name=$$name of=$$of awk -v took="$$(tail -n 1 "$$to.time")" '$$2 == "psnr" {psnr[$$1] = $$3}
		$$1 == "result" && $$2 == "ssim-r2" {ssim = $$3}
		/^ct-sr: [0-9x]+ to / {
			size = $$4; factor = $$5; sub(",$$", "", size); gsub(",", "x", factor)
			if (factor !~ /x/) factor = factor "x" factor "x" factor
			if (match($$0, /data residual [^ ]*/)) residual = substr($$0, RSTART + 14, RLENGTH - 14)
		}
		END {
			split(took, t, " "); OFS = "\t"
			print ENVIRON["name"], size, factor, sprintf("%.1f", t[1]), sprintf("%.0f", t[2] / 1024), psnr["cubic"], psnr["result"], ssim,
				"result" in psnr && psnr["result"] != "" ? "" : residual, ENVIRON["of"]
		}' "$$to.log" "$$to.figures" >"$$to.part" && mv "$$to.part" "$$to.row"
	rm -f "$$to.time" "$$to.figures"

.PHONY: all options $(JOBS)
