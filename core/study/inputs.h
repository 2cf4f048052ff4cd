// Uncertain inputs of an ensemble: distributions of members of its scene, the points in the unit
// cube from which they are drawn, and the scene of a draw.
#ifndef CORE_STUDY_INPUTS_H
#define CORE_STUDY_INPUTS_H

#include "core/study/axis.h"

enum {
    INPUTS_MAX = 16,
    INPUT_NUMBERS_MAX = 2 * INPUTS_MAX, // a material has two
    SAMPLING_SOBOL_DIMENSIONS = 32,
};

// Points in the unit cube: independent, a Latin hypercube or a Sobol sequence. Each coordinate is a
// function of its row and dimension: any thread can make any point.
typedef enum SamplingMethod {
    SAMPLING_RANDOM,
    SAMPLING_LATIN_HYPERCUBE,
    SAMPLING_SOBOL
} SamplingMethod;
extern const char *const sampling_names[]; // NULL-terminated

// Points of one seed: rows up to 2^32, dimensions up to 256, of a Sobol sequence up to
// SAMPLING_SOBOL_DIMENSIONS.
typedef struct Sampling {
    int method; // SamplingMethod
    uint64_t seed;
    size_t rows; // of a Latin hypercube
} Sampling;

// A coordinate, within 0 and 1, never one of them and never 1/2.
double sampling_coordinate(const Sampling *sampling, size_t row, size_t dimension);

// Another one, independent of all; `again` from 0 to 2^20 - 1.
double sampling_draw_again(const Sampling *sampling, size_t row, size_t dimension, uint64_t again);

typedef enum InputDistribution {
    INPUT_NORMAL,
    INPUT_LOGNORMAL,
    INPUT_UNIFORM,
    INPUT_TRIANGULAR,
    INPUT_MATERIAL,
} InputDistribution;

// One input. Each distribution has some of the parameters; the others are NAN.
typedef struct UncertainInput {
    StudyAxis axis;   // its members, and from and to of a distribution that has them
    int distribution; // InputDistribution
    double mean, deviation;
    double median, log_deviation; // of the value, and of its natural logarithm
    double mode;
    // Relative standard deviations of e and T_c of a buffer; until completed those of its material.
    union {
        struct {
            double restitution_deviation, contact_time_deviation;
        };
        double relative[2]; // by SensitivityParameter
    };
} UncertainInput;
extern const Field uncertain_input_fields[];

typedef struct UncertainInputs {
    UncertainInput *at;
    size_t count;
} UncertainInputs;

// Validates and completes inputs whose rows are valid, of a completed simulation, below
// "/study/inputs". `numbers`: how many are drawn for a run.
Status uncertain_inputs_complete(UncertainInputs *inputs, const Simulation *simulation,
                                 const SimulationLimits *limits, size_t *numbers, Problem *problem);

// A number that is drawn: the value of an input, or a factor of a buffer's e or T_c.
typedef struct InputNumber {
    const UncertainInput *input;
    size_t index;     // of the input
    int parameter;    // of a factor: SENSITIVITY_RESTITUTION or SENSITIVITY_CONTACT_TIME; else -1
    double min, max;  // numbers outside are drawn again
    const char *unit; // NULL: none
} InputNumber;

// Completed inputs with their points. Immutable, shared by threads.
typedef struct InputModel {
    InputNumber numbers[INPUT_NUMBERS_MAX];
    size_t count;
    StudyAxis axes[INPUTS_MAX]; // of the values; what they own is the inputs'
    size_t axis_count;
    Sampling sampling;
} InputModel;

// Borrows `inputs`.
InputModel input_model_make(const UncertainInputs *inputs, const Simulation *simulation,
                            Sampling sampling);

// Draws the numbers of a row; those of the input `mixed`, or of all, from a second, independent
// table. again[i] counts values of number i that were out of range. STATUS_INVALID if all were.
enum { INPUTS_NONE = -1, INPUTS_ALL = -2 };
Status input_model_draw(const InputModel *model, size_t row, int mixed,
                        double values[INPUT_NUMBERS_MAX], uint64_t again[INPUT_NUMBERS_MAX],
                        Problem *problem);

// The completed scene with all numbers set. Cleared by simulation_clear in any case.
Status input_model_scene(const InputModel *model, const double *values, const Simulation *base,
                         const SimulationLimits *limits, Simulation *target, Problem *problem);

#endif
