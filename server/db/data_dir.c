// The folder of a daemon's data, and the lock that keeps a second daemon out of it. The lock is
// flock's on the folder itself: it ends with the process however that ends. The file impactd.lock
// has the holder's number, for the message alone, and may stay behind or be removed.
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/db/db_private.h"

Status data_dir_make(const char *directory, Problem *problem) {
    char path[PATH_MAX];
    const size_t length = strlen(directory);
    if (length == 0 || length >= sizeof path - 32)
        return problem_set(problem, STATUS_IO,
                           "the data folder's name has %zu bytes; must be 1 to %zu", length,
                           sizeof path - 33);
    memcpy(path, directory, length + 1);
    for (size_t i = 1; i <= length; i++) {
        if (path[i] != '/' && path[i] != '\0')
            continue;
        const char end = path[i];
        path[i] = '\0';
        if (mkdir(path, 0700) != 0 && errno != EEXIST)
            return problem_set(problem, STATUS_IO, "cannot make the folder %s: %s", path,
                               strerror(errno));
        path[i] = end;
    }
    // In a sticky folder, as /tmp is, others cannot remove or rename the files.
    enum { STICKY = 01000 }; // S_ISVTX, which POSIX has among its extensions
    struct stat folder;
    if (stat(directory, &folder) == 0 && (folder.st_mode & (S_IWOTH | STICKY)) == S_IWOTH)
        return problem_set(problem, STATUS_FORBIDDEN,
                           "every user may write to the folder %s, and thus replace the database; "
                           "chmod o-w it, or choose another folder",
                           directory);
    return STATUS_OK;
}

static void folder_report_holder(const char *directory, const char *path, Problem *problem) {
    char holder[32] = "";
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file >= 0 && read(file, holder, sizeof holder - 1) > 0)
        holder[strspn(holder, "0123456789")] = '\0';
    if (file >= 0)
        close(file);
    problem_set(problem, STATUS_CONFLICT,
                "another impactd%s%s%s uses the folder %s; stop it or choose another folder",
                holder[0] != '\0' ? " (process " : "", holder, holder[0] != '\0' ? ")" : "",
                directory);
}

Status data_dir_lock(const char *directory, int *lock, Problem *problem) {
    char path[PATH_MAX];
    *lock = -1;
    TRY(data_dir_make(directory, problem));
    snprintf(path, sizeof path, "%s/impactd.lock", directory);
    const int folder = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0)
        return problem_set(problem, STATUS_IO, "cannot open the folder %s: %s", directory,
                           strerror(errno));
    if (flock(folder, LOCK_EX | LOCK_NB) != 0) {
        const int code = errno;
        if (code == EWOULDBLOCK)
            folder_report_holder(directory, path, problem);
        close(folder);
        return code == EWOULDBLOCK
                   ? STATUS_CONFLICT
                   : problem_set(problem, STATUS_IO, "cannot lock the folder %s: %s", directory,
                                 strerror(code));
    }
    const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    const int code = errno;
    if (file >= 0) { // a full disk is no reason not to start
        (void)dprintf(file, "%ld\n", (long)getpid());
        close(file);
    } else if (code != ENOSPC && code != EDQUOT) {
        close(folder);
        return problem_set(problem, STATUS_IO, "cannot make %s: %s", path, strerror(code));
    }
    *lock = folder;
    return STATUS_OK;
}

void data_dir_unlock(int lock) {
    if (lock >= 0)
        close(lock);
}

Status data_dir_sync(const char *directory, Problem *problem) {
    const int folder = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const bool is_synced = folder >= 0 && fsync(folder) == 0;
    // Some file systems cannot sync a folder and need not.
    const int code = errno;
    if (folder >= 0)
        close(folder);
    if (is_synced || (folder >= 0 && code == EINVAL))
        return STATUS_OK;
    return problem_set(problem, STATUS_IO, "cannot sync the folder %s: %s", directory,
                       strerror(code));
}
