/* embed.h: a timestep as the network sees it. */
#ifndef CT_UNET_EMBED_H
#define CT_UNET_EMBED_H
#include <stddef.h>

/* Sinusoids of a timestep: emb[i] = cos(t f_i), emb[half + i] = sin(t f_i), f_i =
 * 10000^(-i/half), half = dim/2; an odd dim ends in 0. */
void ct_embed(size_t dim, float *emb, double t);

#endif
