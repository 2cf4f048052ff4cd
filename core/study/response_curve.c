// The points are made one after the other, each from the state in which the one before it ended, so
// that a branch is kept as long as it attracts: up and down differ where there is hysteresis.
//
// Continuation follows a branch by pseudo-arclength (Keller 1977): with z the scaled state and
// value, t the tangent and h the step, the next point z satisfies
//
//     P(z) = y   and   t . (z - z0) = h,
//
// which has a solution also at a fold.
#include "core/study/response_curve.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/math/linear_system.h"
#include "core/solve/cycle_flow.h"

enum {
    CURVE_BRANCHES = 64,   // continued
    CURVE_CONTINUED = 200, // points of the continuation, beside four for each value
    CURVE_CORRECTIONS = 8,
    CURVE_EASY = 4,           // corrections up to which the step grows
    CURVE_HARD = 5,           // and beyond which it shrinks
    CURVE_APERIODIC_MIN = 32, // cycles of a motion without a period
    CURVE_NAMED = 30,         // points in a warning
};

static const double CURVE_STEP = 0.02, CURVE_STEP_MIN = 1e-4, CURVE_STEP_MAX = 0.05;
static const double CURVE_PRECISION = 1e-10;
static const double ENGINE_COST = 2; // of a cycle by the event engine alone, over that of a run
static const double CURVE_DIFFERENCE = 1e-7; // of the value, over the axis's range
static const double CURVE_JUMP = 0.5;        // between points: another branch
static const double CURVE_MARGIN = 1e-9;     // of the largest multiplier below 1, if stable
static const double CURVE_ALIKE = 0.01;      // peaks of one branch

static const char *const curve_direction_names[] = {"up", "down", "both", NULL};

// clang-format off
static const Field response_study_fields[] = {
    FIELD_ITEM(ResponseStudy, axis, study_axis_fields, NULL, PRESENCE_REQUIRED, "the number that varies: a range of from, to and count"),
    FIELD_CHOICE(ResponseStudy, direction, curve_direction_names, CURVE_UP, "up: from, then on to to, each point from the state of the one before; down: the reverse; both: up, then down"),
    FIELD_COUNT(ResponseStudy, settle_cycles, NULL, WITHIN(1, CURVE_CYCLES), 200, "maximum number of cycles of the sine at each point before the motion is called aperiodic; a chaotic one may still end on an orbit later. Fewer are used where a stable orbit is found earlier, up to three times as many where the motion has not yet left an unstable one"),
    FIELD_COUNT(ResponseStudy, max_period, NULL, WITHIN(1, CYCLE_FLOW_PERIOD), 8, "longest period searched for, in cycles of the sine"),
    FIELD_FLAG(ResponseStudy, continuation, false, "also follows each branch through its folds by pseudo-arclength continuation, with its unstable orbits: at most four points for each value of the axis, and 200; each one is a run too"),
    FIELD_COUNT(ResponseStudy, section_points, NULL, WITHIN(0, CURVE_SECTION), 64, "points of the section where no periodic orbit is found"),
    FIELD_BASE(ResponseStudy, names, study_names_fields),
    FIELD_END
};

