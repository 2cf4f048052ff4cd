// What a material comes to for one pair of masses: k_b, c_b and Z with what the spread of e and T_c
// leaves of them, and how far they are to be believed. Not the identification itself
// (contact/identify.h) and not a scene's plan. Used by whoever shows it.
#ifndef CORE_DROP_TEST_PAIR_PARAMETERS_H
#define CORE_DROP_TEST_PAIR_PARAMETERS_H

#include "core/base/report.h"
#include "core/scene/damper.h"
#include "core/scene/material.h"

// A figure with its standard uncertainty, from the standard deviations of e and T_c: of one
// contact, not of a mean. low and high are the value over and times exp(1.96 u) with the relative
// uncertainty u: 95 % of contacts lie between them if e and T_c scatter log-normally with just
// these deviations; that they were told by few readings is not in it. NAN: not known.
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
typedef struct PairContacts {
    PairContact *at;
    size_t count;
} PairContacts;

typedef struct PairParameters {
    double damper_mass;             // [kg]
    double structure_mass;          // NAN: it does not move [kg]
    int identified_for;             // IdentifiedFor
    double effective_mass;          // [kg]
    double test_mass;               // of the test's pair; NAN: not known [kg]
    double least_speed, most_speed; // for which the material was measured; NAN [m/s]
    PairContacts contacts;          // by row, then by rule
    Warnings warnings;
} PairParameters;

extern const Field pair_parameters_fields[]; // without the warnings

// What is asked: a good material, masses above 0 (structure_mass NAN: fixed), and a rule or
// CHOICE_ABSENT for both. STATUS_INVALID at "/identified_for" where the rig is not known. Cleared
// by pair_parameters_clear in any case.
Status pair_parameters_run(const Material *material, double damper_mass, double structure_mass,
                           int identified_for, int separation, PairParameters *pair,
                           Problem *problem);
void pair_parameters_clear(PairParameters *pair);

#endif
