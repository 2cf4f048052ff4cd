// Numbers in columns as replies: the format by extension or Accept, the Outcome they come from, and
// the way out, whole where that is short and as a stream where it is long. Not what the columns
// are: that is series.c's, ledgers.c's and force.c's, who use it.
#ifndef SERVER_API_COLUMNS_H
#define SERVER_API_COLUMNS_H

#include "server/api/app.h"
#include "server/formats/encoding.h"

// A table with all that must live until it is sent. All zero is empty.
typedef struct ColumnReply {
    Table table;           // its list of columns is `chosen`
    const Column **chosen; // owned
    Columns own;           // what was made for it, or nothing
    Outcome *outcome;      // a hold, or NULL
    Encoding *encoding;    // made by columns_reply
} ColumnReply;

void column_reply_clear(ColumnReply *column_reply);
// Room for `count` columns in sheet->chosen.
Status column_reply_make(ColumnReply *column_reply, size_t count, Problem *problem);
// Chooses all columns that are the sheet's own.
Status column_reply_own(ColumnReply *column_reply, Problem *problem);

// The same with the first of them as the axis.
Status column_reply_own_axis(ColumnReply *column_reply, Problem *problem);

// "?from=&to=" [s]: which of `count` samples, at least one and at the table's rate, its rows are.
// STATUS_USAGE: not numbers, or no sample is there.
Status columns_window(const Request *request, size_t count, Table *table, Problem *problem);
// "?points=n": least and largest value of the rows in at most n buckets, all of one size but the
// last, are the sheet's own then. STATUS_USAGE: not a count.
Status columns_downsample(const Request *request, ColumnReply *column_reply, Problem *problem);

// The table of spectra as they were saved. (ledgers.c)
Status column_reply_psd(ColumnReply *column_reply, const char *text, Problem *problem);

// The encoder asked for by extension (a parameter of the path), else by Accept. `has_chart`: SVG is
// one of the formats.
Status columns_format(const Request *request, size_t parameter, bool has_chart, Reply *reply,
                      const TableFormat **encoder, Problem *problem);

// The outcome of a part of a result. *outcome is a hold, or NULL when the reply is made already:
// the client has the part, or the request has been put to sleep.
Status columns_outcome(App *app, const Request *request, Reply *reply, const char *what,
                       const char *extension, Outcome **outcome, Problem *problem);

// The same without an entity tag.
Status columns_choose(App *app, const Request *request, Reply *reply, Outcome **outcome,
                      Problem *problem);

// Takes what `sheet` holds, also when it fails.
Status columns_reply(App *app, Reply *reply, const TableFormat *encoder, ColumnReply *column_reply,
                     Problem *problem);
// The same of a document whose every byte has its place; the sheet holds what that borrows.
Status columns_reply_segments(App *app, Reply *reply, const char *content_type, Segments *layout,
                              ColumnReply *column_reply, Problem *problem);

#endif
