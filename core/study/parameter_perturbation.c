// Every change starts from the numbers of the original scene, so that changes are independent.
#include "core/study/parameter_perturbation.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/base/philox.h"
#include "core/study/study_run.h"

enum { BUFFERS = 3, DRAWS_MAX = 64, STREAM = 0x53454e53 };

const char *const sensitivity_parameter_names[] = {
    "restitution", "contact_time", "stiffness", "damping", "mass", "clearance", NULL};

static Buffer *perturbation_buffer(const Damper *damper, size_t index) {
    static const size_t offsets[BUFFERS] = {offsetof(Damper, buffer), offsetof(Damper, left_buffer),
                                            offsetof(Damper, right_buffer)};
    return (Buffer *)(void *)((char *)damper + offsets[index]);
}

// The number of a buffer (0) and those of the rows of its table (from 1); NULL beyond the last.
static double *perturbation_number(const Buffer *buffer, int parameter, size_t index) {
    static const size_t offsets[] = {
        [SENSITIVITY_RESTITUTION] = offsetof(Buffer, restitution),
        [SENSITIVITY_CONTACT_TIME] = offsetof(Buffer, contact_time),
        [SENSITIVITY_STIFFNESS] = offsetof(Buffer, stiffness),
        [SENSITIVITY_DAMPING] = offsetof(Buffer, damping),
    };
    const bool has_rows =
        parameter == SENSITIVITY_RESTITUTION || parameter == SENSITIVITY_CONTACT_TIME;
    if (index == 0)
        return (double *)(void *)((char *)buffer + offsets[parameter]);
    if (!has_rows || index > buffer->table.count)
        return NULL;
    ContactRow *row = &buffer->table.at[index - 1];
    return parameter == SENSITIVITY_RESTITUTION ? &row->restitution : &row->contact_time;
}

// The number of a damper; NULL: the parameter is one of buffers.
static double *perturbation_damper_number(Damper *damper, int parameter) {
    return parameter == SENSITIVITY_MASS        ? &damper->mass
           : parameter == SENSITIVITY_CLEARANCE ? &damper->clearance
                                                : NULL;
}

// Largest value of a parameter in a buffer and its table; NAN: none.
static double perturbation_buffer_max(const Buffer *buffer, int parameter) {
    double max = (double)NAN;
    const double *number;
    for (size_t i = 0; (number = perturbation_number(buffer, parameter, i)) != NULL; i++)
        max = fmax(max, *number);
    return max;
}

// The same of the scene.
static double perturbation_max(const Simulation *simulation, int parameter) {
    const Dampers *dampers = &simulation->scene.dampers;
    double max = (double)NAN;
    for (size_t i = 0; i < dampers->count; i++) {
        const double *own = perturbation_damper_number(&dampers->at[i], parameter);
        if (own != NULL)
            max = fmax(max, *own);
        for (size_t k = 0; k < BUFFERS && own == NULL; k++)
            max = fmax(max,
                       perturbation_buffer_max(perturbation_buffer(&dampers->at[i], k), parameter));
    }
    return max;
}

const char *perturbation_refuse(const Simulation *simulation, int parameter) {
    const Dampers *dampers = &simulation->scene.dampers;
    const ContactLaw *law = dampers_contact_law(dampers, scene_contact(&simulation->scene));
    const double max = perturbation_max(simulation, parameter);
    if (isnan(max))
        return "no buffer of the scene has it, or the contact model does not use it";
    if (!(max > 0))
        return "it is 0, which has no relative change";
    // A law without loss has the restitution 1 and no other.
    if (parameter == SENSITIVITY_RESTITUTION && law->form == CONTACT_POWER && law->factor == NULL)
        return "the contact model gives all energy back";
    for (size_t i = 0; i < dampers->count && parameter == SENSITIVITY_CLEARANCE; i++)
        if (fabs(dampers->at[i].position) * 2 * (1 + 1e-9) >= dampers->at[i].clearance)
            return "a free mass starts at a stop, which a smaller one would move past it";
    return NULL;
}

