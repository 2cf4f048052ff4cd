// Each of the two deviations is given once for all buffers or told buffer by buffer, never both. A
// completed study says which: an absent number means the list.
#include "core/study/input_uncertainty.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/parameter_perturbation.h"

enum { BUFFERS = 3 };

static const Buffer *buffer_of(const Damper *damper, size_t index) {
    const Buffer *const buffers[BUFFERS] = {&damper->buffer, &damper->left_buffer,
                                            &damper->right_buffer};
    return buffers[index];
}

static double told_of(const SensitivitySpread *spread, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? spread->restitution : spread->contact_time;
}

static const char *name_of(int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? "restitution" : "contact_time";
}

static double *given_of(SensitivityStudy *study, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? &study->restitution_deviation
                                                : &study->contact_time_deviation;
}

double spread_of(const SensitivityStudy *study, size_t damper, SensitivityBuffer buffer,
                 int parameter) {
    const double given = parameter == SENSITIVITY_RESTITUTION ? study->restitution_deviation
                                                              : study->contact_time_deviation;
    if (!isnan(given))
        return given;
    for (size_t i = 0; i < study->spread.count; i++) {
        const SensitivitySpread *spread = &study->spread.at[i];
        const double told = told_of(spread, parameter);
        if (spread->damper == damper + 1 && spread->buffer == (int)buffer)
            return isnan(told) ? 0 : told;
    }
    return 0;
}

bool spread_is_there(const SensitivityStudy *study) {
    bool is_there = study->restitution_deviation > 0 || study->contact_time_deviation > 0;
    for (size_t i = 0; i < study->spread.count; i++)
        is_there =
            is_there || study->spread.at[i].restitution > 0 || study->spread.at[i].contact_time > 0;
    return is_there;
}

static double recorded(const Buffer *buffer, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? buffer->test.restitution_deviation
                                                : buffer->test.contact_time_deviation;
}

// What a buffer's material tells, where the study does not say it for all; NAN: nothing.
static double find_recorded(SensitivityStudy *study, const Simulation *simulation,
                            const Buffer *buffer, int parameter) {
    const double deviation = recorded(buffer, parameter);
    const bool is_used = buffer->material != NULL && isnan(*given_of(study, parameter)) &&
                         change_refuse(simulation, parameter) == NULL;
    return is_used && deviation > 0 ? deviation : (double)NAN;
}

