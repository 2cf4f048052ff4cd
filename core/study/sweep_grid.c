// A point's number in a grid is written in the axes' lengths as digits, the last axis the lowest:
//
//     value of axis a = (point / stride_a) mod count_a,  stride_a = product of the later counts
//
// and in a list it is each axis's own index. Its scene is a copy of the sweep's with those values
// set, completed like any other.
// A point is judged by making its scene. Its faults are told where their cause stands: at a value
// of an axis, not in a scene that nobody wrote.
#include "core/study/sweep_grid.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"

enum {
    PLACE = sizeof((Fault){0}.pointer),
    COST_SAMPLES = 64,
    COST_SCENES = 2000, // what they may cost
    AFFORDED_MIN = 16,
    SWEEP_VALUES = 1 << 21,
    RANGE_SAMPLES = 512,
};

static bool sweep_grid_is_range(const SweepAxis *axis) {
    return axis->values.count == 0;
}

static size_t sweep_grid_axis_length(const SweepAxis *axis) {
    return sweep_grid_is_range(axis) ? (size_t)axis->count : axis->values.count;
}

size_t sweep_points(const SweepStudy *study) {
    size_t points = study->axes.count > 0;
    for (size_t i = 0; i < study->axes.count; i++) {
        const size_t length = sweep_grid_axis_length(&study->axes.at[i]);
        if (study->mode == SWEEP_LIST && i > 0)
            continue; // all are as long as the first
        if (length > 0 && points > SIZE_MAX / length)
            return SIZE_MAX;
        points *= length;
    }
    return points;
}

// Equal differences as they are: whole numbers stay whole.
static double sweep_grid_range_value(const SweepAxis *axis, size_t index) {
    const double last = (double)(axis->count - 1);
    if (index == 0)
        return axis->from;
    if (index + 1 == axis->count)
        return axis->to;
    return axis->spacing == SWEEP_LOGARITHMIC
               ? axis->from * pow(axis->to / axis->from, (double)index / last)
               : axis->from + (axis->to - axis->from) / last * (double)index;
}

static Status sweep_grid_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the sweep's points");
}

static Status sweep_grid_read_values(const SweepAxis *axis, SweepValues *values, Problem *problem) {
    size_t room = 1;
    for (size_t i = 0; i < axis->values.count; i++)
        room += strlen(axis->values.at[i]) + 1;
    values->at = calloc(values->count, sizeof *values->at);
    values->texts = malloc(room);
    if (values->at == NULL || values->texts == NULL)
        return sweep_grid_no_memory(problem);
    char *text = values->texts;
    for (size_t i = 0; i < values->count; i++) {
        if (sweep_grid_is_range(axis)) {
            values->at[i] = scalar_number(sweep_grid_range_value(axis, i));
            continue;
        }
        if (!scalar_read(axis->values.at[i], &values->at[i], text))
            return problem_set(problem, STATUS_INTERNAL, "a value of the sweep cannot be read");
        text += strlen(axis->values.at[i]) + 1;
    }
    return STATUS_OK;
}

void sweep_grid_free(SweepGrid *plan) {
    if (plan == NULL)
        return;
    for (size_t i = 0; plan->axes != NULL && i < plan->axis_count; i++) {
        free(plan->axes[i].at);
        free(plan->axes[i].texts);
    }
    free(plan->axes);
    free(plan);
}

size_t sweep_grid_index(const SweepGrid *plan, size_t axis, size_t point) {
    const SweepValues *values = &plan->axes[axis];
    return point / values->stride % values->count;
}

