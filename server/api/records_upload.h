// What POST /v1/records brings: a ground motion's file as it is published, with the rest in the
// query, or all of it as JSON. Read, judged and measured; not stored. Used by records.c.
#ifndef SERVER_API_RECORDS_UPLOAD_H
#define SERVER_API_RECORDS_UPLOAD_H

#include "core/base/report.h"
#include "server/db/records.h"
#include "server/http/request.h"

typedef struct RecordUpload {
    RecordRow row;
    Reals samples;     // [m/s^2]
    Warnings warnings; // what is allowed but hardly meant
} RecordUpload;

// `upload` may be uninitialised. Cleared by record_upload_clear in any case.
Status record_upload_read(const Request *request, RecordUpload *upload, Problem *problem);
void record_upload_clear(RecordUpload *upload);

#endif