double perturbation_max_step(const Simulation *simulation, int parameter, double step) {
    return parameter == SENSITIVITY_RESTITUTION
               ? fmax(0, fmin(step, 1 / perturbation_max(simulation, parameter) - 1))
               : step;
}

static void perturbation_scale(const Buffer *from, int parameter, double factor, Buffer *to) {
    const double max = parameter == SENSITIVITY_RESTITUTION ? 1 : (double)INFINITY;
    const double *number;
    for (size_t i = 0; (number = perturbation_number(from, parameter, i)) != NULL; i++)
        *perturbation_number(to, parameter, i) =
            *number * factor > max ? max : *number * factor; // NAN remains
}

void perturbation_apply(const Simulation *simulation, int parameter, double factor,
                        Simulation *target) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0; i < dampers->count; i++) {
        Damper *from = &dampers->at[i], *to = &target->scene.dampers.at[i];
        const double *own = perturbation_damper_number(from, parameter);
        if (own != NULL)
            *perturbation_damper_number(to, parameter) = *own * factor;
        for (size_t k = 0; k < BUFFERS && own == NULL; k++)
            perturbation_scale(perturbation_buffer(from, k), parameter, factor,
                               perturbation_buffer(to, k));
    }
}

// Log-normal, of mean 1 and relative deviation s.
static double perturbation_factor(double normal, double s) {
    const double variance = log1p(s * s);
    return exp(sqrt(variance) * normal - variance / 2);
}

// Draws the factors of restitution and contact time of one buffer, whose largest restitution is
// `max`.
static void perturbation_draw_factors(uint64_t seed, uint64_t run, size_t buffer, double max,
                                      const double deviation[2], double factor[2]) {
    for (uint64_t again = 0; again < DRAWS_MAX; again++) {
        double normal[2];
        philox_normal_pair(seed, STREAM + buffer, DRAWS_MAX * run + again, normal);
        factor[0] = perturbation_factor(normal[0], deviation[0]);
        if (again == 0)
            factor[1] = perturbation_factor(normal[1], deviation[1]);
        if (!(max * factor[0] > 1))
            return;
    }
    factor[0] = 1 / max; // very rare: the restitution becomes 1
}

Status perturbation_draw(const InputUncertainty *uncertainty, uint64_t seed,
                         const Simulation *simulation, uint64_t run, Simulation *target,
                         Reals *restitution, Reals *contact_time, Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    size_t drawn = 0;
    for (size_t i = 0; i < BUFFERS * dampers->count; i++) {
        const size_t damper = i / BUFFERS, k = i % BUFFERS;
        const Buffer *from = perturbation_buffer(&dampers->at[damper], k);
        Buffer *to = perturbation_buffer(&target->scene.dampers.at[damper], k);
        double deviation[2], factor[2];
        if (!buffer_is_given(from))
            continue;
        for (int parameter = 0; parameter < 2; parameter++)
            deviation[parameter] =
                uncertainty_find(uncertainty, damper, (SensitivityBuffer)k, parameter);
        perturbation_draw_factors(seed, run, drawn++,
                                  perturbation_buffer_max(from, SENSITIVITY_RESTITUTION), deviation,
                                  factor);
        for (int parameter = 0; parameter < 2; parameter++)
            if (deviation[parameter] > 0)
                perturbation_scale(from, parameter, factor[parameter], to);
        TRY(study_add_real(factor[0], restitution, problem));
        TRY(study_add_real(factor[1], contact_time, problem));
    }
    return STATUS_OK;
}

// Below, a parameter is SENSITIVITY_RESTITUTION or SENSITIVITY_CONTACT_TIME.

static double uncertainty_value(const InputDeviation *deviation, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? deviation->restitution : deviation->contact_time;
}

static double uncertainty_common(const InputUncertainty *uncertainty, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? uncertainty->restitution_deviation
                                                : uncertainty->contact_time_deviation;
}

static double uncertainty_recorded(const Buffer *buffer, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? buffer->test.restitution_deviation
                                                : buffer->test.contact_time_deviation;
}

