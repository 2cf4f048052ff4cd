// The JSON documents of a result: what API.md calls plan, summary, work, warnings, energy,
// impacts.json and psd.json. Not the series: those are the encoders'. Used by worker.c and by
// `impactd run`.
#ifndef SERVER_JOBS_DOCUMENTS_H
#define SERVER_JOBS_DOCUMENTS_H

#include "core/base/progress.h"
#include "core/study/study.h"
#include "server/util/bytes.h"

void document_plan(Bytes *bytes, const PlanReport *plan);
void document_summary(Bytes *bytes, const Outcome *outcome); // with what was asked for besides
void document_work(Bytes *bytes, const WorkCounters *work);
void document_warnings(Bytes *bytes, const Warnings *warnings);
// Two such arrays as one; NULL is an empty one.
void document_join(Bytes *bytes, const char *first, const char *second);
void document_energy(Bytes *bytes, const Energy *energy);
// These two may be long: where the watch says so they are left unfinished, and it is false.
// Where the scene asked for none: null.
bool document_impacts(Bytes *bytes, const Response *response, const Progress *watch);
// Without any density: null.
bool document_psd(Bytes *bytes, const Spectrum *spectrum, const Progress *watch);
// The scene as it can be submitted again, with its study, without its notes.
void document_scene(Bytes *bytes, const StudyRequest *inquiry);
// A study's answer, as it is kept: what is unknown is left out, so that it can be read again.
void document_study(Bytes *bytes, const StudyAnswer *answer);
// The same as people get it: {"kind": ..., what is unknown null}.
void document_answer(Bytes *bytes, const Variant *answer);

#endif
