// The digest that a canonical scene has beside the name guards that the same scene always means the
// same samples, also when a record of that name was deleted and another one uploaded.
#include "server/jobs/resolve_record.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "core/study/sweep.h"
#include "server/db/records.h"

// Of all records that one sweep names: they are in memory as long as it runs.
enum { PINNED_SAMPLES = 1 << 24 };

static const char axis_pointer[] = "/excitation/name";

// "no record is called ...; there are ...", with the nearest one suggested.
static Status refuse_unknown(Db *db, const char *name, const char *pointer, Problem *problem) {
    enum { LISTED = 1000, SUGGESTED = 10 }; // SUGGESTED: faults that tell what names there are
    Fault fault = {.detail = ""};
    RecordRows known = {NULL, 0};
    char short_name[80], list[160] = "";
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, name);
    text_fit(short_name, sizeof short_name, name);
    if (db_is_private(db)) {
        snprintf(fault.detail, sizeof fault.detail,
                 "\"%s\" is a record of a daemon, and there is none here: put the samples into the "
                 "scene (impactd import FILE), or send it to the daemon (impactd submit)",
                 short_name);
        return problem_add_fault(problem, STATUS_INVALID, &fault);
    }
    const bool is_suggested = problem->count < SUGGESTED;
    if (is_suggested && db_records(db, NULL, "", LISTED, &known, NULL) == STATUS_OK) {
        const char **names = calloc(known.count + 1, sizeof *names);
        for (size_t i = 0; i < known.count; i++) {
            text_list(list, sizeof list, known.at[i].name);
            if (names != NULL)
                names[i] = known.at[i].name;
        }
        const char *nearest = names == NULL ? NULL : spelling_nearest(names, name);
        if (nearest != NULL)
            text_fit(fault.did_you_mean, sizeof fault.did_you_mean, nearest);
        free(names);
    }
    snprintf(fault.detail, sizeof fault.detail, "no record is called \"%s\"%s%s", short_name,
             !is_suggested     ? ""
             : known.count > 0 ? "; there are "
                               : "; there are none: POST one to /v1/records",
             list);
    record_rows_clear(&known);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

