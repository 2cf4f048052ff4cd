// A point may have fewer samples than the reference: then its displacement is the line between its
// samples, and its mean acceleration holds for the whole of its interval. Both are what a reader of
// the coarser series has.
#include "core/simulation/error_metrics.h"

#include <math.h>

#include "core/result/spectrum_distance.h"
#include "core/simulation/channel_names.h"

// clang-format off
const Field error_fields[] = {
    FIELD_REAL(Errors, displacement, NULL, ANY, OPTIONAL, "largest difference within the horizon over the largest displacement, of all storeys; the reference's own error where that is larger"),
    FIELD_REAL(Errors, mean_acceleration, NULL, ANY, OPTIONAL, "rms of the difference over rms within the horizon"),
    FIELD_REAL(Errors, peak_force, NULL, ANY, OPTIONAL, "difference of the largest contact force within the horizon, of that force; unknown where impacts have no force"),
    FIELD_REAL(Errors, impacts, NULL, ANY, OPTIONAL, "impacts within the horizon, how many more or fewer"),
    FIELD_REAL(Errors, psd, "dB", ANY, OPTIONAL, "rms distance of the spectra over the band that holds 99.9 % of the reference's power, of the channel that is farthest off; unknown where that band is not covered"),
    FIELD_REAL(Errors, rms_displacement, NULL, ANY, OPTIONAL, "difference of the rms displacement of the whole run, of that rms"),
    FIELD_END
};

const Field reference_summary_fields[] = {
    FIELD_REAL(ReferenceSummary, error_estimate, NULL, ANY, OPTIONAL, "its own error of displacement, to the horizon"),
    FIELD_REAL(ReferenceSummary, trust_horizon, "s", ANY, OPTIONAL, "to here samples and impacts are compared; unknown: to the end"),
    FIELD_COUNT(ReferenceSummary, impacts, NULL, AT_MIN(0), OPTIONAL, "its impacts within the horizon"),
    FIELD_REAL(ReferenceSummary, peak_force, "N", ANY, OPTIONAL, "its largest contact force within the horizon"),
    FIELD_REAL(ReferenceSummary, largest, "m", ANY, OPTIONAL, "its largest displacement"),
    FIELD_REAL(ReferenceSummary, psd_from, "Hz", ANY, OPTIONAL, "its spectra are compared from here"),
    FIELD_REAL(ReferenceSummary, psd_to, "Hz", ANY, OPTIONAL, "to here"),
    FIELD_END
};
// clang-format on

double error_metrics_by(const Errors *errors, int metric) {
    const double all[METRICS] = {errors->displacement, errors->mean_acceleration,
                                 errors->peak_force,   errors->impacts,
                                 errors->psd,          errors->rms_displacement};
    return all[metric];
}

static double error_metrics_ratio(double difference, double whole) {
    if (whole > 0)
        return difference / whole;
    return difference == 0 ? 0 : (double)NAN;
}

static double error_metrics_end(const Compared *reference) {
    return isnan(reference->horizon) ? (double)INFINITY : reference->horizon;
}

// How far the reference itself is off in the samples compared: an estimate for the whole run says
// nothing of those before the horizon, which is where it passes RESPONSE_PARTING.
static double error_metrics_own(const Compared *reference) {
    const double estimate = reference->outcome->summary.error_estimate;
    return isnan(reference->horizon) ? estimate : fmin(estimate, RESPONSE_PARTING);
}

// Samples of the reference that can be compared.
static size_t error_metrics_samples(const Compared *reference) {
    const size_t count = reference->outcome->response.count;
    if (isnan(reference->horizon))
        return count;
    const double within = floor(reference->horizon * reference->outcome->response.sample_rate) + 1;
    return within < (double)count ? (size_t)within : count;
}

// Sample i of the reference stands at index at + part of the point's, 0 <= part < 1.
typedef struct SamplePlace {
    size_t at;
    double part;
} SamplePlace;

static SamplePlace error_metrics_place(size_t i, const Response *reference, const Response *point) {
    const double index = (double)i * point->sample_rate / reference->sample_rate;
    const double at = floor(index * (1 + 1e-12));
    const double part = index - at;
    return (SamplePlace){(size_t)at, part > 1e-9 ? part : 0};
}

static double error_metrics_displacement(const Compared *reference, const Compared *point,
                                         size_t count) {
    const Response *from = &reference->outcome->response, *to = &point->outcome->response;
    double largest = 0, worst = 0;
    for (size_t s = 0; s < reference->storeys; s++) {
        const double *x = from->series.at[s].values, *y = to->series.at[s].values;
        for (size_t i = 0; i < from->count; i++)
            largest = fmax(largest, fabs(x[i]));
        for (size_t i = 0; i < count; i++) {
            const SamplePlace place = error_metrics_place(i, from, to);
            if (place.at + (place.part > 0) >= to->count)
                break;
            double value = y[place.at];
            if (place.part > 0)
                value += place.part * (y[place.at + 1] - value);
            worst = fmax(worst, fabs(value - x[i]));
        }
    }
    return error_metrics_ratio(worst, largest);
}

