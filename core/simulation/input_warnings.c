// Single values go by a table over the names of their rows, which mean the same wherever they
// stand; the rest are relations between two parts.
#include "core/simulation/input_warnings.h"

#include <string.h>

typedef struct Usual {
    const char *name; // of a REAL row
    double most;      // usual magnitude at most, in the row's unit
    const char *hint;
} Usual;

static const Usual usual[] = {
    {"clearance", 1, "metres are meant, not millimetres"},
    {"offset", 1, "metres are meant, not millimetres"},
    {"position", 1, "metres are meant, not millimetres"},
    {"displacement", 1, "metres are meant, not millimetres"},
    {"velocity", 100, "metres per second are meant"},
    {"contact_time", 1, "seconds are meant, not milliseconds"},
    {"interval", 1, "seconds are meant, not milliseconds"},
    {"damping_ratio", 1, "a ratio is meant, not percent"},
    {"rms", 100, "m/s^2 are meant, not cm/s^2"},
};

static const Usual *usual_find(const char *name) {
    for (size_t i = 0; i < COUNT(usual); i++)
        if (strcmp(usual[i].name, name) == 0)
            return &usual[i];
    return NULL;
}

static Status warn_real(const Field *field, double value, const char *pointer, Warnings *warnings) {
    const Usual *limit = usual_find(field->name);
    if (limit == NULL || !(fabs(value) > limit->most))
        return STATUS_OK;
    char is[32], most[32];
    const char *space = field->unit != NULL ? " " : "";
    const char *unit = field->unit != NULL ? field->unit : "";
    return warnings_add(warnings, pointer, "is %s%s%s, more than %s%s%s: %s", text_real(is, value),
                        space, unit, text_real(most, limit->most), space, unit, limit->hint);
}

static Status warn_reals(const Field *field, const Reals *reals, const char *pointer,
                         Warnings *warnings) {
    if (reals->count == 1)
        return warn_real(field, reals->at[0], pointer, warnings);
    for (size_t i = 0; i < reals->count && usual_find(field->name) != NULL; i++) {
        char place[sizeof((Fault){0}.pointer)];
        pointer_index(place, sizeof place, pointer, i);
        TRY(warn_real(field, reals->at[i], place, warnings));
    }
    return STATUS_OK;
}

static Status warn_rows(const Field *fields, const void *item, const char *pointer,
                        Warnings *warnings) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        char place[sizeof((Fault){0}.pointer)];
        if (field->kind == FIELD_KIND_BASE) {
            TRY(warn_rows(field->fields, member, pointer, warnings));
            continue;
        }
        if ((field->flags & FIELD_HIDDEN) != 0)
            continue;
        pointer_join(place, sizeof place, pointer, field->name);
        if (field->kind == FIELD_KIND_REALS) {
            TRY(warn_reals(field, member, place, warnings));
        } else if (field->kind == FIELD_KIND_REAL) {
            TRY(warn_real(field, *(const double *)member, place, warnings));
        } else if (field->kind == FIELD_KIND_ITEM) {
            TRY(warn_rows(field->fields, member, place, warnings));
        } else if (field->kind == FIELD_KIND_VARIANT) {
            const Variant *variant = *(Variant *const *)member;
            if (variant != NULL)
                TRY(warn_rows(variant->kind->fields, variant, place, warnings));
        } else if (field->kind == FIELD_KIND_LIST) {
            List list;
            memcpy(&list, member, sizeof list);
            for (size_t i = 0; i < list.count; i++) {
                char element[sizeof((Fault){0}.pointer)];
                pointer_index(element, sizeof element, place, i);
                TRY(warn_rows(field->fields, (const char *)list.at + i * field->size, element,
                              warnings));
            }
        }
    }
    return STATUS_OK;
}

static Status warn_times(const Scene *scene, Warnings *warnings) {
    StructureRates rates;
    TRY(structure_rates(scene_structure(scene), &rates));
    if (!(rates.slowest > 0))
        return STATUS_OK;
    const double frequency = rates.slowest / (2 * 3.14159265358979323846);
    char is[32];
    if (scene->duration * frequency < 1)
        TRY(warnings_add(warnings, "/duration",
                         "is %s s, less than one period of the structure, %.3g s",
                         text_real(is, scene->duration), 1 / frequency));
    if (scene->sample_rate < 2 * frequency)
        TRY(warnings_add(warnings, "/sample_rate",
                         "is %s Hz, fewer than two samples in a period of the structure, %.3g s",
                         text_real(is, scene->sample_rate), 1 / frequency));
    return STATUS_OK;
}

// A damper outweighs what it stands on.
static Status warn_masses(const Scene *scene, Warnings *warnings) {
    const Structure *structure = scene_structure(scene);
    for (size_t i = 0; i < scene->dampers.count; i++) {
        const Damper *on = &scene->dampers.at[i];
        const double mass = on->mass;
        double moved;
        TRY(structure_kind(structure)->moved_mass(structure, (size_t)on->storey - 1, &moved));
        if (mass <= moved)
            continue;
        char damper[64], place[sizeof((Fault){0}.pointer)], is[32], than[32];
        pointer_index(damper, sizeof damper, "/dampers", i);
        pointer_join(place, sizeof place, damper, "mass");
        TRY(warnings_add(warnings, place, "is %s kg, more than the %s's %s kg", text_real(is, mass),
                         structure_storeys(structure) > 1 ? "storey" : "structure",
                         text_real(than, moved)));
    }
    return STATUS_OK;
}

// What the excitation's kind alone can judge.
static Status warn_excitation(const Scene *scene, Warnings *warnings) {
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

static bool are_zero(const Reals *reals) {
    for (size_t i = 0; i < reals->count; i++)
        if (reals->at[i] != 0)
            return false;
    return true;
}

// The default excitation is free vibration from rest: a forgotten one would answer with zeros.
static Status warn_rest(const Scene *scene, Warnings *warnings) {
    const Excitation *excitation = scene_excitation(scene);
    if (excitation_kind(excitation) != &excitation_free || !are_zero(&excitation->displacement) ||
        !are_zero(&excitation->velocity))
        return STATUS_OK;
    for (size_t i = 0; i < scene->dampers.count; i++)
        if (scene->dampers.at[i].velocity != 0)
            return STATUS_OK;
    return warnings_add(warnings, "/excitation",
                        "is free vibration from rest: nothing will move; give an initial "
                        "displacement or velocity, or a kind that shakes the base");
}

Status plausible_warn(const Simulation *simulation, Warnings *warnings) {
    const Scene *scene = &simulation->scene;
    TRY(warn_rows(simulation_fields, simulation, "", warnings));
    TRY(warn_rest(scene, warnings));
    TRY(warn_times(scene, warnings));
    TRY(warn_excitation(scene, warnings));
    return warn_masses(scene, warnings);
}
