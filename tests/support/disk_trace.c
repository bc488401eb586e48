/* Write down what is asked of the disk below a folder: preloaded (LD_PRELOAD) before the C library.

   SQLite, HDF5 and Python all come to the system through these functions. Should one go past them, `disk.py` notices:
   at every sync the file as it is stands in the trace too, and has to be what the trace makes of it. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { MARK, OPEN, WRITE, TRUNCATE, RENAME, UNLINK, MAKE_FOLDER, REMOVE_FOLDER, LINK, SYNC };

struct entry {
    uint32_t kind, truncates;
    uint64_t file;
    int64_t at;
    uint64_t length;
};

static char folder[PATH_MAX];
static int trace = -1;

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

/* Threads write at the same time: what one asks for, and its entry, go before those of another. */
static pthread_mutex_t turn = PTHREAD_RECURSIVE_MUTEX_INITIALIZER_NP;

static int take_turn(void) { return pthread_mutex_lock(&turn); }
static void end_turn(int *taken) { *taken = pthread_mutex_unlock(&turn); }

#define ALONE __attribute__((cleanup(end_turn), unused)) int taken = take_turn()

static void put(const void *bytes, size_t count)
{
    while (count > 0) {
        ssize_t done = NEXT(write)(trace, bytes, count);
        if (done < 0)
            abort();
        bytes = (const char *)bytes + done;
        count -= done;
    }
}

static void add(uint32_t kind, uint64_t file, int64_t at, int truncates, const void *bytes, size_t length)
{
    int kept = errno;
    struct entry entry = {kind, truncates, file, at, length};
    put(&entry, sizeof entry);
    put(bytes, length);
    errno = kept;
}

void trace_begin(const char *below, const char *into)
{
    snprintf(folder, sizeof folder, "%s/", below);
    trace = NEXT(open)(into, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
}

void trace_mark(const char *text)
{
    ALONE;
    add(MARK, 0, 0, 0, text, strlen(text));
}

void trace_end(void)
{
    ALONE;
    NEXT(close)(trace);
    trace = -1;
}

static int inside(const char *path)
{
    size_t length = strlen(folder) - 1;
    return trace >= 0 && strncmp(path, folder, length) == 0 && (path[length] == '/' || path[length] == 0);
}

static int path_of(int fd, char *path)
{
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, PATH_MAX - 1);
    path[length < 0 ? 0 : length] = 0;
    return length >= 0;
}

static int watched(int fd)
{
    char path[PATH_MAX];
    return trace >= 0 && fd != trace && path_of(fd, path) && inside(path);
}

static int named(int at, const char *name, char *path)
{
    char base[PATH_MAX];
    if (trace < 0)
        return 0;
    if (name[0] == '/')
        snprintf(path, PATH_MAX, "%s", name);
    else if (at == AT_FDCWD ? getcwd(base, sizeof base) != NULL : path_of(at, base))
        snprintf(path, PATH_MAX, "%.2000s/%.2000s", base, name);
    else
        return 0;
    return inside(path);
}

static uint64_t file_of(int fd)
{
    struct stat found;
    return fstat(fd, &found) == 0 ? found.st_ino : 0;
}

/* -- opening ------------------------------------------------------------------------------------ */

static int opened(int fd, int at, const char *name, int flags)
{
    char path[PATH_MAX];
    if (fd >= 0 && (flags & (O_CREAT | O_TRUNC)) && named(at, name, path))
        add(OPEN, file_of(fd), 0, (flags & O_TRUNC) != 0, path, strlen(path));
    return fd;
}

static mode_t mode_in(int flags, va_list rest) { return flags & O_CREAT ? va_arg(rest, mode_t) : 0; }

#define OPENER(name, parameters, arguments, at)                                                                        \
    int name parameters                                                                                                \
    {                                                                                                                  \
        va_list rest;                                                                                                  \
        va_start(rest, flags);                                                                                         \
        mode_t mode = mode_in(flags, rest);                                                                            \
        va_end(rest);                                                                                                  \
        ALONE;                                                                                                         \
        return opened(NEXT(name) arguments, at, path, flags);                                                          \
    }

OPENER(open, (const char *path, int flags, ...), (path, flags, mode), AT_FDCWD)
OPENER(open64, (const char *path, int flags, ...), (path, flags, mode), AT_FDCWD)
OPENER(openat, (int at, const char *path, int flags, ...), (at, path, flags, mode), at)
OPENER(openat64, (int at, const char *path, int flags, ...), (at, path, flags, mode), at)

int creat(const char *path, mode_t mode)
{
    ALONE;
    return opened(NEXT(creat)(path, mode), AT_FDCWD, path, O_CREAT | O_TRUNC);
}

int creat64(const char *path, mode_t mode)
{
    ALONE;
    return opened(NEXT(creat64)(path, mode), AT_FDCWD, path, O_CREAT | O_TRUNC);
}

/* -- writing ------------------------------------------------------------------------------------ */

static ssize_t written(int fd, off64_t at, ssize_t done, const struct iovec *parts, int count)
{
    for (ssize_t left = done; left > 0 && count > 0; ++parts, --count) {
        size_t length = (size_t)left < parts->iov_len ? (size_t)left : parts->iov_len;
        add(WRITE, file_of(fd), at, 0, parts->iov_base, length);
        at += length;
        left -= length;
    }
    return done;
}

static off64_t here(int fd)
{
    return fcntl(fd, F_GETFL) & O_APPEND ? lseek64(fd, 0, SEEK_END) : lseek64(fd, 0, SEEK_CUR);
}

