// With relative standard deviations r_e and r_T, error propagation (identification_sensitivity.h)
// gives
//
//   r_k^2 = (s_ke r_e)^2 + (2 r_T)^2,  r_c^2 = (r_e / ln e)^2 + r_T^2,
//
// for every mass: k_b and c_b are proportional to it. The uncertainties of Z, and of e and T_c
// where k_b and c_b are those of the test's pair, follow by differences of the identification
// itself.
#include "core/drop_test/pair_parameters.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/contact/identification.h"
#include "core/math/student_t.h"

// clang-format off
static const Field figure_fields[] = {
    FIELD_REAL(PairFigure, value, NULL, ANY, OPTIONAL, "null: not known"),
    FIELD_REAL(PairFigure, uncertainty, NULL, ANY, OPTIONAL, "standard, from the deviations of e and T_c that the material states"),
    FIELD_REAL(PairFigure, low, NULL, ANY, OPTIONAL, "value over exp(1.96 u), u the relative uncertainty; 95 % of contacts are between low and high if e and T_c are log-normal with these deviations, whose own uncertainty is ignored"),
    FIELD_REAL(PairFigure, high, NULL, ANY, OPTIONAL, "value times exp(1.96 u)"),
    FIELD_END
};

static const Field contact_rows[] = {
    FIELD_CHOICE(PairContact, separation, separation_names, OPTIONAL, "the rule by which a contact ends"),
    FIELD_REAL(PairContact, approach_speed, "m/s", ANY, OPTIONAL, "of the material's row; null: for every speed"),
    FIELD_ITEM(PairContact, restitution, figure_fields, NULL, PRESENCE_DEFAULT, "e of this pair"),
    FIELD_ITEM(PairContact, contact_time, figure_fields, NULL, PRESENCE_DEFAULT, "T_c of this pair [s]"),
    FIELD_ITEM(PairContact, stiffness, figure_fields, NULL, PRESENCE_DEFAULT, "k_b [N/m]"),
    FIELD_ITEM(PairContact, damping, figure_fields, NULL, PRESENCE_DEFAULT, "c_b [N s/m]"),
    FIELD_ITEM(PairContact, damping_ratio, figure_fields, NULL, PRESENCE_DEFAULT, "Z"),
    FIELD_END
};

const Field pair_parameters_fields[] = {
    FIELD_REAL(PairParameters, damper_mass, "kg", ANY, OPTIONAL, "the free mass"),
    FIELD_REAL(PairParameters, structure_mass, "kg", ANY, OPTIONAL, "of the structure that it strikes; null: fixed"),
    FIELD_CHOICE(PairParameters, identified_for, identified_for_names, OPTIONAL, "pair to which e and T_c of the material belong"),
    FIELD_REAL(PairParameters, effective_mass, "kg", ANY, OPTIONAL, "of this pair"),
    FIELD_REAL(PairParameters, test_mass, "kg", ANY, OPTIONAL, "effective mass of the test's pair"),
    FIELD_REAL(PairParameters, least_speed, "m/s", ANY, OPTIONAL, "slowest approach that was measured"),
    FIELD_REAL(PairParameters, most_speed, "m/s", ANY, OPTIONAL, "fastest"),
    FIELD_LIST(PairParameters, contacts, contact_rows, 0, PRESENCE_DEFAULT, "by row of the material's table, then by rule"),
    FIELD_END
};
// clang-format on

enum { RULES = 2, OUTPUTS = 3 };

static const double mass_tolerance = 0.02; // of effective masses that are considered equal

void pair_parameters_clear(PairParameters *pair) {
    fields_clear(pair_parameters_fields, pair);
    warnings_clear(&pair->warnings);
}

// One row of the material, with relative deviations. NAN: unknown.
typedef struct PairRow {
    double speed, e, T, r_e, r_T;
} PairRow;

static PairRow pair_row(const Material *material, size_t index) {
    const MaterialRow constant = {(double)NAN, material->restitution, material->contact_time,
                                  material->restitution_deviation,
                                  material->contact_time_deviation};
    const MaterialRow *row = material->table.count > 0 ? &material->table.at[index] : &constant;
    return (PairRow){row->approach_speed, row->restitution, row->contact_time,
                     row->restitution_deviation / row->restitution,
                     row->contact_time_deviation / row->contact_time};
}

static PairFigure pair_figure(double value, double relative) {
    if (!isfinite(value))
        return (PairFigure){(double)NAN, (double)NAN, (double)NAN, (double)NAN};
    const double factor = exp(student_t_quantile(0.95, 0) * relative);
    if (!isfinite(factor))
        return (PairFigure){value, (double)NAN, (double)NAN, (double)NAN};
    return (PairFigure){value, value * relative, value / factor, value * factor};
}

