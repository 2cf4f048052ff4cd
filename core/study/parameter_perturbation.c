// Every change starts from the numbers of the original scene, so that changes are independent.
#include "core/study/parameter_perturbation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "core/study/study_run.h"

enum { BUFFERS = 3, NUMBERS = 4, DRAWS_MAX = 64, STREAM = 0x53454e53 };

const char *const sensitivity_parameter_names[] = {
    "restitution", "contact_time", "stiffness", "damping", "mass", "clearance", NULL};

static const size_t perturbation_offsets[BUFFERS] = {
    offsetof(Damper, buffer), offsetof(Damper, left_buffer), offsetof(Damper, right_buffer)};
static const size_t perturbation_numbers[NUMBERS] = {
    [SENSITIVITY_RESTITUTION] = offsetof(Buffer, restitution),
    [SENSITIVITY_CONTACT_TIME] = offsetof(Buffer, contact_time),
    [SENSITIVITY_STIFFNESS] = offsetof(Buffer, stiffness),
    [SENSITIVITY_DAMPING] = offsetof(Buffer, damping),
};

static const Buffer *perturbation_buffer(const Damper *damper, size_t index) {
    return (const Buffer *)(const void *)((const char *)damper + perturbation_offsets[index]);
}

static bool perturbation_is_of_buffer(int parameter) {
    return parameter < SENSITIVITY_MASS;
}

static double perturbation_number(const Buffer *buffer, int parameter) {
    return *(const double *)(const void *)((const char *)buffer + perturbation_numbers[parameter]);
}

// Largest value of a parameter in a buffer and its table; NAN: none.
static double perturbation_buffer_max(const Buffer *buffer, int parameter) {
    double max = perturbation_number(buffer, parameter);
    for (size_t i = 0; i < buffer->table.count; i++) {
        const ContactRow *row = &buffer->table.at[i];
        if (parameter == SENSITIVITY_RESTITUTION)
            max = fmax(max, row->restitution);
        else if (parameter == SENSITIVITY_CONTACT_TIME)
            max = fmax(max, row->contact_time);
    }
    return max;
}

// The same of the scene.
static double perturbation_max(const Simulation *simulation, int parameter) {
    const Dampers *dampers = &simulation->scene.dampers;
    double max = (double)NAN;
    for (size_t i = 0; i < dampers->count; i++) {
        if (parameter == SENSITIVITY_MASS)
            max = fmax(max, dampers->at[i].mass);
        else if (parameter == SENSITIVITY_CLEARANCE)
            max = fmax(max, dampers->at[i].clearance);
        for (size_t k = 0; k < BUFFERS && perturbation_is_of_buffer(parameter); k++)
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
        return "it is 0: a relative change is none";
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

static void perturbation_scale(const Damper *from, size_t buffer, int parameter, double factor,
                               Damper *to) {
    const Buffer *original = perturbation_buffer(from, buffer);
    Buffer *target = (Buffer *)(void *)((char *)to + perturbation_offsets[buffer]);
    const double number = perturbation_number(original, parameter) * factor;
    const bool is_beyond = parameter == SENSITIVITY_RESTITUTION && number > 1;
    *(double *)(void *)((char *)target + perturbation_numbers[parameter]) = is_beyond ? 1 : number;
    for (size_t i = 0; i < original->table.count; i++) {
        const ContactRow *row = &original->table.at[i];
        if (parameter == SENSITIVITY_RESTITUTION)
            target->table.at[i].restitution = fmin(1, row->restitution * factor);
        else if (parameter == SENSITIVITY_CONTACT_TIME)
            target->table.at[i].contact_time = row->contact_time * factor;
    }
}

void perturbation_apply(const Simulation *simulation, int parameter, double factor,
                        Simulation *target) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0; i < dampers->count; i++) {
        const Damper *from = &dampers->at[i];
        Damper *to = &target->scene.dampers.at[i];
        if (parameter == SENSITIVITY_MASS)
            to->mass = from->mass * factor;
        else if (parameter == SENSITIVITY_CLEARANCE)
            to->clearance = from->clearance * factor;
        for (size_t k = 0; k < BUFFERS && perturbation_is_of_buffer(parameter); k++)
            perturbation_scale(from, k, parameter, factor, to);
    }
}

size_t perturbation_buffers(const Simulation *simulation) {
    size_t count = 0;
    for (size_t i = 0; i < simulation->scene.dampers.count; i++)
        for (size_t k = 0; k < BUFFERS; k++)
            count += buffer_is_given(perturbation_buffer(&simulation->scene.dampers.at[i], k));
    return count;
}

// Log-normal, of mean 1 and relative deviation s.
static double perturbation_factor(double normal, double s) {
    const double variance = log1p(s * s);
    return exp(sqrt(variance) * normal - variance / 2);
}

