// The paper's own scheme: Zhong and Williams, Computers & Structures 56 (1995) 113-120. With the
// base linear over a step, a_g = g + s t, the state and (g, s) together follow a constant system
//
//   y' = A y + b g,   g' = s,   s' = 0
//
// whose exponential is made once per set of pressed stops, and applied step by step. Exact while no
// contact begins or ends and the base is linear in every step. Its rows hold many zeros where modes
// do not couple: only what is not zero is kept.
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/matrix_exponential.h"
#include "core/solve/steps_run.h"

// Tables that are kept: so many at most, and of so many values each at least two.
enum { TABLES_MAX = 64 };
static const size_t VALUES_MAX = (size_t)1 << 20;

typedef struct Table {
    double *key;    // step, then stiffness and damping of each damper in contact, else zeros
    size_t *starts; // of the rows; one more than those
    uint32_t *columns;
    double *values; // of exp(A h) - I, the state's rows
} Table;

typedef struct Precise {
    size_t wide; // state, g and s
    size_t most, count, next, last;
    size_t key_size;
    double *key;  // what is wanted
    double *from; // (y, g, s) before the step
    double *y, *force, *rate;
    double *block;
    Table tables[TABLES_MAX];
} Precise;

static Status no_memory(const Steps *steps) {
    return problem_set(steps->state.problem, STATUS_NO_MEMORY,
                       "no memory for the exponentials of %zu modes", steps->state.mode_count);
}

static Status precise_make(Steps *steps) {
    const ModalState *state = &steps->state;
    const size_t m = state->dampers, size = steps->size;
    Precise *own = calloc(1, sizeof *own);
    steps->own = own;
    if (own == NULL)
        return no_memory(steps);
    own->wide = size + 2;
    own->key_size = 1 + 2 * m;
    const size_t fit = VALUES_MAX / (own->wide * own->wide);
    own->most = fit < 2 ? 2 : fit > TABLES_MAX ? TABLES_MAX : fit;
    own->block = calloc(own->key_size + own->wide + 2 * size + m, sizeof *own->block);
    if (own->block == NULL)
        return no_memory(steps);
    own->key = own->block;
    own->from = own->key + own->key_size;
    own->y = own->from + own->wide;
    own->rate = own->y + size;
    own->force = own->rate + size;
    return STATUS_OK;
}

static void forget(Table *table) {
    free(table->key);
    free(table->starts);
    free(table->columns);
    free(table->values);
    memset(table, 0, sizeof *table);
}

static void precise_clear(Steps *steps) {
    Precise *own = steps->own;
    if (own == NULL)
        return;
    for (size_t i = 0; i < own->count; i++)
        forget(&own->tables[i]);
    free(own->block);
    free(own);
    steps->own = NULL;
}

// The columns of A are what the equations of motion make of unit states.
static void make_system(Steps *steps, double *A) {
    Precise *own = steps->own;
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count, m = state->dampers, size = steps->size, wide = own->wide;
    for (size_t column = 0; column <= size; column++) {
        memset(own->y, 0, size * sizeof *own->y);
        if (column < size)
            own->y[column] = 1;
        for (size_t d = 0; d < m; d++)
            own->force[d] =
                own->key[1 + d] * own->y[2 * n + d] + own->key[1 + m + d] * own->y[2 * n + m + d];
        steps_rate(steps, own->y, column == size ? 1 : 0, own->force, own->rate);
        for (size_t i = 0; i < size; i++)
            A[i * wide + column] = own->rate[i];
    }
    A[size * wide + size + 1] = 1;
}

// Keeps what is not zero of the state's rows.
static Status compress(const Precise *own, size_t size, const double *T, Table *table) {
    size_t count = 0;
    for (size_t i = 0; i < size * own->wide; i++)
        count += T[i] != 0;
    table->starts = malloc((size + 1) * sizeof *table->starts);
    table->columns = malloc((count + 1) * sizeof *table->columns);
    table->values = malloc((count + 1) * sizeof *table->values);
    if (table->starts == NULL || table->columns == NULL || table->values == NULL)
        return STATUS_NO_MEMORY;
    count = 0;
    for (size_t i = 0; i < size; i++) {
        table->starts[i] = count;
        for (size_t j = 0; j < own->wide; j++)
            if (T[i * own->wide + j] != 0) {
                table->columns[count] = (uint32_t)j;
                table->values[count++] = T[i * own->wide + j];
            }
    }
    table->starts[size] = count;
    return STATUS_OK;
}