const Field response_point_fields[] = {
    FIELD_COUNT(ResponsePoint, index, NULL, AT_MIN(0), OPTIONAL, "number of the point, from 0"),
    FIELD_COUNT(ResponsePoint, branch, NULL, AT_MIN(1), OPTIONAL, "number of the curve that it is on, from 1"),
    FIELD_REAL(ResponsePoint, value, NULL, ANY, OPTIONAL, "of the axis"),
    FIELD_CHOICE(ResponsePoint, direction, curve_direction_names, OPTIONAL, "in which the axis was followed; absent in a continuation"),
    FIELD_COUNT(ResponsePoint, period, NULL, AT_MIN(1), OPTIONAL, "in cycles of the sine; null: no periodic orbit found"),
    FIELD_COUNT(ResponsePoint, impacts_per_period, NULL, AT_MIN(0), OPTIONAL, "of all dampers"),
    FIELD_FLAG_OR_NULL(ResponsePoint, stable, "all multipliers are below 1 in magnitude; false also where one is 1, as of a mass that touches no stop; null where no period is found"),
    FIELD_ROWS_OR_NULL(ResponsePoint, multipliers, NULL, "Floquet multipliers, real and imaginary part, the largest first"),
    FIELD_REAL(ResponsePoint, peak_displacement, "m", ANY, OPTIONAL, "largest displacement of any storey over the period or the section's cycles, also between events"),
    FIELD_REAL(ResponsePoint, rms_displacement, "m", ANY, OPTIONAL, "root mean square over the same time, the largest of all storeys"),
    FIELD_REAL(ResponsePoint, undamped_peak_displacement, "m", ANY, OPTIONAL, "largest displacement of any storey in the steady state without dampers"),
    FIELD_ROWS_OR_NULL(ResponsePoint, section, NULL, "displacement and velocity of the top storey at the upward zero crossings of the sine, where no period is found"),
    FIELD_REAL(ResponsePoint, lyapunov, "1/s", ANY, OPTIONAL, "largest Lyapunov exponent over the section's cycles, where no period is found; null where contact parameters depend on the approach speed"),
    FIELD_END
};

static const Field response_failure_fields[] = {STUDY_FAILURE_ROWS("first_point", "index of the first of them; of a continuation, of the point that it began at")};
static const Field response_runs_fields[] = {STUDY_RUNS_ROWS(response_failure_fields)};

static const Field response_answer_fields[] = {
    FIELD_BASE(ResponseCurve, member, study_member_fields),
    FIELD_TEXT(ResponseCurve, unit, 0, PRESENCE_OPTIONAL, 0, "of its values"),
    FIELD_BASE(ResponseCurve, made, response_runs_fields),
    FIELD_LIST(ResponseCurve, points, response_point_fields, 0, PRESENCE_DEFAULT, "in the order in which they were made, and along each curve of a continuation"),
    FIELD_END
};
// clang-format on

// A periodic orbit at which a branch begins.
typedef struct CurveStart {
    CycleFlow *flow;
    size_t point;
} CurveStart;

typedef struct CurveWork {
    StudyWork work;
    const ResponseStudy *study;
    ResponseCurve *answer;
    const StudyTools *tools;
    Problem *problem;
    ProgressRange range;
    Progress progress; // of the runs: at the fraction of the points made
    CycleFlow *flow;   // at the last point
    uint64_t branch;   // so far
    CurveStart starts[CURVE_BRANCHES];
    size_t start_count;
    // Of a continuation; vectors have a number for the value behind the scaled state.
    size_t size; // of the state
    double z[CURVE_STATE + 1], at[CURVE_STATE + 1], tangent[CURVE_STATE + 1], by_value[CURVE_STATE];
    double matrix[(CURVE_STATE + 1) * (CURVE_STATE + 1)];
    size_t unsettled_count;
    char unsettled[256]; // numbers of the first of these points
} CurveWork;

static double curve_frequency(const Simulation *simulation) {
    return ((const ExcitationSine *)(const void *)scene_excitation(&simulation->scene))->frequency;
}

// Numbers of the state; the exact one is known after the plan.
static size_t curve_state_size(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const size_t storeys = structure_storeys(scene_structure(scene));
    return 2 * (accuracy_modes((const Accuracy *)(const void *)simulation->accuracy, storeys) +
                scene->dampers.count);
}

// The row of the number that varies; NULL, and a fault, if there is none.
static const Field *curve_axis_field(const StudyAxis *axis, const Simulation *simulation,
                                     Problem *problem) {
    Simulation scene;
    bool is_tag;
    if (fields_copy(simulation_fields, simulation, &scene) != STATUS_OK)
        return NULL;
    const Field *field = study_axis_find(axis, &scene, &is_tag, "/study/axis", problem);
    simulation_clear(&scene);
    return field;
}

