// The scene of given values is a copy of the study's with these values set, one axis after the
// other, completed like any other scene.
#include "core/study/axis.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const study_spacing_names[] = {"linear", "logarithmic", NULL};

// clang-format off
#define AXIS_POINTERS                                                                              \
    FIELD_TEXT(StudyAxis, pointer, 200, PRESENCE_OPTIONAL, 0, "JSON Pointer to the member that varies, such as /dampers/0/clearance; values of a buffer are names of materials, of /excitation/name names of records, of a kind's name (/contact/model) kinds"), \
    FIELD_TEXTS(StudyAxis, pointers, NULL, NULL, STUDY_AXIS_POINTERS, PRESENCE_OPTIONAL, 0, "in place of pointer: several members that all get the same value")
#define AXIS_VALUES FIELD_TEXTS(StudyAxis, values, NULL, NULL, STUDY_AXIS_VALUES, PRESENCE_OPTIONAL, FIELD_SCALARS, "its values in this order; or give a range")
#define AXIS_RANGE                                                                                 \
    FIELD_REAL(StudyAxis, from, NULL, ANY, OPTIONAL, "first value of a range"),                    \
    FIELD_REAL(StudyAxis, to, NULL, ANY, OPTIONAL, "last number of a range")
#define AXIS_NO_GRID                                                                               \
    {.name = "count", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(StudyAxis, count, uint64_t), .presence = PRESENCE_OPTIONAL, .flags = FIELD_HIDDEN}, \
    {.name = "spacing", .kind = FIELD_KIND_CHOICE, .offset = FIELD_AT(StudyAxis, spacing, int), .choices = study_spacing_names, .presence = PRESENCE_OPTIONAL, .flags = FIELD_HIDDEN}

const Field study_axis_fields[] = {
    AXIS_POINTERS,
    AXIS_VALUES,
    AXIS_RANGE,
    FIELD_COUNT(StudyAxis, count, NULL, WITHIN(2, STUDY_AXIS_VALUES), OPTIONAL, "number of values, both ends included"),
    FIELD_CHOICE(StudyAxis, spacing, study_spacing_names, OPTIONAL, "spacing of a range: equal differences or equal ratios; linear if absent"),
    FIELD_END
};

const Field study_variable_fields[] = {AXIS_POINTERS, AXIS_VALUES, AXIS_RANGE, AXIS_NO_GRID, FIELD_END};

const Field study_range_fields[] = {
    AXIS_POINTERS,
    AXIS_RANGE,
    AXIS_NO_GRID,
    {.name = "values", .kind = FIELD_KIND_TEXTS, .offset = FIELD_AT(StudyAxis, values, Texts), .size = sizeof(char *), .presence = PRESENCE_OPTIONAL, .flags = FIELD_HIDDEN},
    FIELD_END
};

const Field pinned_record_fields[] = {
    FIELD_TEXT(PinnedRecord, name, RECORD_NAME_SIZE - 1, PRESENCE_REQUIRED, 0, "of an uploaded record"),
    FIELD_TEXT(PinnedRecord, digest, RECORD_DIGEST_SIZE - 1, PRESENCE_OPTIONAL, 0, "SHA-256 of its interval and samples"),
    FIELD_REFCOUNT(PinnedRecord, named),
    FIELD_END
};

const Field study_names_fields[] = {
    FIELD_LIST(StudyNames, materials, buffer_fields, 0, PRESENCE_OPTIONAL, "numbers of the materials that the scene and the axes name, at submission; filled in if absent"),
    FIELD_LIST(StudyNames, records, pinned_record_fields, 0, PRESENCE_OPTIONAL, "ground motions that the axes name, at submission; filled in if absent"),
    FIELD_END
};

const Field study_member_fields[] = {
    FIELD_TEXT(StudyMember, pointer, 0, PRESENCE_OPTIONAL, 0, "JSON Pointer to the member, the first one of tied members"),
    FIELD_TEXTS(StudyMember, pointers, NULL, NULL, 0, PRESENCE_OPTIONAL, 0, "all tied members, if there are several"),
    FIELD_END
};
// clang-format on

size_t study_axis_pointer_count(const StudyAxis *axis) {
    return axis->pointer != NULL ? 1 : axis->pointers.count;
}

const char *study_axis_pointer(const StudyAxis *axis, size_t index) {
    return axis->pointer != NULL ? axis->pointer : axis->pointers.at[index];
}

