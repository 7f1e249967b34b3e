/* guard.h: no exception leaves C++ (for the .cc files of this folder only). */
#ifndef CT_SHIM_GUARD_H
#define CT_SHIM_GUARD_H
#include "core/err.h"

/* Within a catch: what was thrown becomes a failure naming `what`. -1. */
int guard_failed(struct ct_err *e, const char *what) noexcept;

/* f() returns 0 or -1 after ct_fail; what it throws becomes a failure naming `what`. */
template <class F> int guard(struct ct_err *e, const char *what, F f) noexcept
{
	try {
		return f();
	} catch (...) {
		return guard_failed(e, what);
	}
}

#endif
