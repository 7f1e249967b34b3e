# One file a command, src/tools/ct-NAME.c; each has a man page, man/ct-NAME.1.in.
# bin_PROGRAMS += ct-NAME
# ct_NAME_SOURCES = src/tools/ct-NAME.c
bin_PROGRAMS += ct-degrade
ct_degrade_SOURCES = src/tools/ct-degrade.c
bin_PROGRAMS += ct-upsample
ct_upsample_SOURCES = src/tools/ct-upsample.c
bin_PROGRAMS += ct-metrics
ct_metrics_SOURCES = src/tools/ct-metrics.c
