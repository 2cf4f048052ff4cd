// Contact parameters of a material for one pair of masses: k_b, c_b and Z with the uncertainty that
// follows from that of e and T_c, and warnings about their validity.
#ifndef CORE_DROP_TEST_PAIR_PARAMETERS_H
#define CORE_DROP_TEST_PAIR_PARAMETERS_H

#include "core/base/report.h"
#include "core/scene/damper.h"
#include "core/scene/material.h"

// A value with its standard uncertainty, from the standard deviations of e and T_c: of one contact,
// not of a mean. low and high are the value over and times exp(1.96 u) with the relative
// uncertainty u: 95 % of contacts if e and T_c are log-normal with these deviations. The number of
// readings behind the deviations is ignored. NAN: unknown.
typedef struct PairFigure {
    double value, uncertainty, low, high;
} PairFigure;

// Under one separation rule, at one row of the material's table.
typedef struct PairContact {
    int separation;                       // Separation
    double approach_speed;                // of the row; NAN: for every speed [m/s]
    PairFigure restitution, contact_time; // of this pair [-], [s]
    PairFigure stiffness, damping;        // k_b [N/m], c_b [N s/m]
    PairFigure damping_ratio;             // Z [-]
} PairContact;
typedef struct PairParameters {
    double damper_mass;             // [kg]
    double structure_mass;          // NAN: fixed [kg]
    int identified_for;             // IdentifiedFor
    double effective_mass;          // [kg]
    double test_mass;               // of the test's pair; NAN: unknown [kg]
    double least_speed, most_speed; // measured; NAN: unknown [m/s]
    struct {
        PairContact *at;
        size_t count;
    } contacts; // by row, then by rule
    Warnings warnings;
} PairParameters;

extern const Field pair_parameters_fields[]; // without the warnings

// Of a valid material, masses above 0 (structure_mass NAN: fixed) and one separation rule or both
// (CHOICE_ABSENT). STATUS_INVALID at "/identified_for": the masses of the rig are unknown. Released
// by pair_parameters_clear in any case.
Status pair_parameters_run(const Material *material, double damper_mass, double structure_mass,
                           int identified_for, int separation, PairParameters *pair,
                           Problem *problem);
void pair_parameters_clear(PairParameters *pair);

#endif
