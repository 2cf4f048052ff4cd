// An impact damper: a free mass between two stops with buffers.
#ifndef CORE_SCENE_DAMPER_H
#define CORE_SCENE_DAMPER_H

#include <stdint.h>

#include "core/base/field.h"
#include "core/contact/contact.h"
#include "core/result/response.h"
#include "core/scene/buffer.h"

// The masses of the test in which e and T_c were measured.
typedef struct Rig {
    double impactor_mass; // [kg]
    double base_mass;     // NAN: a fixed base [kg]
} Rig;

typedef enum IdentifiedFor { IDENTIFIED_FOR_SCENE, IDENTIFIED_FOR_RIG } IdentifiedFor;
extern const char *const identified_for_names[]; // "scene", "rig"; NULL-terminated

// The stops are at u = offset +- clearance / 2, where u is the displacement of the free mass
// relative to the structure.
typedef struct Damper {
    double mass;      // m [kg]
    double clearance; // d [m]
    double offset;    // of the middle between the stops [m]
    double position;  // initial, relative to that middle [m]
    double velocity;  // initial, relative to the structure [m/s]
    uint64_t storey;  // from 1; COUNT_ABSENT: the top one
    Buffer buffer;    // of both sides, or
    Buffer left_buffer;
    Buffer right_buffer;
    int identified_for; // IdentifiedFor: the pair for which e and T_c are valid
    Rig rig;            // given with IDENTIFIED_FOR_RIG
} Damper;

typedef struct Dampers {
    Damper *at;
    size_t count;
} Dampers;

extern const Field damper_fields[];

// The buffer of one side: its own if given, else the common one.
const Buffer *damper_buffer(const Damper *damper, Side side);

// The effective mass for which e and T_c are valid; `own` is that of the pair in the scene [kg].
double damper_identified_mass(const Damper *damper, double own);

// Clears the rig of `damper`, a modified copy of the completed `base`, if `base` got its rig from
// its materials. damper_complete then sets the rig of the damper's own materials.
void damper_reset_rig(const Damper *base, Damper *damper);

// The law for these dampers. "auto" is spring_damper if any side has a contact time, a stiffness or
// a damping, else impulse.
const ContactLaw *dampers_contact_law(const Dampers *dampers, const Contact *contact);

// Adds the faults that involve several members, below `pointer`, under the law from
// dampers_contact_law, on a structure of `storeys` (0: unknown). Then sets the default storey,
// removes values that the law does not use, and normalises the buffers: `buffer` if both sides are
// equal, else one for each side.
Status damper_complete(Damper *damper, const ContactLaw *law, size_t storeys, const char *pointer,
                       Problem *problem);

#endif
