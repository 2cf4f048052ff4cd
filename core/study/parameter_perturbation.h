// A scene with one parameter scaled, or with restitutions and contact times drawn at random, and
// the uncertainty of these inputs.
#ifndef CORE_STUDY_PARAMETER_PERTURBATION_H
#define CORE_STUDY_PARAMETER_PERTURBATION_H

#include "core/simulation/simulation.h"

// A parameter stands for that of all dampers and sides.
typedef enum SensitivityParameter {
    SENSITIVITY_RESTITUTION,
    SENSITIVITY_CONTACT_TIME,
    SENSITIVITY_STIFFNESS,
    SENSITIVITY_DAMPING,
    SENSITIVITY_MASS,
    SENSITIVITY_CLEARANCE,
    SENSITIVITY_PARAMETERS
} SensitivityParameter;
extern const char *const sensitivity_parameter_names[]; // NULL-terminated

typedef enum SensitivityBuffer {
    SENSITIVITY_BOTH,
    SENSITIVITY_LEFT,
    SENSITIVITY_RIGHT
} SensitivityBuffer;

// Relative standard deviations of one buffer's restitution and contact time; NAN: exact.
typedef struct InputDeviation {
    uint64_t damper; // from 1
    int buffer;      // SensitivityBuffer
    char *source;    // "sponge@1"; NULL: given by the user
    double restitution, contact_time;
} InputDeviation;

typedef struct InputDeviations {
    InputDeviation *at;
    size_t count;
} InputDeviations;

// Each of the two deviations is given for all buffers at once (0: exact), or, where that is NAN,
// buffer by buffer in `spread`.
typedef struct InputUncertainty {
    double restitution_deviation, contact_time_deviation;
    InputDeviations spread; // none until completed: from the revisions of the buffers' materials
} InputUncertainty;

// Validates and completes it for a completed simulation, below "/study". A number without a
// deviation is exact.
Status uncertainty_complete(InputUncertainty *uncertainty, const Simulation *simulation,
                            Problem *problem);

// Validates the deviations that are given for all buffers at once.
Status uncertainty_check_common(const InputUncertainty *uncertainty, const Simulation *simulation,
                                Problem *problem);

// Whether any number has a deviation.
bool uncertainty_exists(const InputUncertainty *uncertainty);

// Relative standard deviation of a buffer's SENSITIVITY_RESTITUTION or SENSITIVITY_CONTACT_TIME;
// dampers from 0.
double uncertainty_find(const InputUncertainty *uncertainty, size_t damper,
                        SensitivityBuffer buffer, int parameter);

// Why a completed simulation has no relative change of a parameter; NULL: it has. A static text.
const char *perturbation_refuse(const Simulation *simulation, int parameter);

// Largest relative step up, at most `step`: a restitution ends at 1.
double perturbation_max_step(const Simulation *simulation, int parameter, double step);

// Sets the parameter of `target`, a copy of `simulation`, to `factor` times that of `simulation`.
void perturbation_apply(const Simulation *simulation, int parameter, double factor,
                        Simulation *target);

// Draws run `run` into `target`, a copy of `simulation`, and appends the factors of each buffer
// that is given, one where both sides share it. They are log-normal with mean 1 and the given
// relative deviation; a factor that puts a restitution beyond 1 is drawn again. STATUS_NO_MEMORY.
Status perturbation_draw(const InputUncertainty *uncertainty, uint64_t seed,
                         const Simulation *simulation, uint64_t run, Simulation *target,
                         Reals *restitution, Reals *contact_time, Problem *problem);

#endif
