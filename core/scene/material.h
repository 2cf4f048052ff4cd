// A buffer material as a lab keeps it: what one revision of it says, in the lab's words and
// numbers. Not who wrote it and when, nor what others think of it (store), nor what stands at a
// stop of a scene (buffer.h). Used by measure/, by the store's users and by whoever resolves names.
#ifndef CORE_SCENE_MATERIAL_H
#define CORE_SCENE_MATERIAL_H

#include "core/base/field.h"

enum { MATERIAL_ROWS = 1000, MATERIAL_SLUG_MAX = 63 };

// What was measured at one approach speed; deviations are standard deviations, NAN: not known.
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

// What the buffer lay on in the test.
typedef enum MaterialBase { MATERIAL_BASE_FIXED, MATERIAL_BASE_FREE } MaterialBase;
extern const char *const material_base_names[]; // "fixed", "free"; NULL-terminated

// What is not known is NAN, NULL, CHOICE_ABSENT or empty: never a figure that nobody measured.
typedef struct Material {
    char *name;       // for people
    char *kind;       // "foam", "rubber", "metal" ...
    double thickness; // [m]
    char *hardness;   // with its scale: "Shore A 40"
    char *supplier, *notes;
    Texts tags;
    double restitution, restitution_deviation;   // e [-]; absent beside a table
    double contact_time, contact_time_deviation; // T_c [s]; likewise
    MaterialRows table;                          // by strictly rising approach speed
    int separation; // Separation: the rule by which a contact's end was told; CHOICE_ABSENT
    double least_speed, most_speed;             // approach speeds measured [m/s]
    double least_temperature, most_temperature; // [degC]
    char *impactor;                             // "steel ball, 30 mm"
    double impactor_mass;                       // [kg]
    int base;                                   // MaterialBase; CHOICE_ABSENT: nobody says
    double base_mass;                           // of a free base [kg]
    char *source;                               // DOI, report, or where the numbers come from
    Reals measurements; // of this material, by number, that the numbers were taken from
} Material;

extern const Field material_fields[];
extern const Field material_list_fields[]; // of them only those that are lists

// Whether `slug` may name a material: [a-z0-9_-]+, at most MATERIAL_SLUG_MAX of them.
bool material_slug_is_good(const char *slug);

// All faults that rows cannot see, and the rows', below `pointer`. STATUS_OK or STATUS_INVALID.
Status material_check(const Material *material, const char *pointer, Problem *problem);

// The range of approach speeds for which it was measured: as stated, else its table's ends, else
// NAN.
void material_speeds(const Material *material, double *least, double *most);

// The effective mass of the test's pair; NAN where the test's masses are not known [kg].
double material_test_mass(const Material *material);

#endif
