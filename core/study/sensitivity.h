// The study "sensitivity": effects of errors of restitution, contact time and masses on the contact
// parameters and on the response.
#ifndef CORE_STUDY_SENSITIVITY_H
#define CORE_STUDY_SENSITIVITY_H

#include "core/study/statistics.h"

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
    SENSITIVITY_RIGHT,
    SENSITIVITY_BUFFERS
} SensitivityBuffer;
extern const char *const sensitivity_buffer_names[]; // NULL-terminated

// Relative standard deviations of one buffer's restitution and contact time; NAN: exact.
typedef struct InputDeviation {
    uint64_t damper; // from 1
    int buffer;      // SensitivityBuffer
    char *source;    // "sponge@1"; NULL: given by the user
    union {
        struct {
            double restitution, contact_time;
        };
        double of[2]; // by SensitivityParameter
    };
} InputDeviation;

typedef struct InputDeviations {
    InputDeviation *at;
    size_t count;
} InputDeviations;

// Each of the two deviations is given for all buffers at once (0: exact), or, where that is NAN,
// buffer by buffer in `spread`.
typedef struct InputUncertainty {
    union {
        struct {
            double restitution_deviation, contact_time_deviation;
        };
        double common[2]; // by SensitivityParameter
    };
    InputDeviations spread; // none until completed: from the revisions of the buffers' materials
} InputUncertainty;

// Relative standard deviation of a buffer's SENSITIVITY_RESTITUTION or SENSITIVITY_CONTACT_TIME;
// dampers from 0.
double uncertainty_find(const InputUncertainty *uncertainty, size_t damper,
                        SensitivityBuffer buffer, int parameter);

// That which a buffer's material records; NAN: none.
double uncertainty_recorded(const Buffer *buffer, int parameter);

// Why a completed simulation has no relative change of a parameter; NULL: it has. A static text.
const char *perturbation_refuse(const Simulation *simulation, int parameter);

// Largest relative step up, at most `step`: a restitution ends at 1.
double perturbation_max_step(const Simulation *simulation, int parameter, double step);

// Sets the parameter of `target`, a copy of `simulation`, to `factor` times that of `simulation`.
void perturbation_apply(const Simulation *simulation, int parameter, double factor,
                        Simulation *target);

// One of the buffers of all dampers, numbered by SENSITIVITY_BUFFERS * damper + SensitivityBuffer.
Buffer *perturbation_buffer(const Dampers *dampers, size_t buffer);

// The largest number of a parameter in a buffer and the rows of its table; NAN: none.
double perturbation_buffer_max(const Dampers *dampers, size_t buffer, int parameter);

// Sets all of them in `to` to `factor` times those of `from`; a restitution is at most 1.
void perturbation_scale(const Dampers *from, size_t buffer, int parameter, double factor,
                        Dampers *to);

// Log-normal of mean 1 and relative deviation `s`, from a standard normal number.
double perturbation_factor(double normal, double s);

// Draws run `run` into `target`, a copy of `simulation`, and appends the factors of each buffer
// that is given, one where both sides share it. They are log-normal with mean 1 and the given
// relative deviation; a factor that puts a restitution beyond 1 is drawn again. STATUS_NO_MEMORY.
Status perturbation_draw(const InputUncertainty *uncertainty, uint64_t seed,
                         const Simulation *simulation, uint64_t run, Simulation *target,
                         Reals *restitution, Reals *contact_time);

enum { SENSITIVITY_STEPS = 3 }; // each half of the one before

// The request.
typedef struct SensitivityStudy {
    Variant variant;
    Texts parameters; // none until completed: those that the scene has
    double step;      // relative, the largest of SENSITIVITY_STEPS
    InputUncertainty uncertainty;
    uint64_t runs; // COUNT_ABSENT until completed: none without a deviation
    uint64_t seed;
} SensitivityStudy;

// Sensitivity of one stop's k_b and c_b: relative change over relative error.
typedef struct SensitivityStop {
    uint64_t damper; // from 1
    int side;        // Side
    double restitution, contact_time, effective_mass, stiffness, damping;
    double stiffness_by_restitution, stiffness_by_contact_time;
    double damping_by_restitution, damping_by_contact_time;
    double by_damper_mass, by_structure_mass;      // of both k_b and c_b
    double stiffness_deviation, damping_deviation; // relative, of the input's; NAN: none
    char *why;                                     // why there are no closed forms
} SensitivityStop;

// Derivative of one metric by one parameter.
typedef struct SensitivitySlope {
    int metric;        // StatisticsMetric
    double value;      // of the scene itself
    double derivative; // relative change over relative change, at the middle step
    double spread;     // largest less smallest of all steps
    bool is_settled;   // the spread is small: the steps agree
} SensitivitySlope;

typedef struct SensitivityRow {
    int parameter; // SensitivityParameter
    Reals steps;   // relative
    struct {
        SensitivitySlope *at;
        size_t count;
    } slopes;
    char *why; // why there are none
} SensitivityRow;

// The answer.
typedef struct Sensitivity {
    Variant variant;
    Summary summary; // of the scene itself
    double steps;    // solver steps of all runs
    struct {
        SensitivityStop *at;
        size_t count;
    } contact;
    struct {
        SensitivityRow *at;
        size_t count;
    } response;
    bool is_chaotic; // the scene continues beyond its trust horizon
    char *why;       // consequence for the slopes
    uint64_t runs, made, failed, seed;
    InputUncertainty uncertainty;
    char *distribution;
    double confidence;
    struct {
        RunStatistic *at;
        size_t count;
    } statistics; // over the drawn runs
    StudyFailures failures;
    Reals frequency; // [Hz]
    RunSpectra spectra;
    RunTable table; // the drawn runs, from 1
} Sensitivity;

#endif
