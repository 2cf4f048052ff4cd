// A scene with one of its parameters a little different, or with e and T_c drawn anew. Not a run.
// Used by sensitivity.c and sensitivity_run.c.
#ifndef CORE_STUDY_PARAMETER_PERTURBATION_H
#define CORE_STUDY_PARAMETER_PERTURBATION_H

#include "core/study/sensitivity.h"

// Why a completed simulation cannot be changed by a parameter; NULL: it can. A static text.
const char *perturbation_refuse(const Simulation *simulation, int parameter);

// The largest relative step up that a parameter allows, at most `step`: e ends at 1.
double perturbation_max_step(const Simulation *simulation, int parameter, double step);

// Sets `member`, a copy of `simulation`, to it with `factor` times the parameter.
void perturbation_apply(const Simulation *simulation, int parameter, double factor,
                        Simulation *member);

// Buffers that are drawn, each for itself: those that are given, one where both sides share it.
size_t perturbation_buffers(const Simulation *simulation);

// Sets `member` to run `run` of the study: restitution[i] and contact_time[i] get the factors of
// buffer i. Logarithms of factors are normal, so that the mean is 1 and the relative deviation the
// study's; what would put e beyond 1 is drawn again.
void perturbation_draw(const SensitivityStudy *study, const Simulation *simulation, uint64_t run,
                       Simulation *member, double *restitution, double *contact_time);

// Relative standard deviations of each buffer's e and T_c: those of the study for all buffers, or
// buffer by buffer as their materials were measured.
//
// Completes and validates them for a completed simulation: what is not given is read from the
// materials; a number without a deviation is exact.
Status deviations_complete(SensitivityStudy *study, const Simulation *simulation, Problem *problem);

// Whether any number has a deviation.
bool deviations_exist(const SensitivityStudy *study);

// Relative standard deviation of a buffer's SENSITIVITY_RESTITUTION or SENSITIVITY_CONTACT_TIME;
// dampers from 0.
double deviation_find(const SensitivityStudy *study, size_t damper, SensitivityBuffer buffer,
                      int parameter);

#endif
