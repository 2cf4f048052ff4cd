// From a Reply to what libmicrohttpd sends: headers, bodies, streams, and answers that are sent
// again and again. Not what the answer is (dispatch.h). Used by exchange.c, on the event loops.
#ifndef SERVER_HTTP_RESPONSE_H
#define SERVER_HTTP_RESPONSE_H

#include <microhttpd.h>
#include <stdbool.h>

#include "server/http/request.h"

struct Exchange;

enum { SENT_AGAIN = 64 };

// A small answer out of the cache of whole answers, made into a response once for each event loop:
// making one costs as much as sending it.
typedef struct SharedResponse {
    const void *shared; // the Reply's
    struct MHD_Response *response;
} SharedResponse;

// Takes what `reply` owns.
enum MHD_Result response_queue(struct Exchange *exchange, Reply *reply, bool closes);

void response_forget(SharedResponse shared_response[SENT_AGAIN]);

#endif
