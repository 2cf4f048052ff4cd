// Uncertain inputs of an ensemble: distributions of members of its scene, and the scene of a draw.
#ifndef CORE_STUDY_INPUTS_H
#define CORE_STUDY_INPUTS_H

#include "core/study/axis.h"
#include "core/study/sampling.h"

enum {
    INPUTS_MAX = 16,
    INPUT_NUMBERS_MAX = 2 * INPUTS_MAX, // a material has two
};

typedef enum InputDistribution {
    INPUT_NORMAL,
    INPUT_LOGNORMAL,
    INPUT_UNIFORM,
    INPUT_TRIANGULAR,
    INPUT_MATERIAL,
} InputDistribution;

// One input: a member of the completed scene, or several that all get the same value. Each
// distribution has some of the parameters; the others are NAN.
typedef struct UncertainInput {
    char *pointer; // NULL: `pointers`
    Texts pointers;
    int distribution; // InputDistribution
    double mean, deviation;
    double median, log_deviation; // of the value, and of its natural logarithm
    double from, mode, to;
    // Relative standard deviations of e and T_c of a buffer; until completed those of its material.
    double restitution_deviation, contact_time_deviation;
} UncertainInput;
extern const Field uncertain_input_fields[];

typedef struct UncertainInputs {
    UncertainInput *at;
    size_t count;
} UncertainInputs;

const char *uncertain_input_pointer(const UncertainInput *input, size_t index); // from 0

// Validates and completes inputs whose rows are valid, of a completed simulation, below
// "/study/inputs".
Status uncertain_inputs_complete(UncertainInputs *inputs, const Simulation *simulation,
                                 const SimulationLimits *limits, Problem *problem);

// A number that is drawn: the value of an input, or a factor of a buffer's e or T_c.
typedef struct InputNumber {
    const UncertainInput *input;
    size_t index;     // of the input
    int parameter;    // of a factor: SENSITIVITY_RESTITUTION or SENSITIVITY_CONTACT_TIME; else -1
    Range range;      // numbers outside are drawn again
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

// `tables` independent points per row: dimension d of table t is d + t * count. Borrows `inputs`.
// Cleared by input_model_clear in any case. STATUS_NO_MEMORY.
Status input_model_make(const UncertainInputs *inputs, const Simulation *simulation, int method,
                        uint64_t seed, size_t rows, size_t tables, InputModel *model);
void input_model_clear(InputModel *model);

// Draws a number; *again counts values that were out of range. STATUS_INVALID if all were.
Status input_model_draw(const InputModel *model, size_t number, size_t row, size_t table,
                        double *value, uint64_t *again, Problem *problem);

// The completed scene with all numbers set. Cleared by simulation_clear in any case.
Status input_model_scene(const InputModel *model, const double *values, const Simulation *base,
                         const SimulationLimits *limits, Simulation *target, Problem *problem);

#endif