// A side of its own, where the scene has one buffer for both.
static Status sweep_grid_split_buffer(const char *pointer, Simulation *target) {
    static const char before[] = "/dampers/";
    if (strncmp(pointer, before, sizeof before - 1) != 0)
        return STATUS_OK;
    char *end;
    const size_t number = strtoul(pointer + sizeof before - 1, &end, 10);
    const bool is_left = strncmp(end, "/left_buffer", 12) == 0;
    if ((!is_left && strncmp(end, "/right_buffer", 13) != 0) ||
        number >= target->scene.dampers.count)
        return STATUS_OK;
    Damper *damper = &target->scene.dampers.at[number];
    if (!buffer_is_given(&damper->buffer))
        return STATUS_OK;
    fields_clear(buffer_fields, &damper->left_buffer);
    fields_clear(buffer_fields, &damper->right_buffer);
    TRY(fields_copy(buffer_fields, &damper->buffer, &damper->left_buffer));
    buffer_move(&damper->right_buffer, &damper->buffer);
    return STATUS_OK;
}

// What a name stands for: who changes a number takes the name away. But a completed scene has left
// out what its contact model does not use, which a point's may.
static Status sweep_grid_fill_material(const Buffer *pinned, Buffer *buffer) {
    if (isnan(buffer->restitution))
        buffer->restitution = pinned->restitution;
    if (isnan(buffer->contact_time))
        buffer->contact_time = pinned->contact_time;
    buffer->test = pinned->test;
    if (pinned->table.count == 0)
        return STATUS_OK;
    const size_t size = pinned->table.count * sizeof *pinned->table.at;
    ContactRow *rows = malloc(size);
    if (rows == NULL)
        return STATUS_NO_MEMORY;
    memcpy(rows, pinned->table.at, size);
    free(buffer->table.at);
    buffer->table = (ContactRows){rows, pinned->table.count};
    return STATUS_OK;
}

// Materials' numbers come from where the study pins them.
static Status sweep_grid_fill_materials(const Buffers *materials, Simulation *target) {
    for (size_t i = 0; i < 3 * target->scene.dampers.count; i++) {
        Damper *damper = &target->scene.dampers.at[i / 3];
        Buffer *const sides[] = {&damper->buffer, &damper->left_buffer, &damper->right_buffer};
        Buffer *buffer = sides[i % 3];
        for (size_t k = 0; buffer->material != NULL && k < materials->count; k++)
            if (strcmp(materials->at[k].material, buffer->material) == 0)
                TRY(sweep_grid_fill_material(&materials->at[k], buffer));
    }
    return STATUS_OK;
}

// Likewise the ground motion that the scene names now.
static Status sweep_grid_fill_record(const PinnedRecords *records, Simulation *target) {
    ExcitationRecord *record = (ExcitationRecord *)(void *)target->scene.excitation;
    if (excitation_kind(&record->excitation) != &excitation_record || record->name == NULL)
        return STATUS_OK;
    for (size_t i = 0; i < records->count; i++) {
        const PinnedRecord *pinned = &records->at[i];
        if (pinned->named != NULL && strcmp(pinned->name, record->name) == 0)
            return record_resolve(record, (NamedRecord *)(void *)pinned->named) ? STATUS_OK
                                                                                : STATUS_NO_MEMORY;
    }
    return STATUS_OK;
}

static void sweep_grid_clear_texts(Texts *texts) {
    for (size_t i = 0; i < texts->count; i++)
        free(texts->at[i]);
    free(texts->at);
    *texts = (Texts){NULL, 0};
}

static void sweep_grid_clear_output(Simulation *target) {
    sweep_grid_clear_texts(&target->output.channels);
    sweep_grid_clear_texts(&target->output.psd.channels);
    target->output.impacts = false;
}

