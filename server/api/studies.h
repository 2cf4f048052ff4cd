// The answer of a result's study, read back as it was kept. Used by results.c and studies.c.
#ifndef SERVER_API_STUDIES_H
#define SERVER_API_STUDIES_H

#include "core/study/study.h"
#include "server/store/store.h"

// Of a row that has one. Cleared by fields_clear(study_answer_fields, ...) in any case.
Status study_read(const ResultRow *row, StudyAnswer *answer, Problem *problem);

#endif
