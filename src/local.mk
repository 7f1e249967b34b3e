# One file a command, src/tools/ct-NAME.c; each has a man page, man/ct-NAME.1.in.
# bin_PROGRAMS += ct-NAME
# ct_NAME_SOURCES = src/tools/ct-NAME.c