// The pair, and how e and T_c of the material apply to it.
typedef struct PairCase {
    double mass, test_mass;
    int identified_for;
    Separation separation;
} PairCase;

static Identification pair_identify(const PairCase *pair_case, double e, double T) {
    if (pair_case->identified_for != IDENTIFIED_FOR_RIG)
        return identification_from_restitution(pair_case->mass, e, T, pair_case->separation);
    const Identification rig =
        identification_from_restitution(pair_case->test_mass, e, T, pair_case->separation);
    return identification_from_stiffness(pair_case->mass, rig.stiffness, rig.damping,
                                         pair_case->separation);
}

static void pair_outputs(const PairCase *pair_case, double log_e, double log_T,
                         double values[OUTPUTS]) {
    const Identification it = pair_identify(pair_case, exp(log_e), exp(log_T));
    values[0] = log(it.damping_ratio);
    values[1] = log(it.restitution);
    values[2] = log(it.contact_time);
}

// Relative uncertainties of Z, e and T_c. An unknown deviation matters only where they depend on
// it.
static void pair_spread(const PairCase *pair_case, const PairRow *known, double relative[OUTPUTS]) {
    const double h = 1e-5, e = log(known->e), T = log(known->T);
    double more[OUTPUTS], less[OUTPUTS], late[OUTPUTS], soon[OUTPUTS];
    pair_outputs(pair_case, e - h, T, less);
    pair_outputs(pair_case, e + h > 0 ? e : e + h, T, more);
    pair_outputs(pair_case, e, T + h, late);
    pair_outputs(pair_case, e, T - h, soon);
    const double width = e + h > 0 ? h : 2 * h;
    for (int i = 0; i < OUTPUTS; i++) {
        const double by_e = (more[i] - less[i]) / width, by_T = (late[i] - soon[i]) / (2 * h);
        const double part_e = fabs(by_e) < 1e-9 ? 0 : by_e * known->r_e;
        const double part_T = fabs(by_T) < 1e-9 ? 0 : by_T * known->r_T;
        relative[i] = hypot(part_e, part_T);
    }
}

static PairContact pair_contact(const PairCase *pair_case, const PairRow *known) {
    PairContact contact = {.separation = 0};
    fields_clear(contact_rows, &contact);
    contact.separation = (int)pair_case->separation;
    contact.approach_speed = known->speed;
    contact.restitution = pair_figure(known->e, known->r_e);
    if (!(known->e > 0))
        return contact;
    // Z does not depend on the contact time.
    const bool has_time = !isnan(known->T);
    const PairRow with = {known->speed, known->e, has_time ? known->T : 1, known->r_e,
                          has_time ? known->r_T : 0};
    const Identification it = pair_identify(pair_case, with.e, with.T);
    double relative[OUTPUTS];
    pair_spread(pair_case, &with, relative);
    contact.restitution = pair_figure(it.restitution, relative[1]);
    contact.restitution.high =
        !isnan(contact.restitution.high) ? fmin(contact.restitution.high, 1) : (double)NAN;
    contact.damping_ratio = pair_figure(it.damping_ratio, relative[0]);
    if (!has_time)
        return contact;
    const IdentificationSensitivity by = identification_sensitivity(with.e, pair_case->separation);
    contact.contact_time = pair_figure(it.contact_time, relative[2]);
    contact.stiffness = pair_figure(it.stiffness, hypot(by.stiffness_by_restitution * with.r_e,
                                                        by.stiffness_by_contact_time * with.r_T));
    contact.damping = pair_figure(it.damping, hypot(by.damping_by_restitution * with.r_e,
                                                    by.damping_by_contact_time * with.r_T));
    return contact;
}

static Status pair_fill(const Material *material, int separation, PairParameters *pair) {
    const size_t rows = material->table.count > 0 ? material->table.count : 1;
    pair->contacts.at = calloc(rows * RULES, sizeof *pair->contacts.at);
    TRY(status_made(pair->contacts.at != NULL));
    for (size_t i = 0; i < rows; i++)
        for (int rule = 0; rule < RULES; rule++) {
            const PairRow known = pair_row(material, i);
            const PairCase pair_case = {pair->effective_mass, pair->test_mass, pair->identified_for,
                                        (Separation)rule};
            if (separation == CHOICE_ABSENT || separation == rule)
                pair->contacts.at[pair->contacts.count++] = pair_contact(&pair_case, &known);
        }
    return STATUS_OK;
}

