// Latin hypercube (McKay, Beckman and Conover, Technometrics 21, 239, 1979): in each dimension
// every one of N equal strata has one of the N points, at a random place within.
//
// Sobol sequence: bit by bit in base 2, x_i = i_1 v_1 xor i_2 v_2 xor ..., with i_1 the lowest bit
// of the row and the direction numbers v_j = m_j / 2^j of a primitive polynomial of degree s with
// the inner coefficients a:
//
//   m_j = 2 a_1 m_(j-1) xor 2^2 a_2 m_(j-2) xor ... xor 2^s m_(j-s) xor m_(j-s).
//
// A digital shift, a random word for each dimension, makes means over the points unbiased and keeps
// their uniformity.
//
// A number is the quantile of its distribution at a coordinate of a point. One that is out of its
// member's range is drawn again, from coordinates of its own.
#include "core/study/inputs.h"

#include <math.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/philox.h"
#include "core/math/student_t.h"
#include "core/study/sensitivity.h"

enum {
    WORD_BITS = 32,
    STREAM_POINTS = 0x494e5000, // streams of random numbers, one for each dimension
    STREAM_STRATA = 0x494e5100,
    STREAM_AGAIN = 0x494e5200,
    STREAM_SHIFT = 0x494e5300,
    AGAIN_BITS = 20,
};

const char *const sampling_names[] = {"random", "latin_hypercube", "sobol", NULL};

// Dimensions 2 to 32 of new-joe-kuo-6: S. Joe and F. Y. Kuo, "Constructing Sobol sequences with
// better two-dimensional projections", SIAM J. Sci. Comput. 30, 2635 (2008). In the first one all m
// are 1.
// clang-format off
static const struct {
    uint8_t degree, coefficients;
    uint8_t m[7];
} sampling_directions[SAMPLING_SOBOL_DIMENSIONS - 1] = {
    {1, 0, {1}}, {2, 1, {1, 3}}, {3, 1, {1, 3, 1}}, {3, 2, {1, 1, 1}}, {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}}, {5, 2, {1, 1, 5, 5, 17}}, {5, 4, {1, 1, 5, 5, 5}},
    {5, 7, {1, 1, 7, 11, 19}}, {5, 11, {1, 1, 5, 1, 1}}, {5, 13, {1, 1, 1, 3, 11}},
    {5, 14, {1, 3, 5, 5, 31}}, {6, 1, {1, 3, 3, 9, 7, 49}}, {6, 13, {1, 1, 1, 15, 21, 21}},
    {6, 16, {1, 3, 1, 13, 27, 49}}, {6, 19, {1, 1, 1, 15, 7, 5}}, {6, 22, {1, 3, 1, 15, 13, 25}},
    {6, 25, {1, 1, 5, 5, 19, 61}}, {7, 1, {1, 3, 7, 11, 23, 15, 103}},
    {7, 4, {1, 3, 7, 13, 13, 15, 69}}, {7, 7, {1, 1, 3, 13, 7, 35, 63}},
    {7, 8, {1, 3, 5, 9, 1, 25, 53}}, {7, 14, {1, 3, 1, 13, 9, 35, 107}},
    {7, 19, {1, 3, 1, 5, 27, 61, 31}}, {7, 21, {1, 1, 5, 11, 19, 41, 61}},
    {7, 28, {1, 3, 5, 3, 3, 13, 69}}, {7, 31, {1, 1, 7, 13, 1, 19, 1}},
    {7, 32, {1, 3, 7, 5, 13, 19, 59}}, {7, 37, {1, 1, 3, 9, 25, 29, 41}},
    {7, 41, {1, 3, 5, 13, 23, 1, 55}}, {7, 42, {1, 3, 7, 3, 13, 59, 17}},
};
// clang-format on

static void sampling_words(uint64_t seed, uint64_t stream, uint64_t index, uint32_t out[4]) {
    const uint32_t counter[4] = {(uint32_t)index, (uint32_t)(index >> 32), (uint32_t)stream,
                                 (uint32_t)(stream >> 32)};
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    philox_words(counter, key, out);
}