static double error_metrics_acceleration(const Compared *reference, const Compared *point,
                                         size_t count) {
    const Response *from = &reference->outcome->response, *to = &point->outcome->response;
    double squares = 0, differences = 0;
    for (size_t s = 0; s < reference->storeys; s++) {
        const double *x = from->series.at[reference->storeys + s].values;
        const double *y = to->series.at[reference->storeys + s].values;
        for (size_t i = 0; i < count; i++) {
            const SamplePlace place = error_metrics_place(i, from, to);
            const size_t at = place.at + (place.part > 0); // the mean before its sample
            if (at >= to->count)
                break;
            squares += x[i] * x[i];
            differences += (y[at] - x[i]) * (y[at] - x[i]);
        }
    }
    return sqrt(error_metrics_ratio(differences, squares));
}

typedef struct HorizonImpacts {
    uint64_t impacts;
    double peak; // NAN where no contact has one
} HorizonImpacts;

// Of the contacts that begin within the horizon.
static HorizonImpacts error_metrics_impacts(const Impacts *impacts, double horizon) {
    HorizonImpacts within = {0, (double)NAN};
    for (size_t i = 0; i < impacts->count; i++) {
        const Impact *impact = &impacts->at[i];
        if (impact->start > horizon)
            continue;
        within.impacts += impact->kind == IMPACT_IMPACT;
        within.peak = fmax(within.peak, impact->peak_force);
    }
    return within;
}

static double error_metrics_channel_distance(const Spectrum *reference, const double *wanted,
                                             const Spectrum *point, const double *density) {
    const size_t end = distance_band_end(wanted, reference->densities.rows);
    return distance_level(reference, wanted, point, density, 1, end);
}

// Of the channel that is farthest off.
static double error_metrics_psd(const Spectrum *reference, const Spectrum *point) {
    const size_t count = reference->densities.count;
    double worst = (double)NAN;
    for (size_t i = 0; i < count && i < point->densities.count; i++) {
        const double own = error_metrics_channel_distance(
            reference, reference->densities.at[i].values, point, point->densities.at[i].values);
        if (isnan(own))
            return own;
        worst = fmax(worst, own);
    }
    return worst;
}

ReferenceSummary error_metrics_reference(const Compared *reference) {
    const Outcome *outcome = reference->outcome;
    const HorizonImpacts within =
        error_metrics_impacts(&outcome->response.impacts, error_metrics_end(reference));
    ReferenceSummary summary = {.error_estimate = error_metrics_own(reference),
                                .trust_horizon = reference->horizon,
                                .impacts = within.impacts,
                                .peak_force = within.peak,
                                .largest = outcome->summary.peak_displacement,
                                .psd_from = (double)NAN,
                                .psd_to = (double)NAN};
    const Spectrum *spectrum = &outcome->spectrum;
    for (size_t i = 0; i < spectrum->densities.count; i++) {
        const size_t end =
            distance_band_end(spectrum->densities.at[i].values, spectrum->densities.rows);
        if (end < 2)
            continue;
        summary.psd_from = spectrum->frequency[1];
        summary.psd_to = fmax(summary.psd_to, spectrum->frequency[end - 1]);
    }
    return summary;
}

Errors error_metrics_measure(const Compared *reference, const Compared *point) {
    const Outcome *from = reference->outcome, *to = point->outcome;
    Errors errors = {.displacement = (double)NAN,
                     .mean_acceleration = (double)NAN,
                     .peak_force = (double)NAN,
                     .impacts = (double)NAN,
                     .psd = error_metrics_psd(&from->spectrum, &to->spectrum),
                     .rms_displacement = (double)NAN};
    if (!point->has_motion)
        return errors;
    const size_t count = error_metrics_samples(reference);
    if (count > 1) {
        // Nothing closer than the reference itself can be summary.
        errors.displacement =
            fmax(error_metrics_displacement(reference, point, count), error_metrics_own(reference));
        errors.mean_acceleration = error_metrics_acceleration(reference, point, count);
    }
    const double horizon = error_metrics_end(reference);
    const HorizonImpacts a = error_metrics_impacts(&from->response.impacts, horizon);
    const HorizonImpacts b = error_metrics_impacts(&to->response.impacts, horizon);
    errors.impacts = fabs((double)a.impacts - (double)b.impacts);
    if (point->has_force && reference->has_force && !isnan(a.peak))
        errors.peak_force = error_metrics_ratio(fabs(fmax(b.peak, 0) - a.peak), a.peak);
    errors.rms_displacement =
        error_metrics_ratio(fabs(to->summary.rms_displacement - from->summary.rms_displacement),
                            from->summary.rms_displacement);
    return errors;
}

Status error_metrics_request(Simulation *simulation, Problem *problem) {
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    static const ChannelId wanted[] = {CHANNEL_DISPLACEMENT, CHANNEL_MEAN_ACCELERATION};
    Texts *names = &simulation->output.channels;
    channel_names_clear(names);
    for (size_t i = 0; i < COUNT(wanted) * storeys; i++)
        if (channel_names_add(&simulation->scene, wanted[i / storeys], i % storeys + 1, names) !=
            STATUS_OK)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for the channels");
    return STATUS_OK;
}
