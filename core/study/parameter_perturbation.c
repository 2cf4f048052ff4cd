// Every change begins at the scene's own numbers, so that no change leaves a trace in the next.
// Each of the two deviations is given once for all buffers or told buffer by buffer, never both. A
// completed study says which: an absent number means the list.
#include "core/study/parameter_perturbation.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"

enum { DRAWS = 64, STREAM = 0x53454e53 };

const char *const sensitivity_parameter_names[] = {
    "restitution", "contact_time", "stiffness", "damping", "mass", "clearance", NULL};

enum { BUFFERS = 3, NUMBERS = 4 };
static const size_t buffers[BUFFERS] = {offsetof(Damper, buffer), offsetof(Damper, left_buffer),
                                        offsetof(Damper, right_buffer)};
static const size_t numbers[NUMBERS] = {
    [SENSITIVITY_RESTITUTION] = offsetof(Buffer, restitution),
    [SENSITIVITY_CONTACT_TIME] = offsetof(Buffer, contact_time),
    [SENSITIVITY_STIFFNESS] = offsetof(Buffer, stiffness),
    [SENSITIVITY_DAMPING] = offsetof(Buffer, damping),
};

static const Buffer *perturbation_buffer(const Damper *damper, size_t index) {
    return (const Buffer *)(const void *)((const char *)damper + buffers[index]);
}

static Buffer *perturbation_own_buffer(Damper *damper, size_t index) {
    return (Buffer *)(void *)((char *)damper + buffers[index]);
}

static double perturbation_number(const Buffer *buffer, int parameter) {
    return *(const double *)(const void *)((const char *)buffer + numbers[parameter]);
}

static double perturbation_row_number(const ContactRow *row, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION    ? row->restitution
           : parameter == SENSITIVITY_CONTACT_TIME ? row->contact_time
                                                   : (double)NAN;
}

// The largest of what a buffer has of a parameter; NAN: nothing.
static double perturbation_largest_of(const Buffer *buffer, int parameter) {
    double largest = perturbation_number(buffer, parameter);
    for (size_t i = 0; i < buffer->table.count; i++)
        largest = fmax(largest, perturbation_row_number(&buffer->table.at[i], parameter));
    return largest;
}

static bool perturbation_is_of_buffer(int parameter) {
    return parameter < SENSITIVITY_MASS;
}

// The largest of what the scene has of a parameter; NAN: nothing.
static double perturbation_largest(const Simulation *simulation, int parameter) {
    const Dampers *dampers = &simulation->scene.dampers;
    double most = (double)NAN;
    for (size_t i = 0; i < dampers->count; i++) {
        if (parameter == SENSITIVITY_MASS)
            most = fmax(most, dampers->at[i].mass);
        else if (parameter == SENSITIVITY_CLEARANCE)
            most = fmax(most, dampers->at[i].clearance);
        for (size_t k = 0; k < BUFFERS && perturbation_is_of_buffer(parameter); k++)
            most = fmax(
                most, perturbation_largest_of(perturbation_buffer(&dampers->at[i], k), parameter));
    }
    return most;
}

const char *perturbation_refuse(const Simulation *simulation, int parameter) {
    const Contact *contact = scene_contact(&simulation->scene);
    const ContactLaw *law = dampers_contact_law(&simulation->scene.dampers, contact);
    const double most = perturbation_largest(simulation, parameter);
    if (isnan(most))
        return "no buffer of the scene has it, or the contact model does not use it";
    if (!(most > 0))
        return "it is 0: a relative change is none";
    // A law that gives all energy back has e = 1 and no other.
    if (parameter == SENSITIVITY_RESTITUTION && law->form == CONTACT_POWER && law->factor == NULL)
        return "the contact model gives all energy back";
    if (parameter == SENSITIVITY_CLEARANCE)
        for (size_t i = 0; i < simulation->scene.dampers.count; i++)
            if (fabs(simulation->scene.dampers.at[i].position) * 2 * (1 + 1e-9) >=
                simulation->scene.dampers.at[i].clearance)
                return "a free mass starts at a stop, which a smaller one would move past it";
    return NULL;
}

