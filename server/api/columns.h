// Tables of numbers as replies: the format by extension or Accept, part and points by the query,
// whole where it is short and as a stream where it is long.
#ifndef SERVER_API_COLUMNS_H
#define SERVER_API_COLUMNS_H

#include "server/api/app.h"
#include "server/formats/table_stream.h"

// The format of the extension in the path's `parameter`, else by Accept. `has_chart`: SVG is one of
// the formats.
Status columns_format(const Request *request, size_t parameter, bool has_chart, Reply *reply,
                      const TableFormat **format, Problem *problem);

// "?from=&to=" [s]: which of `count` samples, at least one, are written. "?points=n": smallest and
// largest values in at most n buckets. STATUS_USAGE: not numbers, or no sample is there.
Status columns_window(const Request *request, size_t count, TableStream *stream, Problem *problem);

// The outcome with series of the result in the request's first parameter. *outcome is a reference,
// or NULL where the request waits until it is computed.
Status columns_outcome(App *app, const Request *request, Reply *reply, Outcome **outcome,
                       Problem *problem);

// Lets the request wait for its callback until 60 s after its start; `kept` comes back as
// request->kept and is freed by `forget`, here too where the time is over: STATUS_BUSY with `why`.
Status columns_wait(const Request *request, Reply *reply, void *kept, void (*forget)(void *kept),
                    const char *why, Problem *problem);

// Takes `stream`, also when it fails; NULL is STATUS_NO_MEMORY.
Status columns_reply(App *app, Reply *reply, const TableFormat *format, TableStream *stream,
                     Problem *problem);

#endif
