// A library for LD_PRELOAD that records what a program does to the files of a folder. With
// IMPACTD_WRITES=FILE and IMPACTD_WRITES_OF=FOLDER in the environment every file that is made,
// renamed or removed there, every write, truncation and sync is appended to FILE when it has
// succeeded: a head, then its bytes. disk_states.py reads them.
//
// Not recorded: *-shm, which SQLite maps into memory and makes anew after a failure.
#define _GNU_SOURCE // RTLD_NEXT
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

enum { DESCRIPTORS = 4096 };
enum { MADE = 1, WROTE, TRUNCATED, SYNCED, SYNCED_FOLDER, RENAMED, REMOVED, LINKED };

typedef struct Head {
    uint32_t kind, size; // of the bytes that follow
    uint64_t file;       // its inode
    int64_t offset;      // or the new size
} Head;

static pthread_once_t once = PTHREAD_ONCE_INIT;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int output = -1;
static const char *folder;
static bool is_recorded[DESCRIPTORS];

static ssize_t (*real_write)(int, const void *, size_t);
static ssize_t (*real_pwrite)(int, const void *, size_t, off_t);
static int (*real_open)(const char *, int, ...);
static int (*real_ftruncate)(int, off_t);
static int (*real_fsync)(int);
static int (*real_fdatasync)(int);
static int (*real_close)(int);
static int (*real_rename)(const char *, const char *);
static int (*real_unlink)(const char *);
static int (*real_link)(const char *, const char *);
static int (*real_mkstemp)(char *);

// ISO C has no conversion from what dlsym returns to a function.
static void find_real(const char *name, void *function) {
    void *found = dlsym(RTLD_NEXT, name);
    if (found == NULL)
        abort();
    memcpy(function, &found, sizeof found);
}

