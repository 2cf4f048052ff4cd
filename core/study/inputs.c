// A number is the quantile of its distribution at a coordinate of a point in the unit cube. One
// that is out of its member's range is drawn again, from coordinates of its own.
#include "core/study/inputs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/math/student_t.h"
#include "core/study/sensitivity.h"

enum {
    POINTERS_MAX = 16,  // of one input
    MEMBERS_MAX = 4096, // of all numbers, rows of tables included
    DRAWS_MAX = 256,    // of one number
    PROBES = 64,        // of a distribution
    PROBES_WITHIN = 7,  // of these in range: fewer than a tenth cannot be drawn
};

static const char place_of_all[] = "/study/inputs";
static const char *const input_distribution_names[] = {"normal",     "lognormal", "uniform",
                                                       "triangular", "material",  NULL};

// clang-format off
const Field uncertain_input_fields[] = {
    FIELD_TEXT(UncertainInput, pointer, 200, PRESENCE_OPTIONAL, 0, "JSON Pointer to the real number that is uncertain, such as /dampers/0/clearance; of distribution material to a buffer"),
    FIELD_TEXTS(UncertainInput, pointers, NULL, NULL, POINTERS_MAX, PRESENCE_OPTIONAL, 0, "in place of pointer: several members that all get the same value"),
    FIELD_CHOICE(UncertainInput, distribution, input_distribution_names, REQUIRED, "normal: mean and deviation; lognormal: median and log_deviation; uniform: from and to; triangular: from, mode and to; material: e and T_c of a buffer, times log-normal factors of mean 1 and the relative deviations that its material records"),
    FIELD_REAL(UncertainInput, mean, NULL, ANY, OPTIONAL, "of normal"),
    FIELD_REAL(UncertainInput, deviation, NULL, ABOVE(0), OPTIONAL, "standard deviation of normal"),
    FIELD_REAL(UncertainInput, median, NULL, ABOVE(0), OPTIONAL, "of lognormal"),
    FIELD_REAL(UncertainInput, log_deviation, NULL, ABOVE(0), OPTIONAL, "of lognormal: standard deviation of the natural logarithm"),
    FIELD_REAL(UncertainInput, from, NULL, ANY, OPTIONAL, "smallest value of uniform or triangular"),
    FIELD_REAL(UncertainInput, mode, NULL, ANY, OPTIONAL, "most probable value of triangular"),
    FIELD_REAL(UncertainInput, to, NULL, ANY, OPTIONAL, "largest value of uniform or triangular"),
    FIELD_REAL(UncertainInput, restitution_deviation, NULL, WITHIN(0, 1), OPTIONAL, "of material: relative standard deviation of the restitution; if absent the recorded one, 0: exact"),
    FIELD_REAL(UncertainInput, contact_time_deviation, NULL, WITHIN(0, 1), OPTIONAL, "of material: likewise of the contact time"),
    FIELD_END
};
// clang-format on

// clang-format off
static const struct {
    const char *name;
    bool is_needed[INPUT_MATERIAL + 1], is_optional; // by InputDistribution
} input_parameters[] = {
    {"mean", {[INPUT_NORMAL] = true}, false},
    {"deviation", {[INPUT_NORMAL] = true}, false},
    {"median", {[INPUT_LOGNORMAL] = true}, false},
    {"log_deviation", {[INPUT_LOGNORMAL] = true}, false},
    {"from", {[INPUT_UNIFORM] = true, [INPUT_TRIANGULAR] = true}, false},
    {"mode", {[INPUT_TRIANGULAR] = true}, false},
    {"to", {[INPUT_UNIFORM] = true, [INPUT_TRIANGULAR] = true}, false},
    {"restitution_deviation", {[INPUT_MATERIAL] = true}, true},
    {"contact_time_deviation", {[INPUT_MATERIAL] = true}, true},
};
// clang-format on

static size_t uncertain_input_pointers(const UncertainInput *input) {
    return input->pointer != NULL ? 1 : input->pointers.count;
}