// Without judging it. `*axis` is the one whose value cannot be there.
static Status sweep_grid_apply(const SweepGrid *plan, size_t point, Simulation *target,
                               size_t *axis, char why[POINTER_SENTENCE]) {
    TRY(fields_copy(simulation_fields, plan->simulation, target));
    for (size_t i = 0; i < plan->axis_count; i++) {
        const SweepValues *values = &plan->axes[i];
        if (values->field == NULL)
            continue; // its pointer leads nowhere, which was told
        *axis = i;
        TRY(sweep_grid_split_buffer(values->pointer, target));
        TRY(pointer_set(simulation_fields, target, values->pointer,
                        &values->at[sweep_grid_index(plan, i, point)], why));
    }
    TRY(sweep_grid_fill_materials(&plan->study->materials, target));
    for (size_t i = 0; i < target->scene.dampers.count; i++)
        damper_ask_rig(&plan->simulation->scene.dampers.at[i], &target->scene.dampers.at[i]);
    return sweep_grid_fill_record(&plan->study->records, target);
}

Status sweep_grid_scene(const SweepGrid *plan, size_t point, bool is_bare,
                        const SimulationLimits *limits, Simulation *target, Problem *problem) {
    size_t axis = 0;
    char why[POINTER_SENTENCE] = "";
    const Status status = sweep_grid_apply(plan, point, target, &axis, why);
    if (status == STATUS_INVALID)
        return problem_add(problem, status, plan->axes[axis].pointer, "%s", why);
    if (status != STATUS_OK)
        return sweep_grid_no_memory(problem);
    if (is_bare)
        sweep_grid_clear_output(target);
    return simulation_complete(target, limits, NULL, problem);
}

// Measured: 3 us with one storey, 0.1 ms with 40 and 0.7 ms with 100; a record's own
// samples are copied, those of a named one are not.
size_t sweep_grid_affordable(const SweepGrid *plan, size_t scenes) {
    const Scene *scene = &plan->simulation->scene;
    const Excitation *excitation = scene_excitation(scene);
    const double n = (double)structure_storeys(scene_structure(scene));
    double cost = 1 + n / 4 + n * n / 64;
    if (excitation_kind(excitation) == &excitation_record)
        cost += 1e-3 * (double)((const ExcitationRecord *)(const void *)excitation)->samples.count;
    if (scenes == SIZE_MAX)
        return SIZE_MAX;
    const size_t most = (size_t)((double)scenes / cost);
    return most > AFFORDED_MIN ? most : AFFORDED_MIN;
}

double sweep_grid_steps(const SweepGrid *plan, const SimulationLimits *limits) {
    const size_t afforded = sweep_grid_affordable(plan, COST_SCENES);
    const size_t most = afforded < COST_SAMPLES ? afforded : COST_SAMPLES;
    const size_t samples = plan->points < most ? plan->points : most;
    double steps = 0;
    for (size_t i = 0; i < samples; i++) {
        // Odd multiples of half a part: an axis's period does not hide the other axes.
        const size_t point = (size_t)((double)plan->points * ((double)i + 0.5) / (double)samples);
        Simulation target;
        if (sweep_grid_scene(plan, point, true, limits, &target, NULL) == STATUS_OK)
            steps += simulation_cost(&target).steps;
        simulation_clear(&target);
    }
    return samples > 0 ? steps * (double)plan->points / (double)samples : 0;
}

// What an axis asks for beside what rows can see.
static Status sweep_grid_check_axis(const SweepAxis *axis, size_t number, Problem *problem) {
    char place[PLACE];
    snprintf(place, sizeof place, "/study/axes/%zu", number);
    const bool has_range = !isnan(axis->from) || !isnan(axis->to) || axis->count != COUNT_ABSENT;
    if (axis->values.count > 0 && (has_range || axis->spacing != CHOICE_ABSENT))
        return problem_add(problem, STATUS_INVALID, place,
                           "has values and a range: leave out values, or from, to, count and "
                           "spacing");
    if (axis->values.count > 0)
        return STATUS_OK;
    if (isnan(axis->from) || isnan(axis->to) || axis->count == COUNT_ABSENT)
        return problem_add(problem, STATUS_INVALID, place,
                           "needs values, or a range of from, to and count");
    if (axis->spacing == SWEEP_LOGARITHMIC && !(axis->from * axis->to > 0))
        return problem_add(problem, STATUS_INVALID, place,
                           "logarithmic spacing needs from and to of one sign, neither 0");
    return STATUS_OK;
}

