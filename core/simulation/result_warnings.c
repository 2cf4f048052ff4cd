// What a run can leave: the error of modes that it left out; the time to which rounding, or the
// solver's steps, let its trajectory be the scene's own; and how far its impacts and its masses are
// from those with which its buffers were measured. Speeds are counted by the ledger, of every
// impact of a run that succeeds.
#include "core/simulation/result_warnings.h"

#include <math.h>
#include <stdio.h>

#include "core/base/side.h"
#include "core/contact/contact.h"

// The scene asked for it; the number is foretold, and dampers can make more of it.
static Status warn_of_modes(Outcome *outcome) {
    const double error = outcome->response.given_up;
    if (!(error > RESPONSE_PARTING))
        return STATUS_OK;
    return warnings_add(&outcome->warnings, "/accuracy/modes",
                        "with the modes left out the displacement is wrong by up to %.2g of its "
                        "largest value%s: more modes are closer",
                        error, error > 0.1 ? ", and only statistics hold" : "");
}

static Status warn_of_horizon(Outcome *outcome) {
    if (isnan(outcome->summary.trust_horizon) || outcome->response.given_up > RESPONSE_PARTING)
        return STATUS_OK;
    return warnings_add(&outcome->warnings, "/duration",
                        "the run goes on beyond t = %.6g s: there rounding has moved the "
                        "displacement by %g of its largest value, and from there on only "
                        "statistics hold",
                        outcome->summary.trust_horizon, RESPONSE_PARTING);
}

// What steps are wrong by is not rounding's.
static Status warn_of_steps(Outcome *outcome) {
    const Summary *summary = &outcome->summary;
    if (isnan(summary->error_estimate))
        return warnings_add(&outcome->warnings, "/accuracy",
                            "the error of these steps is not known: the run beside this one that "
                            "would tell it came to no end");
    const double error = summary->error_estimate - outcome->response.given_up;
    if (error <= RESPONSE_PARTING)
        return STATUS_OK;
    return warnings_add(&outcome->warnings, "/accuracy",
                        "with these steps the displacement is wrong by about %.2g of its largest "
                        "value%s: shorter steps, a smaller tolerance, or the solver exact "
                        "without one, are closer",
                        error, error > 0.1 ? ", and only statistics hold" : "");
}

// A buffer of a damper, and where it stands.
typedef struct Stops {
    const Buffer *buffer;
    const char *name;  // as the scene calls it
    const char *where; // in words
    int first, count;  // sides
} Stops;

// One for both sides, or one for each.
static size_t find_stops(const Damper *damper, Stops stops[2]) {
    static const char *const names[] = {"left_buffer", "right_buffer"};
    static const char *const wheres[] = {"left stop", "right stop"};
    const Buffer *left = damper_buffer(damper, SIDE_LEFT);
    if (left == damper_buffer(damper, SIDE_RIGHT)) {
        stops[0] = (Stops){left, "buffer", "stops", SIDE_LEFT, 2};
        return 1;
    }
    for (int side = 0; side < 2; side++) {
        const Buffer *buffer = damper_buffer(damper, (Side)side);
        const bool is_common = buffer == &damper->buffer;
        stops[side] = (Stops){buffer, is_common ? "buffer" : names[side], wheres[side], side, 1};
    }
    return 2;
}

// What met several stops with one range.
static Approaches add_up(const Approaches *met, int count) {
    Approaches sum = met[0];
    for (int i = 1; i < count; i++) {
        if (met[i].count == 0)
            continue;
        sum.least = sum.count == 0 ? met[i].least : fmin(sum.least, met[i].least);
        sum.most = sum.count == 0 ? met[i].most : fmax(sum.most, met[i].most);
        sum.count += met[i].count;
        sum.below += met[i].below;
        sum.above += met[i].above;
    }
    return sum;
}

// "0.15 to 1 m/s", "0.15 m/s and more", "1 m/s and less".
static void tell_range(double from, double to, char *text, size_t size) {
    char low[32], high[32];
    text_real(low, from);
    text_real(high, to);
    if (isnan(to))
        snprintf(text, size, "%s m/s and more", low);
    else if (isnan(from))
        snprintf(text, size, "%s m/s and less", high);
    else
        snprintf(text, size, "%s to %s m/s", low, high);
}

