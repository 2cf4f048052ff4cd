#include "core/plan/plan.h"

#include <stdlib.h>
#include <string.h>

#include "core/result/response.h"

// clang-format off
const Field derived_fields[] = {
    FIELD_COUNT(Derived, damper, NULL, AT_MIN(1), OPTIONAL, "number of the damper"),
    FIELD_CHOICE(Derived, side, side_names, OPTIONAL, "side of the damper"),
    FIELD_TEXT(Derived, material, 0, PRESENCE_OPTIONAL, 0, "where the numbers come from"),
    FIELD_REAL(Derived, restitution, NULL, ANY, OPTIONAL, "coefficient of restitution e"),
    FIELD_REAL(Derived, contact_time, "s", ANY, OPTIONAL, "contact time T_c of an isolated impact"),
    FIELD_REAL(Derived, effective_mass, "kg", ANY, OPTIONAL, "effective mass m_e of the pair"),
    FIELD_REAL(Derived, stiffness, "N/m", ANY, OPTIONAL, "contact stiffness k_b"),
    FIELD_REAL(Derived, damping, "N s/m", ANY, OPTIONAL, "contact damping c_b"),
    FIELD_REAL(Derived, damping_ratio, NULL, ANY, OPTIONAL, "damping ratio Z of the contact"),
    FIELD_REAL(Derived, reached_restitution, NULL, ANY, OPTIONAL, "restitution of an isolated contact under a power law, or with parameters carried over from a rig"),
    FIELD_REAL(Derived, reached_contact_time, "s", ANY, OPTIONAL, "contact time of that contact"),
    FIELD_REAL(Derived, identified_mass, "kg", ANY, OPTIONAL, "effective mass of the rig"),
    FIELD_REAL(Derived, exponent, NULL, ANY, OPTIONAL, "exponent n of a power law"),
    FIELD_REAL(Derived, factor, NULL, ANY, OPTIONAL, "a power law's dissipation factor: D, or xi"),
    FIELD_END
};

const Field mode_fields[] = {
    FIELD_REAL(PlanMode, frequency, "Hz", ANY, OPTIONAL, "natural frequency without damping"),
    FIELD_REAL(PlanMode, damping_ratio, NULL, ANY, OPTIONAL, "damping ratio xi of the mode by itself; unknown where it does not swing"),
    FIELD_END
};

static const Field attempt_fields[] = {
    FIELD_TEXT(PlanAttempt, way, 0, PRESENCE_OPTIONAL, 0, "settings of the run"),
    FIELD_REAL(PlanAttempt, predicted_error, NULL, ANY, OPTIONAL, "predicted relative error"),
    FIELD_REAL(PlanAttempt, estimated_error, NULL, ANY, OPTIONAL, "relative error estimated by the run"),
    FIELD_REAL(PlanAttempt, steps, NULL, ANY, OPTIONAL, "solver steps, counted"),
    FIELD_END
};

static const char *const verdict_names[] = {"kept", "missed", "unknown", NULL};

const Field target_fields[] = {
    FIELD_REAL(PlanTarget, error, NULL, ANY, OPTIONAL, "requested relative error"),
    FIELD_CHOICE(PlanTarget, metric, metric_names, OPTIONAL, "quantity that has the error"),
    FIELD_TEXT(PlanTarget, way, 0, PRESENCE_OPTIONAL, 0, "settings chosen; after a run those of the result"),
    FIELD_REAL(PlanTarget, predicted_error, NULL, ANY, OPTIONAL, "predicted relative error of these settings"),
    FIELD_REAL(PlanTarget, estimated_error, NULL, ANY, OPTIONAL, "relative error estimated by the run"),
    FIELD_CHOICE(PlanTarget, verdict, verdict_names, OPTIONAL, "whether the estimated error keeps the requested one; unknown where it could not be estimated"),
    FIELD_LIST(PlanTarget, attempts, attempt_fields, 0, PRESENCE_OPTIONAL, "all runs of the search"),
    FIELD_END
};

const Field plan_report_fields[] = {
    FIELD_TEXT(PlanReport, contact_model, 0, PRESENCE_OPTIONAL, 0, "contact model of the run"),
    FIELD_TEXT(PlanReport, solver, 0, PRESENCE_OPTIONAL, 0, "solver of the run"),
    FIELD_ITEM(PlanReport, target, target_fields, NULL, PRESENCE_OPTIONAL, "outcome of accuracy.target; null without one"),
    FIELD_LIST(PlanReport, decisions, decision_fields, 0, PRESENCE_DEFAULT, "choices with their reasons"),
    FIELD_LIST(PlanReport, derived, derived_fields, 0, PRESENCE_DEFAULT, "contact parameters for this pair of masses"),
    FIELD_LIST(PlanReport, modes, mode_fields, 0, PRESENCE_DEFAULT, "natural modes of the structure, the slowest first"),
    FIELD_END
};
// clang-format on