static Status curve_check_axis(const StudyAxis *axis, const Simulation *simulation,
                               Problem *problem) {
    static const char place[] = "/study/axis";
    TRY(study_axis_check(axis, true, place, problem));
    TRY(study_axis_check_physics(axis, place, problem));
    if (axis->values.count > 0)
        return problem_add(problem, STATUS_INVALID, "/study/axis/values",
                           "cannot be followed up and down: give from, to and count");
    if (axis->count > CURVE_VALUES)
        return problem_add_real(problem, STATUS_INVALID, "/study/axis/count", (double)axis->count,
                                NULL, "must be at most %d", CURVE_VALUES);
    if (!(axis->from < axis->to))
        return problem_add(problem, STATUS_INVALID, place,
                           "from must be below to: direction down follows it in reverse");
    const Field *field = curve_axis_field(axis, simulation, problem);
    if (field == NULL)
        return problem->count > 0 ? STATUS_INVALID : STATUS_NO_MEMORY;
    if (field->kind != FIELD_KIND_REAL && field->kind != FIELD_KIND_REALS)
        return json_pointer_fault(problem, place, "pointer",
                                  "must be that of a real number: only such a number can vary "
                                  "continuously");
    return STATUS_OK;
}

static size_t curve_points(const ResponseStudy *study) {
    return (size_t)study->axis.count * (study->direction == CURVE_BOTH ? 2 : 1);
}

static Status curve_complete(void *request, const Simulation *simulation,
                             const SimulationLimits *limits, Problem *problem) {
    const ResponseStudy *study = request;
    const ExcitationKind *kind = excitation_kind(scene_excitation(&simulation->scene));
    Status status = STATUS_OK;
    (void)limits;
    if (kind != &excitation_sine)
        status = problem_add(problem, STATUS_INVALID, "/study/kind",
                             "response needs the cycles of a sine: /excitation/kind must be sine, "
                             "is %s",
                             kind->kind.name);
    if (curve_state_size(simulation) > CURVE_STATE)
        status = problem_add(problem, STATUS_INVALID, "/study/kind",
                             "response follows the modes and dampers with all their changes: their "
                             "number must be at most %d, is %zu; keep fewer modes by "
                             "/accuracy/modes",
                             CURVE_STATE / 2, curve_state_size(simulation) / 2);
    TRY(study_first_failure(curve_check_axis(&study->axis, simulation, problem), status));
    const double rows = (double)curve_points(study) *
                        (double)(study->section_points + curve_state_size(simulation));
    if (rows > CURVE_ROWS)
        return problem_add(problem, STATUS_INVALID, "/study/section_points",
                           "with the multipliers are %.3g pairs of numbers at all points, at most "
                           "%d are allowed: ask for fewer of them or fewer points",
                           rows, CURVE_ROWS);
    return STATUS_OK;
}

static void curve_references(void *request, StudyReferences *references) {
    ResponseStudy *study = request;
    *references = (StudyReferences){.names = &study->names}; // the axis has numbers
}

static size_t curve_continued(const ResponseStudy *study) {
    return study->continuation ? 4 * (size_t)study->axis.count + CURVE_CONTINUED : 0;
}

static size_t curve_points_max(const ResponseStudy *study) {
    return curve_points(study) + curve_continued(study);
}

static size_t curve_aperiodic_cycles(const ResponseStudy *study) {
    return study->section_points > CURVE_APERIODIC_MIN ? (size_t)study->section_points
                                                       : CURVE_APERIODIC_MIN;
}

// As if no point had a period, and with the columns of the linearised motion; by the exact solver.
static Status curve_cost(const void *request, const Simulation *simulation,
                         const SimulationLimits *limits, double *steps) {
    const ResponseStudy *study = request;
    bool varies_frequency = false;
    for (size_t i = 0; i < study_axis_pointer_count(&study->axis); i++)
        varies_frequency |=
            strcmp(study_axis_pointer(&study->axis, i), "/excitation/frequency") == 0;
    const uint64_t modes = ((const Accuracy *)(const void *)simulation->accuracy)->modes;
    AccuracyExact exact = {{{&solver_exact.kind}, modes}, (double)NAN};
    Simulation view = *simulation; // borrows all but the solver
    view.accuracy = &exact.accuracy.variant;
    const double second = ENGINE_COST * simulation_cost(&view).steps / simulation->scene.duration;
    // Mean length of a cycle over the points.
    double period = 0;
    for (size_t i = 0; i < study->axis.count; i++) {
        const double frequency = varies_frequency ? study_axis_value(&study->axis, i).number
                                                  : curve_frequency(simulation);
        period += frequency > 0 ? 1 / frequency : 0; // another one fails at once
    }
    const double cycle = second * period / (double)study->axis.count;
    const double columns = 1 + (double)curve_state_size(simulation);
    double cycles = (double)study->settle_cycles + 2 * (double)curve_aperiodic_cycles(study) +
                    4 * columns * (double)study->max_period;
    cycles *= (double)curve_points(study);
    cycles += (double)curve_continued(study) * 4 * columns * 2;
    (void)limits;
    *steps = cycles * cycle;
    return STATUS_OK;
}