double uncertainty_find(const InputUncertainty *uncertainty, size_t damper,
                        SensitivityBuffer buffer, int parameter) {
    double found = uncertainty_common(uncertainty, parameter);
    for (size_t i = 0; i < uncertainty->spread.count && isnan(found); i++) {
        const InputDeviation *deviation = &uncertainty->spread.at[i];
        if (deviation->damper == damper + 1 && deviation->buffer == (int)buffer)
            found = uncertainty_value(deviation, parameter);
    }
    return isnan(found) ? 0 : found;
}

bool uncertainty_exists(const InputUncertainty *uncertainty) {
    bool exists = uncertainty->restitution_deviation > 0 || uncertainty->contact_time_deviation > 0;
    for (size_t i = 0; i < uncertainty->spread.count; i++)
        exists = exists || uncertainty->spread.at[i].restitution > 0 ||
                 uncertainty->spread.at[i].contact_time > 0;
    return exists;
}

// Fills the deviations that are recorded with the buffers' materials, where none is given for all.
static Status uncertainty_fill_recorded(InputUncertainty *uncertainty, const Simulation *simulation,
                                        Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0; i < BUFFERS * dampers->count; i++) {
        const Buffer *buffer = perturbation_buffer(&dampers->at[i / BUFFERS], i % BUFFERS);
        double recorded[2];
        for (int parameter = 0; parameter < 2; parameter++) {
            recorded[parameter] = uncertainty_recorded(buffer, parameter);
            if (!(recorded[parameter] > 0) || !isnan(uncertainty_common(uncertainty, parameter)) ||
                perturbation_refuse(simulation, parameter) != NULL)
                recorded[parameter] = (double)NAN;
        }
        if (buffer->material == NULL || (isnan(recorded[0]) && isnan(recorded[1])))
            continue;
        InputDeviation *added = study_list_add(&uncertainty->spread, sizeof *added, problem);
        if (added == NULL)
            return STATUS_NO_MEMORY;
        *added = (InputDeviation){.damper = i / BUFFERS + 1,
                                  .buffer = (int)(i % BUFFERS),
                                  .restitution = recorded[0],
                                  .contact_time = recorded[1]};
        TRY(study_copy_text(buffer->material, &added->source, problem));
    }
    return STATUS_OK;
}

// Adds a fault at a member of an entry of the list; without a name at the entry.
__attribute__((format(printf, 4, 5))) static Status
uncertainty_fault(size_t index, const char *member, Problem *problem, const char *format, ...) {
    char place[sizeof((Fault){0}.pointer)], sentence[sizeof((Fault){0}.detail)];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(sentence, sizeof sentence, format, arguments);
    va_end(arguments);
    snprintf(place, sizeof place, "/study/spread/%zu%s%s", index, member != NULL ? "/" : "",
             member != NULL ? member : "");
    return problem_add(problem, STATUS_INVALID, place, "%s", sentence);
}

static Status uncertainty_check_number(const InputUncertainty *uncertainty,
                                       const Simulation *simulation, size_t index, int parameter,
                                       Problem *problem) {
    const InputDeviation *deviation = &uncertainty->spread.at[index];
    const double value = uncertainty_value(deviation, parameter);
    const char *why = perturbation_refuse(simulation, parameter);
    const char *name = sensitivity_parameter_names[parameter];
    if (value > 0 && why != NULL)
        return uncertainty_fault(index, name, problem, "must be left out: %s", why);
    if (!isnan(value) && !isnan(uncertainty_common(uncertainty, parameter)))
        return uncertainty_fault(index, name, problem,
                                 "must be left out: %s_deviation gives it for all buffers", name);
    if (value > 1)
        return uncertainty_fault(index, name, problem,
                                 "is %.3g of its value, as %.64s records, and must be at most 1 to "
                                 "be drawn from: give %s_deviation",
                                 value, deviation->source, name);
    return STATUS_OK;
}