// Draws the factors of one buffer, whose largest restitution is `max`.
static void perturbation_draw_factors(uint64_t seed, uint64_t run, size_t buffer, double max,
                                      const double deviation[2], double *restitution,
                                      double *contact_time) {
    for (uint64_t again = 0; again < DRAWS_MAX; again++) {
        double normal[2];
        philox_normal_pair(seed, STREAM + buffer, DRAWS_MAX * run + again, normal);
        *restitution = perturbation_factor(normal[0], deviation[0]);
        if (again == 0)
            *contact_time = perturbation_factor(normal[1], deviation[1]);
        if (!(max * *restitution > 1))
            return;
    }
    *restitution = 1 / max; // very rare: the restitution becomes 1
}

void perturbation_draw(const InputUncertainty *uncertainty, uint64_t seed,
                       const Simulation *simulation, uint64_t run, Simulation *target,
                       double *restitution, double *contact_time) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0, buffer = 0; i < dampers->count; i++)
        for (size_t k = 0; k < BUFFERS; k++) {
            const Damper *from = &dampers->at[i];
            Damper *to = &target->scene.dampers.at[i];
            if (!buffer_is_given(perturbation_buffer(from, k)))
                continue;
            double *const factors[] = {&restitution[buffer], &contact_time[buffer]};
            double deviation[2];
            for (int parameter = 0; parameter < 2; parameter++)
                deviation[parameter] =
                    uncertainty_find(uncertainty, i, (SensitivityBuffer)k, parameter);
            perturbation_draw_factors(
                seed, run, buffer,
                perturbation_buffer_max(perturbation_buffer(from, k), SENSITIVITY_RESTITUTION),
                deviation, factors[0], factors[1]);
            for (int parameter = 0; parameter < 2; parameter++)
                if (deviation[parameter] > 0)
                    perturbation_scale(from, k, parameter, *factors[parameter], to);
            buffer++;
        }
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
    const double common = uncertainty_common(uncertainty, parameter);
    if (!isnan(common))
        return common;
    for (size_t i = 0; i < uncertainty->spread.count; i++) {
        const InputDeviation *deviation = &uncertainty->spread.at[i];
        if (deviation->damper == damper + 1 && deviation->buffer == (int)buffer)
            return isnan(uncertainty_value(deviation, parameter))
                       ? 0
                       : uncertainty_value(deviation, parameter);
    }
    return 0;
}

bool uncertainty_exists(const InputUncertainty *uncertainty) {
    bool exists = uncertainty->restitution_deviation > 0 || uncertainty->contact_time_deviation > 0;
    for (size_t i = 0; i < uncertainty->spread.count; i++)
        exists = exists || uncertainty->spread.at[i].restitution > 0 ||
                 uncertainty->spread.at[i].contact_time > 0;
    return exists;
}

// The deviation recorded with a buffer's material, unless one is given for all; NAN: none.
static double uncertainty_find_recorded(const InputUncertainty *uncertainty,
                                        const Simulation *simulation, const Buffer *buffer,
                                        int parameter) {
    const double deviation = uncertainty_recorded(buffer, parameter);
    const bool is_used = buffer->material != NULL &&
                         isnan(uncertainty_common(uncertainty, parameter)) &&
                         perturbation_refuse(simulation, parameter) == NULL;
    return is_used && deviation > 0 ? deviation : (double)NAN;
}

static Status uncertainty_fill_recorded(InputUncertainty *uncertainty, const Simulation *simulation,
                                        Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    InputDeviations *spread = &uncertainty->spread;
    for (size_t i = 0; i < BUFFERS * dampers->count; i++) {
        const Buffer *buffer = perturbation_buffer(&dampers->at[i / BUFFERS], i % BUFFERS);
        const double e =
            uncertainty_find_recorded(uncertainty, simulation, buffer, SENSITIVITY_RESTITUTION);
        const double T =
            uncertainty_find_recorded(uncertainty, simulation, buffer, SENSITIVITY_CONTACT_TIME);
        if (isnan(e) && isnan(T))
            continue;
        InputDeviation *at = realloc(spread->at, (spread->count + 1) * sizeof *at);
        if (at == NULL)
            return study_no_memory(problem);
        spread->at = at;
        at[spread->count] = (InputDeviation){i / BUFFERS + 1, (int)(i % BUFFERS), NULL, e, T};
        TRY(study_copy_text(buffer->material, &at[spread->count++].source, problem));
    }
    return STATUS_OK;
}

enum { PLACE = sizeof((Fault){0}.pointer) };

static const char *uncertainty_place(char place[PLACE], size_t index, const char *member) {
    snprintf(place, PLACE, "/study/spread/%zu%s%s", index, member[0] != '\0' ? "/" : "", member);
    return place;
}