// The flow of the scene with this value. NULL in *flow: it failed, and `status` is the reason.
static Status curve_make_flow(CurveWork *work, double value, const CycleFlow *from,
                              CycleFlow **flow) {
    const StudyAxes axes = {(StudyAxis *)(void *)&work->study->axis, 1};
    const StudyValue values[] = {{NULL, value}};
    Simulation scene;
    *flow = NULL;
    Status status = study_scene_make(work->work.simulation, &axes, values, &work->study->names,
                                     true, work->tools->limits, &scene, work->problem);
    if (status == STATUS_OK)
        status = simulation_cycle_flow(&scene, work->tools->limits, &work->progress, from, flow,
                                       work->problem);
    simulation_clear(&scene);
    return status;
}

static Status curve_add_row(double a, double b, Rows *rows) {
    Reals *row = list_append(rows, sizeof *row);
    TRY(status_made(row != NULL));
    return study_copy_reals((const double[]){a, b}, 2, row);
}

static ResponsePoint *curve_add_point(CurveWork *work, double value, int direction) {
    ResponsePoint *point = list_grow(&work->answer->points, sizeof *point);
    if (point == NULL)
        return NULL;
    (void)fields_default(response_point_fields, point);
    point->value = value;
    point->direction = direction;
    return point;
}

static void curve_fill_motion(const CycleMotion *motion, const CycleFlow *flow,
                              ResponsePoint *point) {
    point->peak_displacement = motion->peak_displacement;
    point->rms_displacement = motion->rms_displacement;
    point->undamped_peak_displacement = cycle_flow_undamped_peak(flow);
}

// Of the orbit at which the flow is.
static Status curve_fill_orbit(CycleFlow *flow, size_t period, ResponsePoint *point) {
    const Orbit *orbit = cycle_flow_orbit(flow);
    CycleMotion motion;
    TRY(cycle_flow_run(flow, period, NULL, 0, &motion));
    const double radius = cycle_flow_radius(flow);
    point->period = period;
    point->impacts_per_period = motion.impacts;
    point->stable = isnan(radius) ? CHOICE_ABSENT : radius < 1 - CURVE_MARGIN;
    for (size_t i = 0; i < orbit->size && !isnan(radius); i++)
        TRY(curve_add_row(orbit->real[i], orbit->imaginary[i], &point->multipliers));
    curve_fill_motion(&motion, flow, point);
    return STATUS_OK;
}

static Status curve_fill_section(CurveWork *work, CycleFlow *flow, ResponsePoint *point) {
    const size_t points = (size_t)work->study->section_points;
    double(*section)[2] = calloc(points + 1, sizeof *section);
    TRY(status_made(section != NULL));
    CycleMotion motion;
    Status status = cycle_flow_run_aperiodic(flow, curve_aperiodic_cycles(work->study),
                                             &point->lyapunov, points, section, &motion);
    curve_fill_motion(&motion, flow, point);
    for (size_t i = 0; i < points && status == STATUS_OK; i++)
        status = curve_add_row(section[i][0], section[i][1], &point->section);
    free(section);
    return status;
}