#define WRITER(name, parameters, arguments, position, ...)                                                             \
    ssize_t name parameters                                                                                            \
    {                                                                                                                  \
        if (!watched(fd))                                                                                              \
            return NEXT(name) arguments;                                                                               \
        ALONE;                                                                                                         \
        off64_t first = position;                                                                                      \
        return written(fd, first, NEXT(name) arguments, __VA_ARGS__);                                                  \
    }

#define ONE &(struct iovec){(void *)bytes, length}, 1

WRITER(write, (int fd, const void *bytes, size_t length), (fd, bytes, length), here(fd), ONE)
WRITER(pwrite, (int fd, const void *bytes, size_t length, off_t at), (fd, bytes, length, at), at, ONE)
WRITER(pwrite64, (int fd, const void *bytes, size_t length, off64_t at), (fd, bytes, length, at), at, ONE)
WRITER(writev, (int fd, const struct iovec *parts, int count), (fd, parts, count), here(fd), parts, count)
WRITER(pwritev, (int fd, const struct iovec *parts, int count, off_t at), (fd, parts, count, at), at, parts, count)
WRITER(pwritev64, (int fd, const struct iovec *parts, int count, off64_t at), (fd, parts, count, at), at, parts, count)

#define CUTTER(name, type)                                                                                             \
    int name(int fd, type length)                                                                                      \
    {                                                                                                                  \
        ALONE;                                                                                                         \
        int failed = NEXT(name)(fd, length);                                                                           \
        if (!failed && watched(fd))                                                                                    \
            add(TRUNCATE, file_of(fd), length, 0, "", 0);                                                              \
        return failed;                                                                                                 \
    }

CUTTER(ftruncate, off_t)
CUTTER(ftruncate64, off64_t)

#define CUTTER_BY_NAME(name, type)                                                                                     \
    int name(const char *path, type length)                                                                            \
    {                                                                                                                  \
        char whole[PATH_MAX];                                                                                          \
        struct stat found;                                                                                             \
        ALONE;                                                                                                         \
        int failed = NEXT(name)(path, length);                                                                         \
        if (!failed && named(AT_FDCWD, path, whole) && stat(whole, &found) == 0)                                       \
            add(TRUNCATE, found.st_ino, length, 0, "", 0);                                                             \
        return failed;                                                                                                 \
    }

CUTTER_BY_NAME(truncate, off_t)
CUTTER_BY_NAME(truncate64, off64_t)

/* -- syncing ------------------------------------------------------------------------------------ */

static int synced(int fd, int failed)
{
    if (failed || !watched(fd))
        return failed;
    char link[64], *content = NULL;
    struct stat found;
    fstat(fd, &found);
    ssize_t length = 0;
    if (S_ISREG(found.st_mode)) {
        /* the descriptor itself may be there to write only */
        snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
        int again = NEXT(open)(link, O_RDONLY | O_CLOEXEC);
        content = malloc(found.st_size + 1);
        length = pread(again, content, found.st_size, 0);
        if (length != found.st_size)
            abort();
        NEXT(close)(again);
    }
    add(SYNC, found.st_ino, 0, 0, content, length);
    free(content);
    return failed;
}

int fsync(int fd)
{
    ALONE;
    return synced(fd, NEXT(fsync)(fd));
}

int fdatasync(int fd)
{
    ALONE;
    return synced(fd, NEXT(fdatasync)(fd));
}

/* -- names -------------------------------------------------------------------------------------- */

static int called(uint32_t kind, int failed, int at, const char *path)
{
    char whole[PATH_MAX];
    struct stat found;
    if (!failed && named(at, path, whole))
        add(kind, stat(whole, &found) == 0 ? found.st_ino : 0, 0, 0, whole, strlen(whole));
    return failed;
}

static int called_both(uint32_t kind, int failed, int at, const char *from, int to_at, const char *to)
{
    char both[2 * PATH_MAX], second[PATH_MAX];
    if (!failed && (named(at, from, both) | named(to_at, to, second))) {
        size_t length = strlen(both) + 1;
        strcpy(both + length, second);
        add(kind, 0, 0, 0, both, length + strlen(second));
    }
    return failed;
}

int rename(const char *from, const char *to)
{
    ALONE;
    return called_both(RENAME, NEXT(rename)(from, to), AT_FDCWD, from, AT_FDCWD, to);
}

int renameat(int at, const char *from, int to_at, const char *to)
{
    ALONE;
    return called_both(RENAME, NEXT(renameat)(at, from, to_at, to), at, from, to_at, to);
}

int link(const char *from, const char *to)
{
    ALONE;
    return called_both(LINK, NEXT(link)(from, to), AT_FDCWD, from, AT_FDCWD, to);
}

int unlink(const char *path)
{
    ALONE;
    return called(UNLINK, NEXT(unlink)(path), AT_FDCWD, path);
}

int unlinkat(int at, const char *path, int flags)
{
    ALONE;
    return called(flags & AT_REMOVEDIR ? REMOVE_FOLDER : UNLINK, NEXT(unlinkat)(at, path, flags), at, path);
}

int rmdir(const char *path)
{
    ALONE;
    return called(REMOVE_FOLDER, NEXT(rmdir)(path), AT_FDCWD, path);
}

int mkdir(const char *path, mode_t mode)
{
    ALONE;
    return called(MAKE_FOLDER, NEXT(mkdir)(path, mode), AT_FDCWD, path);
}

int mkdirat(int at, const char *path, mode_t mode)
{
    ALONE;
    return called(MAKE_FOLDER, NEXT(mkdirat)(at, path, mode), at, path);
}
