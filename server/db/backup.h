// A copy of a daemon's database as one file, made beside it while it runs, or without one. Not a
// part of the daemon and no export: what is in it is for another impactd. Used by cli/backup.c.
#ifndef SERVER_DB_BACKUP_H
#define SERVER_DB_BACKUP_H

#include <stdint.h>

#include "core/base/progress.h"
#include "core/base/status.h"

typedef struct BackupRequest {
    const char *directory; // the daemon's
    const char *path;      // of the copy
    bool replaces;         // what is at `path` already
    const Progress *watch; // NULL: nobody
} BackupRequest;

// What is in a copy.
typedef struct Backup {
    uint64_t bytes, jobs, results, materials;
} Backup;

// Writes all that was acknowledged before it began, and checks it. The file appears at `path` whole
// and durable, or nothing is left: STATUS_CANCELLED where the watch wants no more, STATUS_FULL,
// STATUS_NOT_FOUND without a database, STATUS_CONFLICT where `path` is taken.
Status backup_write(const BackupRequest *request, Backup *backup, Problem *problem);

#endif
