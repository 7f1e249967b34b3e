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
# A fuzz target fuzz-x is check_PROGRAMS += tests/fuzz/fuzz-x of fuzz-x.c and $(FUZZ_DRIVER).
FUZZ_DRIVER = tests/fuzz/driver.c tests/fuzz/driver.h
check_PROGRAMS += tests/t-exr
tests_t_exr_SOURCES = tests/t-exr.c
dist_check_SCRIPTS += tests/t-exr.sh