// The parameters of an isolated contact of this pair of masses, where they are the same at all
// speeds.
static void stops_report(const ContactStop *stop, double mass, Derived *derived) {
    const ContactParameters *own = &stop->parameters;
    const bool is_carried = stop->mass != mass;
    derived->effective_mass = mass;
    derived->identified_mass = is_carried ? stop->mass : (double)NAN;
    derived->restitution = own->restitution;
    derived->contact_time = stop->numbers.contact_time;
    derived->stiffness =
        stop->law->form == CONTACT_POWER ? stop->numbers.stiffness : own->stiffness;
    derived->damping = stop->law->form == CONTACT_POWER ? (double)NAN : own->damping;
    derived->exponent = own->exponent;
    derived->damping_ratio = derived->factor = (double)NAN;
    derived->reached_restitution = derived->reached_contact_time = (double)NAN;
    if (stop->law->form == CONTACT_IMPULSIVE || stop->numbers.rows.count > 0)
        return;
    if (stop->law->form == CONTACT_POWER) {
        derived->factor = own->factor;
        derived->reached_restitution = stop->law->restitution(own->factor, own->exponent);
        derived->reached_contact_time =
            stop->numbers.contact_time * pow(mass / stop->mass, 1 / (own->exponent + 1));
        return;
    }
    const Identification found = identification_from_stiffness(mass, own->stiffness, own->damping,
                                                               (Separation)stop->separation);
    derived->damping_ratio = found.damping_ratio;
    if (isnan(stop->numbers.contact_time)) {
        derived->restitution = found.restitution;
        derived->contact_time = found.contact_time;
    } else if (is_carried) {
        derived->reached_restitution = found.restitution;
        derived->reached_contact_time = found.contact_time;
    }
}

// Replaces rows borrowed from the scene by a copy, because the plan outlives the scene.
static Status stops_copy_rows(ContactRows *rows) {
    if (rows->count == 0)
        return STATUS_OK;
    ContactRow *own = malloc(rows->count * sizeof *own);
    if (own != NULL)
        memcpy(own, rows->at, rows->count * sizeof *own);
    rows->at = own;
    return own != NULL ? STATUS_OK : STATUS_NO_MEMORY;
}

// Prepares both stops of the damper `index`, whose mass and effective mass the plan has. Released
// by stops_clear, also after a failure.
static Status stops_make(const Scene *scene, Plan *plan, size_t index) {
    const Damper *damper = &scene->dampers.at[index];
    PlanDamper *planned = &plan->dampers[index];
    const double mass = planned->effective_mass;
    for (int side = 0; side < 2; side++) {
        const Buffer *buffer = damper_buffer(damper, (Side)side);
        const ContactNumbers numbers = buffer_numbers(buffer);
        ContactStop *stop = &planned->stops[side];
        *stop = contact_stop_prepare(plan->law, scene_contact(scene)->separation,
                                     damper_identified_mass(damper, mass), mass, &numbers);
        TRY(stops_copy_rows(&stop->numbers.rows));
        Derived *derived = &plan->report.derived.at[plan->report.derived.count++];
        derived->damper = index + 1;
        derived->side = side;
        stops_report(stop, mass, derived);
        if (buffer->material != NULL && (derived->material = strdup(buffer->material)) == NULL)
            return STATUS_NO_MEMORY;
    }
    return STATUS_OK;
}

static void stops_clear(Plan *plan) {
    for (size_t i = 0; i < plan->damper_count; i++)
        for (int side = 0; side < 2; side++)
            free(plan->dampers[i].stops[side].numbers.rows.at);
}

static bool stop_varies(const ContactStop *stop) {
    return stop->numbers.rows.count > 0 || (stop->law != NULL && stop->law->form == CONTACT_POWER);
}

bool stops_vary(const PlanDamper *damper) {
    return stop_varies(&damper->stops[SIDE_LEFT]) || stop_varies(&damper->stops[SIDE_RIGHT]);
}

ContactParameters stops_freeze(const ContactStop *stop, double approach_speed) {
    return stop_varies(stop) ? contact_parameters_at(stop, approach_speed) : stop->parameters;
}

