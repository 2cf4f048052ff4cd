// The values of request headers: Accept, Accept-Encoding, Prefer, Range, If-Match, If-None-Match,
// Content-Type.
#ifndef SERVER_HTTP_HEADER_H
#define SERVER_HTTP_HEADER_H

#include <stdbool.h>
#include <stddef.h>

// RFC 9110: which of `types` (media types, NULL-terminated, the preferred one first) the client
// likes best; -1 for none. NULL or "" accepts all. Parameters of the types themselves (charset)
// play no part.
int header_accept(const char *accept, const char *const *types);

// Whether an Accept-Encoding accepts gzip; NULL and "" do not.
bool header_accepts_gzip(const char *accept_encoding);

// RFC 7240.
typedef struct Prefer {
    bool responds_async;
    bool has_wait;
    double wait; // [s]
} Prefer;
Prefer header_prefer(const char *prefer);

typedef enum RangeKind {
    RANGE_WHOLE, // none, or one that may be passed over: several ranges, another unit, not well
                 // formed
    RANGE_PART,
    RANGE_UNSATISFIABLE,
} RangeKind;
// "bytes=first-last", "bytes=first-", "bytes=-suffix" within `size` bytes.
RangeKind header_range(const char *range, size_t size, size_t *first, size_t *last);

// Whether If-None-Match ("*" or a list, weak ones included) names `etag`.
bool header_etag_matches(const char *if_none_match, const char *etag);

// The next entity tag of a list (If-Match), which goes on behind it: with its quotes, or *. Weak
// ones, which never match strongly, and what is no tag are passed over. False at the end.
bool header_etag_next(const char **list, const char **tag, size_t *size);

// Whether a Content-Type is `type`, whatever its parameters.
bool header_type_is(const char *content_type, const char *type);

#endif
