/* residual.h: what projections of a refined volume lack, drawn from a prior conditional on them.
 *
 * The truth of such projections b (of a volume that was s times coarser) is b + m r:
 *   known  a volume that was refined knows what it has below twice the Nyquist frequency of its
 *          coarse voxels, and so does b: P = V^T V, V the cosines below that in both directions
 *          (ct_measurement_band of 2/s of the picture). Nothing is added there: P r = 0
 *   m      the RMS of what is missing, taken for `missing` times that of the octave below,
 *          (P - P') b with P' as P at half the frequency. In units of it the noise that a chain
 *          begins with, N(0, 1), is no more than what is missing, and erases nothing that b has
 *   prior  its network tells the velocity (Salimans, Ho: Progressive distillation, ICLR 2022)
 *          v = sqrt(abar_t) z - sqrt(1 - abar_t) r of x_t = sqrt(abar_t) r + sqrt(1 - abar_t) z,
 *          given x_t and b twice: 2 b / max - 1, and (b - P' b) over the RMS of the octave. So
 *          eps = sqrt(1 - abar) x + sqrt(abar) v for the samplers, which hold r by A = V, y = 0
 *   out    b + weight m (mean of the samples), where each sample stands for what was expected when
 *          nothing but noise was known of it: the same mean without the spread that is drawn.
 *          weight, at most 1, is what the prior is worth on data that it was not trained on, of
 *          scans that were well sampled and of others. The deviation of the samples, times m, is
 *          what remains unknown
 */
#ifndef CT_DIFFUSION_RESIDUAL_H
#define CT_DIFFUSION_RESIDUAL_H
#include "core/env.h"
#include "core/stack.h"
#include "diffusion/superres.h"

/* The metadata "intensity_map" of such a prior. */
#define CT_RESIDUAL_MAP                                                                            \
	"residual / missing; 2 x / max - 1, max: of the stack; x above half of what is known / "   \
	"octave"
/* What the network is given: x_t, then the condition. */
enum { CT_RESIDUAL_PLANES = 3 };

struct ct_residual {
	size_t factor;           /* s >= 3: of 2 nothing is missing */
	double missing;          /* > 0 */
	double sampled, aliased; /* weights, 0 to 1 */
};

/* From the metadata of a prior, and to them. 1 if they are of another one, CT_EINPUT. */
int ct_residual_get(struct ct_residual *r, const struct ct_meta *m, struct ct_err *e);
int ct_residual_put(const struct ct_residual *r, struct ct_meta *m, struct ct_err *e);

/* What is known of pictures (high, wide), multiples of the factor: below twice the Nyquist
 * frequency of the coarse ones, and below that itself. */
struct ct_residual_frame {
	struct ct_measurement known, half;
};

/* *f zero; free it in any case. CT_EGEOM if the sides are no multiples. */
int ct_residual_frame_alloc(
	struct ct_residual_frame *f, size_t factor, size_t high, size_t wide, struct ct_err *e);
void ct_residual_frame_free(struct ct_residual_frame *f);
/* Values of the scratch t that the next functions want. */
size_t ct_residual_frame_scratch(const struct ct_residual_frame *f);
/* r <- r - P r */
void ct_residual_hold(const struct ct_residual_frame *f, float *r, double *t);
/* The condition c[2][high][wide] of a picture b. */
void ct_residual_condition(const struct ct_residual_frame *f, float *c, const float *b, double max,
	double octave, double *t);
/* RMS of (P - P') b over a stack; m is `missing` times that. CT_EGEOM, CT_EINPUT if there is
 * nothing. */
int ct_residual_octave(double *rms, const struct ct_stack *b, size_t factor, struct ct_err *e);

/* Those that do what is wanted here. */
bool ct_residual_draws(enum ct_sampler_rule rule);

/* Is the network asked for this weight, and a deviation or none? Of 0 and none out is b. */
bool ct_residual_asks(double weight, bool deviation);
/* out, and deviation if not NULL, of b and this weight, as ct_superres() of p, of which norm, op
 * and what goes with them do not count, nor init. CT_EUSAGE for another sampler or factor. net
 * takes CT_RESIDUAL_PLANES and tells velocities. */
int ct_residual_draw(const struct ct_residual *r, double weight, const struct ct_superres *p,
	const struct ct_denoiser *net, const struct ct_stack *b, struct ct_stack *out,
	struct ct_stack *deviation, bool *done, const struct ct_env *env, struct ct_err *e);

#endif
