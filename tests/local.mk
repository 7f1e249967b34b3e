# Plain C and shell tests that print TAP.
TEST_EXTENSIONS = .sh
LOG_DRIVER = env AM_TAP_AWK='$(AWK)' $(SHELL) $(top_srcdir)/build-aux/tap-driver.sh
SH_LOG_DRIVER = $(LOG_DRIVER)
SH_LOG_COMPILER = $(SHELL)
AM_TESTS_ENVIRONMENT = LC_ALL=C; PATH='$(abs_top_builddir)':$$PATH; srcdir='$(abs_top_srcdir)'; builddir='$(abs_top_builddir)'; \
	CT_TOOLS='$(bin_PROGRAMS)'; unset CT_THREADS OMP_NUM_THREADS; \
	export LC_ALL PATH srcdir builddir CT_TOOLS;
TESTS = $(check_PROGRAMS) $(dist_check_SCRIPTS)
EXTRA_DIST += tests/tap.sh tests/tap.h
check_PROGRAMS += tests/t-core
tests_t_core_SOURCES = tests/t-core.c
dist_check_SCRIPTS += tests/t-layers.sh
check_PROGRAMS += tests/t-ssim
tests_t_ssim_SOURCES = tests/t-ssim.c
check_PROGRAMS += tests/t-resample
tests_t_resample_SOURCES = tests/t-resample.c
check_PROGRAMS += tests/t-degrade
tests_t_degrade_SOURCES = tests/t-degrade.c
check_PROGRAMS += tests/t-metrics
tests_t_metrics_SOURCES = tests/t-metrics.c
check_PROGRAMS += tests/t-splat
tests_t_splat_SOURCES = tests/t-splat.c
check_PROGRAMS += tests/t-voxel
tests_t_voxel_SOURCES = tests/t-voxel.c
