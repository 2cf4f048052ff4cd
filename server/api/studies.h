// The answer of a result's study, read back as it was kept, and in what format. Used by results.c,
// studies.c and sweeps.c.
#ifndef SERVER_API_STUDIES_H
#define SERVER_API_STUDIES_H

#include "core/study/study.h"
#include "server/db/db.h"
#include "server/formats/study_formats.h"
#include "server/http/request.h"

// Of a row that has one. Cleared by fields_clear(study_answer_fields, ...) in any case.
Status study_read(const ResultRow *row, StudyAnswer *answer, Problem *problem);

// The format by the extension in the request's second parameter, else by Accept. STATUS_NOT_FOUND,
// STATUS_NOT_ACCEPTABLE.
Status study_format(const Request *request, const StudyFormat *formats, Reply *reply,
                    const StudyFormat **format, Problem *problem);

#endif
