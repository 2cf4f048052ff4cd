// Precise time integration: Zhong and Williams, Computers & Structures 56 (1995) 113-120. With a
// base that is linear over a step, a_g = g + s t, the state and (g, s) follow a constant system
//
//   y' = A y + b g,   g' = s,   s' = 0
//
// Its matrix exponential is computed once per set of contacts and step length, and multiplies the
// state step by step. The result is exact while no contact begins or ends and the base is linear in
// every step. Uncoupled modes leave many zeros in the rows; only nonzero values are stored.
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/engine.h"
#include "core/solve/time_stepping.h"

// Limits of the cache: tables, and their values together; two tables fit in any case.
enum { TABLES_MAX = 64 };
static const size_t VALUES_MAX = (size_t)1 << 20;

// The state's rows of exp(A h) - I, as a sparse matrix in compressed rows.
typedef struct PreciseTable {
    double *key;       // step, then stiffness and damping of each damper in contact, else zeros
    double *values;    // behind the key
    uint32_t *starts;  // of the rows, and their end
    uint32_t *columns; // behind the starts
} PreciseTable;

typedef struct Precise {
    size_t wide;                   // of the state, g and s
    size_t max, count, next, last; // tables: limit, stored, next to replace, used last
    size_t key_size;
    double *key;  // of the table for this step
    double *from; // (y, g, s) at the step's start
    PreciseTable tables[TABLES_MAX];
    double values[];
} Precise;

static Status precise_make(TimeStepping *stepping) {
    const size_t m = stepping->state.dampers, wide = stepping->size + 2;
    const size_t key_size = 1 + 2 * m, fit = VALUES_MAX / (wide * wide);
    TRY(time_stepping_make_method(stepping, sizeof(Precise) + (key_size + wide) * sizeof(double)));
    Precise *precise = stepping->method;
    precise->wide = wide;
    precise->key_size = key_size;
    precise->max = fit < 2 ? 2 : fit > TABLES_MAX ? TABLES_MAX : fit;
    precise->key = precise->values;
    precise->from = precise->key + key_size;
    return STATUS_OK;
}

static void precise_table_clear(PreciseTable *table) {
    free(table->key);
    free(table->starts);
    *table = (PreciseTable){0};
}

static void precise_clear(TimeStepping *stepping) {
    Precise *precise = stepping->method;
    for (size_t i = 0; i < precise->count; i++)
        precise_table_clear(&precise->tables[i]);
}

// The place of a component of y = (q, p, r, w; g, s) in the rows of transition.h.
static size_t precise_place(const ModalState *state, size_t i) {
    const size_t n = state->mode_count, m = state->dampers;
    return i < n || i >= 2 * n + m ? i : i < 2 * n ? i + m : i - n;
}

// Stores the nonzero values of the state's rows of T.
static void precise_compress(const TimeStepping *stepping, const double *T, PreciseTable *table) {
    const Precise *precise = stepping->method;
    uint32_t count = 0;
    table->values = table->key + precise->key_size;
    table->columns = table->starts + stepping->size + 1;
    memcpy(table->key, precise->key, precise->key_size * sizeof *table->key);
    for (size_t i = 0; i < stepping->size; i++) {
        const double *row = T + precise_place(&stepping->state, i) * precise->wide;
        table->starts[i] = count;
        for (size_t j = 0; j < precise->wide; j++) {
            const double value = row[precise_place(&stepping->state, j)];
            if (value != 0) {
                table->columns[count] = (uint32_t)j;
                table->values[count++] = value;
            }
        }
    }
    table->starts[stepping->size] = count;
}

