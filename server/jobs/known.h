// Whole answers to bodies that were answered before, by the body byte for byte: what a known scene
// costs is a comparison, a copy and a late row. Not results and not scenes: of another writing of
// the same scene nothing is known here. Locked. Used by intake.c.
#ifndef SERVER_JOBS_KNOWN_H
#define SERVER_JOBS_KNOWN_H

#include "server/jobs/intake.h"

typedef struct Known Known;

Known *known_new(size_t most_bytes); // NULL without memory
void known_free(Known *known);

// `mark` is what the answer was made under; it holds as long as that stays the same.
void known_put(Known *known, const Submission *submission, uint64_t mark, const JobRow *row,
               const char *text, size_t size, const JobSlots *slots);
// The answer with a job of its own, of which `store` gets a late row. False: not known, or the
// store has no room now.
bool known_answer(Known *known, Store *store, const Submission *submission, uint64_t mark,
                  KnownAnswer *answer);
void known_forget(Known *known, const char *result);
void known_tally(Known *known, LayerTally *tally);

#endif