Status study_axis_member(const StudyAxis *axis, StudyMember *member) {
    for (size_t i = 0; i < axis->pointers.count && axis->pointers.count > 1; i++)
        TRY(texts_append(&member->pointers, axis->pointers.at[i]));
    return text_copy(study_axis_pointer(axis, 0), &member->pointer);
}

bool study_axis_is_range(const StudyAxis *axis) {
    return axis->values.count == 0;
}

size_t study_axis_length(const StudyAxis *axis) {
    return study_axis_is_range(axis) ? (size_t)axis->count : axis->values.count;
}

// Equal differences are not scaled: whole numbers stay whole.
static double study_axis_number(const StudyAxis *axis, size_t index) {
    const double last = (double)(axis->count - 1);
    if (index == 0)
        return axis->from;
    if (index + 1 == axis->count)
        return axis->to;
    return axis->spacing == STUDY_LOGARITHMIC
               ? axis->from * pow(axis->to / axis->from, (double)index / last)
               : axis->from + (axis->to - axis->from) / last * (double)index;
}

StudyValue study_axis_value(const StudyAxis *axis, size_t index) {
    return study_axis_is_range(axis) ? (StudyValue){NULL, study_axis_number(axis, index)}
                                     : (StudyValue){axis->values.at[index], (double)NAN};
}

Status study_axis_check(const StudyAxis *axis, bool is_grid, const char *place, Problem *problem) {
    const bool has_range = !isnan(axis->from) || !isnan(axis->to) || axis->count != COUNT_ABSENT;
    const char *range = is_grid ? "from, to and count" : "from and to";
    if ((axis->pointer != NULL) == (axis->pointers.count > 0))
        return problem_add(problem, STATUS_INVALID, place,
                           axis->pointer != NULL
                               ? "has a pointer and pointers: leave one of them out"
                               : "needs a pointer, or pointers of tied members");
    if (axis->values.count > 0 && (has_range || axis->spacing != CHOICE_ABSENT))
        return problem_add(problem, STATUS_INVALID, place,
                           "has values and a range: leave out values, or %s%s", range,
                           axis->spacing != CHOICE_ABSENT ? " and spacing" : "");
    if (axis->values.count > 0)
        return STATUS_OK;
    if (isnan(axis->from) || isnan(axis->to) || (is_grid && axis->count == COUNT_ABSENT))
        return problem_add(problem, STATUS_INVALID, place, "needs values, or a range of %s", range);
    if (!isfinite(axis->to - axis->from))
        return problem_add(problem, STATUS_INVALID, place,
                           "is wider than a number can hold: from %s to %s",
                           real_text(axis->from).at, real_text(axis->to).at);
    if (!is_grid && !(axis->from < axis->to))
        return problem_add(problem, STATUS_INVALID, place, "from must be below to, is %s, to is %s",
                           real_text(axis->from).at, real_text(axis->to).at);
    if (axis->spacing == STUDY_LOGARITHMIC && !(axis->from * axis->to > 0))
        return problem_add(problem, STATUS_INVALID, place,
                           "logarithmic spacing needs from and to of one sign, neither 0");
    return STATUS_OK;
}

JsonPointer study_axis_place(const StudyAxis *axis, const char *place, size_t index) {
    return axis->pointer != NULL ? json_pointer_of(place, "pointer")
                                 : json_pointer_at(json_pointer_of(place, "pointers").at, index);
}

// Refuses pointer `index` of axis `number` if an earlier one is the same or, unless it is a grid,
// designates the same member.
static Status study_axes_check_pointer(const StudyAxes *axes, bool is_grid, size_t number,
                                       size_t index, const char *place, Problem *problem) {
    const char *pointer = study_axis_pointer(&axes->at[number], index);
    for (size_t i = 0; i <= number; i++) {
        const size_t count = i < number ? study_axis_pointer_count(&axes->at[i]) : index;
        for (size_t k = 0; k < count; k++) {
            const char *other = study_axis_pointer(&axes->at[i], k);
            if (is_grid ? strcmp(other, pointer) == 0 : json_pointer_overlaps(other, pointer))
                return problem_add(problem, STATUS_INVALID,
                                   study_axis_place(&axes->at[number], place, index).at,
                                   "is also set by entry %zu: give one entry each", i);
        }
    }
    return STATUS_OK;
}

