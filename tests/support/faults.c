/* Let the k-th write, fsync or rename below a folder fail: preloaded (LD_PRELOAD) before the C
   library.

   SQLite, HDF5 and Python all come to the system through these functions, so this sees what they
   do, whoever does it. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { NONE, FAIL_EIO, FAIL_ENOSPC, SHORT_WRITE };

static const char *folder;
static long countdown = -1, seen;
static int mode = NONE, sticky;

void faults_arm(const char *below, long at, int how, int from_then_on) {
    folder = strdup(below);
    countdown = at;
    mode = how;
    sticky = from_then_on;
    seen = 0;
}

long faults_seen(void) { return seen; }

static int below(int descriptor) {
    char link[64], path[PATH_MAX];
    if (folder == NULL) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return strncmp(path, folder, strlen(folder)) == 0;
}

static int now(void) {
    long number = seen++;
    return countdown >= 0 && (number == countdown || (sticky && number > countdown));
}

static int refuse(void) {
    errno = mode == FAIL_EIO ? EIO : ENOSPC;
    return -1;
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

#define WRITER(name, parameters, arguments, shorter)                                               \
    ssize_t name parameters {                                                                      \
        if (!below(fd) || !now()) return NEXT(name) arguments;                                     \
        if (mode == SHORT_WRITE && count > 1) return NEXT(name) shorter;                           \
        return refuse();                                                                           \
    }

WRITER(write, (int fd, const void *buffer, size_t count), (fd, buffer, count),
       (fd, buffer, count / 2))
WRITER(pwrite, (int fd, const void *buffer, size_t count, off_t at), (fd, buffer, count, at),
       (fd, buffer, count / 2, at))
WRITER(pwrite64, (int fd, const void *buffer, size_t count, off64_t at), (fd, buffer, count, at),
       (fd, buffer, count / 2, at))

int fsync(int fd) { return below(fd) && now() && mode != SHORT_WRITE ? refuse() : NEXT(fsync)(fd); }

int fdatasync(int fd) {
    return below(fd) && now() && mode != SHORT_WRITE ? refuse() : NEXT(fdatasync)(fd);
}

int rename(const char *from, const char *to) {
    if (folder != NULL && strncmp(from, folder, strlen(folder)) == 0 && now() &&
        mode != SHORT_WRITE)
        return refuse();
    return NEXT(rename)(from, to);
}
