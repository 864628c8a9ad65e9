/* Makes the n-th system call on files below one folder fail, or kills the process there.

   Put before libc by LD_PRELOAD: Python's os and io, HDF5 and netCDF call these functions. Nothing
   is counted before faults_begin(). With a folder for shadows, everything that fsync makes durable
   is copied there: INODE.data is a file at its last fsync, INODE.list the names of a folder at its
   last fsync, INODE.live a link that keeps a file that loses its name; power.py puts together from
   these what a failure of the power would leave.
*/
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

enum { SHORT = -1, KILL_BEFORE = -2, KILL_AFTER = -3, FULL = -4 };

static atomic_int armed;
static atomic_long calls;
static long target;
static int fault, log_handle = -1;
static char root[4096], shadow[4096];
static __thread int dies, inside;

#define REAL(name) ((__typeof__(name) *)dlsym(RTLD_NEXT, #name))

/* Fault `kind` (an errno, or one of the above) at call number `at` below `folder`; 0: only record. */
void faults_begin(const char *folder, const char *shadows, const char *log, long at, int kind)
{
    snprintf(root, sizeof root, "%s", folder);
    snprintf(shadow, sizeof shadow, "%s", shadows);
    log_handle = *log ? REAL(open)(log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666) : -1;
    target = at;
    fault = kind;
    atomic_store(&armed, 1);
}

long faults_end(void)
{
    atomic_store(&armed, 0);
    return atomic_load(&calls);
}

static const char *of_handle(int handle, char *buffer)
{
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", handle);
    ssize_t n = readlink(link, buffer, 4095);
    if (n < 0) return NULL;
    buffer[n] = 0;
    return buffer;
}

static const char *of_name(int folder, const char *name, char *buffer)
{
    if (name[0] == '/') return name;
    char from[4096];
    if (folder == AT_FDCWD ? !getcwd(from, sizeof from) : !of_handle(folder, from)) return NULL;
    if (snprintf(buffer, 4096, "%s/%s", from, name) >= 4096) return NULL;
    return buffer;
}

static int below(const char *path)
{
    size_t n = strlen(root);
    return path && !strncmp(path, root, n) && (path[n] == '/' || !path[n]);
}

/* 0: go on; SHORT; or the error that the call ends with. */
static int enter(const char *call, const char *path, int takes_room)
{
    if (!atomic_load(&armed) || inside || !below(path)) return 0;
    long n = atomic_fetch_add(&calls, 1) + 1;
    int hit = n == target;
    if (log_handle >= 0) {
        char line[4200];
        int size = snprintf(line, sizeof line, "%ld %s %s%s\n", n, call, path + strlen(root),
                            hit ? " HIT" : "");
        if (REAL(write)(log_handle, line, size) < 0) abort();
    }
    if (fault == FULL) return target && n >= target && takes_room ? ENOSPC : 0;
    if (!hit) return 0;
    if (fault == KILL_BEFORE) kill(getpid(), SIGKILL);
    if (fault == KILL_AFTER) { dies = 1; return 0; }
    return fault;
}

static void leave(void)
{
    if (dies) kill(getpid(), SIGKILL);
}

/* --- shadows ------------------------------------------------------------------------------- */

static void shadow_name(char *name, ino_t inode, const char *ending)
{
    snprintf(name, 4200, "%s/%lu.%s", shadow, (unsigned long)inode, ending);
}