static void start(void) {
    find_real("write", (void *)&real_write);
    find_real("pwrite64", (void *)&real_pwrite);
    find_real("open64", (void *)&real_open);
    find_real("ftruncate64", (void *)&real_ftruncate);
    find_real("fsync", (void *)&real_fsync);
    find_real("fdatasync", (void *)&real_fdatasync);
    find_real("close", (void *)&real_close);
    find_real("rename", (void *)&real_rename);
    find_real("unlink", (void *)&real_unlink);
    find_real("link", (void *)&real_link);
    find_real("mkstemp64", (void *)&real_mkstemp);
    const char *path = getenv("IMPACTD_WRITES");
    folder = getenv("IMPACTD_WRITES_OF");
    if (path != NULL && folder != NULL)
        output = real_open(path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
}

static bool is_below(const char *path) {
    const size_t size = folder != NULL ? strlen(folder) : 0, length = strlen(path);
    if (output < 0 || strncmp(path, folder, size) != 0 || (path[size] != '/' && path[size] != '\0'))
        return false;
    return length < 4 || strcmp(path + length - 4, "-shm") != 0;
}

static bool is_watched(int file) {
    return file >= 0 && file < DESCRIPTORS && is_recorded[file];
}

// The order of the records is that of what happened, also among processes: each is done and
// recorded under both locks.
static void record_lock(void) {
    pthread_mutex_lock(&lock);
    (void)flock(output, LOCK_EX);
}

static void record_unlock(void) {
    (void)flock(output, LOCK_UN);
    pthread_mutex_unlock(&lock);
}

static void record_put(uint32_t kind, uint64_t file, int64_t offset, const void *bytes,
                       size_t size) {
    Head head = {kind, (uint32_t)size, file, offset};
    const struct iovec parts[] = {{&head, sizeof head}, {(void *)(uintptr_t)bytes, size}};
    if (writev(output, parts, 2) != (ssize_t)(sizeof head + size))
        abort();
}

static uint64_t file_number(int file) {
    struct stat what;
    return fstat(file, &what) == 0 ? what.st_ino : 0;
}

static void record_paths(uint32_t kind, const char *from, const char *to) {
    char both[8192];
    const size_t size = strlen(from) + 1, more = strlen(to) + 1;
    if (size + more > sizeof both)
        abort();
    memcpy(both, from, size);
    memcpy(both + size, to, more);
    record_put(kind, 0, 0, both, size + more);
}

static int open_recorded(const char *path, int flags, mode_t mode) {
    struct stat before;
    pthread_once(&once, start);
    if (!is_below(path))
        return real_open(path, flags, mode);
    record_lock();
    const bool is_new = (flags & O_CREAT) != 0 && stat(path, &before) != 0;
    const int file = real_open(path, flags, mode);
    if (file >= 0 && file < DESCRIPTORS) {
        is_recorded[file] = true;
        if (is_new)
            record_put(MADE, file_number(file), 0, path, strlen(path));
        else if ((flags & O_TRUNC) != 0)
            record_put(TRUNCATED, file_number(file), 0, NULL, 0);
    }
    record_unlock();
    return file;
}

int open(const char *path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & (O_CREAT | __O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
    va_end(more);
    return open_recorded(path, flags, mode);
}

int open64(const char *path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    const mode_t mode = (flags & (O_CREAT | __O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
    va_end(more);
    return open_recorded(path, flags, mode);
}

static int mkstemp_recorded(char *path) {
    pthread_once(&once, start);
    if (!is_below(path))
        return real_mkstemp(path);
    record_lock();
    const int file = real_mkstemp(path);
    if (file >= 0 && file < DESCRIPTORS) {
        is_recorded[file] = true;
        record_put(MADE, file_number(file), 0, path, strlen(path));
    }
    record_unlock();
    return file;
}

int mkstemp(char *path) {
    return mkstemp_recorded(path);
}

int mkstemp64(char *path) {
    return mkstemp_recorded(path);
}

int close(int file) {
    pthread_once(&once, start);
    if (is_watched(file))
        is_recorded[file] = false;
    return real_close(file);
}

static ssize_t pwrite_recorded(int file, const void *bytes, size_t size, off_t offset) {
    pthread_once(&once, start);
    if (!is_watched(file))
        return real_pwrite(file, bytes, size, offset);
    record_lock();
    const ssize_t written = real_pwrite(file, bytes, size, offset);
    if (written > 0)
        record_put(WROTE, file_number(file), offset, bytes, (size_t)written);
    record_unlock();
    return written;
}

ssize_t pwrite(int file, const void *bytes, size_t size, off_t offset) {
    return pwrite_recorded(file, bytes, size, offset);
}

ssize_t pwrite64(int file, const void *bytes, size_t size, off_t offset) {
    return pwrite_recorded(file, bytes, size, offset);
}

ssize_t write(int file, const void *bytes, size_t size) {
    pthread_once(&once, start);
    if (!is_watched(file))
        return real_write(file, bytes, size);
    record_lock();
    const off_t offset = lseek(file, 0, SEEK_CUR);
    const ssize_t written = real_write(file, bytes, size);
    if (written > 0)
        record_put(WROTE, file_number(file), offset, bytes, (size_t)written);
    record_unlock();
    return written;
}

static int truncate_recorded(int file, off_t size) {
    pthread_once(&once, start);
    if (!is_watched(file))
        return real_ftruncate(file, size);
    record_lock();
    const int code = real_ftruncate(file, size);
    if (code == 0)
        record_put(TRUNCATED, file_number(file), size, NULL, 0);
    record_unlock();
    return code;
}

int ftruncate(int file, off_t size) {
    return truncate_recorded(file, size);
}

int ftruncate64(int file, off_t size) {
    return truncate_recorded(file, size);
}

static int sync_recorded(int file, int (*const *real)(int)) {
    struct stat what;
    pthread_once(&once, start);
    if (!is_watched(file))
        return (*real)(file);
    record_lock();
    const int code = (*real)(file);
    const bool is_folder = fstat(file, &what) == 0 && S_ISDIR(what.st_mode);
    if (code == 0)
        record_put(is_folder ? SYNCED_FOLDER : SYNCED, what.st_ino, 0, NULL, 0);
    record_unlock();
    return code;
}

int fsync(int file) {
    return sync_recorded(file, &real_fsync);
}

int fdatasync(int file) {
    return sync_recorded(file, &real_fdatasync);
}

static int names_recorded(uint32_t kind, int (*const *real)(const char *, const char *),
                          const char *from, const char *to) {
    pthread_once(&once, start);
    if (!is_below(from) && !is_below(to))
        return (*real)(from, to);
    record_lock();
    const int code = (*real)(from, to);
    if (code == 0)
        record_paths(kind, from, to);
    record_unlock();
    return code;
}

int rename(const char *from, const char *to) {
    return names_recorded(RENAMED, &real_rename, from, to);
}

int link(const char *from, const char *to) {
    return names_recorded(LINKED, &real_link, from, to);
}

int unlink(const char *path) {
    pthread_once(&once, start);
    if (!is_below(path))
        return real_unlink(path);
    record_lock();
    const int code = real_unlink(path);
    if (code == 0)
        record_put(REMOVED, 0, 0, path, strlen(path));
    record_unlock();
    return code;
}