// A new branch begins where the kind of motion changes, or its state jumps.
static Status curve_find_branch(CurveWork *work, CycleFlow *flow, size_t number, double jump) {
    ResponsePoint *point = &work->answer->points.at[number];
    const ResponsePoint *last = number > 0 ? point - 1 : NULL;
    if (last == NULL || last->direction != point->direction || last->period != point->period ||
        last->impacts_per_period != point->impacts_per_period ||
        (point->period != COUNT_ABSENT && jump > CURVE_JUMP))
        work->branch++;
    point->branch = work->branch;
    if (!work->study->continuation || point->period == COUNT_ABSENT ||
        work->start_count == CURVE_BRANCHES ||
        (work->start_count > 0 &&
         work->answer->points.at[work->starts[work->start_count - 1].point].branch == work->branch))
        return STATUS_OK;
    CurveStart *start = &work->starts[work->start_count];
    TRY(curve_make_flow(work, point->value, flow, &start->flow));
    start->point = number;
    work->start_count++;
    return STATUS_OK;
}

static void curve_note_unsettled(CurveWork *work, size_t number) {
    char text[32];
    snprintf(text, sizeof text, "%zu", number);
    if (work->unsettled_count++ < CURVE_NAMED)
        text_list(work->unsettled, sizeof work->unsettled, text);
}

static Status curve_make_point(CurveWork *work, CycleFlow *flow, size_t number) {
    const ResponseStudy *study = work->study;
    const Orbit *orbit = cycle_flow_orbit(flow);
    double before[CURVE_STATE], jump = 0;
    cycle_flow_get(flow, before);
    TRY(cycle_flow_settle(flow, (size_t)study->settle_cycles, (size_t)study->max_period));
    ResponsePoint *point = &work->answer->points.at[number];
    if (orbit->period > 0) {
        for (size_t i = 0; i < orbit->size && cycle_flow_is_linearised(flow); i++)
            jump = fmax(jump, fabs(orbit->y[i] - before[i]) / orbit->scales[i]);
        TRY(curve_fill_orbit(flow, orbit->period, point));
        TRY(curve_find_branch(work, flow, number, jump));
        return cycle_flow_shift(flow, true);
    }
    // A linear structure without a steady motion is undamped and in resonance, or nearly so.
    if (!orbit->is_settled || work->work.simulation->scene.dampers.count == 0)
        curve_note_unsettled(work, number);
    TRY(cycle_flow_shift(flow, true));
    TRY(curve_fill_section(work, flow, point));
    return curve_find_branch(work, flow, number, 0);
}

// A failure of a point is counted and leaves its row without numbers.
static Status curve_fail(CurveWork *work, Status status, size_t number) {
    if (study_run_ends_study(status))
        return status;
    ResponsePoint *point = &work->answer->points.at[number];
    const double value = point->value;
    const int direction = point->direction;
    fields_clear(response_point_fields, point);
    (void)fields_default(response_point_fields, point);
    point->value = value;
    point->direction = direction;
    point->branch = ++work->branch;
    problem_clear(work->problem);
    return STATUS_OK;
}

static Status curve_count(CurveWork *work, Status status, double steps, size_t number) {
    const RunRecord run = {.status = status, .steps = steps, .why = work->problem->detail};
    return study_runs_add(&work->answer->made, &run, number);
}

static Status curve_advance(CurveWork *work) {
    const ResponseStudy *study = work->study;
    const double all = (double)(curve_points(study) + curve_continued(study));
    work->range.from = fmin((double)work->answer->points.count / all, 1);
    return study_advance(work->tools->progress, work->range.from, work->problem);
}

static Status curve_sweep(CurveWork *work, int direction) {
    const StudyAxis *axis = &work->study->axis;
    for (size_t i = 0; i < axis->count; i++) {
        const size_t number = work->answer->points.count;
        const double value =
            study_axis_value(axis, direction == CURVE_UP ? i : (size_t)axis->count - 1 - i).number;
        CycleFlow *flow;
        TRY(curve_advance(work));
        TRY(status_made(curve_add_point(work, value, direction) != NULL));
        Status status = curve_make_flow(work, value, work->flow, &flow);
        if (status == STATUS_OK)
            status = curve_make_point(work, flow, number);
        const double steps = flow != NULL ? cycle_flow_steps(flow) : 0;
        CycleFlow *const other = status == STATUS_OK ? work->flow : flow;
        if (status == STATUS_OK)
            work->flow = flow;
        cycle_flow_free(other);
        TRY(curve_count(work, status, steps, number));
        if (status != STATUS_OK)
            TRY(curve_fail(work, status, number));
    }
    return STATUS_OK;
}

