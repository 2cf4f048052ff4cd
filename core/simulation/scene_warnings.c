// Warnings that a result should be read with. Those of the input: values that are allowed but
// implausible (millimetres for metres, percent for a ratio). Single values are checked by a table
// over the names of their fields, which mean the same everywhere; the rest are relations between
// two parts. Those of the result: the error of modes left out, the time to which rounding or the
// solver's steps leave the trajectory valid, and the distance of impacts and masses from those with
// which the buffers were measured. Every impact of a successful run has its speed counted.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/contact/contact.h"
#include "core/result/response.h"
#include "core/simulation/internal.h"

typedef struct TypicalLimit {
    const char *name; // of a REAL row
    double max;       // typical magnitude at most, in the row's unit
    const char *hint;
} TypicalLimit;

static const TypicalLimit typical[] = {
    {"clearance", 1, "the unit is m, not mm"},
    {"offset", 1, "the unit is m, not mm"},
    {"position", 1, "the unit is m, not mm"},
    {"displacement", 1, "the unit is m, not mm"},
    {"velocity", 100, "the unit is m/s"},
    {"contact_time", 1, "the unit is s, not ms"},
    {"interval", 1, "the unit is s, not ms"},
    {"damping_ratio", 1, "it is a ratio, not a percentage"},
    {"rms", 100, "the unit is m/s^2, not cm/s^2"},
};

static const TypicalLimit *warnings_find_limit(const char *name) {
    for (size_t i = 0; i < COUNT(typical); i++)
        if (strcmp(typical[i].name, name) == 0)
            return &typical[i];
    return NULL;
}

// The pointer of one value among several ends with its index.
static Status warnings_of_values(const Field *field, const double *values, size_t count,
                                 const char *pointer, Warnings *warnings) {
    const TypicalLimit *limit = warnings_find_limit(field->name);
    const char *space = field->unit != NULL ? " " : "";
    const char *unit = field->unit != NULL ? field->unit : "";
    for (size_t i = 0; i < count && limit != NULL; i++)
        if (fabs(values[i]) > limit->max)
            TRY(warnings_add(warnings, count > 1 ? json_pointer_at(pointer, i).at : pointer,
                             "is %s%s%s, more than %s%s%s: %s", real_text(values[i]).at, space,
                             unit, real_text(limit->max).at, space, unit, limit->hint));
    return STATUS_OK;
}

static Status warnings_of_rows(const Field *fields, const void *item, const char *pointer,
                               Warnings *warnings) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        char place[sizeof((Fault){0}.pointer)];
        if (field->kind == FIELD_KIND_BASE) {
            TRY(warnings_of_rows(field->fields, member, pointer, warnings));
            continue;
        }
        if ((field->flags & FIELD_HIDDEN) != 0)
            continue;
        json_pointer_join(place, sizeof place, pointer, field->name);
        if (field->kind == FIELD_KIND_REALS) {
            const Reals *reals = member;
            TRY(warnings_of_values(field, reals->at, reals->count, place, warnings));
        } else if (field->kind == FIELD_KIND_REAL) {
            TRY(warnings_of_values(field, member, 1, place, warnings));
        } else if (field->kind == FIELD_KIND_ITEM) {
            TRY(warnings_of_rows(field->fields, member, place, warnings));
        } else if (field->kind == FIELD_KIND_VARIANT) {
            const Variant *variant = *(Variant *const *)member;
            if (variant != NULL)
                TRY(warnings_of_rows(variant->kind->fields, variant, place, warnings));
        } else if (field->kind == FIELD_KIND_LIST) {
            List list;
            memcpy(&list, member, sizeof list);
            for (size_t i = 0; i < list.count; i++) {
                char element[sizeof((Fault){0}.pointer)];
                json_pointer_index(element, sizeof element, place, i);
                TRY(warnings_of_rows(field->fields, (const char *)list.at + i * field->size,
                                     element, warnings));
            }
        }
    }
    return STATUS_OK;
}

static Status warnings_of_times(const Scene *scene, Warnings *warnings) {
    StructureRates rates;
    TRY(structure_rates(scene_structure(scene), SIZE_MAX, &rates));
    if (!(rates.slowest > 0))
        return STATUS_OK;
    const double frequency = rates.slowest / (2 * 3.14159265358979323846);
    if (scene->duration * frequency < 1)
        TRY(warnings_add(warnings, "/duration",
                         "is %s s, less than one period of the structure, %.3g s",
                         real_text(scene->duration).at, 1 / frequency));
    if (scene->sample_rate < 2 * frequency)
        TRY(warnings_add(warnings, "/sample_rate",
                         "is %s Hz, fewer than two samples in a period of the structure, %.3g s",
                         real_text(scene->sample_rate).at, 1 / frequency));
    return STATUS_OK;
}

