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
    POINTERS_MAX = 16, // of one input
    DRAWS_MAX = 64,    // of one number
    PARAMETERS = 9,    // of all distributions
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

// Rows of the parameters that each distribution has, from its first.
static const struct {
    const char *first;
    size_t count;
} input_parameters[] = {
    [INPUT_NORMAL] = {"mean", 2},
    [INPUT_LOGNORMAL] = {"median", 2},
    [INPUT_UNIFORM] = {"from", 3}, // without the mode
    [INPUT_TRIANGULAR] = {"from", 3},
    [INPUT_MATERIAL] = {"restitution_deviation", 2}, // both are optional
};

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
    const Field *all = fields_find(uncertain_input_fields, "mean", NULL),
                *first = fields_find(uncertain_input_fields,
                                     input_parameters[input->distribution].first, NULL);
    Status status = STATUS_OK;
    for (const Field *field = all; field < all + PARAMETERS; field++) {
        const bool is_given = !field_is_absent(field, input),
                   is_own = field >= first &&
                            field < first + input_parameters[input->distribution].count &&
                            !(input->distribution == INPUT_UNIFORM && field == first + 1);
        if (is_given != is_own && (is_given || input->distribution != INPUT_MATERIAL))
            status =
                json_pointer_fault(problem, own.at, field->name, "%s by distribution %s",
                                   is_given ? "must be left out: it is not used" : "is required",
                                   input_distribution_names[input->distribution]);
    }
    if (input->from >= input->to)
        status = json_pointer_fault(problem, own.at, "to", "must be above from, %s",
                                    real_text(input->from).at);
    if (input->mode < input->from || input->mode > input->to)
        status = json_pointer_fault(problem, own.at, "mode", "must be within from and to");
    return status;
}

static Status uncertain_input_check_overlap(const UncertainInputs *inputs, size_t number,
                                            size_t index, Problem *problem) {
    const UncertainInput *input = &inputs->at[number];
    const char *pointer = uncertain_input_pointer(input, index);
    for (size_t i = 0; i <= number; i++)
        for (size_t k = 0; k < (i < number ? uncertain_input_pointers(&inputs->at[i]) : index); k++)
            if (json_pointer_overlaps(uncertain_input_pointer(&inputs->at[i], k), pointer))
                return problem_add(problem, STATUS_INVALID,
                                   uncertain_input_place(input, number, index).at,
                                   "is also set by input %zu: give one input each", i);
    return STATUS_OK;
}

// The given buffer that a pointer such as /dampers/0/left_buffer designates; NULL: none. Its place
// is for perturbation_scale.
static const Buffer *uncertain_input_buffer(const char *pointer, const Simulation *simulation,
                                            size_t *damper, size_t *place) {
    static const char before[] = "/dampers/";
    static const char *const names[] = {"/buffer", "/left_buffer", "/right_buffer"};
    char *end;
    if (strncmp(pointer, before, sizeof before - 1) != 0)
        return NULL;
    *damper = strtoul(pointer + sizeof before - 1, &end, 10);
    for (*place = 0; *place < COUNT(names); ++*place)
        if (*damper < simulation->scene.dampers.count && strcmp(end, names[*place]) == 0) {
            const Buffer *buffer =
                perturbation_buffer(&simulation->scene.dampers.at[*damper], *place);
            return buffer_is_given(buffer) ? buffer : NULL;
        }
    return NULL;
}