const char *uncertain_input_pointer(const UncertainInput *input, size_t index) {
    return input->pointer != NULL ? input->pointer : input->pointers.at[index];
}

static JsonPointer uncertain_input_place(const UncertainInput *input, size_t number, size_t index) {
    const JsonPointer own = json_pointer_at(place_of_all, number);
    return input->pointer != NULL ? json_pointer_of(own.at, "pointer")
                                  : json_pointer_at(json_pointer_of(own.at, "pointers").at, index);
}

static Status uncertain_input_check_parameters(const UncertainInput *input, size_t number,
                                               Problem *problem) {
    const JsonPointer own = json_pointer_at(place_of_all, number);
    const char *name = input_distribution_names[input->distribution];
    Status status = STATUS_OK;
    for (size_t i = 0; i < COUNT(input_parameters); i++) {
        const Field *field = fields_find(uncertain_input_fields, input_parameters[i].name, NULL);
        const bool is_given = !field_is_absent(field, input),
                   is_needed = input_parameters[i].is_needed[input->distribution];
        if (is_given && !is_needed)
            status = json_pointer_fault(problem, own.at, input_parameters[i].name,
                                        "must be left out: distribution %s does not have it", name);
        if (!is_given && is_needed && !input_parameters[i].is_optional)
            status = json_pointer_fault(problem, own.at, input_parameters[i].name,
                                        "is required by distribution %s", name);
    }
    if (input->from >= input->to)
        status = json_pointer_fault(problem, own.at, "to", "must be above from, %s",
                                    real_text(input->from).at);
    if (input->mode < input->from || input->mode > input->to)
        status = json_pointer_fault(problem, own.at, "mode", "must be within from and to");
    return status;
}

// Whether one pointer is the other or above it.
static bool uncertain_input_overlaps(const char *a, const char *b) {
    const size_t length = strlen(a) < strlen(b) ? strlen(a) : strlen(b);
    return strncmp(a, b, length) == 0 && (a[length] == '\0' || a[length] == '/') &&
           (b[length] == '\0' || b[length] == '/');
}

static Status uncertain_input_check_overlap(const UncertainInputs *inputs, size_t number,
                                            size_t index, Problem *problem) {
    const UncertainInput *input = &inputs->at[number];
    const char *pointer = uncertain_input_pointer(input, index);
    for (size_t i = 0; i <= number; i++)
        for (size_t k = 0; k < (i < number ? uncertain_input_pointers(&inputs->at[i]) : index); k++)
            if (uncertain_input_overlaps(uncertain_input_pointer(&inputs->at[i], k), pointer))
                return problem_add(problem, STATUS_INVALID,
                                   uncertain_input_place(input, number, index).at,
                                   "is also set by input %zu: give one input each", i);
    return STATUS_OK;
}

// The buffer that a pointer such as /dampers/0/left_buffer designates; NULL: none.
static const Buffer *uncertain_input_buffer(const char *pointer, const Simulation *simulation) {
    static const char before[] = "/dampers/";
    const Dampers *dampers = &simulation->scene.dampers;
    if (strncmp(pointer, before, sizeof before - 1) != 0)
        return NULL;
    char *end;
    const size_t number = strtoul(pointer + sizeof before - 1, &end, 10);
    if (number >= dampers->count)
        return NULL;
    const Damper *damper = &dampers->at[number];
    const Buffer *buffer = strcmp(end, "/buffer") == 0         ? &damper->buffer
                           : strcmp(end, "/left_buffer") == 0  ? damper_buffer(damper, SIDE_LEFT)
                           : strcmp(end, "/right_buffer") == 0 ? damper_buffer(damper, SIDE_RIGHT)
                                                               : NULL;
    return buffer != NULL && buffer_is_given(buffer) ? buffer : NULL;
}

