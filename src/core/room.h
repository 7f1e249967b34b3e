/* room.h: large arrays that need not fit into memory.
 *
 * While a room is open, an array of CT_ROOM_LEAST bytes or more that is asked for here lies in a
 * file without a name in a folder, mapped: what of it is in memory is the system's to write back,
 * and is let go of whenever the process holds more than it may. So values are the same with a room
 * and without one; a loop over more than a few planes calls ct_room_trim now and then. ct_par_for
 * does after every task.
 *
 * There is one room, of the process, as there is one memory that it bounds. Thread-safe but for
 * open and close.
 */
#ifndef CT_CORE_ROOM_H
#define CT_CORE_ROOM_H
#include "core/err.h"

#include <stdbool.h>
#include <stddef.h>

enum { CT_ROOM_LEAST = 1 << 21 };

/* Keep within `most` bytes of memory, the rest in the folder dir (copied). */
int ct_room_open(const char *dir, size_t most, struct ct_err *e);
/* Of a room just opened: it is one only from the first such array on, and if `times` as much as
 * that one is more than `enough` bytes. */
void ct_room_await(double times, double enough);
/* What is allocated stays until it is freed. */
void ct_room_close(void);
bool ct_room_is_open(void);
/* As ct_alloc and ct_alloc0, to be given to ct_room_free, which also frees what they allocate.
 * CT_EOUTPUT naming the folder if the file system has no space for it. */
int ct_room_alloc(void *out, size_t n, size_t size, struct ct_err *e);
int ct_room_alloc0(void *out, size_t n, size_t size, struct ct_err *e);
void ct_room_free(void *p);
/* Let go of all pages if the process holds too much. Nothing if no room is open. */
void ct_room_trim(void);

#endif
