/* sr.h: the parts of ct-sr. */
#ifndef CT_TOOLS_SR_H
#define CT_TOOLS_SR_H
#include "refine/refine.h"
#include "tools/lib/said.h"

#define QUALITIES(X)                                                                               \
	X(DRAFT, "draft")                                                                          \
	X(FAST, "fast")                                                                            \
	X(BALANCED, "balanced")
enum quality { QUALITIES(CT_WORD_VALUE) };

/* What the command line says. */
struct sr {
	const char *in, *out, *report, *confidence, *keep, *prior, *series, *memory, *sidecar;
	struct said_opts said;
	int quality, views, iterations, gaussians;
	bool paper, release, deid;
};

/* Of projections, where nothing says a factor. */
#define SR_FACTOR "4"
/* HU RMS, of the inversion. */
#define SR_TOLERANCE 0.1

/* The published method: the other commands, one after the other (sr-chain.c). Codes of these. */
int sr_chain(const struct sr *p, const struct ct_env *env, struct ct_err *e);

#endif
