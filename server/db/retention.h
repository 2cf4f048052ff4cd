// What is kept: finished jobs go, the oldest first, and with the last job of a result the result.
// Not when: that is jobs/maintenance.c, which uses it.
#ifndef SERVER_DB_RETENTION_H
#define SERVER_DB_RETENTION_H

#include "server/db/db.h"

// 0: no such rule.
typedef struct KeepRules {
    double days;
    uint64_t jobs, bytes; // finished jobs; of the database, without what is free in it
} KeepRules;

enum { RETENTION_BATCH = 64 };

typedef struct Removed {
    size_t jobs, results;
    char result[RETENTION_BATCH][72]; // their ids
    bool is_more;                     // worth another call at once
} Removed;

// Removes some of what is beyond the rules, or gives some free pages back to the disk where there
// are many, in one small transaction.
Status db_remove(Db *db, const KeepRules *rules, Removed *removed, Problem *problem);

#endif