// Midpoints of 2^52 equal parts, which a double holds exactly.
static double sampling_uniform(uint64_t seed, uint64_t stream, uint64_t index) {
    uint32_t words[4];
    sampling_words(seed, stream, index, words);
    return ((double)(((uint64_t)words[1] << 32 | words[0]) >> 12) + 0.5) * 0x1p-52;
}

// The word of a point, of which bit 31 is worth 1/2.
static uint32_t sampling_sobol_word(uint64_t row, size_t dimension) {
    uint32_t m[WORD_BITS], word = 0;
    size_t degree = 0;
    for (size_t j = 0; j < WORD_BITS && row >> j != 0; j++) {
        if (dimension == 0) {
            m[j] = 1;
        } else if (j < (degree = sampling_directions[dimension - 1].degree)) {
            m[j] = sampling_directions[dimension - 1].m[j];
        } else {
            const unsigned coefficients = sampling_directions[dimension - 1].coefficients;
            m[j] = m[j - degree] ^ m[j - degree] << degree;
            for (size_t k = 1; k < degree; k++)
                if (coefficients >> (degree - 1 - k) & 1)
                    m[j] ^= m[j - k] << k;
        }
        if (row >> j & 1)
            word ^= m[j] << (WORD_BITS - 1 - j);
    }
    return word;
}

// The stratum of a row: a permutation of the numbers of some bits by rounds of Feistel (Luby and
// Rackoff, SIAM J. Comput. 17, 373, 1988), repeated until it is one of the rows.
static size_t sampling_stratum(const Sampling *sampling, size_t row, size_t dimension) {
    enum { ROUNDS = 4 };
    unsigned half = 1;
    while (sampling->rows > (size_t)1 << 2 * half)
        half++;
    const size_t mask = ((size_t)1 << half) - 1;
    do {
        for (uint64_t round = 0; round < ROUNDS; round++) {
            uint32_t words[4];
            const size_t right = row & mask;
            sampling_words(sampling->seed, STREAM_STRATA + dimension, right * ROUNDS + round,
                           words);
            row = right << half | ((row >> half) ^ (words[0] & mask));
        }
    } while (row >= sampling->rows);
    return row;
}

double sampling_coordinate(const Sampling *sampling, size_t row, size_t dimension) {
    if (sampling->method == SAMPLING_SOBOL) {
        uint32_t shift[4];
        sampling_words(sampling->seed, STREAM_SHIFT + dimension, 0, shift);
        return ((double)(sampling_sobol_word(row, dimension) ^ shift[0]) + 0.5) * 0x1p-32;
    }
    const double within = sampling_uniform(sampling->seed, STREAM_POINTS + dimension, row);
    if (sampling->method != SAMPLING_LATIN_HYPERCUBE)
        return within;
    const double place =
        ((double)sampling_stratum(sampling, row, dimension) + within) / (double)sampling->rows;
    return place == 0.5 ? 0.5 - 0x1p-53 : place;
}

double sampling_draw_again(const Sampling *sampling, size_t row, size_t dimension, uint64_t again) {
    return sampling_uniform(sampling->seed, STREAM_AGAIN + dimension,
                            (uint64_t)row << AGAIN_BITS | again);
}

enum { DRAWS_MAX = 64 }; // of one number

static const char place_of_all[] = "/study/inputs";
static const char *const input_distribution_names[] = {"normal",     "lognormal", "uniform",
                                                       "triangular", "material",  NULL};

// clang-format off
const Field uncertain_input_fields[] = {
    FIELD_BASE(UncertainInput, axis, study_range_fields),
    FIELD_CHOICE(UncertainInput, distribution, input_distribution_names, REQUIRED, "normal: mean and deviation; lognormal: median and log_deviation; uniform: from and to; triangular: from, mode and to. material: e and T_c of the buffer at pointer, times log-normal factors of mean 1 and the relative deviations that its material records"),
    FIELD_REAL(UncertainInput, mean, NULL, ANY, OPTIONAL, "of normal"),
    FIELD_REAL(UncertainInput, deviation, NULL, ABOVE(0), OPTIONAL, "standard deviation of normal"),
    FIELD_REAL(UncertainInput, median, NULL, ABOVE(0), OPTIONAL, "of lognormal"),
    FIELD_REAL(UncertainInput, log_deviation, NULL, ABOVE(0), OPTIONAL, "of lognormal: standard deviation of the natural logarithm"),
    FIELD_REAL(UncertainInput, mode, NULL, ANY, OPTIONAL, "most probable value of triangular"),
    FIELD_REAL(UncertainInput, restitution_deviation, NULL, WITHIN(0, 1), OPTIONAL, "of material: relative standard deviation of the restitution; if absent the recorded one, 0: exact"),
    FIELD_REAL(UncertainInput, contact_time_deviation, NULL, WITHIN(0, 1), OPTIONAL, "of material: the same for the contact time"),
    FIELD_END
};
// clang-format on