static Status plan_decide_contact(const Scene *scene, Plan *plan) {
    Decisions *decisions = &plan->report.decisions;
    const Contact *contact = scene_contact(scene);
    const ContactLaw *law = plan->law;
    if (plan->damper_count == 0)
        return decisions_add(decisions, "contact_model", "none", NAN, NULL,
                             "the scene has no damper");
    if (contact_law(contact)->form != CONTACT_CHOSEN)
        return decisions_add(decisions, "contact_model", law->kind.name, NAN, NULL,
                             "the scene asks for it");
    if (law->form == CONTACT_IMPULSIVE)
        return decisions_add(decisions, "contact_model", law->kind.name, NAN, NULL,
                             "the buffers have a restitution but no contact time");
    for (size_t i = 0; i < 2 * scene->dampers.count; i++) {
        const Buffer *buffer = damper_buffer(&scene->dampers.at[i / 2], (Side)(i % 2));
        if (buffer->table.count > 0)
            return decisions_add(decisions, "contact_model", law->kind.name, NAN, NULL,
                                 "contact times are given over the approach speed");
        if (!isnan(buffer->contact_time))
            return decisions_add(decisions, "contact_model", law->kind.name, buffer->contact_time,
                                 "s", "a contact time is given");
    }
    return decisions_add(decisions, "contact_model", law->kind.name,
                         damper_buffer(&scene->dampers.at[0], SIDE_LEFT)->stiffness, "N/m",
                         "a contact stiffness is given");
}

// Matrices and vectors in one block, dampers in another.
static Status plan_allocate(Plan *plan, size_t storeys, size_t dampers) {
    plan->storeys = storeys;
    plan->mass = calloc(storeys, (3 * storeys + 3) * sizeof *plan->mass);
    plan->dampers = calloc(dampers > 0 ? dampers : 1, sizeof *plan->dampers);
    plan->report.derived.at =
        calloc(dampers > 0 ? 2 * dampers : 1, sizeof *plan->report.derived.at);
    if (plan->mass == NULL || plan->dampers == NULL || plan->report.derived.at == NULL)
        return STATUS_NO_MEMORY;
    plan->stiffness = plan->mass + storeys * storeys;
    plan->damping = plan->stiffness + storeys * storeys;
    plan->influence = plan->damping + storeys * storeys;
    plan->displacement = plan->influence + storeys;
    plan->velocity = plan->displacement + storeys;
    return STATUS_OK;
}

static Status plan_damper(const Scene *scene, Plan *plan, size_t index) {
    const Structure *structure = scene_structure(scene);
    const Damper *damper = &scene->dampers.at[index];
    const size_t storey = (size_t)damper->storey - 1;
    double moved;
    TRY(structure_kind(structure)->moved_mass(structure, storey, &moved));
    plan->dampers[index] = (PlanDamper){
        .storey = storey,
        .mass = damper->mass,
        .effective_mass = contact_effective_mass(moved, damper->mass),
        .clearance = damper->clearance,
        .offset = damper->offset,
        .position = damper->position,
        .velocity = damper->velocity,
    };
    plan->damper_count = index + 1;
    return stops_make(scene, plan, index);
}

static void plan_copy_start(const Reals *given, double *start) {
    for (size_t i = 0; i < given->count; i++)
        start[i] = given->at[i];
}

bool plan_is_single_in_flight(const Plan *plan) {
    return plan->storeys == 1 && plan->influence[0] == 1 && plan->damper_count <= 1;
}

bool plan_is_single(const Plan *plan) {
    return plan_is_single_in_flight(plan) && plan->separation == SEPARATION_ZERO_PENETRATION &&
           (plan->damper_count == 0 || !stops_vary(&plan->dampers[0]));
}

// The same ratio in every mode is C = M (sum of 2 xi omega_k phi_k phi_k') M.
static Status plan_damp_modes(Plan *plan, double ratio, Problem *problem) {
    Modes *modes = &plan->modes;
    const size_t n = plan->storeys;
    // The columns of M Phi, stored in the damping's rows until these are computed.
    double *moved = modes->damping;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) {
            double sum = 0;
            for (size_t j = 0; j < n; j++)
                sum += plan->mass[i * n + j] * modes->shapes[j * n + k];
            moved[i * n + k] = sum;
        }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j <= i; j++) {
            double sum = 0;
            for (size_t k = 0; k < n; k++)
                sum += 2 * ratio * modes->omega[k] * moved[i * n + k] * moved[j * n + k];
            plan->damping[i * n + j] = plan->damping[j * n + i] = sum;
            if (!isfinite(sum))
                return problem_set(problem, STATUS_UNSTABLE,
                                   "a damping_ratio of %g gives a damping that double precision "
                                   "cannot hold",
                                   ratio);
        }
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++)
            modes->damping[i * n + k] = i == k ? 2 * ratio * modes->omega[k] : 0;
    modes->is_classical = true;
    return STATUS_OK;
}

static Status plan_decide_damping(Plan *plan, bool is_ratio) {
    return decisions_add(&plan->report.decisions, "damping",
                         plan->modes.is_classical ? "modal" : "coupled", NAN, NULL, "%s",
                         is_ratio ? "the scene gives one damping ratio for every mode"
                         : plan->modes.is_classical
                             ? "the damping matrix does not couple the structure's modes"
                             : "the damping matrix couples the structure's modes");
}

