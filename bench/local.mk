# SPDX-License-Identifier: Apache-2.0
# What `make bench` runs, one after the other; nothing of it is built or run otherwise.
# A program bench/b-x is EXTRA_PROGRAMS += bench/b-x, bench_b_x_SOURCES = bench/b-x.c bench/bench.h
# and BENCH_C += bench/b-x; a script is BENCH_SH += bench/b-x.sh. make bench BENCH=bench/b-x runs
# that one.
BENCH_C =
BENCH_SH =
EXTRA_PROGRAMS += bench/b-project
bench_b_project_SOURCES = bench/b-project.c bench/bench.h
BENCH_C += bench/b-project
BENCH_SH += bench/b-project.sh
EXTRA_DIST += bench/bench.h bench/texture.py $(BENCH_SH)
BENCH = $(BENCH_C) $(BENCH_SH)
.PHONY: bench
bench: $(bin_PROGRAMS) $(BENCH_C)
	@$(AM_TESTS_ENVIRONMENT) for b in $(BENCH); do \
		case $$b in *.sh) $(SHELL) '$(srcdir)'/$$b ;; *) ./$$b ;; esac || exit 1; \
	done
EXTRA_PROGRAMS += bench/b-restore
bench_b_restore_SOURCES = bench/b-restore.c bench/bench.h
BENCH_C += bench/b-restore
EXTRA_PROGRAMS += bench/b-tv
bench_b_tv_SOURCES = bench/b-tv.c bench/bench.h
BENCH_C += bench/b-tv
EXTRA_PROGRAMS += bench/metrics-calls
bench_metrics_calls_SOURCES = bench/metrics-calls.c bench/bench.h
BENCH_SH += bench/b-metrics.sh
bench: bench/metrics-calls
BENCH_SH += bench/b-fdk.sh bench/b-kernels.sh
EXTRA_PROGRAMS += bench/backproject-calls
bench_backproject_calls_SOURCES = bench/backproject-calls.c bench/bench.h
bench: bench/backproject-calls
bench: tests/t-kernels tests/t-kernels-scan tests/t-kernels-model
BENCH_SH += bench/b-upsample.sh bench/b-size.sh
BENCH_SH += bench/b-dicom.sh
EXTRA_PROGRAMS += bench/b-gs
bench_b_gs_SOURCES = bench/b-gs.c bench/gs-limit.h bench/gs-plain.c bench/gs-plain.h tests/gaussian-plain.h bench/bench.h
BENCH_C += bench/b-gs
EXTRA_PROGRAMS += bench/unet-calls
bench_unet_calls_SOURCES = bench/unet-calls.c bench/bench.h
BENCH_SH += bench/b-unet.sh
EXTRA_DIST += bench/unet-torch.py bench/profile/rows.py bench/profile/fit.py bench/profile/table.py
bench: bench/unet-calls
# No bench: prints the table of src/estimate/expected.c.
EXTRA_PROGRAMS += bench/fit-expected
bench_fit_expected_SOURCES = bench/fit-expected.c
# No bench: what bench/profile/rows.py draws its rows with.
EXTRA_PROGRAMS += bench/profile/edge-rows
bench_profile_edge_rows_SOURCES = bench/profile/edge-rows.c
EXTRA_PROGRAMS += bench/b-encoding
bench_b_encoding_SOURCES = bench/b-encoding.c bench/bench.h
BENCH_C += bench/b-encoding
BENCH_SH += bench/b-field.sh
EXTRA_DIST += bench/field-twin.py bench/naf_twin.py
# No bench: makes projections to train the diffusion prior on, where nothing of ours is installed
# (bench/train/projections.py): nothing of it is shared, and what it does not need is not linked.
EXTRA_PROGRAMS += bench/train/projections
bench_train_projections_SOURCES = bench/train/projections.c
bench_train_projections_LDFLAGS = -static $(AM_LDFLAGS)
bench_train_projections_LDADD = libct.a -ldeflate -lz $(JANSSON_LIBS) -lm
EXTRA_DIST += bench/train/projections.py bench/train/measure_projections.py
# The same of the volume network (bench/train/volume.py). dnn-plain.c stands for oneDNN.
EXTRA_PROGRAMS += bench/train/pairs
bench_train_pairs_SOURCES = bench/train/pairs.c bench/train/dnn-plain.c
bench_train_pairs_CFLAGS = $(AM_CFLAGS) -O3 $(TRAIN_MARCH) -ffp-contract=fast
bench_train_pairs_LDFLAGS = -static $(AM_LDFLAGS)
bench_train_pairs_LDADD = libct.a -ldeflate -lz $(JANSSON_LIBS) -lm
TRAIN_MARCH = -march=x86-64-v3
EXTRA_DIST += bench/train/README.md bench/train/pack.py bench/train/train.py bench/train/volume.py bench/train/import.py bench/train/measure_volume.py bench/train/join.py