Status study_axis_check_physics(const StudyAxis *axis, const char *place, Problem *problem) {
    static const char *const allowed[] = {"/structure", "/dampers", "/contact", "/excitation"};
    Status status = STATUS_OK;
    for (size_t i = 0; i < study_axis_pointer_count(axis); i++) {
        bool is_allowed = false;
        for (size_t k = 0; k < COUNT(allowed); k++)
            is_allowed =
                is_allowed || json_pointer_overlaps(allowed[k], study_axis_pointer(axis, i));
        if (!is_allowed)
            status = problem_add(problem, STATUS_INVALID, study_axis_place(axis, place, i).at,
                                 "must be a member of the structure, the dampers, the contact or "
                                 "the excitation, is %.100s",
                                 study_axis_pointer(axis, i));
    }
    return status;
}

Status study_axes_check(const StudyAxes *axes, bool is_grid, const char *place, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < axes->count; i++) {
        const JsonPointer own = json_pointer_at(place, i);
        if (study_axis_check(&axes->at[i], is_grid, own.at, problem) != STATUS_OK ||
            (!is_grid && study_axis_check_physics(&axes->at[i], own.at, problem) != STATUS_OK))
            status = STATUS_INVALID;
        for (size_t k = 0; k < study_axis_pointer_count(&axes->at[i]); k++)
            if (study_axes_check_pointer(axes, is_grid, i, k, own.at, problem) != STATUS_OK)
                status = STATUS_INVALID;
    }
    return status;
}

// A pointer to one side's buffer splits the buffer that both sides share.
static Status study_scene_split_buffer(const char *pointer, Simulation *target) {
    static const char before[] = "/dampers/";
    if (strncmp(pointer, before, sizeof before - 1) != 0)
        return STATUS_OK;
    char *end;
    const size_t number = strtoul(pointer + sizeof before - 1, &end, 10);
    const bool is_left = strncmp(end, "/left_buffer", 12) == 0;
    if ((!is_left && strncmp(end, "/right_buffer", 13) != 0) ||
        number >= target->scene.dampers.count)
        return STATUS_OK;
    Damper *damper = &target->scene.dampers.at[number];
    if (!buffer_is_given(&damper->buffer))
        return STATUS_OK;
    fields_clear(buffer_fields, &damper->left_buffer);
    fields_clear(buffer_fields, &damper->right_buffer);
    TRY(fields_copy(buffer_fields, &damper->buffer, &damper->left_buffer));
    buffer_move(&damper->right_buffer, &damper->buffer);
    return STATUS_OK;
}

// Fills the numbers of a material: those that an axis set have removed its name, but a completed
// scene has dropped numbers that its contact model does not use, and a point's model may use them.
static Status study_scene_fill_material(const Buffer *pinned, Buffer *buffer) {
    if (isnan(buffer->restitution))
        buffer->restitution = pinned->restitution;
    if (isnan(buffer->contact_time))
        buffer->contact_time = pinned->contact_time;
    buffer->test = pinned->test;
    if (pinned->table.count == 0)
        return STATUS_OK;
    ContactRow *rows = calloc(pinned->table.count, sizeof *rows);
    TRY(status_made(rows != NULL));
    memcpy(rows, pinned->table.at, pinned->table.count * sizeof *rows);
    free(buffer->table.at);
    buffer->table = (ContactRows){rows, pinned->table.count};
    return STATUS_OK;
}

// Resolves materials to the numbers that the study holds.
static Status study_scene_fill_materials(const Buffers *materials, Simulation *target) {
    for (size_t i = 0; i < 3 * target->scene.dampers.count; i++) {
        Damper *damper = &target->scene.dampers.at[i / 3];
        Buffer *const sides[] = {&damper->buffer, &damper->left_buffer, &damper->right_buffer};
        Buffer *buffer = sides[i % 3];
        for (size_t k = 0; buffer->material != NULL && k < materials->count; k++)
            if (text_same(materials->at[k].material, buffer->material))
                TRY(study_scene_fill_material(&materials->at[k], buffer));
    }
    return STATUS_OK;
}

// Likewise a named ground motion.
static Status study_scene_fill_record(const PinnedRecords *records, Simulation *target) {
    ExcitationRecord *record = (ExcitationRecord *)(void *)target->scene.excitation;
    if (excitation_kind(&record->excitation) != &excitation_record || record->name == NULL)
        return STATUS_OK;
    for (size_t i = 0; i < records->count; i++) {
        const PinnedRecord *pinned = &records->at[i];
        if (pinned->named != NULL && strcmp(pinned->name, record->name) == 0)
            return status_made(record_resolve(record, (NamedRecord *)(void *)pinned->named));
    }
    return STATUS_OK;
}