double perturbation_max_step(const Simulation *simulation, int parameter, double step) {
    return parameter == SENSITIVITY_RESTITUTION
               ? fmax(0, fmin(step, 1 / perturbation_largest(simulation, parameter) - 1))
               : step;
}

static void perturbation_scale(const Buffer *from, int parameter, double factor, Buffer *to) {
    const double number = perturbation_number(from, parameter) * factor;
    const bool is_beyond = parameter == SENSITIVITY_RESTITUTION && number > 1;
    *(double *)(void *)((char *)to + numbers[parameter]) = is_beyond ? 1 : number;
    for (size_t i = 0; i < from->table.count; i++) {
        if (parameter == SENSITIVITY_RESTITUTION)
            to->table.at[i].restitution = fmin(1, from->table.at[i].restitution * factor);
        else if (parameter == SENSITIVITY_CONTACT_TIME)
            to->table.at[i].contact_time = from->table.at[i].contact_time * factor;
    }
}

void perturbation_apply(const Simulation *simulation, int parameter, double factor,
                        Simulation *member) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0; i < dampers->count; i++) {
        const Damper *from = &dampers->at[i];
        Damper *to = &member->scene.dampers.at[i];
        if (parameter == SENSITIVITY_MASS)
            to->mass = from->mass * factor;
        else if (parameter == SENSITIVITY_CLEARANCE)
            to->clearance = from->clearance * factor;
        for (size_t k = 0; k < BUFFERS && perturbation_is_of_buffer(parameter); k++)
            perturbation_scale(perturbation_buffer(from, k), parameter, factor,
                               perturbation_own_buffer(to, k));
    }
}

size_t perturbation_buffers(const Simulation *simulation) {
    size_t count = 0;
    for (size_t i = 0; i < simulation->scene.dampers.count; i++)
        for (size_t k = 0; k < BUFFERS; k++)
            count += buffer_is_given(perturbation_buffer(&simulation->scene.dampers.at[i], k));
    return count;
}

// Of mean 1 and relative deviation s.
static double perturbation_factor(double normal, double s) {
    const double variance = log1p(s * s);
    return exp(sqrt(variance) * normal - variance / 2);
}

// Relative standard deviations of one buffer: of e and T_c.
typedef struct BufferDeviation {
    double restitution, contact_time;
} BufferDeviation;

static void perturbation_draw_buffer(uint64_t seed, const BufferDeviation *spread,
                                     const Buffer *from, uint64_t run, size_t buffer,
                                     double *restitution, double *contact_time) {
    const double most = perturbation_largest_of(from, SENSITIVITY_RESTITUTION);
    for (uint64_t again = 0; again < DRAWS; again++) {
        double normal[2];
        noise_normal_pair(seed, STREAM + buffer, DRAWS * run + again, normal);
        *restitution = perturbation_factor(normal[0], spread->restitution);
        if (again == 0)
            *contact_time = perturbation_factor(normal[1], spread->contact_time);
        if (!(most * *restitution > 1))
            return;
    }
    *restitution = 1 / most; // hardly ever: e is 1 then
}

void perturbation_draw(const SensitivityStudy *study, const Simulation *simulation, uint64_t run,
                       Simulation *member, double *restitution, double *contact_time) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0, buffer = 0; i < dampers->count; i++)
        for (size_t k = 0; k < BUFFERS; k++) {
            const Buffer *from = perturbation_buffer(&dampers->at[i], k);
            Buffer *to = perturbation_own_buffer(&member->scene.dampers.at[i], k);
            if (!buffer_is_given(from))
                continue;
            const BufferDeviation spread = {
                deviation_find(study, i, (SensitivityBuffer)k, SENSITIVITY_RESTITUTION),
                deviation_find(study, i, (SensitivityBuffer)k, SENSITIVITY_CONTACT_TIME)};
            perturbation_draw_buffer(study->seed, &spread, from, run, buffer, &restitution[buffer],
                                     &contact_time[buffer]);
            if (spread.restitution > 0)
                perturbation_scale(from, SENSITIVITY_RESTITUTION, restitution[buffer], to);
            if (spread.contact_time > 0)
                perturbation_scale(from, SENSITIVITY_CONTACT_TIME, contact_time[buffer], to);
            buffer++;
        }
}