// Of an input of distribution material.
static Status uncertain_input_check_buffer(const UncertainInput *input, size_t number, size_t index,
                                           const Simulation *simulation, Problem *problem) {
    const JsonPointer place = uncertain_input_place(input, number, index);
    const Buffer *buffer =
                     uncertain_input_buffer(uncertain_input_pointer(input, index), simulation),
                 *first = uncertain_input_buffer(uncertain_input_pointer(input, 0), simulation);
    if (buffer == NULL)
        return problem_add(problem, STATUS_INVALID, place.at,
                           "must designate a given buffer, as /dampers/0/buffer, for distribution "
                           "material");
    if (first != NULL && !text_same(first->material, buffer->material))
        return problem_add(problem, STATUS_INVALID, place.at,
                           "must have the material of the first one: give an input each");
    return STATUS_OK;
}

// Of other distributions. The spectra and histories of all runs must have the same shape, hence
// members of the scene's parts alone.
static Status uncertain_input_check_number(const UncertainInput *input, size_t number, size_t index,
                                           const Simulation *simulation, Problem *problem) {
    static const char *const parts[] = {"/structure/", "/dampers/", "/excitation/", "/contact/"};
    const JsonPointer place = uncertain_input_place(input, number, index);
    const char *pointer = uncertain_input_pointer(input, index);
    char why[JSON_POINTER_MESSAGE_MAX];
    bool is_tag, is_part = false;
    const Field *field = json_pointer_find(simulation_fields, simulation, pointer, &is_tag, why);
    if (field == NULL)
        return problem_add(problem, STATUS_INVALID, place.at, "%s", why);
    for (size_t i = 0; i < COUNT(parts); i++)
        is_part = is_part || strncmp(pointer, parts[i], strlen(parts[i])) == 0;
    if (!is_part)
        return problem_add(problem, STATUS_INVALID, place.at,
                           "must be below /structure, /dampers, /excitation or /contact");
    if (is_tag || (field->kind != FIELD_KIND_REAL && field->kind != FIELD_KIND_REALS &&
                   field->kind != FIELD_KIND_ROWS))
        return problem_add(
            problem, STATUS_INVALID, place.at, "must designate a real number%s",
            field->kind == FIELD_KIND_ITEM ? "; a buffer can have the distribution material" : "");
    return STATUS_OK;
}

static Status uncertain_input_check(const UncertainInputs *inputs, size_t number,
                                    const Simulation *simulation, Problem *problem) {
    const UncertainInput *input = &inputs->at[number];
    Status status = uncertain_input_check_parameters(input, number, problem);
    if ((input->pointer != NULL) == (input->pointers.count > 0))
        return problem_add(problem, STATUS_INVALID, json_pointer_at(place_of_all, number).at,
                           input->pointer != NULL
                               ? "has a pointer and pointers: leave one of them out"
                               : "needs a pointer, or pointers of tied members");
    for (size_t i = 0; i < uncertain_input_pointers(input); i++) {
        Status own = input->distribution == INPUT_MATERIAL
                         ? uncertain_input_check_buffer(input, number, i, simulation, problem)
                         : uncertain_input_check_number(input, number, i, simulation, problem);
        if (own == STATUS_OK)
            own = uncertain_input_check_overlap(inputs, number, i, problem);
        status = study_first_failure(status, own);
    }
    return status;
}

