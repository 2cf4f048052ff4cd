// Which results the database may have, told without reading it: most scenes are new, and a reader
// that looks once more after every commit begins with nothing in its cache. Never says no to one
// that is there; says yes to few that are not. Not for what is deleted. Used by store.c and
// result_rows.c.
#ifndef SERVER_STORE_RESULT_FILTER_H
#define SERVER_STORE_RESULT_FILTER_H

#include "server/store/database.h"

typedef struct ResultFilter ResultFilter;

// One that says yes to all; NULL without memory.
ResultFilter *result_filter_new(void);
void result_filter_free(ResultFilter *filter);

// Reads the ids of all results; from then on it says no. Before anyone else has the filter.
Status result_filter_fill(ResultFilter *filter, Database *database, Problem *problem);
// Before it is written.
void result_filter_add(ResultFilter *filter, const char *id);
bool result_filter_may_have(const ResultFilter *filter, const char *id);

#endif