static const char *const input_parameters[][3] = {
    [INPUT_NORMAL] = {"mean", "deviation"},
    [INPUT_LOGNORMAL] = {"median", "log_deviation"},
    [INPUT_UNIFORM] = {"from", "to"},
    [INPUT_TRIANGULAR] = {"from", "to", "mode"},
    [INPUT_MATERIAL] = {"restitution_deviation", "contact_time_deviation"}, // both are optional
};

static bool input_has_parameter(int distribution, const char *name) {
    bool has = false;
    for (size_t i = 0; i < COUNT(input_parameters[0]); i++)
        has = has || text_same(input_parameters[distribution][i], name);
    return has;
}

static Status uncertain_input_check_parameters(const UncertainInput *input, const char *place,
                                               Problem *problem) {
    const double from = input->axis.from, to = input->axis.to;
    Status status = STATUS_OK;
    for (size_t i = 0; i < COUNT(input_parameters) * COUNT(input_parameters[0]); i++) {
        const char *name =
            input_parameters[i / COUNT(input_parameters[0])][i % COUNT(input_parameters[0])];
        if (name == NULL)
            continue;
        size_t offset = 0;
        const Field *field = fields_find(uncertain_input_fields, name, &offset);
        const bool is_given = !field_is_absent(field, (const char *)input + offset);
        if (is_given != input_has_parameter(input->distribution, name) &&
            (is_given || input->distribution != INPUT_MATERIAL))
            status =
                json_pointer_fault(problem, place, name, "%s by distribution %s",
                                   is_given ? "must be left out: it is not used" : "is required",
                                   input_distribution_names[input->distribution]);
    }
    if (from >= to)
        status =
            json_pointer_fault(problem, place, "to", "must be above from, %s", real_text(from).at);
    if (input->mode < from || input->mode > to)
        status = json_pointer_fault(problem, place, "mode", "must be within from and to");
    return status;
}

// Number of the given buffer that a pointer such as /dampers/0/left_buffer designates; SIZE_MAX:
// none.
static size_t input_buffer(const StudyAxis *axis, size_t index, const Dampers *dampers) {
    for (size_t i = 0; i < SENSITIVITY_BUFFERS * dampers->count; i++) {
        const JsonPointer damper = json_pointer_at("/dampers", i / SENSITIVITY_BUFFERS),
                          own = json_pointer_of(damper.at,
                                                sensitivity_buffer_names[i % SENSITIVITY_BUFFERS]);
        if (strcmp(own.at, study_axis_pointer(axis, index)) == 0 &&
            buffer_is_given(perturbation_buffer(dampers, i)))
            return i;
    }
    return SIZE_MAX;
}

static Status uncertain_input_check_member(const UncertainInput *input, size_t index,
                                           const Simulation *simulation, const char *place,
                                           Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    const StudyAxis *axis = &input->axis;
    const size_t buffer = input_buffer(axis, index, dampers),
                 first = input_buffer(axis, 0, dampers);
    const bool is_material = input->distribution == INPUT_MATERIAL;
    char why[JSON_POINTER_MESSAGE_MAX];
    bool is_tag;
    const Field *field = json_pointer_find(simulation_fields, simulation,
                                           study_axis_pointer(axis, index), &is_tag, why);
    if (is_material && buffer == SIZE_MAX)
        return problem_add(problem, STATUS_INVALID, place,
                           "must designate a given buffer for distribution material: "
                           "/dampers/0/buffer where both stops have the same");
    if (field == NULL)
        return problem_add(problem, STATUS_INVALID, place, "%s", why);
    if (!is_material && !study_field_is_real(field, is_tag))
        return problem_add(
            problem, STATUS_INVALID, place, "must designate a real number%s",
            field->kind == FIELD_KIND_ITEM ? "; a buffer can have the distribution material" : "");
    if (is_material && first != SIZE_MAX &&
        !text_same(perturbation_buffer(dampers, first)->material,
                   perturbation_buffer(dampers, buffer)->material))
        return problem_add(problem, STATUS_INVALID, place,
                           "must have the material of the first one: give an input each");
    return STATUS_OK;
}

