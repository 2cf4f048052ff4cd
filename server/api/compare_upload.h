// What POST /v1/compare is asked: a measured motion and the result to set it beside, as JSON or as
// a table of text with the rest in the query. Not the comparison. Used by compare_measured.c.
#ifndef SERVER_API_COMPARE_UPLOAD_H
#define SERVER_API_COMPARE_UPLOAD_H

#include "core/base/field.h"
#include "server/http/request.h"

enum { MEASURED_MIN = 16 }; // samples

typedef enum Statistic {
    QUANTITY_ACCELERATION,
    QUANTITY_VELOCITY,
    QUANTITY_DISPLACEMENT
} Statistic;
extern const char *const statistic_names[];

typedef enum Align { ALIGN_GIVEN, ALIGN_AUTO } Align;
extern const char *const align_names[];

typedef struct MeasuredUpload {
    Reals samples;
    double interval, start; // [s]
    int quantity;           // Statistic
} MeasuredUpload;

typedef struct MeasuredRequest {
    char *a;
    char *channel;
    MeasuredUpload measured;
    int align;         // Align
    double shift;      // [s]
    double most_shift; // [s]
} MeasuredRequest;

// Made also where it fails, but for STATUS_NO_MEMORY; freed by measured_upload_free.
Status measured_upload_read(const Request *request, MeasuredRequest **asked, Problem *problem);
void measured_upload_free(void *asked);

#endif
