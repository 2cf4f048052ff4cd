// The list of studies, and of what they answer.
#include "core/study/study.h"

const StudyKind *const studies[] = {
    &study_tradeoff, &study_ensemble, &study_compare, &study_sensitivity, &study_sweep, NULL,
};

static const Kind *study_at(size_t index) {
    return index + 1 < COUNT(studies) ? &studies[index]->kind : NULL;
}

static const Kind *answer_at(size_t index) {
    return index + 1 < COUNT(studies) ? studies[index]->answer : NULL;
}

const KindTable study_kinds = {"kind", study_at, true};
const KindTable study_answer_kinds = {"kind", answer_at, false};

const Field study_answer_fields[] = {
    FIELD_VARIANT(StudyAnswer, study, &study_answer_kinds, PRESENCE_REQUIRED, "what it came to"),
    FIELD_END,
};

Status study_run(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                 Variant **answer, Problem *problem) {
    const StudyKind *kind = study_kind(study);
    *answer = variant_new(kind->answer);
    if (*answer == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
    const Status status =
        kind->run((const Study *)(const void *)study, simulation, tools, *answer, problem);
    if (status != STATUS_OK) {
        variant_free(*answer);
        *answer = NULL;
    }
    return status;
}
