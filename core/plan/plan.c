#include "core/plan/plan.h"

#include <stdlib.h>
#include <string.h>

#include "core/plan/contact_setup.h"

static Status decide_contact(const Scene *scene, Plan *plan) {
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
                             "only restitution is known, no contact time");
    for (size_t i = 0; i < 2 * scene->dampers.count; i++) {
        const Buffer *buffer = damper_buffer(&scene->dampers.at[i / 2], (Side)(i % 2));
        if (buffer->table.count > 0)
            return decisions_add(decisions, "contact_model", law->kind.name, NAN, NULL,
                                 "contact times over approach speed are known");
        if (!isnan(buffer->contact_time))
            return decisions_add(decisions, "contact_model", law->kind.name, buffer->contact_time,
                                 "s", "a contact time is known");
    }
    return decisions_add(decisions, "contact_model", law->kind.name,
                         damper_buffer(&scene->dampers.at[0], SIDE_LEFT)->stiffness, "N/m",
                         "a contact stiffness is known");
}

// Room for matrices, vectors and dampers; one block each, so that plan_free need not know sizes.
static Status plan_room(Plan *plan, size_t storeys, size_t dampers) {
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
        .effective_mass = effective_mass(moved, damper->mass),
        .clearance = damper->clearance,
        .offset = damper->offset,
        .position = damper->position,
        .velocity = damper->velocity,
    };
    plan->damper_count = index + 1;
    return stops_make(scene, plan, index);
}

static void start(const Reals *given, double *start) {
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
static Status damp_modes(Plan *plan, double ratio, Problem *problem) {
    Modes *modes = &plan->modes;
    const size_t n = plan->storeys;
    // The columns of M Phi, in place of the damping's rows until those are known.
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

static Status decide_damping(Plan *plan, bool is_ratio) {
    return decisions_add(&plan->report.decisions, "damping",
                         plan->modes.is_classical ? "modal" : "coupled", NAN, NULL, "%s",
                         is_ratio ? "the scene gives one damping ratio for every mode"
                         : plan->modes.is_classical
                             ? "the damping matrix does not couple the structure's modes"
                             : "the damping matrix couples the structure's modes");
}

static PlanMode mode_of(double omega, double damping) {
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
        report->at[0] =
            mode_of(sqrt(plan->stiffness[0] / plan->mass[0]), plan->damping[0] / plan->mass[0]);
        return STATUS_OK;
    }
    TRY(modes_make(&plan->modes, n, plan->mass, plan->stiffness, plan->damping, plan->influence,
                   problem));
    if (!isnan(ratio) && n > 1)
        TRY(damp_modes(plan, ratio, problem));
    for (size_t k = 0; k < n; k++)
        report->at[k] = mode_of(plan->modes.omega[k], plan->modes.damping[k * n + k]);
    return n > 1 ? decide_damping(plan, !isnan(ratio)) : STATUS_OK;
}

// All but the modes and the reasons.
static Status plan_values(const Scene *scene, Plan *plan) {
    const Structure *structure = scene_structure(scene);
    const Excitation *excitation = scene_excitation(scene);
    TRY(fields_default(plan_report_fields, &plan->report));
    TRY(plan_room(plan, structure_storeys(structure), scene->dampers.count));
    structure_fill(structure,
                   &(const Matrices){plan->mass, plan->stiffness, plan->damping, plan->influence});
    start(&excitation->displacement, plan->displacement);
    start(&excitation->velocity, plan->velocity);
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
    TRY(decide_contact(scene, plan));
    TRY(plan_modes(scene_structure(scene), plan, problem));
    TRY(decisions_add(&plan->report.decisions, "solver", solver, NAN, NULL,
                      strcmp(asked, solver) == 0 ? "the scene asks for it"
                      : plan->form == CONTACT_POWER
                          ? "flight is linear, so its motion is known exactly; contacts under a "
                            "power law are integrated to rounding's edge"
                          : "every contact state is linear, so its motion is known exactly"));
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
    *plan = calloc(1, sizeof **plan);
    if (*plan == NULL)
        return STATUS_NO_MEMORY;
    StructureRates rates;
    Status status = plan_values(scene, *plan);
    if (status == STATUS_OK)
        status = structure_rates_of(scene_structure(scene), modes, &rates);
    if (status == STATUS_OK) {
        (*plan)->fastest = rates.fastest;
        (*plan)->kept = modes;
        (*plan)->modes.is_classical = !isnan(scene_structure(scene)->damping_ratio);
        return STATUS_OK;
    }
    plan_free(*plan);
    *plan = NULL;
    return status;
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
