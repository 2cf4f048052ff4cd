// Ways to fill a Reply: owned bytes, static bytes, parts of them, "not changed".
// Not problems (body.h) and not sending (listener.h). Used by api/ and dispatch.c.
#ifndef SERVER_HTTP_REPLY_H
#define SERVER_HTTP_REPLY_H

#include "server/http/request.h"
#include "server/util/bytes.h"

extern const char type_json[]; // "application/json"

void reply_default(Reply *reply);
// Gives up whatever body and kept things `reply` owns.
void reply_clear(Reply *reply);

// Takes what `bytes` holds, also when it fails (STATUS_NO_MEMORY or, at the buffer's limit,
// STATUS_LIMIT).
Status reply_bytes(Reply *reply, int code, const char *content_type, Bytes *bytes,
                   Problem *problem);

// A body that lives as long as the program, or until `release(context)`.
void reply_borrow(Reply *reply, int code, const char *content_type, const void *body, size_t size);

// Sets the strong ETag (without quotes here) of something that never changes; true if the client
// has it already, and then the reply is a finished 304.
bool reply_immutable(Reply *reply, const Request *request, const char *tag);
// The same for what may change: the client asks again each time.
bool reply_tagged(Reply *reply, const Request *request, const char *tag);

// The same for a reply that has its tag: whatever else it holds is given up where the client has
// it.
bool reply_is_known(Reply *reply, const Request *request);

// Turns a text that is whole in memory into gzip where the client takes it and it pays.
bool reply_pack(Reply *reply, const Request *request);

// Turns a whole 200 into 206 or 416 where the request asks for a part of a body that accepts
// ranges. STATUS_USAGE with code 416 set in `reply` where there is no such part.
Status reply_range(Reply *reply, const Request *request, Problem *problem);

// Asks to be called again when request->waker is called or after `wait_ms`. `keep` comes back as
// request->kept.
void reply_wait(Reply *reply, int wait_ms, void *keep, void (*forget)(void *keep));

#endif