// Sets one member. NAN leaves it.
static Status study_scene_set(const char *pointer, const StudyValue *value, Simulation *target,
                              char why[JSON_POINTER_MESSAGE_MAX]) {
    if (value->json == NULL) {
        const JsonScalar number = json_scalar_number(value->number);
        return isnan(value->number)
                   ? STATUS_OK
                   : json_pointer_set(simulation_fields, target, pointer, &number, why);
    }
    char *text = malloc(strlen(value->json) + 1);
    JsonScalar scalar;
    TRY(status_made(text != NULL));
    const Status status = json_scalar_read(value->json, &scalar, text)
                              ? json_pointer_set(simulation_fields, target, pointer, &scalar, why)
                              : STATUS_INTERNAL;
    free(text);
    return status;
}

const Field *study_axis_find(const StudyAxis *axis, Simulation *scene, bool *is_tag,
                             const char *place, Problem *problem) {
    const Field *found = NULL;
    bool is_sound = true;
    for (size_t i = 0; i < study_axis_pointer_count(axis); i++) {
        const char *pointer = study_axis_pointer(axis, i);
        char why[JSON_POINTER_MESSAGE_MAX] = "no memory for a scene";
        bool is_name;
        const Field *field =
            study_scene_split_buffer(pointer, scene) == STATUS_OK
                ? json_pointer_find(simulation_fields, scene, pointer, &is_name, why)
                : NULL;
        if (field == NULL) {
            Fault fault = {0};
            text_fit(fault.pointer, sizeof fault.pointer, study_axis_place(axis, place, i).at);
            text_fit(fault.detail, sizeof fault.detail, why);
            text_quote(fault.value, sizeof fault.value, pointer);
            (void)problem_add_fault(problem, STATUS_INVALID, &fault);
            is_sound = false;
            continue;
        }
        if (found == NULL) {
            found = field;
            *is_tag = is_name;
        }
        // Impossible values are reported point by point; a possible one is enough here.
        Status set = STATUS_INVALID;
        const bool is_grid = study_axis_length(axis) != COUNT_ABSENT;
        for (size_t k = 0; k < (is_grid ? study_axis_length(axis) : 1) && set == STATUS_INVALID;
             k++) {
            const StudyValue value =
                is_grid ? study_axis_value(axis, k) : (StudyValue){NULL, axis->from};
            set = study_scene_set(pointer, &value, scene, why);
        }
    }
    return is_sound ? found : NULL;
}

bool study_field_is_real(const Field *field, bool is_tag) {
    return !is_tag && (field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_REALS ||
                       field->kind == FIELD_KIND_ROWS);
}

Status study_axes_find(const StudyAxes *axes, const Simulation *simulation, const char *place,
                       const Field **rows, bool *are_tags, Problem *problem) {
    Simulation scene;
    Status status = fields_copy(simulation_fields, simulation, &scene);
    for (size_t i = 0; i < axes->count && status != STATUS_NO_MEMORY; i++) {
        bool is_tag;
        const Field *row =
            study_axis_find(&axes->at[i], &scene, &is_tag, json_pointer_at(place, i).at, problem);
        if (row == NULL)
            status = STATUS_INVALID;
        if (rows != NULL) {
            rows[i] = row;
            are_tags[i] = row != NULL && is_tag;
        }
    }
    simulation_clear(&scene);
    return status;
}

// `*place` is the pointer of a value that cannot be set.
static Status study_scene_apply(const Simulation *base, const StudyAxes *axes,
                                const StudyValue *values, const StudyNames *names,
                                Simulation *target, const char **place,
                                char why[JSON_POINTER_MESSAGE_MAX]) {
    TRY(fields_copy(simulation_fields, base, target));
    target->output.reduction = false; // unless an axis requests it
    for (size_t i = 0; i < axes->count; i++)
        for (size_t k = 0; k < study_axis_pointer_count(&axes->at[i]); k++) {
            *place = study_axis_pointer(&axes->at[i], k);
            if (values[i].json == NULL && isnan(values[i].number))
                continue;
            TRY(study_scene_split_buffer(*place, target));
            TRY(study_scene_set(*place, &values[i], target, why));
        }
    if (names != NULL)
        TRY(study_scene_fill_materials(&names->materials, target));
    for (size_t i = 0; i < target->scene.dampers.count; i++)
        damper_reset_rig(&base->scene.dampers.at[i], &target->scene.dampers.at[i]);
    return names != NULL ? study_scene_fill_record(&names->records, target) : STATUS_OK;
}

