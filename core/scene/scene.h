// What the user describes: structure, dampers, contact, excitation, time. Plain values in SI units.
// Not yet judged against each other (scene_complete) and not made ready (plan/).
// Used by plan/ and simulation/.
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

// Samples per channel: i = 0 ... floor(duration * sample_rate (1 + 1e-12)). Saturates at SIZE_MAX.
size_t scene_sample_count(const Scene *scene);

// Storeys of the structure; 0 where a fault among `problem`'s leaves them unknown.
size_t scene_storeys(const Scene *scene, const Problem *problem);

// Judges and completes: adds every fault that the rows alone cannot see (materials still
// unresolved, parts that exclude each other, positions beyond a stop, more than `most_samples`
// samples; 0: no limit), fills defaults that depend on other members and erases what the chosen
// model does not use, so that equal scenes have equal canonical forms. Call after fields_check and
// after slugs are resolved; says nothing of what already has a fault.
Status scene_complete(Scene *scene, size_t most_samples, Problem *problem);

#endif