// `pointer` is where the name stands, `place` where a digest would.
static Status find(Db *db, const char *name, const char *digest, const char *pointer,
                   const char *place, NamedRecord **named, Problem *problem) {
    *named = NULL;
    if (!record_name_is_sound(name))
        return refuse_unknown(db, name, pointer, problem);
    const Status status = db_record_named(db, name, named, NULL);
    if (status == STATUS_NOT_FOUND)
        return refuse_unknown(db, name, pointer, problem);
    if (status != STATUS_OK)
        return problem_set(problem, status, "the record \"%.64s\" could not be looked up", name);
    if (digest == NULL || strcmp(digest, (*named)->digest) == 0)
        return STATUS_OK;
    Fault fault = {.detail = ""};
    text_fit(fault.pointer, sizeof fault.pointer, place);
    text_quote(fault.value, sizeof fault.value, digest);
    snprintf(fault.detail, sizeof fault.detail,
             "is not that of the record \"%s\", which is %.16s...: the one that the scene was made "
             "with has been deleted; without a digest this one is taken",
             (*named)->name, (*named)->digest);
    refcount_unref(&(*named)->shared);
    *named = NULL;
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

static ExcitationRecord *record_of(const Simulation *simulation) {
    Excitation *excitation = (Excitation *)(void *)simulation->scene.excitation;
    if (excitation == NULL || excitation_kind(excitation) != &excitation_record)
        return NULL;
    ExcitationRecord *record = (ExcitationRecord *)(void *)excitation;
    return record->name != NULL ? record : NULL;
}

Status resolve_record_motion(Db *db, Simulation *simulation, Problem *problem) {
    ExcitationRecord *record = record_of(simulation);
    NamedRecord *named;
    if (record == NULL || record->named != NULL)
        return STATUS_OK;
    TRY(find(db, record->name, record->digest, axis_pointer, "/excitation/digest", &named,
             problem));
    const bool is_resolved = record_resolve(record, named);
    refcount_unref(&named->shared);
    return is_resolved ? STATUS_OK
                       : problem_set(problem, STATUS_NO_MEMORY, "no memory for a scene");
}

static const PinnedRecord *pinned_find(const PinnedRecords *records, const char *name) {
    for (size_t i = 0; i < records->count; i++)
        if (records->at[i].name != NULL && strcmp(records->at[i].name, name) == 0)
            return &records->at[i];
    return NULL;
}

// Takes the hold.
static Status pin(PinnedRecords *records, NamedRecord *named) {
    PinnedRecord *at = realloc(records->at, (records->count + 1) * sizeof *at);
    if (at != NULL) {
        records->at = at;
        PinnedRecord *pinned = &at[records->count];
        *pinned = (PinnedRecord){strdup(named->name), strdup(named->digest), &named->shared};
        if (pinned->name != NULL && pinned->digest != NULL) {
            records->count++;
            return STATUS_OK;
        }
        free(pinned->name);
        free(pinned->digest);
    }
    refcount_unref(&named->shared);
    return STATUS_NO_MEMORY;
}

// To what a sweep holds.
static Status add_samples(const Refcount *named, size_t *samples, const char *place,
                          Problem *problem) {
    *samples += ((const NamedRecord *)(const void *)named)->samples.count;
    if (*samples <= PINNED_SAMPLES)
        return STATUS_OK;
    (void)problem_add(problem, STATUS_INVALID, place,
                      "names one more record than a sweep can hold: all of its records may have "
                      "%d samples, with this one they have %zu; sweep over fewer at a time",
                      PINNED_SAMPLES, *samples);
    return STATUS_LIMIT;
}

// What was found before stays; it only needs to be there still.
static Status hold(Db *db, const char *name, const char *digest, const char *pointer,
                   const char *place, Refcount **named, Problem *problem) {
    NamedRecord *found;
    TRY(find(db, name, digest, pointer, place, &found, problem));
    if (*named == NULL)
        *named = &found->shared;
    else
        refcount_unref(&found->shared);
    return STATUS_OK;
}

// One that came with the sweep.
static Status resolve_pinned(Db *db, PinnedRecord *pinned, size_t index, Problem *problem) {
    char name[64], digest[64];
    snprintf(name, sizeof name, "/study/records/%zu/name", index);
    snprintf(digest, sizeof digest, "/study/records/%zu/digest", index);
    if (pinned->name == NULL)
        return STATUS_OK; // told by the rows
    TRY(hold(db, pinned->name, pinned->digest, name, digest, &pinned->named, problem));
    const NamedRecord *named = (const NamedRecord *)(const void *)pinned->named;
    if (pinned->digest == NULL && (pinned->digest = strdup(named->digest)) == NULL)
        return STATUS_NO_MEMORY;
    return STATUS_OK;
}

// One value of an axis. What is no text is for the axis to refuse.
static Status resolve_value(Db *db, const char *value, PinnedRecords *records, size_t *samples,
                            const char *place, Problem *problem) {
    JsonScalar scalar;
    NamedRecord *named;
    char *room = malloc(strlen(value) + 1);
    if (room == NULL)
        return STATUS_NO_MEMORY;
    Status status = STATUS_OK;
    if (json_scalar_read(value, &scalar, room) && scalar.kind == JSON_SCALAR_TEXT &&
        pinned_find(records, scalar.text) == NULL) {
        status = find(db, scalar.text, NULL, place, place, &named, problem);
        if (status == STATUS_OK)
            status = pin(records, named);
        if (status == STATUS_OK)
            status = add_samples(&named->shared, samples, place, problem);
    }
    free(room);
    return status;
}

static SweepStudy *sweep_of(const StudyRequest *inquiry) {
    return inquiry->study != NULL && study_kind(inquiry->study) == &study_sweep
               ? (SweepStudy *)(void *)inquiry->study
               : NULL;
}

Status resolve_sweep_records(Db *db, StudyRequest *inquiry, Problem *problem) {
    SweepStudy *study = sweep_of(inquiry);
    Status status = STATUS_OK;
    size_t samples = 0;
    for (size_t i = 0; study != NULL && i < study->records.count; i++) {
        PinnedRecord *pinned = &study->records.at[i];
        char place[64];
        snprintf(place, sizeof place, "/study/records/%zu", i);
        if (problem->count >= PROBLEM_FAULTS) // no more can be told
            return STATUS_INVALID;
        Status one = resolve_pinned(db, pinned, i, problem);
        if (one == STATUS_OK && pinned->named != NULL)
            one = add_samples(pinned->named, &samples, place, problem);
        if (one != STATUS_OK && one != STATUS_INVALID)
            return one;
        status = status == STATUS_OK ? one : status;
    }
    for (size_t i = 0; study != NULL && i < study->axes.count; i++) {
        const SweepAxis *axis = &study->axes.at[i];
        const bool takes_records =
            axis->pointer != NULL && strcmp(axis->pointer, axis_pointer) == 0;
        for (size_t k = 0; takes_records && k < axis->values.count; k++) {
            char place[96];
            snprintf(place, sizeof place, "/study/axes/%zu/values/%zu", i, k);
            if (problem->count >= PROBLEM_FAULTS)
                return STATUS_INVALID;
            const Status one =
                resolve_value(db, axis->values.at[k], &study->records, &samples, place, problem);
            if (one != STATUS_OK && one != STATUS_INVALID)
                return one;
            status = status == STATUS_OK ? one : status;
        }
    }
    return status;
}

void resolve_records_drop(StudyRequest *inquiry) {
    ExcitationRecord *record = record_of(&inquiry->simulation);
    SweepStudy *study = sweep_of(inquiry);
    if (record != NULL) {
        refcount_unref(record->named);
        record->named = NULL;
    }
    for (size_t i = 0; study != NULL && i < study->records.count; i++) {
        refcount_unref(study->records.at[i].named);
        study->records.at[i].named = NULL;
    }
}

Status resolve_records_again(Db *db, StudyRequest *inquiry, Problem *problem) {
    ExcitationRecord *record = record_of(&inquiry->simulation);
    SweepStudy *study = sweep_of(inquiry);
    if (record != NULL)
        TRY(hold(db, record->name, record->digest, axis_pointer, "/excitation/digest",
                 &record->named, problem));
    for (size_t i = 0; study != NULL && i < study->records.count; i++)
        TRY(resolve_pinned(db, &study->records.at[i], i, problem));
    return STATUS_OK;
}

static void put_use(Bytes *uses, const char *name) {
    char use[RECORD_NAME_SIZE + 8];
    record_use_name(name, use);
    bytes_text(uses, use);
    bytes_text(uses, "\n");
}

void resolve_record_uses(const StudyRequest *inquiry, Bytes *uses) {
    const ExcitationRecord *record = record_of(&inquiry->simulation);
    const SweepStudy *study = sweep_of(inquiry);
    if (record != NULL)
        put_use(uses, record->name);
    for (size_t i = 0; study != NULL && i < study->records.count; i++)
        put_use(uses, study->records.at[i].name);
}
