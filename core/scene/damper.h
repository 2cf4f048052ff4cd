// A free mass between two buffered stops.
// Not a buffer's numbers (buffer.h) and not what they come to for a pair of masses
// (contact/identify.h). Used by scene/ and plan/.
#ifndef CORE_SCENE_DAMPER_H
#define CORE_SCENE_DAMPER_H

#include <stdint.h>

#include "core/base/field.h"
#include "core/base/side.h"
#include "core/contact/contact.h"
#include "core/scene/buffer.h"

// The masses of the test that measured e and T_c.
typedef struct Rig {
    double impactor_mass; // [kg]
    double base_mass;     // NAN: a fixed base [kg]
} Rig;

typedef enum IdentifiedFor { IDENTIFIED_FOR_SCENE, IDENTIFIED_FOR_RIG } IdentifiedFor;
extern const char *const identified_for_names[]; // "scene", "rig"; NULL-terminated

// Stops at u = offset +- clearance / 2, u being the free mass's displacement relative to the
// structure.
typedef struct Damper {
    double mass;      // m [kg]
    double clearance; // d [m]
    double offset;    // of the stops' middle [m]
    double position;  // initial, relative to that middle [m]
    double velocity;  // initial, relative to the structure [m/s]
    uint64_t storey;  // from 1; COUNT_ABSENT: the top one
    Buffer buffer;    // both sides, or
    Buffer left_buffer;
    Buffer right_buffer;
    int identified_for; // IdentifiedFor: the pair for which e and T_c hold
    Rig rig;            // given with IDENTIFIED_FOR_RIG
} Damper;

typedef struct Dampers {
    Damper *at;
    size_t count;
} Dampers;

extern const Field damper_fields[];

// The buffer of one side: that side's own, else the common one.
const Buffer *damper_buffer(const Damper *damper, Side side);

// The effective mass for which e and T_c hold, where that of the scene's pair is `own` [kg].
double damper_identified_mass(const Damper *damper, double own);

// Takes the rig off `damper`, which began as a copy of the completed `base`, where that is the one
// that the materials of `base` tell: completed anew it has that of its own materials.
void damper_ask_rig(const Damper *base, Damper *damper);

// Which law a run of these dampers uses: what "auto" stands for is spring_damper wherever a contact
// time or k, c is known on any side, else impulse.
const ContactLaw *dampers_contact_law(const Dampers *dampers, const Contact *contact);

// Faults that rows cannot see, below `pointer`, under the law that dampers_contact_law found, on a
// structure of so many storeys (0: not known). Then fills the storey, erases what the law does not
// use, and gives equal buffers one form: `buffer` where both sides are the same, else one for each
// side.
Status damper_complete(Damper *damper, const ContactLaw *law, size_t storeys, const char *pointer,
                       Problem *problem);

#endif