// --- continuation ---

static double curve_span(const CurveWork *work) {
    return work->study->axis.to - work->study->axis.from;
}

// The return map and its derivatives at work->z. *change is that by the map, NAN if it failed;
// *made is the flow there, with the contact states of `from`.
static Status curve_evaluate(CurveWork *work, const CycleFlow *from, size_t period, double *change,
                             CycleFlow **made) {
    const size_t n = work->size;
    CycleFlow *beside = NULL;
    *change = (double)NAN;
    Status status = curve_make_flow(work, work->z[n] * curve_span(work), from, made);
    if (status == STATUS_OK)
        status = curve_make_flow(work, (work->z[n] + CURVE_DIFFERENCE) * curve_span(work), from,
                                 &beside);
    if (status == STATUS_OK && cycle_flow_orbit(*made)->size == n &&
        cycle_flow_orbit(beside)->size == n) {
        const Orbit *orbit = cycle_flow_orbit(*made), *other = cycle_flow_orbit(beside);
        for (size_t i = 0; i < n; i++)
            orbit->y[i] = other->y[i] = work->z[i] * orbit->scales[i];
        cycle_flow_keep(beside);
        cycle_flow_keep(*made);
        (void)cycle_flow_map(beside, period, false, &status);
        if (status == STATUS_OK)
            *change = cycle_flow_map(*made, period, true, &status);
        for (size_t i = 0; i < n; i++)
            work->by_value[i] =
                (other->end[i] - orbit->end[i]) / orbit->scales[i] / CURVE_DIFFERENCE;
        cycle_flow_restore(*made, orbit->y);
        work->answer->made.steps += cycle_flow_steps(*made) + cycle_flow_steps(beside);
    }
    cycle_flow_free(beside);
    if (study_run_ends_study(status))
        return status;
    problem_clear(work->problem);
    return STATUS_OK;
}

// Newton's step from work->z, at which `orbit` was evaluated, across the tangent:
// (I - P') x - P_value x_value = P(y) - y, tangent . x = 0. Returns its largest value; NAN: none.
static double curve_step(CurveWork *work, const Orbit *orbit) {
    const size_t n = work->size, m = n + 1;
    double step[CURVE_STATE + 1] = {0}, most = 0;
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < n; k++)
            work->matrix[i * m + k] = (i == k) - orbit->matrix[i * n + k];
        work->matrix[i * m + n] = -work->by_value[i];
        step[i] = (orbit->end[i] - orbit->y[i]) / orbit->scales[i];
    }
    memcpy(work->matrix + n * m, work->tangent, m * sizeof *step);
    if (!linear_system_solve(work->matrix, step, m, 1))
        return (double)NAN;
    for (size_t i = 0; i < m; i++) {
        work->z[i] += step[i];
        most = fmax(most, fabs(step[i]));
    }
    return most;
}

// Newton's method from work->at + step tangent. *count is that of the corrections; *made is NULL if
// they failed.
static Status curve_correct(CurveWork *work, const CycleFlow *from, size_t period, double step,
                            int *count, CycleFlow **made) {
    for (size_t i = 0; i <= work->size; i++)
        work->z[i] = work->at[i] + step * work->tangent[i];
    double moved = 0;
    *made = NULL;
    for (*count = 0; *count < CURVE_CORRECTIONS && moved < 1; ++*count) {
        double change;
        TRY(curve_evaluate(work, from, period, &change, made));
        if (change <= CURVE_PRECISION)
            return STATUS_OK;
        moved = change < 1 ? curve_step(work, cycle_flow_orbit(*made)) : (double)NAN;
        cycle_flow_free(*made);
        *made = NULL;
    }
    return STATUS_OK;
}

