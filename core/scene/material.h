// A buffer material as a laboratory describes it: the contents of one revision.
#ifndef CORE_SCENE_MATERIAL_H
#define CORE_SCENE_MATERIAL_H

#include "core/base/field.h"

enum { MATERIAL_ROWS = 1000, MATERIAL_SLUG_MAX = 63 };

// Measured values at one approach speed, with standard deviations; NAN: unknown.
typedef struct MaterialRow {
    double approach_speed;         // [m/s]
    double restitution;            // e [-]
    double contact_time;           // T_c [s]
    double restitution_deviation;  // [-]
    double contact_time_deviation; // [s]
} MaterialRow;

typedef struct MaterialRows {
    MaterialRow *at;
    size_t count;
} MaterialRows;

// The support of the buffer in the test.
typedef enum MaterialBase { MATERIAL_BASE_FIXED, MATERIAL_BASE_FREE } MaterialBase;
extern const char *const material_base_names[]; // "fixed", "free"; NULL-terminated

// Unknown values are NAN, NULL, CHOICE_ABSENT or empty.
typedef struct Material {
    char *name;       // display name
    char *kind;       // "foam", "rubber", "metal" ...
    double thickness; // [m]
    char *hardness;   // with its scale: "Shore A 40"
    char *supplier, *notes;
    Texts tags;
    double restitution, restitution_deviation;   // e [-]; absent if there is a table
    double contact_time, contact_time_deviation; // T_c [s]; absent if there is a table
    MaterialRows table;                          // by strictly ascending approach speed
    int separation; // Separation: how the end of a contact was determined; CHOICE_ABSENT
    double least_speed, most_speed;             // range of approach speeds [m/s]
    double least_temperature, most_temperature; // [degC]
    char *impactor;                             // "steel ball, 30 mm"
    double impactor_mass;                       // [kg]
    int base;                                   // MaterialBase; CHOICE_ABSENT: unknown
    double base_mass;                           // of a free base [kg]
    char *source;                               // DOI, report or other source
    Reals measurements; // numbers of the measurements of this material that were used
} Material;

extern const Field material_fields[];
extern const Field material_list_fields[]; // only the rows that are lists

// Whether `slug` is a valid name: [a-z0-9_-]+, at most MATERIAL_SLUG_MAX characters.
bool material_slug_is_valid(const char *slug);

// Adds all faults below `pointer`, also those of the rows. Returns STATUS_OK or STATUS_INVALID.
Status material_validate(const Material *material, const char *pointer, Problem *problem);

// The range of measured approach speeds [m/s]: as stated, else the ends of the table, else NAN.
void material_speed_range(const Material *material, double *least, double *most);

// The effective mass of the pair in the test; NAN if its masses are unknown [kg].
double material_test_mass(const Material *material);

#endif