// Fills in the recorded deviations of a material; 0: exact, or not a number of this scene.
static Status uncertain_input_fill(UncertainInput *input, const Simulation *simulation,
                                   const char *place, Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    const Buffer *buffer = perturbation_buffer(dampers, input_buffer(&input->axis, 0, dampers));
    for (int i = SENSITIVITY_RESTITUTION; i <= SENSITIVITY_CONTACT_TIME; i++) {
        const char *refused = perturbation_refuse(simulation, i),
                   *name = input_parameters[INPUT_MATERIAL][i];
        const double recorded = uncertainty_recorded(buffer, i);
        double *deviation = &input->relative[i];
        if (*deviation > 0 && refused != NULL)
            return json_pointer_fault(problem, place, name, "must be left out: %s", refused);
        if (isnan(*deviation))
            *deviation = recorded > 0 && refused == NULL ? recorded : 0;
        if (*deviation > 1)
            return json_pointer_fault_real(problem, place, name, *deviation, NULL,
                                           "is recorded by %.64s and must be at most 1 to be drawn "
                                           "from: give it",
                                           buffer->material);
    }
    if (input->relative[0] > 0 || input->relative[1] > 0)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, place,
                       "has no spread: %.64s records none of the restitution or contact time that "
                       "the scene uses; give restitution_deviation or contact_time_deviation, or "
                       "numbers with another distribution",
                       buffer->material != NULL ? buffer->material : "a buffer without a material");
}

static Status uncertain_input_complete(UncertainInput *input, const Simulation *simulation,
                                       const char *place, Problem *problem) {
    Status status = uncertain_input_check_parameters(input, place, problem);
    for (size_t i = 0; i < study_axis_pointer_count(&input->axis); i++) {
        const JsonPointer own = study_axis_place(&input->axis, place, i);
        status = study_first_failure(
            status, uncertain_input_check_member(input, i, simulation, own.at, problem));
    }
    return status == STATUS_OK && input->distribution == INPUT_MATERIAL &&
                   study_axis_pointer_count(&input->axis) > 0
               ? uncertain_input_fill(input, simulation, place, problem)
               : status;
}

static double input_normal(double u) {
    return copysign(student_t_quantile(fabs(2 * u - 1), 0), u - 0.5);
}

// The quantile of a number.
static double input_number_value(const InputNumber *number, double u) {
    const UncertainInput *input = number->input;
    const double from = input->axis.from, to = input->axis.to, width = to - from;
    switch (input->distribution) {
    case INPUT_NORMAL:
        return input->mean + input->deviation * input_normal(u);
    case INPUT_LOGNORMAL:
        return input->median * exp(input->log_deviation * input_normal(u));
    case INPUT_UNIFORM:
        return from + width * u;
    case INPUT_TRIANGULAR:
        return u * width < input->mode - from ? from + sqrt(u * width * (input->mode - from))
                                              : to - sqrt((1 - u) * width * (to - input->mode));
    default:
        return perturbation_factor(input_normal(u), input->relative[number->parameter]);
    }
}

// The range of the members, which also gives their unit; no restitution may exceed 1.
static void input_number_limit(InputNumber *number, const Simulation *simulation) {
    const StudyAxis *axis = &number->input->axis;
    number->min = number->parameter < 0 ? -(double)INFINITY : 0;
    number->max = (double)INFINITY;
    for (size_t i = study_axis_pointer_count(axis); i-- > 0;) {
        const char *pointer = study_axis_pointer(axis, i);
        if (number->parameter < 0) {
            char why[JSON_POINTER_MESSAGE_MAX];
            bool is_tag;
            const Field *field =
                json_pointer_find(simulation_fields, simulation, pointer, &is_tag, why);
            const Range *range = &field->range;
            number->unit = field->unit;
            number->max = fmin(number->max, range->max);
            number->min =
                fmax(number->min,
                     range->is_open_below ? nextafter(range->min, (double)INFINITY) : range->min);
        } else if (number->parameter == SENSITIVITY_RESTITUTION) {
            const Dampers *dampers = &simulation->scene.dampers;
            const double max = perturbation_buffer_max(dampers, input_buffer(axis, i, dampers),
                                                       SENSITIVITY_RESTITUTION);
            if (max > 0)
                number->max = fmin(number->max, 1 / max);
        }
    }
}