static double deviation_value(const SensitivitySpread *spread, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? spread->restitution : spread->contact_time;
}

static const char *deviation_name(int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? "restitution" : "contact_time";
}

static double *deviation_common(SensitivityStudy *study, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? &study->restitution_deviation
                                                : &study->contact_time_deviation;
}

double deviation_find(const SensitivityStudy *study, size_t damper, SensitivityBuffer buffer,
                      int parameter) {
    const double given = parameter == SENSITIVITY_RESTITUTION ? study->restitution_deviation
                                                              : study->contact_time_deviation;
    if (!isnan(given))
        return given;
    for (size_t i = 0; i < study->spread.count; i++) {
        const SensitivitySpread *spread = &study->spread.at[i];
        const double told = deviation_value(spread, parameter);
        if (spread->damper == damper + 1 && spread->buffer == (int)buffer)
            return isnan(told) ? 0 : told;
    }
    return 0;
}

bool deviations_exist(const SensitivityStudy *study) {
    bool is_there = study->restitution_deviation > 0 || study->contact_time_deviation > 0;
    for (size_t i = 0; i < study->spread.count; i++)
        is_there =
            is_there || study->spread.at[i].restitution > 0 || study->spread.at[i].contact_time > 0;
    return is_there;
}

static double deviation_recorded(const Buffer *buffer, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? buffer->test.restitution_deviation
                                                : buffer->test.contact_time_deviation;
}

// What a buffer's material tells, where the study does not say it for all; NAN: nothing.
static double deviation_find_recorded(SensitivityStudy *study, const Simulation *simulation,
                                      const Buffer *buffer, int parameter) {
    const double deviation = deviation_recorded(buffer, parameter);
    const bool is_used = buffer->material != NULL && isnan(*deviation_common(study, parameter)) &&
                         perturbation_refuse(simulation, parameter) == NULL;
    return is_used && deviation > 0 ? deviation : (double)NAN;
}