// A damper is heavier than the storey that carries it.
static Status warnings_of_masses(const Scene *scene, Warnings *warnings) {
    const Structure *structure = scene_structure(scene);
    for (size_t i = 0; i < scene->dampers.count; i++) {
        const Damper *on = &scene->dampers.at[i];
        const double mass = on->mass;
        double moved;
        TRY(structure_kind(structure)->moved_mass(structure, (size_t)on->storey - 1, &moved));
        if (mass <= moved)
            continue;
        const JsonPointer damper = json_pointer_at("/dampers", i);
        const JsonPointer place = json_pointer_of(damper.at, "mass");
        TRY(warnings_add(
            warnings, place.at, "is %s kg, more than the %s's %s kg", real_text(mass).at,
            structure_storeys(structure) > 1 ? "storey" : "structure", real_text(moved).at));
    }
    return STATUS_OK;
}

// Doubts of the excitation's own kind.
static Status warnings_of_excitation(const Scene *scene, Warnings *warnings) {
    const Excitation *excitation = scene_excitation(scene);
    const ExcitationKind *kind = excitation_kind(excitation);
    if (kind->doubt == NULL || warnings == NULL)
        return STATUS_OK;
    const Span span = {.duration = scene->duration, .sample_rate = scene->sample_rate};
    Problem doubts;
    problem_clear(&doubts);
    kind->doubt(excitation, &span, "/excitation", &doubts);
    for (size_t i = 0; i < doubts.count && i < PROBLEM_FAULTS; i++)
        TRY(warnings_add(warnings, doubts.faults[i].pointer, "%s", doubts.faults[i].detail));
    return STATUS_OK;
}

// The default excitation is free vibration from rest: if it was forgotten the result is all zeros.
static Status warnings_of_rest(const Scene *scene, Warnings *warnings) {
    const Excitation *excitation = scene_excitation(scene);
    if (excitation_kind(excitation) != &excitation_free ||
        !reals_are_zero(&excitation->displacement) || !reals_are_zero(&excitation->velocity))
        return STATUS_OK;
    for (size_t i = 0; i < scene->dampers.count; i++)
        if (scene->dampers.at[i].velocity != 0)
            return STATUS_OK;
    return warnings_add(warnings, "/excitation",
                        "is free vibration from rest: nothing moves; give an initial "
                        "displacement or velocity, or a kind that moves the base");
}

Status scene_warnings_of_input(const Simulation *simulation, Warnings *warnings) {
    const Scene *scene = &simulation->scene;
    TRY(warnings_of_rows(simulation_fields, simulation, "", warnings));
    TRY(warnings_of_rest(scene, warnings));
    TRY(warnings_of_times(scene, warnings));
    TRY(warnings_of_excitation(scene, warnings));
    return warnings_of_masses(scene, warnings);
}

// The error is predicted, and dampers can enlarge it.
static Status warnings_of_modes(Outcome *outcome) {
    const double error = outcome->response.truncation_error;
    if (!(error > RESPONSE_DIVERGENCE))
        return STATUS_OK;
    return warnings_add(&outcome->warnings, "/accuracy/modes",
                        "the modes left out change the displacement by up to %.2g of its largest "
                        "value%s: keep more modes for a smaller error",
                        error, error > 0.1 ? "; only statistics are valid" : "");
}

static Status warnings_of_horizon(Outcome *outcome) {
    if (isnan(outcome->summary.trust_horizon) ||
        outcome->response.truncation_error > RESPONSE_DIVERGENCE)
        return STATUS_OK;
    return warnings_add(&outcome->warnings, "/duration",
                        "the run continues beyond t = %.6g s, where rounding has changed the "
                        "displacement by %g of its largest value: from there on only statistics "
                        "are valid",
                        outcome->summary.trust_horizon, RESPONSE_DIVERGENCE);
}

// The error of the solver's steps, not of rounding.
static Status warnings_of_steps(Outcome *outcome) {
    const Summary *summary = &outcome->summary;
    if (isnan(summary->error_estimate))
        return warnings_add(
            &outcome->warnings, "/accuracy",
            "the error of these steps is unknown: the companion run that estimates it "
            "failed");
    const double error = summary->error_estimate - outcome->response.truncation_error;
    if (error <= RESPONSE_DIVERGENCE)
        return STATUS_OK;
    return warnings_add(
        &outcome->warnings, "/accuracy",
        "the error of these steps is about %.2g of the largest displacement%s: take "
        "shorter steps, a smaller tolerance, or the solver exact without one",
        error, error > 0.1 ? "; only statistics are valid" : "");
}