// The next point becomes the last one, and the tangent the secant through both.
static void curve_update_tangent(CurveWork *work) {
    double size = 0;
    for (size_t i = 0; i <= work->size; i++) {
        work->tangent[i] = work->z[i] - work->at[i];
        size += work->tangent[i] * work->tangent[i];
    }
    for (size_t i = 0; i <= work->size; i++) {
        work->tangent[i] /= sqrt(size);
        work->at[i] = work->z[i];
    }
}

// A point of a continuation that began at point `begin`; the flow is there. One that fails is left
// out.
static Status curve_add_continued(CurveWork *work, CycleFlow *flow, double value, size_t period,
                                  size_t begin) {
    const double before = cycle_flow_steps(flow);
    ResponsePoint *point = curve_add_point(work, value, CHOICE_ABSENT);
    TRY(status_made(point != NULL));
    point->branch = work->branch;
    Status status = cycle_flow_multiply(flow);
    if (status == STATUS_OK)
        status = curve_fill_orbit(flow, period, point);
    cycle_flow_restore(flow, cycle_flow_orbit(flow)->y);
    if (status != STATUS_OK) {
        fields_clear(response_point_fields, point);
        work->answer->points.count--;
    }
    return study_first_failure(status,
                               curve_count(work, status, cycle_flow_steps(flow) - before, begin));
}

// Follows the branch of an orbit to one side until it leaves the axis or is lost.
static Status curve_follow(CurveWork *work, const CurveStart *start, size_t period, double side) {
    const size_t n = work->size, first = work->answer->points.count;
    const double span = curve_span(work);
    CycleFlow *flow = NULL;
    Status status = STATUS_OK;
    double step = CURVE_STEP;
    cycle_flow_get(start->flow, work->at);
    for (size_t i = 0; i < n; i++) {
        work->at[i] /= cycle_flow_orbit(start->flow)->scales[i];
        work->tangent[i] = 0;
    }
    work->at[n] = work->answer->points.at[start->point].value / span;
    work->tangent[n] = side;
    while (status == STATUS_OK && step >= CURVE_STEP_MIN &&
           work->answer->points.count - first < curve_continued(work->study) / 8 &&
           work->answer->points.count + 1 < curve_points_max(work->study)) {
        int count = 0;
        CycleFlow *next = NULL;
        status = curve_advance(work);
        if (status == STATUS_OK)
            status =
                curve_correct(work, flow != NULL ? flow : start->flow, period, step, &count, &next);
        if (next == NULL) {
            step /= 2;
            continue;
        }
        cycle_flow_free(flow);
        flow = next;
        const double value = work->z[n] * span;
        if (!(value >= work->study->axis.from && value <= work->study->axis.to))
            break;
        curve_update_tangent(work);
        step = count < CURVE_EASY   ? fmin(1.5 * step, CURVE_STEP_MAX)
               : count > CURVE_HARD ? step / 2
                                    : step;
        if (status == STATUS_OK)
            status = curve_add_continued(work, flow, value, period, start->point);
    }
    cycle_flow_free(flow);
    if (study_run_ends_study(status))
        return status;
    problem_clear(work->problem);
    return STATUS_OK;
}

// Whether a curve that is continued already goes through the orbit at which a branch begins.
static bool curve_is_followed(const CurveWork *work, const ResponsePoint *begin) {
    const ResponsePoints *points = &work->answer->points;
    for (size_t i = curve_points(work->study); i + 1 < points->count; i++) {
        const ResponsePoint *a = &points->at[i], *b = a + 1;
        const double part = (begin->value - a->value) / (b->value - a->value);
        if (a->branch != b->branch || a->period != begin->period ||
            a->impacts_per_period != begin->impacts_per_period || !(part >= 0 && part <= 1))
            continue;
        const double peak =
            a->peak_displacement + part * (b->peak_displacement - a->peak_displacement);
        if (fabs(peak - begin->peak_displacement) <= CURVE_ALIKE * begin->peak_displacement)
            return true;
    }
    return false;
}

