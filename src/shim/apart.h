/* apart.h: work that a library may die of, in a process of its own. (For the .cc files of this
 * folder only.) */
#ifndef CT_SHIM_APART_H
#define CT_SHIM_APART_H
#include "core/err.h"

#include <cstddef>
#include <functional>

/* f(out, e) fills out[n] and returns 0, or -1 after ct_fail. It runs in a copy of this process,
 * whose words go nowhere: if that dies, throws, or takes a minute of the processor, it is CT_EINPUT
 * naming `what`. CT_ENOMEM, also if it wants a gigabyte more than n numbers take, where inflate.h
 * says that there is a limit. */
int apart(float *out, size_t n, const char *what, ct_err *e,
	const std::function<int(float *, ct_err *)> &f);

#endif