Status study_scene_make(const Simulation *base, const StudyAxes *axes, const StudyValue *values,
                        const StudyNames *names, bool is_bare, const SimulationLimits *limits,
                        Simulation *target, Problem *problem) {
    const char *place = "";
    char why[JSON_POINTER_MESSAGE_MAX] = "";
    const Status status = study_scene_apply(base, axes, values, names, target, &place, why);
    if (status == STATUS_INVALID)
        return problem_add(problem, status, place, "%s", why);
    if (status != STATUS_OK)
        return study_result(STATUS_NO_MEMORY, problem);
    if (is_bare) {
        texts_clear(&target->output.channels);
        texts_clear(&target->output.psd.channels);
        target->output.impacts = false;
    }
    return simulation_complete(target, limits, NULL, problem);
}

Status study_axes_check_value(const StudyAxes *axes, size_t number, size_t index,
                              const Simulation *simulation, const StudyNames *names,
                              const SimulationLimits *limits, const char *place, Problem *scratch,
                              Problem *problem) {
    const StudyAxis *axis = &axes->at[number];
    const JsonPointer own = json_pointer_at(place, number);
    const bool is_range = study_axis_is_range(axis);
    const JsonPointer at = is_range ? json_pointer_of(own.at, index == 0 ? "from" : "to")
                                    : json_pointer_at(json_pointer_of(own.at, "values").at, index);
    StudyValue values[STUDY_AXES];
    Simulation scene;
    for (size_t i = 0; i < axes->count; i++)
        values[i] = (StudyValue){NULL, (double)NAN};
    values[number] = is_range ? (StudyValue){NULL, index == 0 ? axis->from : axis->to}
                              : study_axis_value(axis, index);
    problem_clear(scratch);
    const Status status =
        study_scene_make(simulation, axes, values, names, true, limits, &scene, scratch);
    simulation_clear(&scene);
    return status == STATUS_INVALID
               ? problem_add(problem, status, at.at, "gives a scene that is not valid: %s: %s",
                             scratch->faults[0].pointer, scratch->faults[0].detail)
               : status;
}

Status study_scene_use_record(Simulation *scene, const PinnedRecord *pinned) {
    Variant **excitation = &scene->scene.excitation;
    if (*excitation == NULL || (*excitation)->kind != &excitation_record.kind) {
        variant_free(*excitation);
        *excitation = variant_new(&excitation_record.kind);
        TRY(status_made(*excitation != NULL));
    }
    ExcitationRecord *record = (ExcitationRecord *)(void *)*excitation;
    free(record->name);
    free(record->source);
    free(record->samples.at);
    record->source = NULL;
    record->samples = (Reals){NULL, 0};
    record->interval = (double)NAN;
    TRY(status_made((record->name = strdup(pinned->name)) != NULL));
    return status_made(record_resolve(record, (NamedRecord *)(void *)pinned->named));
}

Status study_suite_prepare(const PinnedRecords *suite, Simulation *simulation, Problem *problem) {
    const Excitation *excitation = scene_excitation(&simulation->scene);
    if (excitation != NULL && excitation_kind(excitation) == &excitation_record)
        return STATUS_OK;
    if (excitation != NULL &&
        (excitation_kind(excitation) != &excitation_free ||
         !reals_are_zero(&excitation->displacement) || !reals_are_zero(&excitation->velocity)))
        return problem_add(
            problem, STATUS_INVALID, "/excitation",
            "would be replaced by the records of the study, is of the kind %s: leave "
            "it out, or give the start with the kind record",
            excitation_kind(excitation)->kind.name);
    return suite->count > 0 && suite->at[0].named != NULL
               ? study_result(study_scene_use_record(simulation, &suite->at[0]), problem)
               : STATUS_OK;
}

Status study_suite_check(const PinnedRecords *suite, const char *place, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 1; i < suite->count; i++) {
        size_t first = 0;
        while (first < i && !text_same(suite->at[first].name, suite->at[i].name))
            first++;
        if (first < i)
            status = problem_add(problem, STATUS_INVALID, json_pointer_at(place, i).at,
                                 "is listed twice, first at %s/%zu", place, first);
    }
    return status;
}
