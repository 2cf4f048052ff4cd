// A database as one file: a copy of the daemon's, made beside it while it runs or without it, and
// the way back.
#ifndef SERVER_DB_BACKUP_H
#define SERVER_DB_BACKUP_H

#include <stdint.h>

#include "core/base/progress.h"
#include "core/base/status.h"

typedef struct BackupRequest {
    const char *directory; // the daemon's
    const char *path;      // of the copy
    bool replaces;         // the file that is written may exist
    const Progress *watch; // NULL: none
} BackupRequest;

// What a copy contains.
typedef struct Backup {
    uint64_t bytes, jobs, results, materials;
} Backup;

// Copies all that was acknowledged before it began to `path`, and checks it. The file appears whole
// and durable, or nothing is left: STATUS_CANCELLED when the watch stops, STATUS_FULL,
// STATUS_NOT_FOUND without a database, STATUS_CONFLICT where `path` is taken.
Status backup_write(const BackupRequest *request, Backup *backup, Problem *problem);

// Copies `path` to the folder's database, likewise. STATUS_CONFLICT where a daemon has the folder,
// where it has a database and that may not be replaced, and where the schema is not this program's.
Status backup_restore(const BackupRequest *request, Backup *backup, Problem *problem);

#endif