// Of an input of distribution material.
static Status uncertain_input_check_buffer(const UncertainInput *input, size_t number, size_t index,
                                           const Simulation *simulation, Problem *problem) {
    const JsonPointer place = uncertain_input_place(input, number, index);
    size_t at[2];
    const Buffer *buffer = uncertain_input_buffer(uncertain_input_pointer(input, index), simulation,
                                                  &at[0], &at[1]),
                 *first = uncertain_input_buffer(uncertain_input_pointer(input, 0), simulation,
                                                 &at[0], &at[1]);
    if (buffer == NULL)
        return problem_add(problem, STATUS_INVALID, place.at,
                           "must designate a given buffer for distribution material: "
                           "/dampers/0/buffer where both stops have the same");
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
    static const char *const names[] = {"restitution_deviation", "contact_time_deviation"};
    const JsonPointer own = json_pointer_at(place_of_all, number);
    size_t at[2];
    const Buffer *buffer =
        uncertain_input_buffer(uncertain_input_pointer(input, 0), simulation, &at[0], &at[1]);
    double *const deviations[] = {&input->restitution_deviation, &input->contact_time_deviation};
    const double recorded[] = {buffer->test.restitution_deviation,
                               buffer->test.contact_time_deviation};
    for (int i = SENSITIVITY_RESTITUTION; i <= SENSITIVITY_CONTACT_TIME; i++) {
        const char *refused = perturbation_refuse(simulation, i);
        if (*deviations[i] > 0 && refused != NULL)
            return json_pointer_fault(problem, own.at, names[i], "must be left out: %s", refused);
        if (isnan(*deviations[i]))
            *deviations[i] = recorded[i] > 0 && refused == NULL ? recorded[i] : 0;
        if (*deviations[i] > 1)
            return json_pointer_fault_real(problem, own.at, names[i], *deviations[i], NULL,
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
        return perturbation_factor(input_normal(u), number->parameter == SENSITIVITY_RESTITUTION
                                                        ? input->restitution_deviation
                                                        : input->contact_time_deviation);
    }
}

static bool input_number_is_within(const InputNumber *number, double value) {
    const Range *range = &number->range;
    return isfinite(value) && value <= range->max &&
           (range->is_open_below ? value > range->min : value >= range->min);
}

static void input_number_limit(InputNumber *number, const Range *range) {
    Range *own = &number->range;
    if (range->min > own->min || (range->min == own->min && range->is_open_below)) {
        own->min = range->min;
        own->is_open_below = range->is_open_below;
    }
    own->max = fmin(own->max, range->max);
}

static void input_model_add_value(InputModel *model, InputNumber *number,
                                  const Simulation *simulation) {
    const UncertainInput *input = number->input;
    for (size_t i = uncertain_input_pointers(input); i-- > 0;) {
        char why[JSON_POINTER_MESSAGE_MAX];
        bool is_tag;
        const Field *field = json_pointer_find(simulation_fields, simulation,
                                               uncertain_input_pointer(input, i), &is_tag, why);
        number->unit = field->unit;
        input_number_limit(number, &field->range);
    }
    model->axes[model->axis_count++] = (StudyAxis){.pointer = input->pointer,
                                                   .pointers = input->pointers,
                                                   .from = (double)NAN,
                                                   .to = (double)NAN,
                                                   .count = COUNT_ABSENT,
                                                   .spacing = CHOICE_ABSENT};
}

// No restitution of its buffers may exceed 1.
static void input_number_limit_factor(InputNumber *number, const Simulation *simulation) {
    number->range.min = 0;
    for (size_t i = 0; i < uncertain_input_pointers(number->input); i++) {
        size_t damper, place;
        (void)uncertain_input_buffer(uncertain_input_pointer(number->input, i), simulation, &damper,
                                     &place);
        const double max = perturbation_buffer_max(&simulation->scene.dampers.at[damper], place,
                                                   number->parameter);
        if (number->parameter == SENSITIVITY_RESTITUTION && max > 0)
            number->range.max = fmin(number->range.max, 1 / max);
    }
}

Status input_model_make(const UncertainInputs *inputs, const Simulation *simulation, int method,
                        uint64_t seed, size_t rows, size_t tables, InputModel *model) {
    *model = (InputModel){.count = 0};
    for (size_t i = 0; i < inputs->count; i++) {
        const UncertainInput *input = &inputs->at[i];
        const double deviations[] = {input->restitution_deviation, input->contact_time_deviation};
        for (int parameter = -1; parameter <= SENSITIVITY_CONTACT_TIME; parameter++) {
            if (parameter < 0 ? input->distribution == INPUT_MATERIAL
                              : !(deviations[parameter] > 0))
                continue;
            InputNumber *number = &model->numbers[model->count++];
            *number = (InputNumber){input, i, parameter, ANY, NULL};
            if (parameter < 0)
                input_model_add_value(model, number, simulation);
            else
                input_number_limit_factor(number, simulation);
        }
    }
    return sampling_make(method, seed, rows, tables * model->count, &model->sampling);
}

void input_model_clear(InputModel *model) {
    sampling_clear(&model->sampling);
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
    return problem_add(problem, STATUS_INVALID, uncertain_input_pointer(of->input, 0),
                       "is out of its range in all of %d draws", (int)DRAWS_MAX);
}

// Factors are those of the base's numbers, values are set after them.
static void input_model_scale(const InputModel *model, const double *values, const Simulation *base,
                              Simulation *copy) {
    for (size_t i = 0; i < model->count; i++) {
        const InputNumber *number = &model->numbers[i];
        for (size_t k = 0; k < uncertain_input_pointers(number->input); k++) {
            size_t damper, place;
            if (number->parameter >= 0 &&
                uncertain_input_buffer(uncertain_input_pointer(number->input, k), base, &damper,
                                       &place) != NULL)
                perturbation_scale(&base->scene.dampers.at[damper], place, number->parameter,
                                   values[i], &copy->scene.dampers.at[damper]);
        }
    }
}

Status input_model_scene(const InputModel *model, const double *values, const Simulation *base,
                         const SimulationLimits *limits, Simulation *target, Problem *problem) {
    StudyValue set[INPUTS_MAX];
    size_t count = 0;
    Simulation copy;
    *target = (Simulation){0};
    if (fields_copy(simulation_fields, base, &copy) != STATUS_OK)
        return study_result(STATUS_NO_MEMORY, problem);
    input_model_scale(model, values, base, &copy);
    for (size_t i = 0; i < model->count; i++)
        if (model->numbers[i].parameter < 0)
            set[count++] = (StudyValue){NULL, values[i]};
    const StudyAxes axes = {(StudyAxis *)model->axes, count};
    const Status status = study_scene_make(&copy, &axes, set, NULL, false, limits, target, problem);
    simulation_clear(&copy);
    return status;
}

// The medians of all inputs must be a scene.
static Status uncertain_inputs_check_medians(const InputModel *model, const Simulation *simulation,
                                             const SimulationLimits *limits, Problem *problem) {
    double values[INPUT_NUMBERS_MAX];
    Problem own;
    Simulation scene;
    problem_clear(&own);
    for (size_t i = 0; i < model->count; i++)
        values[i] = input_number_value(&model->numbers[i], 0.5 - 0x1p-50);
    const Status status = input_model_scene(model, values, simulation, limits, &scene, &own);
    simulation_clear(&scene);
    return status != STATUS_INVALID ? status
                                    : problem_add(problem, status, place_of_all,
                                                  "have medians that give no valid scene: %.80s "
                                                  "%.200s",
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
        status = uncertain_inputs_check_medians(&model, simulation, limits, problem);
    input_model_clear(&model);
    return status;
}