// "slower than", "faster than" or both, and how far it went.
static void tell_outside(const Approaches *met, char which[48], char reach[64]) {
    if (met->above == 0) {
        snprintf(which, 48, "slower");
        snprintf(reach, 64, "down to %.3g", met->least);
    } else if (met->below == 0) {
        snprintf(which, 48, "faster");
        snprintf(reach, 64, "up to %.3g", met->most);
    } else {
        snprintf(which, 48, "slower and %llu faster", (unsigned long long)met->above);
        snprintf(reach, 64, "at %.3g to %.3g", met->least, met->most);
    }
}

static Status warn_of_stops(const Stops *stops, size_t damper, const Approaches *all,
                            Warnings *warnings) {
    const Approaches met = add_up(&all[stops->first], stops->count);
    const bool is_named = stops->buffer->material != NULL;
    char pointer[64], range[96], which[48], reach[64];
    if (met.below + met.above == 0)
        return STATUS_OK;
    snprintf(pointer, sizeof pointer, "/dampers/%zu/%s%s", damper, stops->name,
             is_named ? "" : "/table");
    tell_range(met.from, met.to, range, sizeof range);
    tell_outside(&met, which, reach);
    return warnings_add(
        warnings, pointer,
        "%llu of %llu impacts at the %s of damper %zu were %s than %.80s%s (%s), %s m/s: %s",
        (unsigned long long)(met.below > 0 ? met.below : met.above), (unsigned long long)met.count,
        stops->where, damper + 1, which, is_named ? stops->buffer->material : "the table",
        is_named ? " was measured" : " tells", range, reach,
        stops->buffer->table.count > 0 ? "the nearest row is used there"
                                       : "its numbers are used there without a measurement");
}

static Status warn_of_speeds(const Scene *scene, const Approaches *met, Warnings *warnings) {
    for (size_t i = 0; met != NULL && i < scene->dampers.count; i++) {
        Stops stops[2];
        const size_t count = find_stops(&scene->dampers.at[i], stops);
        for (size_t k = 0; k < count; k++)
            TRY(warn_of_stops(&stops[k], i, &met[2 * i], warnings));
    }
    return STATUS_OK;
}

// By how much the effective masses may differ of the test and of the scene.
static const double pair_part = 0.2;

static Status warn_of_pair(const Derived *derived, const Stops *stops, Warnings *warnings) {
    const double tested = buffer_test_mass(stops->buffer), own = derived->effective_mass;
    char pointer[64];
    if (!buffer_is_measured(stops->buffer) || !(fabs(own - tested) > pair_part * tested))
        return STATUS_OK;
    snprintf(pointer, sizeof pointer, "/dampers/%llu/identified_for",
             (unsigned long long)derived->damper - 1);
    return warnings_add(warnings, pointer,
                        "%.80s was measured with an effective mass of %.3g kg, that of this pair "
                        "is %.3g kg: restitution and contact time belong to a pair of masses; "
                        "\"rig\" carries over the stiffness and damping instead",
                        stops->buffer->material, tested, own);
}

Status caution_warn_of_pairs(const Scene *scene, const DerivedList *derived, Warnings *warnings) {
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    for (size_t i = 0; i < derived->count && law->form != CONTACT_IMPULSIVE; i++) {
        const Derived *at = &derived->at[i];
        const Damper *damper = &scene->dampers.at[at->damper - 1];
        Stops stops[2];
        const size_t count = find_stops(damper, stops);
        for (size_t k = 0; k < count && damper->identified_for == IDENTIFIED_FOR_SCENE; k++)
            if (stops[k].first == at->side)
                TRY(warn_of_pair(at, &stops[k], warnings));
    }
    return STATUS_OK;
}

Status caution_warn(const Scene *scene, const DerivedList *derived, Outcome *outcome) {
    TRY(warn_of_modes(outcome));
    TRY(outcome->response.is_stepped ? warn_of_steps(outcome) : warn_of_horizon(outcome));
    TRY(caution_warn_of_pairs(scene, derived, &outcome->warnings));
    return warn_of_speeds(scene, outcome->response.approaches, &outcome->warnings);
}
