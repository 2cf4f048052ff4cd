// The JSON documents of a result: plan, summary, work, warnings, energy, scene and the answer of
// its study.
#ifndef SERVER_JOBS_DOCUMENTS_H
#define SERVER_JOBS_DOCUMENTS_H

#include "core/study/study.h"
#include "server/util/bytes.h"

void document_plan(Bytes *bytes, const PlanReport *plan);
void document_summary(Bytes *bytes, const Outcome *outcome); // with the reduction, if requested
void document_work(Bytes *bytes, const WorkCounters *work);
void document_warnings(Bytes *bytes, const Warnings *warnings);
// Two such arrays as one; NULL is an empty one.
void document_join(Bytes *bytes, const char *first, const char *second);
void document_energy(Bytes *bytes, const Energy *energy);
// The scene as it can be submitted again, with its study, without its notes.
void document_scene(Bytes *bytes, const StudyRequest *inquiry);
// A study's answer as it is stored: what is unknown is left out, so that it can be read again.
void document_study(Bytes *bytes, const StudyAnswer *answer);
// The same as it is sent: {"kind": ...}, what is unknown is null.
void document_answer(Bytes *bytes, const Variant *answer);

#endif