static PlanMode plan_mode_of(double omega, double damping) {
    return (PlanMode){omega / (2 * 3.14159265358979323846),
                      omega > 0 ? damping / (2 * omega) : (double)NAN};
}

static Status plan_modes(const Structure *structure, Plan *plan, Problem *problem) {
    const size_t n = plan->storeys;
    const double ratio = structure->damping_ratio;
    PlanModes *report = &plan->report.modes;
    report->at = calloc(n, sizeof *report->at);
    if (report->at == NULL)
        return STATUS_NO_MEMORY;
    report->count = n;
    if (plan_is_single(plan)) {
        report->at[0] = plan_mode_of(sqrt(plan->stiffness[0] / plan->mass[0]),
                                     plan->damping[0] / plan->mass[0]);
        return STATUS_OK;
    }
    TRY(modes_make(&plan->modes, n, plan->mass, plan->stiffness, plan->damping, plan->influence,
                   problem));
    if (!isnan(ratio) && n > 1)
        TRY(plan_damp_modes(plan, ratio, problem));
    for (size_t k = 0; k < n; k++)
        report->at[k] = plan_mode_of(plan->modes.omega[k], plan->modes.damping[k * n + k]);
    return n > 1 ? plan_decide_damping(plan, !isnan(ratio)) : STATUS_OK;
}

// Everything but modes and decisions.
static Status plan_values(const Scene *scene, Plan *plan) {
    const Structure *structure = scene_structure(scene);
    const Excitation *excitation = scene_excitation(scene);
    TRY(fields_default(plan_report_fields, &plan->report));
    TRY(plan_allocate(plan, structure_storeys(structure), scene->dampers.count));
    structure_assemble(structure, &(const StructureMatrices){plan->mass, plan->stiffness,
                                                             plan->damping, plan->influence});
    plan->has_drifts = structure_kind(structure)->has_drifts;
    plan_copy_start(&excitation->displacement, plan->displacement);
    plan_copy_start(&excitation->velocity, plan->velocity);
    plan->duration = scene->duration;
    plan->sample_rate = scene->sample_rate;
    plan->count = scene_sample_count(scene);
    plan->law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    plan->form = plan->law->form;
    plan->separation = plan->form == CONTACT_LINEAR ? (Separation)scene_contact(scene)->separation
                                                    : SEPARATION_ZERO_PENETRATION;
    for (size_t i = 0; i < scene->dampers.count; i++)
        TRY(plan_damper(scene, plan, i));
    return STATUS_OK;
}

static Status plan_fill(const Scene *scene, const char *asked, const char *solver, Plan *plan,
                        Problem *problem) {
    TRY(plan_values(scene, plan));
    TRY(plan_decide_contact(scene, plan));
    TRY(plan_modes(scene_structure(scene), plan, problem));
    TRY(decisions_add(
        &plan->report.decisions, "solver", solver, NAN, NULL,
        strcmp(asked, solver) == 0 ? "the scene asks for it"
        : plan->form == CONTACT_POWER
            ? "flight is linear and has an exact solution; contacts under a power law "
              "are integrated to the limit of rounding"
            : "every contact state is linear and has an exact solution"));
    plan->report.contact_model = strdup(plan->damper_count > 0 ? plan->law->kind.name : "none");
    plan->report.solver = strdup(solver);
    return plan->report.contact_model != NULL && plan->report.solver != NULL ? STATUS_OK
                                                                             : STATUS_NO_MEMORY;
}

Status plan_new(const Scene *scene, const char *asked, const char *solver, Plan **plan,
                Problem *problem) {
    *plan = calloc(1, sizeof **plan);
    const Status status =
        *plan == NULL ? STATUS_NO_MEMORY : plan_fill(scene, asked, solver, *plan, problem);
    if (status == STATUS_OK)
        return STATUS_OK;
    plan_free(*plan);
    *plan = NULL;
    return status == STATUS_NO_MEMORY ? problem_set(problem, status, "no memory for the plan")
                                      : status;
}

Status plan_sketch(const Scene *scene, size_t modes, Plan **plan) {
    StructureRates rates;
    TRY(structure_rates(scene_structure(scene), modes, &rates));
    *plan = calloc(1, sizeof **plan);
    const Status status = *plan == NULL ? STATUS_NO_MEMORY : plan_values(scene, *plan);
    if (status != STATUS_OK) {
        plan_free(*plan);
        return status;
    }
    (*plan)->fastest = rates.fastest;
    (*plan)->kept = modes;
    (*plan)->modes.is_classical = !isnan(scene_structure(scene)->damping_ratio);
    return STATUS_OK;
}

void plan_free(Plan *plan) {
    if (plan == NULL)
        return;
    fields_clear(plan_report_fields, &plan->report);
    stops_clear(plan);
    modes_clear(&plan->modes);
    free(plan->mass);
    free(plan->dampers);
    free(plan);
}
