// The primary structure. Only what the user gives; modes and matrices are plan/'s.
// Used by scene/ and plan/.
#ifndef CORE_SCENE_STRUCTURE_H
#define CORE_SCENE_STRUCTURE_H

#include "core/base/field.h"

// First member of every kind of structure.
typedef struct Structure {
    Variant variant;
} Structure;

// Kind "sdof": M x'' + C x' + K x = -M a_g + N.
typedef struct StructureSdof {
    Structure structure;
    double mass;          // M [kg]
    double stiffness;     // K [N/m]
    double damping;       // C [N s/m]; absent where damping_ratio is given
    double damping_ratio; // xi, C = 2 xi sqrt(K M) [-]
} StructureSdof;

extern const KindTable structure_kinds;
extern const Kind structure_sdof;

// C in N s/m, whichever way it was given.
double structure_damping(const StructureSdof *structure);

// Faults that rows cannot see, below `pointer`; fills damping = 0 where neither was given.
Status structure_complete(Structure *structure, const char *pointer, Problem *problem);

#endif