// Fills in the recorded deviations of a material; 0: exact, or not a number of this scene.
static Status uncertain_input_fill(UncertainInput *input, size_t number,
                                   const Simulation *simulation, Problem *problem) {
    const JsonPointer own = json_pointer_at(place_of_all, number);
    const Buffer *buffer = uncertain_input_buffer(uncertain_input_pointer(input, 0), simulation);
    static const char *const names[] = {"restitution_deviation", "contact_time_deviation"};
    double *const deviations[] = {&input->restitution_deviation, &input->contact_time_deviation};
    const double recorded[] = {buffer->test.restitution_deviation,
                               buffer->test.contact_time_deviation};
    for (int parameter = SENSITIVITY_RESTITUTION; parameter <= SENSITIVITY_CONTACT_TIME;
         parameter++) {
        double *deviation = deviations[parameter];
        const char *refused = perturbation_refuse(simulation, parameter);
        if (*deviation > 0 && refused != NULL)
            return json_pointer_fault(problem, own.at, names[parameter], "must be left out: %s",
                                      refused);
        if (isnan(*deviation))
            *deviation = recorded[parameter] > 0 && refused == NULL ? recorded[parameter] : 0;
        if (*deviation > 1)
            return json_pointer_fault_real(problem, own.at, names[parameter], *deviation, NULL,
                                           "is recorded by %.64s and must be at most 1 to be drawn "
                                           "from: give it",
                                           buffer->material);
    }
    if (*deviations[0] > 0 || *deviations[1] > 0)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, own.at,
                       "has no spread: %.64s records none of the restitution or contact time that "
                       "the scene uses; give restitution_deviation or contact_time_deviation, or "
                       "numbers with another distribution",
                       buffer->material != NULL ? buffer->material : "a buffer without a material");
}

static double input_normal(double u) {
    return copysign(student_t_quantile(fabs(2 * u - 1), 0), u - 0.5);
}

// The quantile of a number.
static double input_number_value(const InputNumber *number, double u) {
    const UncertainInput *input = number->input;
    const double width = input->to - input->from;
    switch (input->distribution) {
    case INPUT_NORMAL:
        return input->mean + input->deviation * input_normal(u);
    case INPUT_LOGNORMAL:
        return input->median * exp(input->log_deviation * input_normal(u));
    case INPUT_UNIFORM:
        return input->from + width * u;
    case INPUT_TRIANGULAR:
        return u * width < input->mode - input->from
                   ? input->from + sqrt(u * width * (input->mode - input->from))
                   : input->to - sqrt((1 - u) * width * (input->to - input->mode));
    default:
        return perturbation_factor(input_normal(u), number->deviation);
    }
}

static bool input_number_is_within(const InputNumber *number, double value) {
    const Range *range = &number->range;
    return isfinite(value) && value <= range->max &&
           (range->is_open_below ? value > range->min : value >= range->min);
}

// Whether enough of the distribution is in range; the value nearest to its median that is.
static bool input_number_probe(const InputNumber *number, double *middle) {
    size_t within = 0;
    for (size_t i = 0; i < PROBES; i++) { // outwards from the median
        const double off = ((double)(i / 2) + 0.5) / PROBES;
        const double value = input_number_value(number, i % 2 == 0 ? 0.5 - off : 0.5 + off);
        if (input_number_is_within(number, value) && within++ == 0)
            *middle = value;
    }
    return within >= PROBES_WITHIN;
}

static void input_number_limit(InputNumber *number, const Range *range) {
    Range *own = &number->range;
    if (range->min > own->min || (range->min == own->min && range->is_open_below)) {
        own->min = range->min;
        own->is_open_below = range->is_open_below;
    }
    own->max = fmin(own->max, range->max);
}

// Adds "pointer" or "pointer/name" to the members that the last number sets.
static Status input_model_add(InputModel *model, double base, const char *pointer,
                              const char *name) {
    if (model->axes.count == MEMBERS_MAX)
        return STATUS_LIMIT;
    StudyAxis *axis = list_grow(&model->axes, sizeof *axis);
    TRY(status_made(axis != NULL));
    *axis = (StudyAxis){
        .from = (double)NAN, .to = (double)NAN, .count = COUNT_ABSENT, .spacing = CHOICE_ABSENT};
    TRY(study_add_real(base, &model->bases));
    return text_copy(name != NULL ? json_pointer_of(pointer, name).at : pointer, &axis->pointer);
}

static InputNumber *input_model_add_number(InputModel *model, const UncertainInputs *inputs,
                                           size_t index) {
    InputNumber *number = &model->numbers[model->count++];
    *number = (InputNumber){.input = &inputs->at[index],
                            .index = index,
                            .deviation = (double)NAN,
                            .range = ANY,
                            .member = model->axes.count};
    return number;
}

