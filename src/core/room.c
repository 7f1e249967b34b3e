/* room.c: see room.h. */
#include "config.h"
#include "core/mem.h"
#include "core/room.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static struct {
	char *dir;
	size_t trim; /* bytes at which pages are let go of */
	int statm;   /* /proc/self/statm, or -1: every trim lets go */
	size_t n, cap;
	struct map {
		void *p;
		size_t bytes;
	} * map; /* arrays in files */
	atomic_bool open;
	double times, enough; /* while the first array is awaited, else 0 */
	pthread_mutex_t lock;
} room = {.statm = -1, .lock = PTHREAD_MUTEX_INITIALIZER};

int ct_room_open(const char *dir, size_t most, struct ct_err *e)
{
	ct_room_close();
	room.dir = strdup(dir);
	if (!room.dir)
		return ct_fail(e, CT_ENOMEM, "no memory for a file name");
	room.trim = most / 4 * 3; /* the rest is what is touched between two looks */
	room.statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
	atomic_store(&room.open, true);
	return 0;
}

void ct_room_close(void)
{
	atomic_store(&room.open, false);
	room.times = 0;
	if (room.statm >= 0)
		close(room.statm);
	room.statm = -1;
	free(room.dir);
	room.dir = NULL;
}

void ct_room_await(double times, double enough)
{
	room.times = times;
	room.enough = enough;
	atomic_store(&room.open, false);
}

/* Is it one for an array of so many bytes? */
static bool is_for(size_t bytes)
{
	if (bytes < CT_ROOM_LEAST || bytes > CT_MAX_BYTES)
		return false;
	pthread_mutex_lock(&room.lock);
	if (room.times > 0 && room.times * (double)bytes > room.enough)
		atomic_store(&room.open, true);
	room.times = 0;
	pthread_mutex_unlock(&room.lock);
	return ct_room_is_open();
}

bool ct_room_is_open(void)
{
	return atomic_load_explicit(&room.open, memory_order_relaxed);
}

/* A file of the room, without a name. */
static int file_open(void)
{
	char *name = NULL;
	int fd = -1;

	if (asprintf(&name, "%s/ct-room-XXXXXX", room.dir) < 0)
		return -1;
	fd = mkostemp(name, O_CLOEXEC);
	if (fd >= 0)
		unlink(name);
	free(name);
	return fd;
}

static int map_file(void **out, size_t bytes, struct ct_err *e)
{
	const int fd = file_open();
	int why = fd < 0 ? errno : posix_fallocate(fd, 0, (off_t)bytes);
	void *p = MAP_FAILED;

	if (why == 0) {
		p = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
		why = errno;
	}
	if (fd >= 0)
		close(fd);
	if (p == MAP_FAILED)
		return ct_fail(e, CT_EOUTPUT, "%s: no room for %zu MiB: %s", room.dir, bytes >> 20,
			strerror(why));
	/* large pages would make one that is touched a thousand, to be held and written back */
	(void)madvise(p, bytes, MADV_NOHUGEPAGE);
	(void)madvise(p, bytes, MADV_RANDOM);
	*out = p;
	return 0;
}

/* Keep in mind that it is in a file. */
static int enter(void *p, size_t bytes, struct ct_err *e)
{
	int rc;

	pthread_mutex_lock(&room.lock);
	rc = ct_grow(&room.map, &room.cap, room.n + 1, sizeof *room.map, e);
	if (rc == 0)
		room.map[room.n++] = (struct map){p, bytes};
	pthread_mutex_unlock(&room.lock);
	if (rc)
		munmap(p, bytes);
	return rc;
}

static int allocate(void *out, size_t n, size_t size, bool zero, struct ct_err *e)
{
	size_t bytes;
	void *p = NULL;

	if (__builtin_mul_overflow(n, size, &bytes) || !is_for(bytes))
		return zero ? ct_alloc0(out, n, size, e) : ct_alloc(out, n, size, e);
	if (map_file(&p, bytes, e) || enter(p, bytes, e)) /* a new file is zero */
		return -1;
	memcpy(out, &p, sizeof p);
	return 0;
}

int ct_room_alloc(void *out, size_t n, size_t size, struct ct_err *e)
{
	return allocate(out, n, size, false, e);
}

int ct_room_alloc0(void *out, size_t n, size_t size, struct ct_err *e)
{
	return allocate(out, n, size, true, e);
}

void ct_room_free(void *p)
{
	size_t bytes = 0;

	pthread_mutex_lock(&room.lock);
	for (size_t i = 0; p && i < room.n; i++)
		if (room.map[i].p == p) {
			bytes = room.map[i].bytes;
			room.map[i] = room.map[--room.n];
			break;
		}
	if (room.n == 0) {
		free(room.map);
		room.map = NULL;
		room.cap = 0;
	}
	pthread_mutex_unlock(&room.lock);
	if (bytes)
		munmap(p, bytes);
	else
		free(p);
}

/* Bytes of memory that the process holds; SIZE_MAX if that cannot be known. */
static size_t held(void)
{
	char text[80] = {0}, *at;
	unsigned long pages;

	if (room.statm < 0 || pread(room.statm, text, sizeof text - 1, 0) <= 0)
		return SIZE_MAX;
	at = strchr(text, ' ');
	pages = at ? strtoul(at, NULL, 10) : 0;
	return pages ? pages * (size_t)sysconf(_SC_PAGESIZE) : SIZE_MAX;
}

void ct_room_trim(void)
{
	if (!ct_room_is_open())
		return;
	pthread_mutex_lock(&room.lock); /* the others wait, lest they take more meanwhile */
	if (held() > room.trim)
		for (size_t i = 0; i < room.n; i++)
			(void)madvise(room.map[i].p, room.map[i].bytes, MADV_DONTNEED);
	pthread_mutex_unlock(&room.lock);
}
