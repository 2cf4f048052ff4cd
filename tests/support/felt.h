// A material for tests of the database, and its reviews.
#ifndef TESTS_SUPPORT_FELT_H
#define TESTS_SUPPORT_FELT_H

#include "server/db/materials.h"

// A database in `directory` (NULL: in memory); fails the test if it cannot be opened.
Db *felt_store(const char *directory);

// A revision of "felt" with that restitution; texts are borrowed.
MaterialRevision felt_saying(double restitution);

// Gives a revision of it that status; `reviewer` may be NULL.
Status felt_review(Db *db, uint64_t revision, const char *status, const char *reviewer,
                   uint64_t version);

#endif
