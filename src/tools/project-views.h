/* project-views.h: what ct-project does view by view. */
#ifndef CT_TOOLS_PROJECT_VIEWS_H
#define CT_TOOLS_PROJECT_VIEWS_H
#include "core/env.h"
#include "core/stack.h"
#include "core/vol.h"
#include "diffusion/measurement.h"
#include "xray/photons.h"
#include "xray/project.h"

struct project_job {
	const char *name;            /* of the volume, for messages */
	const struct ct_vol *v;      /* density */
	const float *mu;             /* its attenuation, 1/mm; NULL without noise */
	const struct ct_stack *rays; /* rays that are followed; their data are not used */
	struct ct_stack *out;        /* rays, or pixels of `coarsen` squared of them */
	enum ct_method method;
	enum ct_measurement_kind kind; /* of coarse pixels */
	size_t coarsen;
	struct ct_photons photons;
	double unit; /* attenuation of a mm of density 1 */
};

/* All views into j->out. */
int project_views(const struct project_job *j, const struct ct_env *env, struct ct_err *e);
/* Say on standard output what that would take. */
int project_estimate(const struct project_job *j, const struct ct_env *env, struct ct_err *e);

#endif