static Status take_recorded(SensitivityStudy *study, const Simulation *simulation,
                            Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    SensitivitySpreads *spreads = &study->spread;
    spreads->at = calloc(BUFFERS * dampers->count, sizeof *spreads->at);
    if (spreads->at == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    for (size_t i = 0; i < BUFFERS * dampers->count; i++) {
        const Buffer *buffer = buffer_of(&dampers->at[i / BUFFERS], i % BUFFERS);
        const double e = find_recorded(study, simulation, buffer, SENSITIVITY_RESTITUTION);
        const double T = find_recorded(study, simulation, buffer, SENSITIVITY_CONTACT_TIME);
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

static Status refuse(size_t index, const char *member, const char *detail, Problem *problem) {
    char place[sizeof((Fault){0}.pointer)];
    snprintf(place, sizeof place, "/study/spread/%zu%s%s", index, member[0] != '\0' ? "/" : "",
             member);
    return problem_add(problem, STATUS_INVALID, place, "%s", detail);
}

static Status check_number(const SensitivityStudy *study, const Simulation *simulation,
                           size_t index, int parameter, Problem *problem) {
    const double told = told_of(&study->spread.at[index], parameter);
    const double given = parameter == SENSITIVITY_RESTITUTION ? study->restitution_deviation
                                                              : study->contact_time_deviation;
    const char *why = change_refuse(simulation, parameter);
    char detail[256];
    if (isnan(told))
        return STATUS_OK;
    if (told > 0 && why != NULL) {
        snprintf(detail, sizeof detail, "must be left out: %s", why);
        return refuse(index, name_of(parameter), detail, problem);
    }
    if (!isnan(given)) {
        snprintf(detail, sizeof detail, "must be left out: %s_deviation says it for all buffers",
                 name_of(parameter));
        return refuse(index, name_of(parameter), detail, problem);
    }
    if (told <= 1)
        return STATUS_OK;
    snprintf(detail, sizeof detail,
             "is %.3g of its value, as %.64s tells, and must be at most 1 to be drawn from: give "
             "%s_deviation",
             told, study->spread.at[index].source, name_of(parameter));
    return refuse(index, name_of(parameter), detail, problem);
}

// Who names a source says what that tells.
static Status check_source(const SensitivitySpread *spread, const Buffer *buffer, size_t index,
                           Problem *problem) {
    char detail[256];
    if (spread->source == NULL)
        return STATUS_OK;
    if (buffer->material == NULL || strcmp(spread->source, buffer->material) != 0)
        return refuse(index, "source",
                      "is not what stands at that buffer: leave it out, or name its material and "
                      "revision",
                      problem);
    for (int parameter = SENSITIVITY_RESTITUTION; parameter <= SENSITIVITY_CONTACT_TIME;
         parameter++) {
        const double told = told_of(spread, parameter), known = recorded(buffer, parameter);
        if (isnan(told) || told == known)
            continue;
        snprintf(detail, sizeof detail, "is %.6g, but %.80s tells %.6g: leave out the source", told,
                 spread->source, known);
        return refuse(index, name_of(parameter), detail, problem);
    }
    return STATUS_OK;
}

static Status check_spread(const SensitivityStudy *study, const Simulation *simulation,
                           size_t index, Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    const SensitivitySpread *spread = &study->spread.at[index];
    if (spread->damper > dampers->count)
        return refuse(index, "damper", "is the number of no damper", problem);
    const Buffer *buffer = buffer_of(&dampers->at[spread->damper - 1], (size_t)spread->buffer);
    if (!buffer_is_given(buffer))
        return refuse(index, "buffer",
                      "stands at no stop: where both have the same it is \"buffer\", else "
                      "\"left_buffer\" and \"right_buffer\"",
                      problem);
    for (size_t i = 0; i < index; i++)
        if (study->spread.at[i].damper == spread->damper &&
            study->spread.at[i].buffer == spread->buffer)
            return refuse(index, "", "is of the same buffer as another: one each", problem);
    TRY(check_source(spread, buffer, index, problem));
    const Status first = check_number(study, simulation, index, SENSITIVITY_RESTITUTION, problem);
    const Status second = check_number(study, simulation, index, SENSITIVITY_CONTACT_TIME, problem);
    return first != STATUS_OK ? first : second;
}

static int by_place(const void *a, const void *b) {
    const SensitivitySpread *first = a, *second = b;
    if (first->damper != second->damper)
        return first->damper < second->damper ? -1 : 1;
    return (first->buffer > second->buffer) - (first->buffer < second->buffer);
}

// A list that tells nothing of one of them leaves that sure.
static void settle(SensitivityStudy *study, int parameter) {
    double *given = given_of(study, parameter);
    for (size_t i = 0; i < study->spread.count; i++)
        if (!isnan(told_of(&study->spread.at[i], parameter)))
            return;
    if (isnan(*given))
        *given = 0;
}

Status spread_complete(SensitivityStudy *study, const Simulation *simulation, Problem *problem) {
    SensitivitySpreads *spreads = &study->spread;
    Status status = STATUS_OK;
    if (spreads->count == 0)
        TRY(take_recorded(study, simulation, problem));
    for (size_t i = 0; i < spreads->count; i++)
        if (check_spread(study, simulation, i, problem) != STATUS_OK)
            status = STATUS_INVALID;
    TRY(status);
    if (spreads->count > 1)
        qsort(spreads->at, spreads->count, sizeof *spreads->at, by_place);
    settle(study, SENSITIVITY_RESTITUTION);
    settle(study, SENSITIVITY_CONTACT_TIME);
    return STATUS_OK;
}
