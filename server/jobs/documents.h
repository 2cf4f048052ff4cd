// The JSON documents of a result: plan, summary, work, warnings, energy, scene and the answer of
// its study.
#ifndef SERVER_JOBS_DOCUMENTS_H
#define SERVER_JOBS_DOCUMENTS_H

#include "core/study/study.h"
#include "server/db/db.h"
#include "server/util/bytes.h"

// Plan, summary (with the reduction, if requested), work and notes. STATUS_NO_MEMORY.
Status document_outcome(const Outcome *outcome, ResultRow *row);
void document_warnings(Bytes *bytes, const Warnings *warnings);
// Two such arrays as one; NULL is an empty one.
void document_join(Bytes *bytes, const char *first, const char *second);
void document_energy(Bytes *bytes, const Energy *energy);
// The scene as it can be submitted again, with its study, without its notes.
void document_scene(Bytes *bytes, const StudyRequest *inquiry);
// A study's answer as it is sent: {"kind": ...}, what is unknown is null.
void document_answer(Bytes *bytes, const Variant *answer);

// An answer with the result that it belongs to, as /v1/results/{id}/DOCUMENT.json has it.
typedef struct StudyDocument {
    const Variant *answer;
    const char *result; // its id
    const char *scene;  // the completed scene as JSON
} StudyDocument;
void document_study(Bytes *bytes, const StudyDocument *document);

#endif