// The factor of all e, or of all T_c, of the buffers of one input.
static Status input_model_add_factor(InputModel *model, const UncertainInputs *inputs, size_t index,
                                     const Simulation *simulation, int parameter) {
    const UncertainInput *input = &inputs->at[index];
    const bool is_restitution = parameter == SENSITIVITY_RESTITUTION;
    const char *name = sensitivity_parameter_names[parameter];
    InputNumber *number = input_model_add_number(model, inputs, index);
    double max = 0;
    number->deviation =
        is_restitution ? input->restitution_deviation : input->contact_time_deviation;
    for (size_t i = 0; i < uncertain_input_pointers(input); i++) {
        const char *pointer = uncertain_input_pointer(input, i);
        const Buffer *buffer = uncertain_input_buffer(pointer, simulation);
        const double own = is_restitution ? buffer->restitution : buffer->contact_time;
        if (!isnan(own))
            TRY(input_model_add(model, own, pointer, name));
        max = fmax(max, own);
        for (size_t k = 0; k < buffer->table.count; k++) {
            const ContactRow *row = &buffer->table.at[k];
            const double value = is_restitution ? row->restitution : row->contact_time;
            const JsonPointer rows = json_pointer_of(pointer, "table");
            if (!isnan(value))
                TRY(input_model_add(model, value, json_pointer_at(rows.at, k).at, name));
            max = fmax(max, value);
        }
    }
    number->range = (Range){0, is_restitution && max > 0 ? 1 / max : (double)INFINITY, true};
    return STATUS_OK;
}

static Status input_model_add_value(InputModel *model, const UncertainInputs *inputs, size_t index,
                                    const Simulation *simulation) {
    const UncertainInput *input = &inputs->at[index];
    InputNumber *number = input_model_add_number(model, inputs, index);
    for (size_t i = 0; i < uncertain_input_pointers(input); i++) {
        const char *pointer = uncertain_input_pointer(input, i);
        char why[JSON_POINTER_MESSAGE_MAX];
        bool is_tag;
        const Field *field =
            json_pointer_find(simulation_fields, simulation, pointer, &is_tag, why);
        if (i == 0)
            number->unit = field->unit;
        input_number_limit(number, &field->range);
        TRY(input_model_add(model, (double)NAN, pointer, NULL));
    }
    return STATUS_OK;
}

size_t uncertain_inputs_numbers(const UncertainInputs *inputs) {
    size_t count = 0;
    for (size_t i = 0; i < inputs->count; i++)
        count += inputs->at[i].distribution != INPUT_MATERIAL
                     ? 1
                     : (size_t)(inputs->at[i].restitution_deviation > 0) +
                           (size_t)(inputs->at[i].contact_time_deviation > 0);
    return count;
}

Status input_model_make(const UncertainInputs *inputs, const Simulation *simulation, int method,
                        uint64_t seed, size_t rows, size_t tables, InputModel *model) {
    *model = (InputModel){.count = 0};
    for (size_t i = 0; i < inputs->count; i++) {
        const UncertainInput *input = &inputs->at[i];
        if (input->distribution != INPUT_MATERIAL)
            TRY(input_model_add_value(model, inputs, i, simulation));
        if (input->restitution_deviation > 0)
            TRY(input_model_add_factor(model, inputs, i, simulation, SENSITIVITY_RESTITUTION));
        if (input->contact_time_deviation > 0)
            TRY(input_model_add_factor(model, inputs, i, simulation, SENSITIVITY_CONTACT_TIME));
    }
    return sampling_make(method, seed, rows, tables * model->count, &model->sampling);
}

void input_model_clear(InputModel *model) {
    for (size_t i = 0; i < model->axes.count; i++)
        free(model->axes.at[i].pointer);
    free(model->axes.at);
    free(model->bases.at);
    sampling_clear(&model->sampling);
    *model = (InputModel){.count = 0};
}