static void curve_reverse(ResponsePoints *points, size_t first) {
    for (size_t i = first, k = points->count; i + 1 < k; i++) {
        const ResponsePoint kept = points->at[i];
        points->at[i] = points->at[--k];
        points->at[k] = kept;
    }
}

static Status curve_continue(CurveWork *work, const CurveStart *start) {
    ResponsePoints *points = &work->answer->points;
    const ResponsePoint begin = points->at[start->point];
    const size_t first = points->count, period = (size_t)begin.period;
    if (curve_is_followed(work, &begin) || first >= curve_points_max(work->study))
        return STATUS_OK;
    work->size = cycle_flow_orbit(start->flow)->size;
    work->branch++;
    TRY(curve_follow(work, start, period, -1));
    curve_reverse(points, first);
    ResponsePoint *point = curve_add_point(work, begin.value, CHOICE_ABSENT);
    TRY(status_made(point != NULL));
    TRY(fields_copy(response_point_fields, &points->at[start->point], point));
    point->branch = work->branch;
    point->direction = CHOICE_ABSENT;
    return curve_follow(work, start, period, 1);
}

static Status curve_continue_all(CurveWork *work) {
    // Short periods first: long ones are many.
    for (size_t period = 1; period <= work->study->max_period; period++)
        for (size_t i = 0; i < work->start_count; i++)
            if (work->answer->points.at[work->starts[i].point].period == period)
                TRY(curve_continue(work, &work->starts[i]));
    return work->answer->points.count + 1 < curve_points_max(work->study)
               ? STATUS_OK
               : warnings_add(&work->answer->made.warnings, "/study/continuation",
                              "the continuation ended at its limit of %zu points: give a larger "
                              "count or a shorter range",
                              curve_continued(work->study));
}

static Status curve_warn(CurveWork *work) {
    StudyRuns *made = &work->answer->made;
    if (work->unsettled_count > 0)
        TRY(warnings_add(
            &made->warnings, "/study/settle_cycles",
            "settle_cycles may be too few at %zu of the points, with index %s%s: near the "
            "motion without a period is an orbit that is stable or weakly unstable. In "
            "resonance of an undamped structure no number is enough",
            work->unsettled_count, work->unsettled,
            work->unsettled_count > CURVE_NAMED ? " and more" : ""));
    return study_runs_warn(made);
}

static Status curve_begin(void *of, const StudyTools *tools, Problem *problem) {
    CurveWork *work = of;
    const ResponseStudy *study = work->study = work->work.study;
    work->answer = work->work.answer;
    work->tools = tools;
    work->problem = problem;
    work->range = (ProgressRange){tools->progress, 0, 0, 0};
    work->progress = progress_range_view(&work->range);
    const Field *field = curve_axis_field(&study->axis, work->work.simulation, problem);
    TRY(status_made(field != NULL));
    TRY(text_copy(field->unit, &work->answer->unit));
    TRY(study_axis_member(&study->axis, &work->answer->member));
    if (study->direction != CURVE_DOWN)
        TRY(curve_sweep(work, CURVE_UP));
    if (study->direction != CURVE_UP)
        TRY(curve_sweep(work, CURVE_DOWN));
    if (study->continuation)
        TRY(curve_continue_all(work));
    for (size_t i = 0; i < work->answer->points.count; i++)
        work->answer->points.at[i].index = i;
    return curve_warn(work);
}

static void curve_free(void *of) {
    CurveWork *work = of;
    for (size_t i = 0; i < work->start_count; i++)
        cycle_flow_free(work->starts[i].flow);
    cycle_flow_free(work->flow);
}

const StudyKind study_response = {
    .kind = {"response",
             "steady motion under a sine while a number varies: periodic orbits and their "
             "stability, always by the exact solver",
             response_study_fields, sizeof(ResponseStudy)},
    .answer = &(const Kind){"response", "orbits and sections at each value", response_answer_fields,
                            sizeof(ResponseCurve)},
    .shorten = "ask for fewer points, settle_cycles or section_points",
    .references = curve_references,
    .max_runs = 1000,
    .complete = curve_complete,
    .cost = curve_cost,
    .work_size = sizeof(CurveWork),
    .begin = curve_begin,
    .free = curve_free,
};
