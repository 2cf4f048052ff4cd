// A scene prepared for a run, with the reason for each choice. A plan is immutable and shared
// between threads.
#ifndef CORE_PLAN_PLAN_H
#define CORE_PLAN_PLAN_H

#include "core/base/report.h"
#include "core/contact/contact_parameters.h"
#include "core/contact/identification.h"
#include "core/excitation/base_motion.h"
#include "core/plan/modes.h"
#include "core/scene/scene.h"

// Contact parameters of a pair of masses, one for each damper and side; NAN: unknown.
typedef struct Derived {
    uint64_t damper; // from 1
    int side;        // Side
    char *material;  // "sponge@1"; NULL if numbers were given
    double restitution, contact_time, effective_mass, stiffness, damping, damping_ratio;
    // Of an isolated contact of this pair, where they differ: under a power law, or with parameters
    // carried over from a rig.
    double reached_restitution, reached_contact_time;
    double identified_mass; // of the rig; NAN without one
    double exponent, factor;
} Derived;
typedef struct DerivedList {
    Derived *at;
    size_t count;
} DerivedList;

// One natural mode of the structure.
typedef struct PlanMode {
    double frequency;     // [Hz]
    double damping_ratio; // of the mode alone; NAN for a rigid-body motion
} PlanMode;
typedef struct PlanModes {
    PlanMode *at;
    size_t count;
} PlanModes;

// One run of the search for a target.
typedef struct PlanAttempt {
    char *way;              // "exact, tolerance 1e-06"
    double predicted_error; // NAN before it was run
    double estimated_error; // NAN: unknown, or it failed
    double steps;           // counted; NAN: it failed
} PlanAttempt;
typedef struct PlanAttempts {
    PlanAttempt *at;
    size_t count;
} PlanAttempts;

typedef enum PlanVerdict { VERDICT_KEPT, VERDICT_MISSED, VERDICT_UNKNOWN } PlanVerdict;

// The outcome of accuracy.target.
typedef struct PlanTarget {
    double error;           // the relative error requested; NAN: no target
    int metric;             // Metric
    char *way;              // settings chosen; after a run those of the result
    double predicted_error; // of those settings
    double estimated_error; // of the run; NAN before it, or unknown
    int verdict;            // PlanVerdict; CHOICE_ABSENT before the run
    PlanAttempts attempts;  // all runs
} PlanTarget;

// The readable part of a plan: the API's "plan" object.
typedef struct PlanReport {
    char *contact_model; // "none" where there is no damper
    char *solver;
    PlanTarget target;
    Decisions decisions;
    DerivedList derived;
    PlanModes modes;
} PlanReport;

extern const Field plan_report_fields[], derived_fields[], mode_fields[], target_fields[];

// One free mass.
typedef struct PlanDamper {
    size_t storey;             // from 0
    double mass;               // m [kg]
    double effective_mass;     // m_e of the free mass and its storey, 1 / (1/m + (M^-1)_jj) [kg]
    double clearance, offset;  // d, middle of the stops [m]
    double position, velocity; // at t = 0, relative to the stops' middle and to the storey
    // By Side. Their parameters hold for every impact; NAN where they depend on the approach speed
    // (stops_freeze).
    ContactStop stops[2];
} PlanDamper;

// Plain values, written by plan_new. Matrices are storeys x storeys, row after row.
typedef struct Plan {
    size_t storeys;
    double *mass, *stiffness, *damping; // M, K, C of the structure [kg], [N/m], [N s/m]
    double *influence;                  // r of M x'' + C x' + K x = -M r a_g + N [-]
    bool has_drifts;                    // the structure has storey drifts
    double *displacement, *velocity;    // of the storeys at t = 0 [m], [m/s]
    Modes modes;       // all, or those kept; empty where plan_is_single, and in a sketch
    bool is_truncated; // moving modes are left out (plan_keep)
    size_t kept;       // of a sketch: number of modes that the run keeps; 0: all
    double given_up;   // predicted error of displacement by modes left out, over its largest value
    double fastest;    // of a sketch: bound on omega and decay rate of all modes [rad/s]
    PlanDamper *dampers;
    size_t damper_count;
    const ContactLaw *law;
    ContactForm form; // the law's: never CONTACT_CHOSEN
    Separation separation;
    double duration, sample_rate;
    size_t count; // samples
    PlanReport report;
} Plan;

// The plan of a scene that scene_complete has accepted; `solver` is the chosen solver's name,
// `asked` the name in the accuracy object. Freed by plan_free.
Status plan_new(const Scene *scene, const char *asked, const char *solver, Plan **plan,
                Problem *problem);
// A plan without modes and decisions, which takes a small part of the time, for the cost of a run
// with so many modes. Freed by plan_free.
Status plan_sketch(const Scene *scene, size_t modes, Plan **plan);
void plan_free(Plan *plan);

// Whether the plan has one storey that moves with the base, at most one damper, and a law whose
// contact phases are linear or instantaneous.
bool plan_is_single(const Plan *plan);
// The same for a run that reaches no stop: the law does not matter.
bool plan_is_single_in_flight(const Plan *plan);

// The number of modes of a run.
static inline size_t plan_mode_count(const Plan *plan) {
    return plan->modes.count > 0 ? plan->modes.count : plan->kept > 0 ? plan->kept : plan->storeys;
}

// Whether a stop's parameters depend on the approach speed.
bool stops_vary(const PlanDamper *damper);

// Parameters of an impact that begins with this approach speed [m/s].
ContactParameters stops_freeze(const ContactStop *stop, double approach_speed);

// Selects the modes of a plan of plan_new, once; `modes` is the number asked for, 0: all. Adds its
// decisions and the predicted error to the plan. Does nothing where plan_is_single.
// STATUS_CANCELLED where `progress`, which may be NULL, requests a stop.
Status plan_keep(Plan *plan, const Scene *scene, size_t modes, const Progress *progress,
                 Problem *problem);

// Relative to the same run with all modes; at most 1. Exceeded in about 1 % of scenes without
// dampers and 3 % of scenes with dampers.
typedef struct TruncationError {
    double displacement;      // largest difference over the largest displacement, any storey
    double mean_acceleration; // rms of the difference over rms, of all storeys together
    double rms_displacement;  // difference of the largest storey's rms over that rms
} TruncationError;

// Writes to errors[k] the error of a run with the k + 1 lowest modes, for all plan->modes.count of
// them; it never rises with k and ends with 0. The plan has all modes of its structure (plan_new,
// before plan_keep). Nothing is written where plan_is_single. Makes the base's motion.
Status truncation_predict(const Plan *plan, const Scene *scene, const Progress *progress,
                          TruncationError *errors);

// What that takes in solver steps, with `modes` modes. The base has samples every `base_interval`,
// or a closed form (0); nothing moves faster than `fastest` [rad/s].
double truncation_cost(double duration, double sample_rate, double base_interval, double fastest,
                       size_t modes);

// The share of the lowest `kept` modes in the mass that the base moves, r' M r; 1 where it moves
// none.
double truncation_moved_mass(const Plan *plan, size_t kept);

// Properties of a scene that are proved before the run from bounds (reachability.c).
typedef struct Regime {
    bool is_unforced; // the base does not move
    bool is_at_rest;  // nothing moves
    bool is_clear;    // no mass reaches a stop; true without a mass
    // Bound on the distance of a mass from the middle of its stops over half their distance, the
    // largest of all masses; INFINITY: 1 or more, or unknown [-]
    double reach;
} Regime;

// `base` is the motion that the plan's run has.
Regime regime_find(const Plan *plan, const Base *base);

#endif
