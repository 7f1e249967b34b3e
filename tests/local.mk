# Plain C and shell tests that print TAP.
TEST_EXTENSIONS = .sh
LOG_DRIVER = env AM_TAP_AWK='$(AWK)' $(SHELL) $(top_srcdir)/build-aux/tap-driver.sh
SH_LOG_DRIVER = $(LOG_DRIVER)
SH_LOG_COMPILER = $(SHELL)
AM_TESTS_ENVIRONMENT = LC_ALL=C; PATH='$(abs_top_builddir)':$$PATH; srcdir='$(abs_top_srcdir)'; \
	CT_TOOLS='$(bin_PROGRAMS)'; unset CT_THREADS OMP_NUM_THREADS; \
	export LC_ALL PATH srcdir CT_TOOLS;
TESTS = $(check_PROGRAMS) $(dist_check_SCRIPTS)
EXTRA_DIST += tests/tap.sh tests/tap.h
check_PROGRAMS += tests/t-core
tests_t_core_SOURCES = tests/t-core.c
dist_check_SCRIPTS += tests/t-layers.sh
check_PROGRAMS += tests/t-schedule
tests_t_schedule_SOURCES = tests/t-schedule.c
check_PROGRAMS += tests/t-box tests/t-matched
tests_t_box_SOURCES = tests/t-box.c
tests_t_matched_SOURCES = tests/t-matched.c
check_PROGRAMS += tests/t-ddnm
tests_t_ddnm_SOURCES = tests/t-ddnm.c
