// The physical input: structure, dampers, contact law, excitation and duration. Plain values in SI
// units.
#ifndef CORE_SCENE_SCENE_H
#define CORE_SCENE_SCENE_H

#include <stdint.h>

#include "core/contact/contact.h"
#include "core/excitation/excitation.h"
#include "core/scene/damper.h"
#include "core/scene/structure.h"

enum { SCENE_DAMPERS = 64 };

typedef struct Scene {
    Variant *structure; // a Structure
    Dampers dampers;
    Variant *contact;    // a Contact
    Variant *excitation; // an Excitation
    double duration;     // [s]
    double sample_rate;  // [Hz]
} Scene;

extern const Field scene_fields[];

static inline const Structure *scene_structure(const Scene *scene) {
    return (const Structure *)(const void *)scene->structure;
}
static inline const Contact *scene_contact(const Scene *scene) {
    return (const Contact *)(const void *)scene->contact;
}
static inline const Excitation *scene_excitation(const Scene *scene) {
    return (const Excitation *)(const void *)scene->excitation;
}

// The number of samples i = 0 ... floor(duration * sample_rate (1 + 1e-12)); at most SIZE_MAX.
size_t scene_sample_count(const Scene *scene);

// The number of storeys; 0 if unknown because of a fault in `problem`.
size_t scene_storeys(const Scene *scene, const Problem *problem);

// Validates and completes a scene, after fields_validate and after materials are resolved. Adds
// every fault that involves several members, not where there is one already: unresolved materials,
// members that exclude each other, positions beyond a stop, more than `max_samples` samples (0: no
// limit). Sets defaults that depend on other members and removes values that the chosen models do
// not use, so that equal scenes have equal canonical forms.
Status scene_complete(Scene *scene, size_t max_samples, Problem *problem);

#endif