// A source that is named must be the buffer's material, and the numbers must be its own.
static Status uncertainty_check_source(const InputDeviation *deviation, const Buffer *buffer,
                                       size_t index, Problem *problem) {
    if (deviation->source == NULL)
        return STATUS_OK;
    if (!text_same(deviation->source, buffer->material))
        return uncertainty_fault(
            index, "source", problem,
            "is not the material of that buffer: leave it out, or name its material and revision");
    for (int parameter = 0; parameter < 2; parameter++) {
        const double value = uncertainty_value(deviation, parameter),
                     recorded = uncertainty_recorded(buffer, parameter);
        if (!isnan(value) && value != recorded)
            return uncertainty_fault(index, sensitivity_parameter_names[parameter], problem,
                                     "is %.6g, but %.80s records %.6g: leave out the source", value,
                                     deviation->source, recorded);
    }
    return STATUS_OK;
}

static Status uncertainty_check(const InputUncertainty *uncertainty, const Simulation *simulation,
                                size_t index, Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    const InputDeviation *deviation = &uncertainty->spread.at[index];
    if (deviation->damper > dampers->count)
        return uncertainty_fault(index, "damper", problem, "must be the number of a damper");
    const Buffer *buffer =
        perturbation_buffer(&dampers->at[deviation->damper - 1], (size_t)deviation->buffer);
    if (!buffer_is_given(buffer))
        return uncertainty_fault(index, "buffer", problem,
                                 "is not given: if both stops have the same it is \"buffer\", else "
                                 "\"left_buffer\" and \"right_buffer\"");
    for (size_t i = 0; i < index; i++)
        if (uncertainty->spread.at[i].damper == deviation->damper &&
            uncertainty->spread.at[i].buffer == deviation->buffer)
            return uncertainty_fault(index, NULL, problem,
                                     "names the buffer of another entry: give one each");
    TRY(uncertainty_check_source(deviation, buffer, index, problem));
    const Status restitution =
        uncertainty_check_number(uncertainty, simulation, index, SENSITIVITY_RESTITUTION, problem);
    return study_first_failure(restitution,
                               uncertainty_check_number(uncertainty, simulation, index,
                                                        SENSITIVITY_CONTACT_TIME, problem));
}

static int uncertainty_compare(const void *a, const void *b) {
    const InputDeviation *first = a, *second = b;
    if (first->damper != second->damper)
        return first->damper < second->damper ? -1 : 1;
    return (first->buffer > second->buffer) - (first->buffer < second->buffer);
}

Status uncertainty_complete(InputUncertainty *uncertainty, const Simulation *simulation,
                            Problem *problem) {
    InputDeviations *spread = &uncertainty->spread;
    bool is_exact[2] = {true, true}; // no entry has a deviation of it
    Status status = STATUS_OK;
    if (spread->count == 0)
        TRY(uncertainty_fill_recorded(uncertainty, simulation, problem));
    for (size_t i = 0; i < spread->count; i++) {
        status =
            study_first_failure(status, uncertainty_check(uncertainty, simulation, i, problem));
        is_exact[0] = is_exact[0] && isnan(spread->at[i].restitution);
        is_exact[1] = is_exact[1] && isnan(spread->at[i].contact_time);
    }
    TRY(status);
    if (spread->count > 1)
        qsort(spread->at, spread->count, sizeof *spread->at, uncertainty_compare);
    if (is_exact[0] && isnan(uncertainty->restitution_deviation))
        uncertainty->restitution_deviation = 0;
    if (is_exact[1] && isnan(uncertainty->contact_time_deviation))
        uncertainty->contact_time_deviation = 0;
    return STATUS_OK;
}

Status uncertainty_check_common(const InputUncertainty *uncertainty, const Simulation *simulation,
                                Problem *problem) {
    Status status = STATUS_OK;
    for (int parameter = 0; parameter < 2; parameter++) {
        const double deviation = uncertainty_common(uncertainty, parameter);
        const char *why = deviation > 0 ? perturbation_refuse(simulation, parameter) : NULL;
        if (why != NULL)
            status = problem_add_real(problem, STATUS_INVALID,
                                      parameter == SENSITIVITY_RESTITUTION
                                          ? "/study/restitution_deviation"
                                          : "/study/contact_time_deviation",
                                      deviation, NULL, "must be left out: %s", why);
    }
    return status;
}
