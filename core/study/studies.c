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