static Status sweep_grid_check_axes(const SweepGrid *plan, Problem *problem) {
    const SweepAxes *axes = &plan->study->axes;
    Status status = STATUS_OK;
    for (size_t i = 0; i < axes->count; i++) {
        char place[PLACE];
        if (sweep_grid_check_axis(&axes->at[i], i, problem) != STATUS_OK)
            status = STATUS_INVALID;
        for (size_t k = 0; k < i; k++)
            if (strcmp(axes->at[i].pointer, axes->at[k].pointer) == 0) {
                snprintf(place, sizeof place, "/study/axes/%zu/pointer", i);
                status = problem_add(problem, STATUS_INVALID, place,
                                     "is the pointer of axis %zu too: one axis each", k);
            }
        snprintf(place, sizeof place, "/study/axes/%zu", i);
        if (status == STATUS_OK && plan->study->mode == SWEEP_LIST &&
            sweep_grid_axis_length(&axes->at[i]) != sweep_grid_axis_length(&axes->at[0]))
            status = problem_add(problem, STATUS_INVALID, place,
                                 "has %zu values, the first axis has %zu: in a list all are as "
                                 "long",
                                 sweep_grid_axis_length(&axes->at[i]),
                                 sweep_grid_axis_length(&axes->at[0]));
    }
    return status;
}

// Every pointer leads somewhere, by values of the axes before it.
static Status sweep_grid_check_pointers(SweepGrid *plan, Problem *problem) {
    Simulation scene;
    Status status = fields_copy(simulation_fields, plan->simulation, &scene);
    if (status != STATUS_OK)
        return sweep_grid_no_memory(problem);
    for (size_t i = 0; i < plan->axis_count && status != STATUS_NO_MEMORY; i++) {
        SweepValues *values = &plan->axes[i];
        char why[POINTER_SENTENCE];
        if (sweep_grid_split_buffer(values->pointer, &scene) != STATUS_OK) {
            status = STATUS_NO_MEMORY;
            break;
        }
        values->field =
            pointer_find(simulation_fields, &scene, values->pointer, &values->is_tag, why);
        if (values->field == NULL) {
            Fault fault = {0};
            snprintf(fault.pointer, sizeof fault.pointer, "/study/axes/%zu/pointer", i);
            text_fit(fault.detail, sizeof fault.detail, why);
            text_quote(fault.value, sizeof fault.value, values->pointer);
            status = problem_put(problem, STATUS_INVALID, &fault);
            continue;
        }
        // Values that cannot stand there are told point by point; one that can is enough here.
        Status set = STATUS_INVALID;
        for (size_t k = 0; k < values->count && set == STATUS_INVALID; k++)
            set = pointer_set(simulation_fields, &scene, values->pointer, &values->at[k], why);
        if (set == STATUS_NO_MEMORY)
            status = set;
    }
    simulation_clear(&scene);
    return status == STATUS_NO_MEMORY ? sweep_grid_no_memory(problem) : status;
}

// All axes are held in memory, value by value.
static Status sweep_grid_check_size(const SweepStudy *study, const SimulationLimits *limits,
                                    Problem *problem) {
    const size_t points = sweep_points(study);
    const size_t most = limits != NULL && limits->points > 0 ? limits->points : SWEEP_POINTS;
    size_t values = 0;
    for (size_t i = 0; i < study->axes.count; i++)
        values += sweep_grid_axis_length(&study->axes.at[i]);
    if (limits != NULL && points > most)
        return problem_add(
            problem, STATUS_INVALID, "/study/axes",
            "are %.4g points, at most %zu are allowed: take fewer values%s", (double)points, most,
            study->axes.count > 1 && study->mode == SWEEP_GRID ? " or fewer axes, or mode list"
                                                               : "");
    if (values > SWEEP_VALUES)
        return problem_add(problem, STATUS_INVALID, "/study/axes",
                           "have %zu values in all, at most %d are allowed: take fewer", values,
                           SWEEP_VALUES);
    return STATUS_OK;
}

