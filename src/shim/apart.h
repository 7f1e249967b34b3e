/* apart.h: work that a library may die of, in a process of its own. (For the .cc files of this
 * folder only.) SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_SHIM_APART_H
#define CT_SHIM_APART_H
#include "core/err.h"

#include <cstddef>
#include <functional>
#include <vector>

#include <sys/types.h>

/* f(out, e) fills out[n] and returns 0, or -1 after ct_fail. It runs in a copy of this process,
 * whose words go nowhere: if that dies, throws, or takes a minute of the processor, it is CT_EINPUT
 * naming `what`. CT_ENOMEM, also if it wants a gigabyte more than n numbers take, where inflate.h
 * says that there is a limit. */
int apart(float *out, size_t n, const char *what, ct_err *e,
	const std::function<int(float *, ct_err *)> &f);

/* Which of f(0) to f(n - 1) throw, or kill the copy of this process in which they run, one after
 * the other. Empty if there is no process or memory for that. */
std::vector<bool> deadly(size_t n, const std::function<void(size_t)> &f);

/* Pictures of n numbers each that are made ahead, by several such processes at a time, while this
 * one goes on; of those that fail, for any reason, there is none. */
class Ahead
{
      public:
	Ahead() = default;
	Ahead(const Ahead &) = delete;
	Ahead &operator=(const Ahead &) = delete;
	~Ahead();
	/* Picture i by f(i, out, e), i below `count`, in at most as many processes; so many of them
	 * are kept at a time. */
	void make(size_t count, size_t n, size_t processes, size_t kept,
		const std::function<int(size_t, float *, ct_err *)> &f);
	/* Picture i, when it is made, until the next is asked for; NULL if it is not made, or was
	 * asked for, or one behind it. */
	const float *get(size_t i);
	/* No more of them. */
	void stop();

      private:
	struct Maker {
		pid_t id;
		int end; /* of a socket: a byte comes for each picture, and goes for each to do */
	};
	void run(size_t p, int end, const std::function<int(size_t, float *, ct_err *)> &f) const;
	float *place(size_t i) const;

	std::vector<Maker> maker; /* the first of picture 0, the next of 1, and so on in turn */
	void *room = nullptr;
	size_t bytes = 0;
	size_t most = 0, size = 0, each = 1; /* pictures, numbers of one, pictures of a maker */
	size_t at = 0;                       /* the picture that is asked for next */
};

#endif