Status input_model_draw(const InputModel *model, size_t number, size_t row, size_t table,
                        double *value, uint64_t *again, Problem *problem) {
    const InputNumber *of = &model->numbers[number];
    const size_t dimension = number + table * model->count;
    *value = input_number_value(of, sampling_coordinate(&model->sampling, row, dimension));
    for (uint64_t i = 0; i < DRAWS_MAX; i++) {
        if (input_number_is_within(of, *value))
            return STATUS_OK;
        ++*again;
        *value = input_number_value(of, sampling_draw_again(&model->sampling, row, dimension, i));
    }
    return problem_add(problem, STATUS_INVALID, model->axes.at[of->member].pointer,
                       "is out of its range in all of %d draws", (int)DRAWS_MAX);
}

Status input_model_scene(const InputModel *model, const double *values, const Simulation *base,
                         const SimulationLimits *limits, Simulation *target, Problem *problem) {
    *target = (Simulation){0};
    StudyValue *all = calloc(model->axes.count + 1, sizeof *all);
    if (all == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    for (size_t i = 0; i < model->count; i++) {
        const size_t end = i + 1 < model->count ? model->numbers[i + 1].member : model->axes.count;
        for (size_t k = model->numbers[i].member; k < end; k++)
            all[k].number = isnan(model->bases.at[k]) ? values[i] : model->bases.at[k] * values[i];
    }
    const Status status =
        study_scene_make(base, &model->axes, all, NULL, false, limits, target, problem);
    free(all);
    return status;
}

// Each distribution must have its range, and their middle must be a scene.
static Status uncertain_inputs_probe(const InputModel *model, const Simulation *simulation,
                                     const SimulationLimits *limits, Problem *problem) {
    Status status = STATUS_OK;
    double values[INPUT_NUMBERS_MAX];
    for (size_t i = 0; i < model->count; i++) {
        const InputNumber *number = &model->numbers[i];
        const JsonPointer own = json_pointer_at(place_of_all, number->index);
        if (!input_number_probe(number, &values[i]))
            status = json_pointer_fault(
                problem, own.at, "distribution",
                "has too few values within the range of %s, %s %s to %s, to be drawn: at least a "
                "tenth must be",
                model->axes.at[number->member].pointer, number->range.is_open_below ? "above" : "",
                real_text(number->range.min).at, real_text(number->range.max).at);
    }
    TRY(status);
    Problem own;
    Simulation scene;
    problem_clear(&own);
    status = input_model_scene(model, values, simulation, limits, &scene, &own);
    simulation_clear(&scene);
    if (status != STATUS_INVALID)
        return status == STATUS_OK ? status : problem_add(problem, status, "", "%s", own.detail);
    return problem_add(problem, status, place_of_all,
                       "give no valid scene at the middle of their ranges: %.80s %.200s",
                       own.faults[0].pointer, own.faults[0].detail);
}

Status uncertain_inputs_complete(UncertainInputs *inputs, const Simulation *simulation,
                                 const SimulationLimits *limits, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < inputs->count; i++)
        status = study_first_failure(status, uncertain_input_check(inputs, i, simulation, problem));
    TRY(status);
    for (size_t i = 0; i < inputs->count; i++)
        if (inputs->at[i].distribution == INPUT_MATERIAL)
            status = study_first_failure(
                status, uncertain_input_fill(&inputs->at[i], i, simulation, problem));
    TRY(status);
    InputModel model;
    status = input_model_make(inputs, simulation, SAMPLING_RANDOM, 1, 1, 1, &model);
    if (status == STATUS_OK)
        status = uncertain_inputs_probe(&model, simulation, limits, problem);
    input_model_clear(&model);
    return status != STATUS_LIMIT
               ? status
               : problem_add(problem, STATUS_INVALID, place_of_all,
                             "set more than %d numbers: name fewer buffers with tables",
                             (int)MEMBERS_MAX);
}