static Status precise_make_table(TimeStepping *stepping, PreciseTable *table) {
    const Precise *precise = stepping->method;
    ModalState *state = &stepping->state;
    const size_t square = precise->wide * precise->wide;
    double *T = malloc(square * sizeof *T);
    Status status = STATUS_NO_MEMORY;
    if (T != NULL)
        status = transition_increment(state, precise->key[0], T, state->problem);
    if (status == STATUS_OK) {
        size_t count = 0;
        for (size_t i = 0; i < square; i++)
            count += T[i] != 0;
        table->key = malloc((precise->key_size + count) * sizeof *table->key);
        table->starts = malloc((stepping->size + 1 + count) * sizeof *table->starts);
        if (table->key != NULL && table->starts != NULL) {
            precise_compress(stepping, T, table);
        } else {
            precise_table_clear(table);
            status = STATUS_NO_MEMORY;
        }
    }
    free(T);
    return status != STATUS_NO_MEMORY
               ? status
               : problem_set(state->problem, status, "no memory for the exponentials of %zu modes",
                             state->mode_count);
}

// At least two tables, mostly zeros where modes do not couple.
static double precise_step_cost(size_t modes, size_t dampers, bool is_coupled, double *setup) {
    const double n = (double)modes, m = (double)dampers, size = 2 * (n + m);
    *setup = 2 * (is_coupled ? 0.15 : 0.05) * size * size * size;
    return 4 + 0.15 * n * (1 + m) + (is_coupled ? 0.052 : 0.012) * n * n;
}

static Status precise_find_table(TimeStepping *stepping, double length,
                                 const PreciseTable **table) {
    Precise *precise = stepping->method;
    const ModalState *state = &stepping->state;
    const size_t m = state->dampers;
    precise->key[0] = length;
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        const bool is_pressed = damper->phase == PHASE_CONTACT;
        precise->key[1 + d] = is_pressed ? damper->contact.stiffness : 0;
        precise->key[1 + m + d] = is_pressed ? damper->contact.damping : 0;
    }
    for (size_t i = 0; i < precise->count; i++) {
        const size_t at = (precise->last + i) % precise->count; // most recently used first
        if (memcmp(precise->tables[at].key, precise->key,
                   precise->key_size * sizeof *precise->key) != 0)
            continue;
        precise->last = at;
        *table = &precise->tables[at];
        return STATUS_OK;
    }
    const size_t at = precise->next;
    precise->next = (precise->next + 1) % precise->max;
    if (at < precise->count)
        precise_table_clear(&precise->tables[at]);
    TRY(precise_make_table(stepping, &precise->tables[at]));
    if (at == precise->count)
        precise->count++;
    double setup;
    (void)precise_step_cost(state->mode_count, m, state->diagonal == NULL, &setup);
    state->run->steps += setup / 2; // the predicted cost includes two tables
    precise->last = at;
    *table = &precise->tables[at];
    return STATUS_OK;
}

static Status precise_step(TimeStepping *stepping, double length) {
    Precise *precise = stepping->method;
    const size_t size = stepping->size;
    const PreciseTable *table;
    TRY(precise_find_table(stepping, length, &table));
    double *from = precise->from;
    memcpy(from, stepping->y, size * sizeof *from);
    from[size] = stepping->ground[0];
    from[size + 1] = (stepping->ground[2] - stepping->ground[0]) / length;
    for (size_t i = 0; i < size; i++) {
        double sum = 0;
        for (size_t j = table->starts[i]; j < table->starts[i + 1]; j++)
            sum += table->values[j] * from[table->columns[j]];
        stepping->y[i] += sum;
    }
    time_stepping_integrate(stepping, from, stepping->y, length, true);
    return STATUS_OK;
}

static const Stepper precise_stepper = {.order = 2, // with a base that is not linear in a step
                                        .between =
                                            "it is rounding, if the base is linear in every step",
                                        .make = precise_make,
                                        .step = precise_step,
                                        .clear = precise_clear,
                                        .cost = precise_step_cost,
                                        .is_by_contacts = true};

const Solver solver_precise = {
    .kind = {"precise",
             "high precision direct integration (Zhong and Williams 1994), contacts switched at "
             "step ends",
             accuracy_step_fields, sizeof(AccuracyStep)},
    .run = time_stepping_run,
    .decide = time_stepping_decide,
    .cost = time_stepping_cost,
    .stepper = &precise_stepper,
    .is_linear_only = true,
};