static Status make_table(Steps *steps, Table *table) {
    const Precise *own = steps->own;
    const ModalState *state = &steps->state;
    const size_t square = own->wide * own->wide;
    double *A = calloc(square, 4 * sizeof *A);
    table->key = malloc(own->key_size * sizeof *table->key);
    Status status = STATUS_NO_MEMORY;
    if (A != NULL && table->key != NULL) {
        memcpy(table->key, own->key, own->key_size * sizeof *table->key);
        make_system(steps, A);
        status = exponential_doublings(A, own->wide, own->key[0], A + square, A + 2 * square,
                                       state->run->progress,
                                       modal_state_time(state) / state->plan->duration)
                     ? compress(own, steps->size, A + square, table)
                     : STATUS_CANCELLED;
    }
    free(A);
    if (status == STATUS_OK)
        return STATUS_OK;
    forget(table);
    return status == STATUS_CANCELLED
               ? problem_set(state->problem, status, "cancelled at t = %.6g s",
                             modal_state_time(state))
               : no_memory(steps);
}

static Status find_table(Steps *steps, double length, const Table **table) {
    Precise *own = steps->own;
    const ModalState *state = &steps->state;
    const size_t m = state->dampers;
    own->key[0] = length;
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        const bool is_pressed = damper->phase == PHASE_CONTACT;
        own->key[1 + d] = is_pressed ? damper->contact.stiffness : 0;
        own->key[1 + m + d] = is_pressed ? damper->contact.damping : 0;
    }
    for (size_t i = 0; i < own->count; i++) {
        const size_t at = (own->last + i) % own->count; // the last one first
        if (memcmp(own->tables[at].key, own->key, own->key_size * sizeof *own->key) != 0)
            continue;
        own->last = at;
        *table = &own->tables[at];
        return STATUS_OK;
    }
    const size_t at = own->next;
    own->next = (own->next + 1) % own->most;
    if (at < own->count)
        forget(&own->tables[at]);
    TRY(make_table(steps, &own->tables[at]));
    if (at == own->count)
        own->count++;
    double making;
    (void)steps->stepper->cost(state->mode_count, m, state->diagonal == NULL, &making);
    state->run->steps += making / 2; // two are in what was foretold
    own->last = at;
    *table = &own->tables[at];
    return STATUS_OK;
}

static Status precise_step(Steps *steps, double length) {
    Precise *own = steps->own;
    const size_t size = steps->size;
    const Table *table;
    TRY(find_table(steps, length, &table));
    double *from = own->from;
    memcpy(from, steps->y, size * sizeof *from);
    from[size] = steps->ground[0];
    from[size + 1] = (steps->ground[2] - steps->ground[0]) / length;
    for (size_t i = 0; i < size; i++) {
        double sum = 0;
        for (size_t j = table->starts[i]; j < table->starts[i + 1]; j++)
            sum += table->values[j] * from[table->columns[j]];
        steps->y[i] += sum;
    }
    steps_sum(steps, from, steps->y, length, true);
    return STATUS_OK;
}

// Two tables at least are made, mostly of zeros where modes do not couple.
static double precise_cost(size_t modes, size_t dampers, bool is_coupled, double *making) {
    const double n = (double)modes, m = (double)dampers, size = 2 * (n + m);
    *making = 2 * (is_coupled ? 0.15 : 0.05) * size * size * size;
    return 4 + 0.15 * n * (1 + m) + (is_coupled ? 0.052 : 0.012) * n * n;
}

static const Stepper stepper = {.name = "precise",
                                .between = "it is rounding, if the base is linear in every step",
                                .order = 2, // with a base that is not linear in a step
                                .is_linear_only = true,
                                .make = precise_make,
                                .step = precise_step,
                                .clear = precise_clear,
                                .cost = precise_cost};

static Status run_all(Run *run, Response *response, Problem *problem) {
    return steps_run(run, &stepper, response, problem);
}

static Status decide(const Accuracy *accuracy, double base_interval, Plan *plan, Problem *problem) {
    return steps_decide(accuracy, &stepper, base_interval, plan, problem);
}

static double cost(const Accuracy *accuracy, double base_interval, const Plan *plan) {
    return steps_cost(accuracy, &stepper, base_interval, plan);
}

const Solver solver_precise = {
    .kind = {"precise",
             "high precision direct integration (Zhong and Williams 1994), contacts switched at "
             "step ends",
             accuracy_step_fields, sizeof(AccuracyStep)},
    .run = run_all,
    .decide = decide,
    .cost = cost,
    .is_linear_only = true,
};