// Sum over stops with the same range.
static ApproachSpeeds approaches_sum(const ApproachSpeeds *met, int count) {
    ApproachSpeeds sum = met[0];
    for (int i = 1; i < count; i++) {
        if (met[i].count == 0)
            continue;
        sum.min = sum.count == 0 ? met[i].min : fmin(sum.min, met[i].min);
        sum.max = sum.count == 0 ? met[i].max : fmax(sum.max, met[i].max);
        sum.count += met[i].count;
        sum.below += met[i].below;
        sum.above += met[i].above;
    }
    return sum;
}

// "0.15 to 1 m/s", "0.15 m/s and more", "1 m/s and less".
static void approaches_write_range(double from, double to, char text[96]) {
    const RealText low = real_text(from), high = real_text(to);
    if (isnan(to))
        snprintf(text, 96, "%s m/s and more", low.at);
    else if (isnan(from))
        snprintf(text, 96, "%s m/s and less", high.at);
    else
        snprintf(text, 96, "%s to %s m/s", low.at, high.at);
}

static bool warnings_is_one_buffer(const Damper *damper) {
    return damper_buffer(damper, SIDE_LEFT) == damper_buffer(damper, SIDE_RIGHT);
}

// Of the impacts at one stop, or at both if they have one buffer.
static Status warnings_of_stop(const Damper *damper, size_t index, Side side,
                               const ApproachSpeeds *met, Warnings *warnings) {
    const Buffer *buffer = damper_buffer(damper, side);
    const char *own = side == SIDE_LEFT ? "left_" : "right_";
    const char *where = side == SIDE_LEFT ? "left stop" : "right stop";
    char pointer[64], range[96];
    if (met->below + met->above == 0)
        return STATUS_OK;
    snprintf(pointer, sizeof pointer, "/dampers/%zu/%sbuffer%s", index,
             buffer == &damper->buffer ? "" : own, buffer->material != NULL ? "" : "/table");
    approaches_write_range(met->from, met->to, range);
    return warnings_add(
        warnings, pointer,
        "%llu of %llu impacts at the %s of damper %zu were outside the speeds of %.80s, %s: all "
        "had %.3g to %.3g m/s; %s",
        (unsigned long long)(met->below + met->above), (unsigned long long)met->count,
        warnings_is_one_buffer(damper) ? "stops" : where, index + 1,
        buffer->material != NULL ? buffer->material : "the table", range, met->min, met->max,
        buffer->table.count > 0 ? "the nearest row is used there"
                                : "its numbers are used there without a measurement");
}

static Status warnings_of_speeds(const Scene *scene, const ApproachSpeeds *met,
                                 Warnings *warnings) {
    for (size_t i = 0; met != NULL && i < scene->dampers.count; i++) {
        const Damper *damper = &scene->dampers.at[i];
        const int stops = warnings_is_one_buffer(damper) ? 2 : 1;
        for (int side = SIDE_LEFT; side <= SIDE_RIGHT; side += stops) {
            const ApproachSpeeds all = approaches_sum(&met[2 * i + (size_t)side], stops);
            TRY(warnings_of_stop(damper, i, (Side)side, &all, warnings));
        }
    }
    return STATUS_OK;
}

// Largest relative difference between the effective masses of test and scene.
static const double pair_part = 0.2;

Status scene_warnings_of_pairs(const Scene *scene, const DerivedList *derived, Warnings *warnings) {
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    for (size_t i = 0; i < derived->count && law->form != CONTACT_IMPULSIVE; i++) {
        const size_t index = (size_t)derived->at[i].damper - 1;
        const Damper *damper = &scene->dampers.at[index];
        const Buffer *buffer = damper_buffer(damper, (Side)derived->at[i].side);
        const double tested = buffer_test_mass(buffer), own = derived->at[i].effective_mass;
        char pointer[64];
        if (damper->identified_for != IDENTIFIED_FOR_SCENE || !buffer_is_measured(buffer) ||
            (derived->at[i].side == SIDE_RIGHT && warnings_is_one_buffer(damper)) ||
            !(fabs(own - tested) > pair_part * tested))
            continue;
        snprintf(pointer, sizeof pointer, "/dampers/%zu/identified_for", index);
        TRY(warnings_add(warnings, pointer,
                         "%.80s was measured with an effective mass of %.3g kg, that of this pair "
                         "is %.3g kg: restitution and contact time belong to a pair of masses; "
                         "\"rig\" carries over the stiffness and damping instead",
                         buffer->material, tested, own));
    }
    return STATUS_OK;
}

Status scene_warnings_of_result(const Scene *scene, const DerivedList *derived, Outcome *outcome) {
    TRY(warnings_of_modes(outcome));
    TRY(outcome->response.is_stepped ? warnings_of_steps(outcome) : warnings_of_horizon(outcome));
    TRY(scene_warnings_of_pairs(scene, derived, &outcome->warnings));
    return warnings_of_speeds(scene, outcome->response.approaches, &outcome->warnings);
}
