// A scene made ready to run, with the reasons for each choice. Never changes once made; shared
// between threads. Not a run: it has no state. Used by solve/ and simulation/.
#ifndef CORE_PLAN_PLAN_H
#define CORE_PLAN_PLAN_H

#include "core/base/report.h"
#include "core/contact/contact_parameters.h"
#include "core/contact/identification.h"
#include "core/plan/modes.h"
#include "core/scene/scene.h"

// What a buffer came to for this pair of masses: one per damper and side. What is not known is NAN.
typedef struct Derived {
    uint64_t damper; // from 1
    int side;        // Side
    char *material;  // "sponge@1"; NULL if numbers were given
    double restitution, contact_time, effective_mass, stiffness, damping, damping_ratio;
    // What an isolated contact of this pair comes to, where that may be another: under a power law,
    // or with parameters carried over from a rig.
    double reached_restitution, reached_contact_time;
    double identified_mass; // of the rig; NAN without one
    double exponent, factor;
} Derived;
typedef struct DerivedList {
    Derived *at;
    size_t count;
} DerivedList;

// One natural mode of the structure, as people know it.
typedef struct PlanMode {
    double frequency;     // [Hz]
    double damping_ratio; // of the mode by itself; NAN where it does not swing
} PlanMode;
typedef struct PlanModes {
    PlanMode *at;
    size_t count;
} PlanModes;

// One run on the way to a target.
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

// What accuracy.target came to.
typedef struct PlanTarget {
    double error;           // relative, wanted; NAN: no target
    int metric;             // Metric
    char *way;              // chosen; after a run the one whose answer this is
    double predicted_error; // of that way
    double estimated_error; // of the run; NAN before it, or unknown
    int verdict;            // PlanVerdict; CHOICE_ABSENT before the run
    PlanAttempts attempts;  // all runs that were needed
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

// One stop's contact parameters, ready for a solver. The first three are those of every impact;
// where they depend on its approach speed they are NAN and only contact_freeze(&contact, ...)
// tells.
typedef struct PlanStop {
    double restitution; // e, under CONTACT_IMPULSIVE
    double stiffness;   // k_b [N/m], under CONTACT_LINEAR
    double damping;     // c_b [N s/m]
    ContactStop contact;
} PlanStop;

// One free mass.
typedef struct PlanDamper {
    size_t storey;             // from 0
    double mass;               // m [kg]
    double effective_mass;     // m_e of the free mass and its storey, 1 / (1/m + (M^-1)_jj) [kg]
    double clearance, offset;  // d, middle of the stops [m]
    double position, velocity; // at t = 0, relative to the stops' middle and to the storey
    PlanStop stops[2];         // by Side
} PlanDamper;

// Plain values, written once by plan_new. Matrices are storeys x storeys, row after row.
typedef struct Plan {
    size_t storeys;
    double *mass, *stiffness, *damping; // M, K, C of the structure [kg], [N/m], [N s/m]
    double *influence;                  // r of M x'' + C x' + K x = -M r a_g + N [-]
    double *displacement, *velocity;    // of the storeys at t = 0 [m], [m/s]
    Modes modes; // of all, or those that are kept; empty where plan_is_single, and in a sketch
    bool is_truncated; // modes are left out that would move (plan/keep.h)
    size_t kept;       // of a sketch: modes that a run is asked to keep; 0: all
    double given_up;   // foretold error of displacement of a truncated plan, over its largest value
    double fastest;    // of a sketch: no mode is faster, or dies away faster [rad/s]
    PlanDamper *dampers;
    size_t damper_count;
    const ContactLaw *law;
    ContactForm form; // the law's: never CONTACT_CHOSEN
    Separation separation;
    double duration, sample_rate;
    size_t count; // samples
    PlanReport report;
} Plan;

// Makes ready a scene that scene_complete has passed; `solver` is the chosen solver's name, `asked`
// what the accuracy object said. Freed by plan_free.
Status plan_new(const Scene *scene, const char *asked, const char *solver, Plan **plan,
                Problem *problem);
// A plan without modes and reasons, in a small part of the time, to tell what a run may cost that
// keeps so many modes. Freed by plan_free.
Status plan_sketch(const Scene *scene, size_t modes, Plan **plan);
void plan_free(Plan *plan);

// Whether the engine for one mass serves: one storey that moves with the base, at most one damper,
// and a law whose contact phases are linear or instantaneous.
bool plan_is_single(const Plan *plan);
// The same where no stop is ever reached: then the law does not matter.
bool plan_is_single_in_flight(const Plan *plan);

// Of a run.
static inline size_t plan_mode_count(const Plan *plan) {
    return plan->modes.count > 0 ? plan->modes.count : plan->kept > 0 ? plan->kept : plan->storeys;
}

#endif
