// Ways to fill a Reply: bytes, parts of them, "not changed", problem documents (RFC 9457).
#ifndef SERVER_HTTP_REPLY_H
#define SERVER_HTTP_REPLY_H

#include "server/http/request.h"
#include "server/util/bytes.h"
#include "server/util/embedded.h"

extern const char type_json[]; // "application/json"

void reply_default(Reply *reply);
// Releases what `reply` owns.
void reply_clear(Reply *reply);

// Takes what `bytes` holds, also when it fails (STATUS_NO_MEMORY or, at the buffer's limit,
// STATUS_LIMIT).
Status reply_bytes(Reply *reply, int code, const char *content_type, Bytes *bytes,
                   Problem *problem);

// The same of JSON, unless `status` is an error already.
Status reply_json(Reply *reply, int code, Bytes *bytes, Status status, Problem *problem);

// A body that lives as long as the program, or until `release(context)`.
void reply_borrow(Reply *reply, int code, const char *content_type, const void *body, size_t size);

// Sets the strong ETag (without quotes here) of something that never changes; true if the client
// has it already, and then the reply is a finished 304.
bool reply_immutable(Reply *reply, const Request *request, const char *tag);
// The same for what may change: the client asks again each time.
bool reply_tagged(Reply *reply, const Request *request, const char *tag);

// A file of the program, or that the client has it already: its digest is the tag.
Status reply_embedded(Reply *reply, const Request *request, const EmbeddedFile *file,
                      const char *content_type);

// The same for a reply that has its tag; the rest of it is released where the client has it.
bool reply_is_known(Reply *reply, const Request *request);

// Indents JSON that is whole in memory where the request asks for it. STATUS_NO_MEMORY: it is as it
// was, which is not what its tag stands for.
Status reply_indent(Reply *reply, const Request *request);
// Appends JSON with two spaces for each level; lists of plain values stay on one line.
void reply_indent_json(Bytes *bytes, const char *text, size_t size);

// Compresses a text that is whole in memory where the client accepts gzip and it becomes smaller.
bool reply_pack(Reply *reply, const Request *request);

// Turns a whole 200 into 206 or 416 where the request asks for a part of a body that accepts
// ranges. STATUS_USAGE with code 416 set in `reply` where there is no such part.
Status reply_range(Reply *reply, const Request *request, Problem *problem);

// Links the next page: the same queries, with `name` now `value`. Without memory for it `body`
// fails: a page without a link is the last one.
void reply_link_next(const Request *request, Reply *reply, const char *name, const char *value,
                     Bytes *body);

// The format of the extension in the path's `parameter`, else by Accept, out of `count`.
// STATUS_NOT_FOUND, STATUS_NOT_ACCEPTABLE.
typedef struct ReplyFormat {
    const char *extension, *content_type;
} ReplyFormat;
enum { REPLY_FORMATS_MAX = 16 };
Status reply_format(const Request *request, size_t parameter, const ReplyFormat *at, size_t count,
                    Reply *reply, size_t *choice, Problem *problem);

// Asks to be called again when request->callback is called or after `wait_ms`. `keep` comes back as
// request->kept.
void reply_wait(Reply *reply, int wait_ms, void *keep, void (*forget)(void *keep));

// Makes the reply application/problem+json. `code` 0: encode_problem_code(problem->status). Headers
// already set in `reply` (Allow, Retry-After, Content-Range) stay. Never fails: without memory the
// body is a constant. `instance` and `request_id` may be NULL.
void reply_problem(Reply *reply, const Problem *problem, int code, const char *instance,
                   const char *request_id);

// Content-Security-Policy of data; of a drawing, which contains its style; of the dashboard: its
// own files and answers, no inline script or style, and no text becomes markup.
extern const char reply_policy[], reply_drawing_policy[], reply_page_policy[];

#endif
