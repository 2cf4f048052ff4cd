// The materials and records that a study request names, as lines stored beside its result.
#ifndef SERVER_JOBS_REFERENCES_H
#define SERVER_JOBS_REFERENCES_H

#include "core/study/study.h"
#include "server/util/bytes.h"

// Adds a line for each revision of a material, "sponge@1\n", and each record,
// "record:elcentro\n", that the prepared scene or its sweep names.
void references_write(Bytes *bytes, const StudyRequest *inquiry);

// One of those lines.
typedef struct ReferenceRow {
    char slug[128];
    unsigned long long revision; // 0: it is of no material
} ReferenceRow;
// Takes the next line off `*lines`; false at their end.
bool references_next(const char **lines, ReferenceRow *use);

#endif