static void copy_shadow(const char *from, const char *name)
{
    char data[1 << 16];
    int in = REAL(open)(from, O_RDONLY | O_CLOEXEC);
    int out = REAL(open)(name, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    for (ssize_t n; (n = REAL(read)(in, data, sizeof data)) > 0;)
        if (REAL(write)(out, data, n) != n) abort();
    REAL(close)(in);
    REAL(close)(out);
}

static void list_shadow(const char *path, const char *name)
{
    FILE *out = REAL(fopen)(name, "we");
    DIR *folder = REAL(opendir)(path);
    for (struct dirent *e; folder && out && (e = readdir(folder));)
        if (strcmp(e->d_name, ".") && strcmp(e->d_name, ".."))
            fprintf(out, "%lu %c %s\n", (unsigned long)e->d_ino, e->d_type == DT_DIR ? 'd' : 'f',
                    e->d_name);
    if (folder) closedir(folder);
    if (out) fclose(out);
}

static void synced(int handle)
{
    char link[64], path[4096], name[4200];
    struct stat about;
    if (!*shadow || !atomic_load(&armed) || inside || !below(of_handle(handle, path))) return;
    inside = 1;
    if (!fstat(handle, &about)) {
        snprintf(link, sizeof link, "/proc/self/fd/%d", handle);
        shadow_name(name, about.st_ino, S_ISDIR(about.st_mode) ? "list" : "data");
        if (S_ISDIR(about.st_mode)) list_shadow(path, name);
        else copy_shadow(link, name);
    }
    inside = 0;
}

static void opened(int handle, const char *path)
{
    char name[4200];
    struct stat about;
    if (handle < 0 || !*shadow || !atomic_load(&armed) || inside || !below(path)) return;
    if (!fstat(handle, &about) && S_ISREG(about.st_mode)) {
        shadow_name(name, about.st_ino, "live");
        REAL(link)(path, name);
    }
}

/* --- calls --------------------------------------------------------------------------------- */

#define FAIL(path, call, room, failed)                                                            \
    char buffer[4096];                                                                            \
    (void)buffer;                                                                                 \
    int found = atomic_load(&armed) ? enter(call, path, room) : 0;                                \
    if (found) { errno = found > 0 ? found : EIO; return failed; }

#define MODE(flags)                                                                               \
    mode_t mode = 0;                                                                              \
    if ((flags) & (O_CREAT | __O_TMPFILE)) {                                                      \
        va_list more;                                                                             \
        va_start(more, flags);                                                                    \
        mode = va_arg(more, mode_t);                                                              \
        va_end(more);                                                                             \
    }

#define OPEN(name)                                                                                \
    int name(const char *path, int flags, ...)                                                    \
    {                                                                                             \
        MODE(flags)                                                                               \
        FAIL(of_name(AT_FDCWD, path, buffer), "open", flags &O_CREAT, -1)                         \
        int done = REAL(name)(path, flags, mode);                                                 \
        opened(done, of_name(AT_FDCWD, path, buffer));                                            \
        leave();                                                                                  \
        return done;                                                                              \
    }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                                                              \
    int name(int folder, const char *path, int flags, ...)                                        \
    {                                                                                             \
        MODE(flags)                                                                               \
        FAIL(of_name(folder, path, buffer), "open", flags &O_CREAT, -1)                           \
        int done = REAL(name)(folder, path, flags, mode);                                         \
        opened(done, of_name(folder, path, buffer));                                              \
        leave();                                                                                  \
        return done;                                                                              \
    }
OPENAT(openat)
OPENAT(openat64)

/* A call that returns `type`, whose path is `where`. */
#define CALL(type, name, call, where, room, failed, given, passed)                                \
    type name given                                                                               \
    {                                                                                             \
        FAIL(where, call, room, failed)                                                           \
        type done = REAL(name) passed;                                                            \
        leave();                                                                                  \
        return done;                                                                              \
    }

/* The same with a number of bytes, which may be fewer than asked. */
#define MOVE(name, call, room, given, passed)                                                     \
    ssize_t name given                                                                            \
    {                                                                                             \
        char buffer[4096];                                                                        \
        int found = atomic_load(&armed) ? enter(call, of_handle(handle, buffer), room) : 0;       \
        if (found == SHORT && size > 1) size = size / 2;                                          \
        else if (found > 0) { errno = found; return -1; }                                         \
        ssize_t done = REAL(name) passed;                                                         \
        leave();                                                                                  \
        return done;                                                                              \
    }
MOVE(write, "write", 1, (int handle, const void *data, size_t size), (handle, data, size))
MOVE(read, "read", 0, (int handle, void *data, size_t size), (handle, data, size))
MOVE(pwrite, "write", 1, (int handle, const void *data, size_t size, off_t at),
     (handle, data, size, at))
MOVE(pwrite64, "write", 1, (int handle, const void *data, size_t size, off64_t at),
     (handle, data, size, at))
MOVE(pread, "read", 0, (int handle, void *data, size_t size, off_t at), (handle, data, size, at))
MOVE(pread64, "read", 0, (int handle, void *data, size_t size, off64_t at),
     (handle, data, size, at))
CALL(ssize_t, writev, "write", of_handle(handle, buffer), 1, -1,
     (int handle, const struct iovec *data, int count), (handle, data, count))

#define FOPEN(name)                                                                               \
    FILE *name(const char *path, const char *mode)                                                \
    {                                                                                             \
        FAIL(of_name(AT_FDCWD, path, buffer), "open", *mode != 'r', NULL)                         \
        FILE *done = REAL(name)(path, mode);                                                      \
        leave();                                                                                  \
        return done;                                                                              \
    }
FOPEN(fopen)
FOPEN(fopen64)

#define SYNC(name)                                                                                \
    int name(int handle)                                                                          \
    {                                                                                             \
        FAIL(of_handle(handle, buffer), "fsync", 0, -1)                                           \
        int done = REAL(name)(handle);                                                            \
        if (!done) synced(handle);                                                                \
        leave();                                                                                  \
        return done;                                                                              \
    }
SYNC(fsync)
SYNC(fdatasync)

int close(int handle)
{
    char buffer[4096];
    int found = atomic_load(&armed) ? enter("close", of_handle(handle, buffer), 0) : 0;
    int done = REAL(close)(handle); /* the handle is gone, whatever close says (Linux) */
    leave();
    if (found) { errno = found > 0 ? found : EIO; return -1; }
    return done;
}

#define NAMED of_name(AT_FDCWD, path, buffer)
CALL(int, unlink, "unlink", NAMED, 0, -1, (const char *path), (path))
CALL(int, rmdir, "rmdir", NAMED, 0, -1, (const char *path), (path))
CALL(int, mkdir, "mkdir", NAMED, 1, -1, (const char *path, mode_t mode), (path, mode))
CALL(int, chmod, "chmod", NAMED, 0, -1, (const char *path, mode_t mode), (path, mode))
CALL(int, rename, "rename", NAMED, 1, -1, (const char *path, const char *to), (path, to))
CALL(int, link, "link", NAMED, 1, -1, (const char *path, const char *to), (path, to))
CALL(int, symlink, "link", of_name(AT_FDCWD, to, buffer), 1, -1,
     (const char *path, const char *to), (path, to))
CALL(DIR *, opendir, "opendir", NAMED, 0, NULL, (const char *path), (path))
CALL(int, unlinkat, "unlink", of_name(folder, path, buffer), 0, -1,
     (int folder, const char *path, int flags), (folder, path, flags))
CALL(int, mkdirat, "mkdir", of_name(folder, path, buffer), 1, -1,
     (int folder, const char *path, mode_t mode), (folder, path, mode))
CALL(int, renameat, "rename", of_name(folder, path, buffer), 1, -1,
     (int folder, const char *path, int other, const char *to), (folder, path, other, to))
CALL(int, ftruncate, "ftruncate", of_handle(handle, buffer), 1, -1, (int handle, off_t size),
     (handle, size))
CALL(int, ftruncate64, "ftruncate", of_handle(handle, buffer), 1, -1, (int handle, off64_t size),
     (handle, size))
CALL(int, flock, "flock", of_handle(handle, buffer), 0, -1, (int handle, int how), (handle, how))
