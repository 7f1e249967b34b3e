/* apart.h: work that a library may die of, in a process of its own. (For the .cc files of this
 * folder only.) */
#ifndef CT_SHIM_APART_H
#define CT_SHIM_APART_H
#include "core/err.h"

#include <cstddef>
#include <functional>
#include <vector>

/* f(out, e) fills out[n] and returns 0, or -1 after ct_fail. It runs in a copy of this process,
 * whose words go nowhere: if that dies, throws, or takes a minute of the processor, it is CT_EINPUT
 * naming `what`. CT_ENOMEM, also if it wants a gigabyte more than n numbers take, where inflate.h
 * says that there is a limit. */
int apart(float *out, size_t n, const char *what, ct_err *e,
	const std::function<int(float *, ct_err *)> &f);

/* Which of f(0) to f(n - 1) throw, or kill the copy of this process in which they run, one after
 * the other. Empty if there is no process or memory for that. */
std::vector<bool> deadly(size_t n, const std::function<void(size_t)> &f);

/* Pictures of n numbers each that are made ahead, by several such processes at a time. */
class Ahead
{
      public:
	Ahead() = default;
	Ahead(const Ahead &) = delete;
	Ahead &operator=(const Ahead &) = delete;
	~Ahead();
	/* Picture i by f(i, out, e), i below `count`, in as many processes; those that fail, for
	 * any reason, are not made. */
	void make(size_t count, size_t n, size_t processes,
		const std::function<int(size_t, float *, ct_err *)> &f);
	/* Picture i, or NULL if it was not made. */
	const float *get(size_t i) const;

      private:
	void *room = nullptr;
	size_t bytes = 0, most = 0, size = 0;
};

#endif
