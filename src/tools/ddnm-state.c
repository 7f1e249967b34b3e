/* ddnm-state.c: see ddnm-parts.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "tools/ddnm-parts.h"
#include "core/clock.h"
#include "core/mem.h"

#include <stdlib.h>
#include <string.h>

enum { EVERY = 60 };

static const struct ct_tensor *find(const struct ct_tensors *w, const char *name, size_t count)
{
	const struct ct_tensor *t = ct_tensors_find(w, name);

	return t && ct_tensor_count(t) == count ? t : NULL;
}

static int unpack(void *state, const struct ct_tensors *w, struct ct_err *e)
{
	struct ddnm_state *s = state;
	const size_t n = ct_stack_count(s->out);
	const struct ct_tensor *done = find(w, "done", s->out->views), *views = find(w, "views", n),
			       *dev = s->std ? find(w, "deviation", n) : views;

	if (!done || !views || !dev)
		return ct_fail(e, CT_EINPUT, "does not have all views");
	memcpy(s->out->data, views->data, n * sizeof *s->out->data);
	if (s->std)
		memcpy(s->std->data, dev->data, n * sizeof *s->std->data);
	for (size_t k = 0; k < s->out->views; k++)
		s->done[k] = done->data[k] != 0;
	return 0;
}

int ddnm_state_open(struct ddnm_state *s, struct ct_resume *run, struct ct_stack *out,
	struct ct_stack *std, struct ct_err *e)
{
	*s = (struct ddnm_state){.run = run, .out = out, .std = std, .last = ct_clock_wall()};
	if (ct_alloc0(&s->done, out->views, sizeof *s->done, e))
		return -1;
	memset(out->data, 0, ct_stack_count(out) * sizeof *out->data);
	if (std)
		memset(std->data, 0, ct_stack_count(std) * sizeof *std->data);
	return ct_resume_load(run, unpack, s, e) < 0 ? -1 : 0;
}

size_t ddnm_state_left(const struct ddnm_state *s)
{
	size_t left = 0;

	for (size_t k = 0; k < s->out->views; k++)
		left += !s->done[k];
	return left;
}

static int put(struct ct_tensors *w, const char *name, const struct ct_stack *s, struct ct_err *e)
{
	return ct_tensors_put(w, name, 3, (const size_t[]){s->views, s->h, s->w}, s->data, e);
}

static int pack(struct ct_tensors *w, const void *state, struct ct_err *e)
{
	const struct ddnm_state *s = state;
	struct ct_tensor *t;

	if (ct_tensors_add(w, "done", 1, &s->out->views, &t, e))
		return -1;
	for (size_t k = 0; k < s->out->views; k++)
		t->data[k] = s->done[k] ? 1.0f : 0.0f;
	return ct_err_any(put(w, "views", s->out, e) || (s->std && put(w, "deviation", s->std, e)));
}

int ddnm_state_save(void *state, bool last, struct ct_err *e)
{
	struct ddnm_state *s = state;

	if (!last && ct_clock_wall() - s->last < EVERY)
		return 0;
	s->last = ct_clock_wall();
	return ct_resume_save(s->run, pack, s, e);
}

int ddnm_state_rescue(const struct ddnm_state *s, struct ct_err *e)
{
	return ct_resume_rescue(s->run, pack, s, e);
}

void ddnm_state_close(struct ddnm_state *s)
{
	free(s->done);
	*s = (struct ddnm_state){0};
}
