// Jobs by what they are called, what became of them and when they came, newest first. Not the
// queue: an unfinished job is "accepted" here whether it runs or not. Used by api/ and the tests.
#ifndef SERVER_DB_JOB_SEARCH_H
#define SERVER_DB_JOB_SEARCH_H

#include "server/db/db.h"
#include "server/util/bytes.h"

// Texts are the caller's; NULL asks for nothing.
typedef struct JobSearch {
    const char *before;          // an id: only those that come after it in the list
    int64_t before_unix_ms;      // of its arrival, where it may be gone; -1: it must be there
    int least_state, most_state; // JobState
    const char *words;           // within the title or a label; upper and lower case are one
    const char *label;           // one whole label, or "key" of a label "key=value"; likewise
    const char *result;          // its id
    const char *study;           // the study's kind; "none": without one
    int64_t since_unix_ms, until_unix_ms; // of arrival, both included
    size_t most;
} JobSearch;

// Everything there is.
JobSearch job_search_all(size_t most);

// STATUS_NOT_FOUND where there is no job `before`, and it does not say when it came.
Status db_job_search(Db *db, const JobSearch *search, JobRows *rows, Problem *problem);

// What a search by words looks into: the title's line, and one for each label.
void job_words(Bytes *bytes, const char *title, const char *const *labels, size_t label_count);

#endif
