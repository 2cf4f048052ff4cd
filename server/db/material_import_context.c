// What is asked of rows of every kind.
#include "server/db/material_import_context.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/base/json_pointer.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer) };

// Clocks differ, and a date alone is its midnight wherever it was written.
static const int64_t time_slack_ms = 24 * 3600 * (int64_t)1000;

const RowColumn import_key_columns[] = {ROW_COLUMN(ImportKey, slug, COLUMN_TEXT),
                                        ROW_COLUMN(ImportKey, number, COLUMN_COUNT), ROW_END};

Status import_fault(const ImportContext *context, const char *place, const char *name,
                    const char *format, ...) {
    char pointer[POINTER_SIZE], text[sizeof((Fault){0}.detail)];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (name[0] != '\0')
        json_pointer_join(pointer, sizeof pointer, place, name);
    else
        text_fit(pointer, sizeof pointer, place);
    return problem_add(context->faults, STATUS_INVALID, pointer, "%s", text);
}

void import_deny(ImportContext *context, const char *place, const char *name, const char *why) {
    if (context->denied++ > 0)
        return;
    json_pointer_join(context->denied_place, sizeof context->denied_place, place, name);
    context->denied_why = why;
}

Status import_load(Sqlite *database, const char *sql, const char *slug, uint64_t number,
                   const RowColumn *columns, void *item, Problem *problem) {
    const ImportKey key = {(char *)slug, number};
    Statement *statement;
    bool has_row = false;
    TRY(statement_begin(database, sql, import_key_columns, &key, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, columns, item, problem);
    statement_end(statement);
    return status;
}

void import_compare_origin(const ImportContext *context, const RowInfo *mark, const char *what,
                           const ImportOrigin *ours, const ImportOrigin *there) {
    static const char never[] = "is not that of the %s that is there, and those never change";
    if (mark->has_author && !text_same(ours->author, there->author))
        (void)import_fault(context, mark->place, "author", never, what);
    if (mark->has_comment && !text_same(ours->comment, there->comment))
        (void)import_fault(context, mark->place, "comment", never, what);
    if (mark->has_created && ours->created_unix_ms != there->created_unix_ms)
        (void)import_fault(context, mark->place, "created", never, what);
}

Status import_validate_number(const ImportContext *context, const RowInfo *mark, const char *name,
                              uint64_t number, uint64_t before, bool drifts, uint64_t *last) {
    if (number == before)
        return import_fault(context, mark->place, name, "stands in the file twice, %llu",
                            (unsigned long long)number);
    if (number <= *last)
        return STATUS_OK;
    const uint64_t next = *last + 1;
    *last = number;
    if (number == next || drifts)
        return STATUS_OK;
    return import_fault(context, mark->place, name,
                        "must be %llu, the next, is %llu: numbers continue without a gap",
                        (unsigned long long)next, (unsigned long long)number);
}

const char *import_author(const ImportContext *context, const RowInfo *mark, const char *author) {
    return mark->has_author && context->import->may_all ? author : context->import->who;
}

void import_validate_time(const ImportContext *context, const char *place, int64_t unix_ms,
                          int64_t revised_unix_ms) {
    if (unix_ms > context->import->now_unix_ms + time_slack_ms)
        (void)import_fault(context, place, "created", "lies in the future");
    else if (unix_ms < revised_unix_ms - time_slack_ms)
        (void)import_fault(context, place, "created",
                           "lies before the revision was written; give that its \"created\", too");
}

void import_validate_origin(ImportContext *context, const RowInfo *mark, const char *author,
                            int64_t created_unix_ms) {
    const bool may_all = context->import->may_all;
    if (!may_all && mark->has_author && author != NULL && !text_same(author, context->import->who))
        import_deny(context, mark->place, "author", "is somebody else");
    if (!may_all && mark->has_created)
        import_deny(context, mark->place, "created", "is a time of the file's own");
    if (mark->has_created)
        import_validate_time(context, mark->place, created_unix_ms, 0);
}
