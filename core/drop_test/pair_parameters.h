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
typedef struct DerivedFigure {
    double value, uncertainty, low, high;
} DerivedFigure;

// Under one separation rule, at one row of the material's table.
typedef struct DerivedContact {
    int separation;                          // Separation
    double approach_speed;                   // of the row; NAN: for every speed [m/s]
    DerivedFigure restitution, contact_time; // of this pair [-], [s]
    DerivedFigure stiffness, damping;        // k_b [N/m], c_b [N s/m]
    DerivedFigure damping_ratio;             // Z [-]
} DerivedContact;
typedef struct DerivedContacts {
    DerivedContact *at;
    size_t count;
} DerivedContacts;

typedef struct DerivedPair {
    double damper_mass;             // [kg]
    double structure_mass;          // NAN: it does not move [kg]
    int identified_for;             // IdentifiedFor
    double effective_mass;          // [kg]
    double test_mass;               // of the test's pair; NAN: not known [kg]
    double least_speed, most_speed; // for which the material was measured; NAN [m/s]
    DerivedContacts contacts;       // by row, then by rule
    Warnings warnings;
} DerivedPair;

extern const Field derived_pair_fields[]; // without the warnings

// What is asked: a good material, masses above 0 (structure_mass NAN: fixed), and a rule or
// CHOICE_ABSENT for both. STATUS_INVALID at "/identified_for" where the rig is not known. Cleared
// by derived_pair_clear in any case.
Status derived_make(const Material *material, double damper_mass, double structure_mass,
                    int identified_for, int separation, DerivedPair *pair, Problem *problem);
void derived_pair_clear(DerivedPair *pair);

#endif