Status sweep_grid_make(const SweepStudy *study, const Simulation *simulation,
                       const SimulationLimits *limits, SweepGrid **made, Problem *problem) {
    SweepGrid *plan = calloc(1, sizeof *plan);
    *made = NULL;
    if (plan == NULL)
        return sweep_grid_no_memory(problem);
    plan->study = study;
    plan->simulation = simulation;
    Status status = sweep_grid_check_axes(plan, problem);
    if (status == STATUS_OK)
        status = sweep_grid_check_size(study, limits, problem);
    if (status == STATUS_OK) {
        plan->points = sweep_points(study);
        plan->axes = calloc(study->axes.count, sizeof *plan->axes);
        if (plan->axes == NULL)
            status = sweep_grid_no_memory(problem);
        else
            plan->axis_count = study->axes.count;
    }
    size_t stride = 1;
    for (size_t i = plan->axis_count; i-- > 0 && status == STATUS_OK;) {
        SweepValues *values = &plan->axes[i];
        values->pointer = study->axes.at[i].pointer;
        values->count = sweep_grid_axis_length(&study->axes.at[i]);
        values->stride = study->mode == SWEEP_LIST ? 1 : stride;
        stride *= values->count;
        status = sweep_grid_read_values(&study->axes.at[i], values, problem);
    }
    if (status != STATUS_OK) {
        sweep_grid_free(plan);
        return status;
    }
    *made = plan;
    return sweep_grid_check_pointers(plan, problem);
}

Status sweep_grid_new(const SweepStudy *study, const Simulation *simulation,
                      const SimulationLimits *limits, SweepGrid **made, Problem *problem) {
    const Status status = sweep_grid_make(study, simulation, limits, made, problem);
    if (status != STATUS_OK) {
        sweep_grid_free(*made);
        *made = NULL;
    }
    return status;
}

// Where the value stands that the point has on an axis.
static void sweep_grid_value_pointer(const SweepGrid *plan, size_t axis, size_t index,
                                     char place[PLACE]) {
    if (sweep_grid_is_range(&plan->study->axes.at[axis]))
        snprintf(place, PLACE, "/study/axes/%zu", axis);
    else
        snprintf(place, PLACE, "/study/axes/%zu/values/%zu", axis, index);
}

// Whether `pointer` is `above` or lies below it.
static bool sweep_grid_is_below(const char *pointer, const char *above) {
    const size_t length = strlen(above);
    return strncmp(pointer, above, length) == 0 &&
           (pointer[length] == '\0' || pointer[length] == '/');
}

// A fault of a point's scene, told where its cause is: the last axis that leads there, else the
// only one, else all of them.
static void sweep_grid_report_fault(const SweepGrid *plan, size_t point, const Fault *fault,
                                    Problem *problem) {
    Fault told = *fault;
    size_t cause = plan->axis_count > 1 ? plan->axis_count : 0;
    for (size_t i = 0; i < plan->axis_count; i++)
        if (sweep_grid_is_below(fault->pointer, plan->axes[i].pointer) ||
            sweep_grid_is_below(plan->axes[i].pointer, fault->pointer))
            cause = i;
    if (cause < plan->axis_count)
        sweep_grid_value_pointer(plan, cause, sweep_grid_index(plan, cause, point), told.pointer);
    else
        snprintf(told.pointer, sizeof told.pointer, "/study/axes");
    char detail[sizeof told.detail + PLACE + 64];
    snprintf(detail, sizeof detail, "point %zu, %s: %s", point, fault->pointer, fault->detail);
    text_fit(told.detail, sizeof told.detail, detail);
    problem_put(problem, STATUS_INVALID, &told);
}

