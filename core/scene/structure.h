// One kind of structure; structures.c lists all kinds. Each provides the matrices of its storeys:
// M x'' + C x' + K x = -M r a_g + N.
#ifndef CORE_SCENE_STRUCTURE_H
#define CORE_SCENE_STRUCTURE_H

#include "core/base/field.h"

enum { STRUCTURE_STOREYS = 200 };

// First member of every kind of structure.
typedef struct Structure {
    Variant variant;      // kind is a StructureKind's
    double damping_ratio; // xi of every mode [-]; absent if C is given
} Structure;

// Storage for the matrices: storeys x storeys, row-major, zero on input.
typedef struct StructureMatrices {
    double *mass, *stiffness, *damping; // M, K, C [kg], [N/m], [N s/m]
    double *influence;                  // r [-]
} StructureMatrices;

typedef struct StructureKind {
    Kind kind;
    const char *damping_name; // the member that excludes damping_ratio
    bool has_drifts;          // storey i stands on storey i - 1, the first on the base
    size_t (*storeys)(const Structure *structure);
    bool (*has_damping)(const Structure *structure); // whether that member is given
    // Adds the faults that involve several members, below `pointer`; then sets defaults.
    Status (*complete)(Structure *structure, const char *pointer, Problem *problem);
    void (*assemble)(const Structure *structure, const StructureMatrices *matrices);
    // The mass that a force on storey j (from 0) accelerates at once, 1 / (M^-1)_jj [kg].
    Status (*moved_mass)(const Structure *structure, size_t storey, double *mass);
} StructureKind;

extern const StructureKind *const structures[]; // NULL-terminated; "sdof" first
extern const KindTable structure_kinds;
extern const Field structure_fields[]; // the rows of every kind
extern const StructureKind structure_sdof, structure_shear_frame, structure_matrix;

static inline const StructureKind *structure_kind(const Structure *structure) {
    return (const StructureKind *)(const void *)structure->variant.kind;
}

// Kind "sdof".
typedef struct SdofStructure {
    Structure structure;
    double mass;      // M [kg]
    double stiffness; // K [N/m]
    double damping;   // C [N s/m]; absent if damping_ratio is given
} SdofStructure;

// Kind "frame": spring i and damper i are below storey i, the first on the ground.
typedef struct ShearFrame {
    Structure structure;
    Reals masses, stiffnesses, dampings;
} ShearFrame;

// Kind "matrices".
typedef struct MatrixStructure {
    Structure structure;
    Rows mass, stiffness, damping;
    Reals influence;
} MatrixStructure;

size_t structure_storeys(const Structure *structure);

// Adds the faults that involve several members, below `pointer`; sets the damping to 0 if none is
// given. After STATUS_OK the structure has 1 to STRUCTURE_STOREYS storeys and valid matrices.
Status structure_complete(Structure *structure, const char *pointer, Problem *problem);

// Writes the matrices of a completed structure. C is 0 if several storeys have a damping_ratio,
// because it then depends on the modes.
void structure_assemble(const Structure *structure, const StructureMatrices *matrices);

// Rates of the `modes` slowest modes of a completed structure, SIZE_MAX: of all [rad/s].
typedef struct StructureRates {
    double slowest;       // the first natural frequency; 0 if a motion has none
    double fastest;       // the last one or, of all modes, a bound on the decay if that is faster
    double damping_ratio; // of all modes, or of the only one; 0: none, or not known
} StructureRates;
Status structure_rates(const Structure *structure, size_t modes, StructureRates *rates);

// For the kinds: sets a list to `count` zeros; adds a fault unless a list has one number per
// storey.
Status structure_zeros(Reals *reals, size_t count, Problem *problem);
Status structure_validate_count(const Reals *reals, size_t storeys, const char *pointer,
                                const char *name, Problem *problem);

#endif