static Status pair_warn_of_mass(const Material *material, PairParameters *pair) {
    const double mass = pair->effective_mass, test = pair->test_mass;
    if (isnan(test))
        return warnings_add(&pair->warnings, "/test_mass",
                            "the masses of the test are unknown: e and T_c belong to its pair, and "
                            "how far this pair differs is unknown");
    if (!(fabs(mass - test) > mass_tolerance * test))
        return STATUS_OK;
    char differs[128];
    snprintf(differs, sizeof differs,
             "this pair's effective mass of %.4g kg is %.3g %% %s the test's %.4g kg", mass,
             100 * fabs(mass / test - 1), mass > test ? "above" : "below", test);
    const PairRow known = pair_row(material, 0);
    if (pair->identified_for == IDENTIFIED_FOR_RIG)
        return warnings_add(&pair->warnings, "/effective_mass",
                            "%s: k_b and c_b are those of the test, e and T_c follow from them",
                            differs);
    if (isnan(known.T) || !(known.e > 0))
        return warnings_add(&pair->warnings, "/effective_mass", "%s: e belongs to the test's pair",
                            differs);
    const PairCase pair_case = {mass, test, IDENTIFIED_FOR_RIG,
                                (Separation)pair->contacts.at[0].separation};
    const Identification it = pair_identify(&pair_case, known.e, known.T);
    return warnings_add(&pair->warnings, "/effective_mass",
                        "%s: e and T_c belong to the test's pair; were k_b and c_b those of the "
                        "test (identified_for=rig), e would be %.3g in place of %.3g and T_c %.3g "
                        "s in place of %.3g s",
                        differs, it.restitution, known.e, it.contact_time, known.T);
}

static Status pair_warn_of_material(const Material *material, int separation,
                                    PairParameters *pair) {
    const size_t rows = material->table.count > 0 ? material->table.count : 1;
    bool has_time = true, has_e = true, has_T = true, is_dead = false;
    for (size_t i = 0; i < rows; i++) {
        const PairRow known = pair_row(material, i);
        has_time = has_time && !isnan(known.T);
        is_dead = is_dead || !(known.e > 0);
        has_e = has_e && !isnan(known.r_e);
        has_T = has_T && !isnan(known.r_T);
    }
    Warnings *to = &pair->warnings;
    if (!has_time)
        TRY(warnings_add(to, "/contacts",
                         "the material has no contact time: stiffness and damping are unknown, "
                         "only impulsive contact can use it"));
    if (is_dead)
        TRY(warnings_add(to, "/contacts",
                         "without a rebound (e = 0) stiffness and damping do not exist"));
    if (!has_e || (has_time && !has_T))
        TRY(warnings_add(to, "/contacts",
                         "the material states no standard deviation of %s%s%s%s: values that "
                         "depend on it have no uncertainty",
                         has_e ? "" : "e", has_e || has_T || !has_time ? "" : " and ",
                         has_T || !has_time ? "" : "T_c",
                         material->table.count > 0 ? " in every row" : ""));
    if (material->separation != CHOICE_ABSENT && separation != material->separation)
        TRY(warnings_add(to, "/contacts",
                         "its T_c was determined under %s; values under %s belong to a T_c that "
                         "another evaluation of the same test would give differently",
                         separation_names[material->separation],
                         separation_names[1 - material->separation]));
    if (isnan(pair->least_speed) || isnan(pair->most_speed))
        TRY(warnings_add(to, "/least_speed",
                         "the material does not state the range of approach speeds that was "
                         "measured"));
    return STATUS_OK;
}

static Status pair_warn(const Material *material, int separation, PairParameters *pair) {
    TRY(pair_warn_of_mass(material, pair));
    TRY(pair_warn_of_material(material, separation, pair));
    // Of overdamping.
    for (size_t i = 0; i < pair->contacts.count; i++) {
        const PairContact *contact = &pair->contacts.at[i];
        if (!isnan(contact->stiffness.value) && isnan(contact->contact_time.value))
            return warnings_add(&pair->warnings, "/contacts",
                                "with this pair the contact is overdamped (Z = %.3g) and never "
                                "ends under %s",
                                contact->damping_ratio.value,
                                separation_names[contact->separation]);
    }
    return STATUS_OK;
}

Status pair_parameters_run(const Material *material, double damper_mass, double structure_mass,
                           int identified_for, int separation, PairParameters *pair,
                           Problem *problem) {
    *pair = (PairParameters){
        .damper_mass = damper_mass,
        .structure_mass = structure_mass,
        .identified_for = identified_for,
        .effective_mass = !isnan(structure_mass)
                              ? contact_effective_mass(damper_mass, structure_mass)
                              : damper_mass,
        .test_mass = material_test_mass(material),
    };
    material_speed_range(material, &pair->least_speed, &pair->most_speed);
    if (identified_for == IDENTIFIED_FOR_RIG && isnan(pair->test_mass))
        return problem_add(
            problem, STATUS_INVALID, "/identified_for",
            "must be scene: the material does not state the masses of the test (impactor_mass, "
            "base, and base_mass of a free one), from which k_b and c_b of its rig follow");
    Status status = pair_fill(material, separation, pair);
    if (status == STATUS_OK)
        status = pair_warn(material, separation, pair);
    return status == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for the parameters");
}