static Status uncertainty_check_number(const InputUncertainty *uncertainty,
                                       const Simulation *simulation, size_t index, int parameter,
                                       Problem *problem) {
    const InputDeviation *deviation = &uncertainty->spread.at[index];
    const double value = uncertainty_value(deviation, parameter);
    const char *why = perturbation_refuse(simulation, parameter);
    const char *name = sensitivity_parameter_names[parameter];
    char place[PLACE];
    (void)uncertainty_place(place, index, name);
    if (isnan(value))
        return STATUS_OK;
    if (value > 0 && why != NULL)
        return problem_add(problem, STATUS_INVALID, place, "must be left out: %s", why);
    if (!isnan(uncertainty_common(uncertainty, parameter)))
        return problem_add(problem, STATUS_INVALID, place,
                           "must be left out: %s_deviation gives it for all buffers", name);
    if (value <= 1)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, place,
                       "is %.3g of its value, as %.64s records, and must be at most 1 to be drawn "
                       "from: give %s_deviation",
                       value, deviation->source, name);
}

// A source that is named must be the buffer's material, and the numbers must be its own.
static Status uncertainty_check_source(const InputDeviation *deviation, const Buffer *buffer,
                                       size_t index, Problem *problem) {
    char place[PLACE];
    if (deviation->source == NULL)
        return STATUS_OK;
    if (buffer->material == NULL || strcmp(deviation->source, buffer->material) != 0)
        return problem_add(
            problem, STATUS_INVALID, uncertainty_place(place, index, "source"),
            "is not the material of that buffer: leave it out, or name its material and "
            "revision");
    for (int parameter = 0; parameter < 2; parameter++) {
        const double value = uncertainty_value(deviation, parameter),
                     recorded = uncertainty_recorded(buffer, parameter);
        if (!isnan(value) && value != recorded)
            return problem_add(
                problem, STATUS_INVALID,
                uncertainty_place(place, index, sensitivity_parameter_names[parameter]),
                "is %.6g, but %.80s records %.6g: leave out the source", value, deviation->source,
                recorded);
    }
    return STATUS_OK;
}

static Status uncertainty_check(const InputUncertainty *uncertainty, const Simulation *simulation,
                                size_t index, Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    const InputDeviation *deviation = &uncertainty->spread.at[index];
    char place[PLACE];
    if (deviation->damper > dampers->count)
        return problem_add(problem, STATUS_INVALID, uncertainty_place(place, index, "damper"),
                           "must be the number of a damper");
    const Buffer *buffer =
        perturbation_buffer(&dampers->at[deviation->damper - 1], (size_t)deviation->buffer);
    if (!buffer_is_given(buffer))
        return problem_add(problem, STATUS_INVALID, uncertainty_place(place, index, "buffer"),
                           "is not given: if both stops have the same it is \"buffer\", else "
                           "\"left_buffer\" and \"right_buffer\"");
    for (size_t i = 0; i < index; i++)
        if (uncertainty->spread.at[i].damper == deviation->damper &&
            uncertainty->spread.at[i].buffer == deviation->buffer)
            return problem_add(problem, STATUS_INVALID, uncertainty_place(place, index, ""),
                               "names the buffer of another entry: give one each");
    TRY(uncertainty_check_source(deviation, buffer, index, problem));
    const Status restitution =
        uncertainty_check_number(uncertainty, simulation, index, SENSITIVITY_RESTITUTION, problem);
    const Status contact_time =
        uncertainty_check_number(uncertainty, simulation, index, SENSITIVITY_CONTACT_TIME, problem);
    return restitution != STATUS_OK ? restitution : contact_time;
}

static int uncertainty_compare(const void *a, const void *b) {
    const InputDeviation *first = a, *second = b;
    if (first->damper != second->damper)
        return first->damper < second->damper ? -1 : 1;
    return (first->buffer > second->buffer) - (first->buffer < second->buffer);
}

// A number without any deviation in the list is exact.
static void uncertainty_fill_exact(InputUncertainty *uncertainty, int parameter, double *common) {
    for (size_t i = 0; i < uncertainty->spread.count; i++)
        if (!isnan(uncertainty_value(&uncertainty->spread.at[i], parameter)))
            return;
    if (isnan(*common))
        *common = 0;
}

Status uncertainty_complete(InputUncertainty *uncertainty, const Simulation *simulation,
                            Problem *problem) {
    InputDeviations *spread = &uncertainty->spread;
    Status status = STATUS_OK;
    if (spread->count == 0)
        TRY(uncertainty_fill_recorded(uncertainty, simulation, problem));
    for (size_t i = 0; i < spread->count; i++)
        if (uncertainty_check(uncertainty, simulation, i, problem) != STATUS_OK)
            status = STATUS_INVALID;
    TRY(status);
    if (spread->count > 1)
        qsort(spread->at, spread->count, sizeof *spread->at, uncertainty_compare);
    uncertainty_fill_exact(uncertainty, SENSITIVITY_RESTITUTION,
                           &uncertainty->restitution_deviation);
    uncertainty_fill_exact(uncertainty, SENSITIVITY_CONTACT_TIME,
                           &uncertainty->contact_time_deviation);
    return STATUS_OK;
}
