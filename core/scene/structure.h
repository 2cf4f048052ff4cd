// What ONE kind of structure is; structures.c lists all. Each comes to matrices of its storeys:
// M x'' + C x' + K x = -M r a_g + N. Modes are plan/'s. Used by scene/, plan/ and simulation/.
#ifndef CORE_SCENE_STRUCTURE_H
#define CORE_SCENE_STRUCTURE_H

#include "core/base/field.h"

enum { STRUCTURE_STOREYS = 200 };

// First member of every kind of structure.
typedef struct Structure {
    Variant variant;      // kind is a StructureKind's
    double damping_ratio; // xi of every mode [-]; absent where C is given
} Structure;

// Where matrices are written: storeys x storeys, row after row, all zero before.
typedef struct Matrices {
    double *mass, *stiffness, *damping; // M, K, C [kg], [N/m], [N s/m]
    double *influence;                  // r [-]
} Matrices;

typedef struct StructureKind {
    Kind kind;
    const char *damping_name; // of the row that damping_ratio excludes
    size_t (*storeys)(const Structure *structure);
    bool (*has_damping)(const Structure *structure); // by that row
    // Faults that rows cannot see, below `pointer`; then fills what was left to defaults.
    Status (*complete)(Structure *structure, const char *pointer, Problem *problem);
    void (*fill)(const Structure *structure, const Matrices *matrices);
    // What a force on a storey (from 0) moves at once, 1 / (M^-1)_jj [kg].
    Status (*moved_mass)(const Structure *structure, size_t storey, double *mass);
} StructureKind;

extern const StructureKind *const structures[]; // NULL-terminated; "sdof" first
extern const KindTable structure_kinds;
extern const Field structure_fields[]; // the rows that every kind has
extern const StructureKind structure_sdof, structure_frame, structure_matrices;

static inline const StructureKind *structure_kind(const Structure *structure) {
    return (const StructureKind *)(const void *)structure->variant.kind;
}

// Kind "sdof".
typedef struct StructureSdof {
    Structure structure;
    double mass;      // M [kg]
    double stiffness; // K [N/m]
    double damping;   // C [N s/m]; absent where damping_ratio is given
} StructureSdof;

// Kind "frame": storey i on spring i and damper i, the first on the ground.
typedef struct StructureFrame {
    Structure structure;
    Reals masses, stiffnesses, dampings;
} StructureFrame;

// Kind "matrices".
typedef struct StructureMatrices {
    Structure structure;
    Rows mass, stiffness, damping;
    Reals influence;
} StructureMatrices;

size_t structure_storeys(const Structure *structure);

// Faults that rows cannot see, below `pointer`; fills damping of 0 where none was given. Then the
// structure has 1 to STRUCTURE_STOREYS storeys and its matrices are what they must be.
Status structure_complete(Structure *structure, const char *pointer, Problem *problem);

// The matrices of a completed structure. C is 0 where several storeys have a damping_ratio: it
// takes their modes to know it.
void structure_fill(const Structure *structure, const Matrices *matrices);

// How fast a completed structure moves, for guesses and warnings [rad/s].
typedef struct StructureRates {
    double slowest; // near its first natural frequency; 0 where a motion has none
    double fastest; // about its last one, or its fastest decay if that is faster
} StructureRates;
Status structure_rates(const Structure *structure, StructureRates *rates);
// The same where only the `modes` slowest move.
Status structure_rates_of(const Structure *structure, size_t modes, StructureRates *rates);

// For the kinds: a list of `count` zeros; a fault unless the list has one number per storey.
Status structure_zeros(Reals *reals, size_t count, Problem *problem);
Status structure_check_count(const Reals *reals, size_t storeys, const char *pointer,
                             const char *name, Problem *problem);

#endif