static Status deviation_fill_recorded(SensitivityStudy *study, const Simulation *simulation,
                                      Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    SensitivitySpreads *spreads = &study->spread;
    spreads->at = calloc(BUFFERS * dampers->count, sizeof *spreads->at);
    if (spreads->at == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    for (size_t i = 0; i < BUFFERS * dampers->count; i++) {
        const Buffer *buffer = perturbation_buffer(&dampers->at[i / BUFFERS], i % BUFFERS);
        const double e =
            deviation_find_recorded(study, simulation, buffer, SENSITIVITY_RESTITUTION);
        const double T =
            deviation_find_recorded(study, simulation, buffer, SENSITIVITY_CONTACT_TIME);
        if (isnan(e) && isnan(T))
            continue;
        SensitivitySpread *spread = &spreads->at[spreads->count++];
        *spread = (SensitivitySpread){.damper = i / BUFFERS + 1,
                                      .buffer = (int)(i % BUFFERS),
                                      .source = strdup(buffer->material),
                                      .restitution = e,
                                      .contact_time = T};
        if (spread->source == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    }
    if (spreads->count == 0) {
        free(spreads->at);
        spreads->at = NULL;
    }
    return STATUS_OK;
}

static Status deviation_refuse(size_t index, const char *member, const char *detail,
                               Problem *problem) {
    char place[sizeof((Fault){0}.pointer)];
    snprintf(place, sizeof place, "/study/spread/%zu%s%s", index, member[0] != '\0' ? "/" : "",
             member);
    return problem_add(problem, STATUS_INVALID, place, "%s", detail);
}

static Status deviation_check_number(const SensitivityStudy *study, const Simulation *simulation,
                                     size_t index, int parameter, Problem *problem) {
    const double told = deviation_value(&study->spread.at[index], parameter);
    const double given = parameter == SENSITIVITY_RESTITUTION ? study->restitution_deviation
                                                              : study->contact_time_deviation;
    const char *why = perturbation_refuse(simulation, parameter);
    char detail[256];
    if (isnan(told))
        return STATUS_OK;
    if (told > 0 && why != NULL) {
        snprintf(detail, sizeof detail, "must be left out: %s", why);
        return deviation_refuse(index, deviation_name(parameter), detail, problem);
    }
    if (!isnan(given)) {
        snprintf(detail, sizeof detail, "must be left out: %s_deviation says it for all buffers",
                 deviation_name(parameter));
        return deviation_refuse(index, deviation_name(parameter), detail, problem);
    }
    if (told <= 1)
        return STATUS_OK;
    snprintf(detail, sizeof detail,
             "is %.3g of its value, as %.64s tells, and must be at most 1 to be drawn from: give "
             "%s_deviation",
             told, study->spread.at[index].source, deviation_name(parameter));
    return deviation_refuse(index, deviation_name(parameter), detail, problem);
}

// Who names a source says what that tells.
static Status deviation_check_source(const SensitivitySpread *spread, const Buffer *buffer,
                                     size_t index, Problem *problem) {
    char detail[256];
    if (spread->source == NULL)
        return STATUS_OK;
    if (buffer->material == NULL || strcmp(spread->source, buffer->material) != 0)
        return deviation_refuse(
            index, "source",
            "is not what stands at that buffer: leave it out, or name its material and "
            "revision",
            problem);
    for (int parameter = SENSITIVITY_RESTITUTION; parameter <= SENSITIVITY_CONTACT_TIME;
         parameter++) {
        const double told = deviation_value(spread, parameter),
                     known = deviation_recorded(buffer, parameter);
        if (isnan(told) || told == known)
            continue;
        snprintf(detail, sizeof detail, "is %.6g, but %.80s tells %.6g: leave out the source", told,
                 spread->source, known);
        return deviation_refuse(index, deviation_name(parameter), detail, problem);
    }
    return STATUS_OK;
}

static Status deviation_check(const SensitivityStudy *study, const Simulation *simulation,
                              size_t index, Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    const SensitivitySpread *spread = &study->spread.at[index];
    if (spread->damper > dampers->count)
        return deviation_refuse(index, "damper", "is the number of no damper", problem);
    const Buffer *buffer =
        perturbation_buffer(&dampers->at[spread->damper - 1], (size_t)spread->buffer);
    if (!buffer_is_given(buffer))
        return deviation_refuse(
            index, "buffer",
            "stands at no stop: where both have the same it is \"buffer\", else "
            "\"left_buffer\" and \"right_buffer\"",
            problem);
    for (size_t i = 0; i < index; i++)
        if (study->spread.at[i].damper == spread->damper &&
            study->spread.at[i].buffer == spread->buffer)
            return deviation_refuse(index, "", "is of the same buffer as another: one each",
                                    problem);
    TRY(deviation_check_source(spread, buffer, index, problem));
    const Status first =
        deviation_check_number(study, simulation, index, SENSITIVITY_RESTITUTION, problem);
    const Status second =
        deviation_check_number(study, simulation, index, SENSITIVITY_CONTACT_TIME, problem);
    return first != STATUS_OK ? first : second;
}

static int deviation_compare(const void *a, const void *b) {
    const SensitivitySpread *first = a, *second = b;
    if (first->damper != second->damper)
        return first->damper < second->damper ? -1 : 1;
    return (first->buffer > second->buffer) - (first->buffer < second->buffer);
}

// A list that tells nothing of one of them leaves that sure.
static void deviation_set_certain(SensitivityStudy *study, int parameter) {
    double *given = deviation_common(study, parameter);
    for (size_t i = 0; i < study->spread.count; i++)
        if (!isnan(deviation_value(&study->spread.at[i], parameter)))
            return;
    if (isnan(*given))
        *given = 0;
}

Status deviations_complete(SensitivityStudy *study, const Simulation *simulation,
                           Problem *problem) {
    SensitivitySpreads *spreads = &study->spread;
    Status status = STATUS_OK;
    if (spreads->count == 0)
        TRY(deviation_fill_recorded(study, simulation, problem));
    for (size_t i = 0; i < spreads->count; i++)
        if (deviation_check(study, simulation, i, problem) != STATUS_OK)
            status = STATUS_INVALID;
    TRY(status);
    if (spreads->count > 1)
        qsort(spreads->at, spreads->count, sizeof *spreads->at, deviation_compare);
    deviation_set_certain(study, SENSITIVITY_RESTITUTION);
    deviation_set_certain(study, SENSITIVITY_CONTACT_TIME);
    return STATUS_OK;
}
