/* guard.h: no exception leaves C++ (for the .cc files of this folder only). */
#ifndef CT_SHIM_GUARD_H
#define CT_SHIM_GUARD_H
#include "core/err.h"

#include <exception>
#include <new>

/* f() returns 0 or -1 after ct_fail; what it throws becomes a failure naming `what`. */
template <class F> int guard(struct ct_err *e, const char *what, F f) noexcept
{
	try {
		return f();
	} catch (const std::bad_alloc &) {
		return ct_fail(e, CT_ENOMEM, "%s: no memory", what);
	} catch (const std::exception &x) {
		return ct_fail(e, CT_EFAIL, "%s: %s", what, x.what());
	} catch (...) {
		return ct_fail(e, CT_EFAIL, "%s: unknown exception", what);
	}
}

#endif
