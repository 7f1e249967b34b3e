# A CT on a finer grid: what is known of it, which method, how much memory, what it costs; and the call.
libct_a_SOURCES += src/refine/rest.c src/refine/rest.h
libct_a_SOURCES += src/refine/damp.c src/refine/damp.h
libct_a_SOURCES += src/refine/slabs.c src/refine/slabs.h
libct_a_SOURCES += src/refine/rehearsal.c src/refine/rehearsal.h
libct_a_SOURCES += src/refine/texture.c src/refine/texture.h
libct_a_SOURCES += src/refine/refine.c src/refine/run.c src/refine/refine-cost.c src/refine/refine-say.c src/refine/refine.h