InputModel input_model_make(const UncertainInputs *inputs, const Simulation *simulation,
                            Sampling sampling) {
    InputModel model = {.sampling = sampling};
    for (size_t i = 0; i < inputs->count; i++) {
        const UncertainInput *input = &inputs->at[i];
        const bool is_material = input->distribution == INPUT_MATERIAL;
        if (!is_material)
            model.axes[model.axis_count++] = input->axis;
        for (int parameter = is_material ? 0 : -1; parameter < (is_material ? 2 : 0); parameter++) {
            if (is_material && !(input->relative[parameter] > 0))
                continue;
            InputNumber *number = &model.numbers[model.count++];
            *number = (InputNumber){.input = input, .index = i, .parameter = parameter};
            input_number_limit(number, simulation);
        }
    }
    return model;
}

static Status input_number_draw(const InputNumber *number, const Sampling *sampling, size_t row,
                                size_t dimension, double *value, uint64_t *again,
                                Problem *problem) {
    *value = input_number_value(number, sampling_coordinate(sampling, row, dimension));
    for (uint64_t i = 0; i < DRAWS_MAX; i++) {
        if (isfinite(*value) && *value >= number->min && *value <= number->max)
            return STATUS_OK;
        ++*again;
        *value = input_number_value(number, sampling_draw_again(sampling, row, dimension, i));
    }
    return problem_add(problem, STATUS_INVALID, study_axis_pointer(&number->input->axis, 0),
                       "is out of its range in all of %d draws", (int)DRAWS_MAX);
}

Status input_model_draw(const InputModel *model, size_t row, int mixed,
                        double values[INPUT_NUMBERS_MAX], uint64_t again[INPUT_NUMBERS_MAX],
                        Problem *problem) {
    for (size_t i = 0; i < model->count; i++) {
        const InputNumber *number = &model->numbers[i];
        const bool is_second = mixed == INPUTS_ALL || mixed == (int)number->index;
        TRY(input_number_draw(number, &model->sampling, row, i + (is_second ? model->count : 0),
                              &values[i], &again[i], problem));
    }
    return STATUS_OK;
}

// Factors are those of the base's numbers, values are set after them.
static void input_model_scale(const InputModel *model, const double *values, const Dampers *base,
                              Dampers *copy) {
    for (size_t i = 0; i < model->count; i++) {
        const InputNumber *number = &model->numbers[i];
        const StudyAxis *axis = &number->input->axis;
        for (size_t k = 0; k < study_axis_pointer_count(axis) && number->parameter >= 0; k++)
            perturbation_scale(base, input_buffer(axis, k, base), number->parameter, values[i],
                               copy);
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
    input_model_scale(model, values, &base->scene.dampers, &copy.scene.dampers);
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
                                 const SimulationLimits *limits, size_t *numbers,
                                 Problem *problem) {
    StudyAxis axes[INPUTS_MAX];
    for (size_t i = 0; i < inputs->count; i++) {
        axes[i] = inputs->at[i].axis;
        axes[i].from = 0; // ranges are those of the distributions
        axes[i].to = 1;
    }
    Status status =
        study_axes_check(&(StudyAxes){axes, inputs->count}, false, place_of_all, problem);
    for (size_t i = 0; i < inputs->count; i++)
        status = study_first_failure(
            status, uncertain_input_complete(&inputs->at[i], simulation,
                                             json_pointer_at(place_of_all, i).at, problem));
    TRY(status);
    const InputModel model =
        input_model_make(inputs, simulation, (Sampling){SAMPLING_RANDOM, 1, 1});
    *numbers = model.count;
    return uncertain_inputs_check_medians(&model, simulation, limits, problem);
}
