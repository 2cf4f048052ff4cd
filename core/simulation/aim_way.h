// The ways to a target: what a run may give up, what that is foretold to make wrong, and which way
// is the cheapest. Not the runs and what is told of them: that is aim.c, which uses it.
#ifndef CORE_SIMULATION_AIM_WAY_H
#define CORE_SIMULATION_AIM_WAY_H

#include "core/simulation/simulation.h"
#include "core/solve/solver.h"

// One way to run the scene by the solver exact: what it gives up.
typedef struct Way {
    double tolerance;  // of contacts under a power law; NAN: none
    uint64_t modes;    // COUNT_ABSENT: all are kept
    bool is_impulsive; // contacts that take time are impulses
    double predicted;  // relative error of the metric
} Way;

// A simulation with a target, and what is foretold of it.
typedef struct Aim {
    const Simulation *simulation;
    const AccuracyAuto *asked;
    Plan *plan; // of all
    bool has_tolerance;
    double impacts, growth; // how many, and of an error until the end
    double *modes_error;    // of the metric by the modes kept, from 1 on; NULL: all are
    double strike_error;    // of displacement, by impulses, each; NAN: not to be had
} Aim;

// Cleared by aim_clear, also after a failure.
Status aim_make(Aim *aim, const Simulation *simulation, Problem *problem);
void aim_clear(Aim *aim);

// The cheapest way foretold to keep `error` of the metric, and the one that gives up nothing.
Way aim_choose(const Aim *aim, double error);
Way aim_whole(const Aim *aim);
bool way_is_whole(const Way *way);

// What a run came to, by its own estimate: relative error of the metric; NAN: unknown.
double aim_estimate(const Aim *aim, const Way *way, const Outcome *outcome);

// "exact, tolerance 1e-06, 8 modes".
void way_name(const Way *way, char name[96]);

// The simulation as a way runs it, completed. Cleared by simulation_clear in any case.
Status way_apply(const Simulation *simulation, const Way *way, Simulation *target,
                 Problem *problem);

// Foretold for a way.
Cost way_cost(const Simulation *simulation, const Way *way);

#endif
