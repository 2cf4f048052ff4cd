// What a list is asked for in its query, and the link to its next page. Not numbers alone
// (http/request.h) and not what is searched. Used by the lists of api/.
#ifndef SERVER_API_QUERY_H
#define SERVER_API_QUERY_H

#include "server/http/request.h"

enum { QUERY_TEXT_MAX = 200 };

// The query's text, NULL where it is absent or empty; at most QUERY_TEXT_MAX bytes.
Status query_text(const Request *request, const char *name, const char **text, Problem *problem);

// Which of `names` (NULL-terminated) it is; `initial` where it is absent.
Status query_choice(const Request *request, const char *name, const char *const *names, int initial,
                    int *choice, Problem *problem);

// "0.4..0.7", "0.4..", "..0.7" or "0.4", both ends included; without it everything, also NAN.
typedef struct QueryRange {
    double least, most;
    bool is_asked;
} QueryRange;
Status query_range(const Request *request, const char *name, QueryRange *range, Problem *problem);
bool query_range_has(const QueryRange *range, double value);

// The link to the page behind this one: all that was asked for again, with `name` now `value`.
void query_link_next(const Request *request, Reply *reply, const char *name, const char *value);

#endif