static Status sweep_grid_check_point(const SweepGrid *plan, size_t point,
                                     const SimulationLimits *limits, Problem *fault,
                                     Problem *problem) {
    Simulation target;
    problem_clear(fault);
    const Status status = sweep_grid_scene(plan, point, true, limits, &target, fault);
    simulation_clear(&target);
    if (status == STATUS_OK)
        return STATUS_OK;
    if (status != STATUS_INVALID)
        return problem_set(problem, status, "%s", fault->detail);
    for (size_t i = 0; i < fault->count && i < PROBLEM_FAULTS; i++)
        sweep_grid_report_fault(plan, point, &fault->faults[i], problem);
    return status;
}

typedef struct Check {
    const SweepGrid *plan;
    const SimulationLimits *limits;
    const Progress *progress;
    Problem *fault, *problem;
    bool is_faulty;
} Check;

static Status sweep_grid_check_next(Check *check, size_t point) {
    if (!progress_advance(check->progress, (double)point / (double)check->plan->points))
        return problem_set(check->problem, STATUS_CANCELLED, "the sweep was stopped");
    const Status status =
        sweep_grid_check_point(check->plan, point, check->limits, check->fault, check->problem);
    check->is_faulty = check->is_faulty || status == STATUS_INVALID;
    return status == STATUS_INVALID ? STATUS_OK : status;
}

// Number k of `samples` among `count`, both ends among them.
static size_t sweep_grid_sample(size_t k, size_t samples, size_t count) {
    return samples == count ? k : k * (count - 1) / (samples - 1);
}

static Status sweep_grid_check_sample(Check *check, size_t most) {
    const SweepGrid *plan = check->plan;
    const bool is_list = plan->study->mode == SWEEP_LIST;
    const size_t axes = is_list ? 1 : plan->axis_count;
    const size_t share = most / axes > 2 ? most / axes : 2; // of each axis
    TRY(sweep_grid_check_next(check, plan->points - 1));
    for (size_t i = 0; i < axes; i++) {
        const size_t count = plan->axes[i].count;
        const bool is_short = is_list || sweep_grid_is_range(&plan->study->axes.at[i]);
        const size_t wanted = is_short && share > RANGE_SAMPLES ? RANGE_SAMPLES : share;
        const size_t samples = count < wanted ? count : wanted;
        for (size_t k = i > 0; k < samples; k++)
            TRY(sweep_grid_check_next(check,
                                      sweep_grid_sample(k, samples, count) * plan->axes[i].stride));
    }
    return STATUS_OK;
}

static Status sweep_grid_check_all(Check *check) {
    for (size_t i = 0; i < check->plan->points; i++)
        TRY(sweep_grid_check_next(check, i));
    return STATUS_OK;
}

Status sweep_grid_check_points(const SweepGrid *plan, size_t scenes, const SimulationLimits *limits,
                               const Progress *progress, Problem *problem) {
    Check check = {.plan = plan,
                   .limits = limits,
                   .progress = progress,
                   .fault = malloc(sizeof(Problem)),
                   .problem = problem};
    if (check.fault == NULL)
        return sweep_grid_no_memory(problem);
    const size_t most = sweep_grid_affordable(plan, scenes);
    const Status status =
        plan->points > most ? sweep_grid_check_sample(&check, most) : sweep_grid_check_all(&check);
    free(check.fault);
    return status == STATUS_OK && check.is_faulty ? STATUS_INVALID : status;
}

Status sweep_grid_validate(const SweepStudy *study, const Simulation *simulation, size_t scenes,
                           const SimulationLimits *limits, Problem *problem) {
    SweepGrid *plan;
    Status status = sweep_grid_make(study, simulation, limits, &plan, problem);
    // Without limits it was judged before.
    if (plan != NULL && limits != NULL) {
        const Status points = sweep_grid_check_points(plan, scenes, limits, NULL, problem);
        status = status == STATUS_OK ? points : status;
    }
    sweep_grid_free(plan);
    return status;
}
