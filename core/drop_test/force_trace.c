// Each contact is fitted in a window of its own, with as much baseline on both sides as there is.
// T_c is stated only where at least five samples are in contact and the trace distinguishes the
// pulse that fits from others; else an interval is stated, and the reason.
//
// Detection: the baseline starts as the densest value, which is not the median where contacts fill
// half of the trace: of the whole trace, or of sixteen parts with a line through them (Theil and
// Sen), whichever leaves the values denser. A polynomial through the samples outside contacts then
// refines it, and the samples outside contacts follow from the polynomial, several times in turn.
#include "core/drop_test/force_trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/drop_test/pulse_fit.h"
#include "core/math/linear_system.h"

enum { SAMPLES_MIN = 5, TRACE_MIN = 8, PARTS = 16, PART_MIN = 16, TERMS = 3 };

// No figure is stated where the interval over T_c or the upper bound of L exceeds its limit, nor
// where the rms residual over the peak does.
static const double width_max = 0.5, decay_max = 4.2, misfit_max = 0.15;

// clang-format off
const Field trace_detection_fields[] = {
    FIELD_REAL(TraceDetection, baseline, "N", ANY, OPTIONAL, "of the trace"),
    FIELD_REAL(TraceDetection, noise, "N", ANY, OPTIONAL, "standard deviation of the trace outside contacts"),
    FIELD_REAL(TraceDetection, threshold, "N", ANY, OPTIONAL, "distance from the baseline that marks a contact"),
    FIELD_REAL(TraceDetection, first, "s", ANY, OPTIONAL, "first sample in contact, or beyond the threshold if no pulse is fitted; times count from the first sample of the trace"),
    FIELD_REAL(TraceDetection, last, "s", ANY, OPTIONAL, "last such sample"),
    FIELD_COUNT(TraceDetection, samples, NULL, AT_MIN(0), OPTIONAL, "number of samples from first to last"),
    FIELD_REAL(TraceDetection, peak, "N", ANY, OPTIONAL, "largest force from the baseline, with its sign"),
    FIELD_REAL(TraceDetection, crossing_time, "s", ANY, OPTIONAL, "between the crossings of the threshold on the pressing side"),
    FIELD_REAL(TraceDetection, crossing_uncertainty, "s", ANY, OPTIONAL, "its standard uncertainty, of half a sample interval at either end"),
    FIELD_REAL(TraceDetection, crossing_shortfall, NULL, ANY, OPTIONAL, "part of T_c by which crossing_time is too short, according to the fitted pulse"),
    FIELD_REAL(TraceDetection, impulse, "N s", ANY, OPTIONAL, "of the best pulse: m_e v0 (1 + e) without gravity"),
    FIELD_REAL(TraceDetection, start, "s", ANY, OPTIONAL, "start of the contact according to the fit; null: too few samples, no pulse fits, or the trace begins or ends during the contact"),
    FIELD_REAL(TraceDetection, end, "s", ANY, OPTIONAL, "end of the contact"),
    FIELD_REALS(TraceDetection, pulse, "N", ANY, 0, PRESENCE_OPTIONAL, "the fitted pulse on its baseline, at equal intervals from start to end; empty where those are unknown"),
    FIELD_REAL(TraceDetection, misfit, NULL, ANY, OPTIONAL, "rms of the residuals during contact, over the noise"),
    FIELD_REAL(TraceDetection, misfit_share, NULL, ANY, OPTIONAL, "the same over the peak"),
    FIELD_END
};
// clang-format on

// Samples above the threshold.
typedef struct DetectedContact {
    size_t first, last; // with the tensile part
    size_t pressed;     // last one before the tensile part
    double peak;        // signed, above the baseline [N]
} DetectedContact;

typedef struct ContactDetection {
    double *force;          // without baseline, one for each sample [N]
    double largest;         // magnitude of these [N]
    double baseline[TERMS]; // times 1, u and u^2, u from -1 to 1 over the trace [N]
    size_t samples;
    double noise;       // standard deviation [N]
    double noise_count; // samples outside contacts, from which it is estimated
    double threshold;   // [N]
    DetectedContact runs[TRACE_CONTACTS_MAX];
    size_t count;
    bool is_full; // more than TRACE_CONTACTS_MAX were found; the others are left out
} ContactDetection;

// The distance from a repeated value to its neighbours among sorted values, if those are frequent
// too: the step of a converter that is coarser than the noise; else 0.
static double detection_step(const double *values, size_t count, size_t at) {
    size_t from = at, to = at + 1, before, after;
    while (from > 0 && values[from - 1] == values[at])
        from--;
    while (to < count && values[to] == values[at])
        to++;
    for (before = from; before > 0 && values[before - 1] == values[from - 1]; before--)
        ;
    for (after = to; after < count && values[after] == values[to]; after++)
        ;
    if (from - before + (after - to) < 3 + count / 50)
        return 0;
    return fmax(from > before ? values[at] - values[from - 1] : 0,
                after > to ? values[to] - values[at] : 0);
}

// The middle of the shortest interval that holds 30 % of the values. Sorts them.
static double detection_densest(double *values, size_t count, double *width) {
    reals_sort(values, count);
    const size_t held = count * 3 / 10 < 2 ? (count < 2 ? count : 2) : count * 3 / 10;
    size_t best = 0;
    for (size_t i = 1; i + held <= count; i++)
        if (values[i + held - 1] - values[i] < values[best + held - 1] - values[best])
            best = i;
    *width = values[best + held - 1] - values[best];
    // The shortest of few is too short by chance.
    *width *= 1 + 8 / (double)held;
    if (*width == 0)
        *width = detection_step(values, count, best);
    return held % 2 == 1 ? values[best + held / 2]
                         : (values[best + held / 2 - 1] + values[best + held / 2]) / 2;
}

// A line c[0] + c[1] u through the densest values of the parts, by medians.
static void detection_line(const double *force, size_t count, double *scratch, double *c) {
    double place[PARTS], value[PARTS], slopes[PARTS * (PARTS - 1) / 2], width;
    size_t n = 0;
    for (size_t i = 0; i < PARTS; i++) {
        const size_t from = count * i / PARTS, to = count * (i + 1) / PARTS;
        memcpy(scratch, force + from, (to - from) * sizeof *scratch);
        value[i] = detection_densest(scratch, to - from, &width);
        place[i] = (double)(from + to) / (double)count - 1;
        for (size_t j = 0; j < i; j++)
            slopes[n++] = (value[i] - value[j]) / (place[i] - place[j]);
    }
    reals_sort(slopes, n);
    c[1] = (slopes[n / 2 - 1] + slopes[n / 2]) / 2;
    for (size_t i = 0; i < PARTS; i++)
        value[i] -= c[1] * place[i];
    reals_sort(value, PARTS);
    c[0] = (value[PARTS / 2 - 1] + value[PARTS / 2]) / 2;
}

// u of a sample, from -1 to 1 over the trace.
static double detection_place(double i, size_t count) {
    return count > 1 ? 2 * i / (double)(count - 1) - 1 : 0;
}

// The baseline c[0] + c[1] u + c[2] u^2 at a sample or between samples [N].
static double detection_baseline(const double *c, double sample, size_t count) {
    const double u = detection_place(sample, count);
    return c[0] + u * (c[1] + u * c[2]);
}

static void detection_subtract(ContactDetection *detection, const Reals *force, const double *c) {
    detection->largest = 0;
    for (size_t i = 0; i < force->count; i++) {
        detection->force[i] = force->at[i] - detection_baseline(c, (double)i, force->count);
        detection->largest = fmax(detection->largest, fabs(detection->force[i]));
    }
    memcpy(detection->baseline, c, sizeof detection->baseline);
}

// Adds to c a polynomial of `terms` terms through the samples outside contacts, by least squares.
// Returns the sum of squares of the residuals.
static double detection_fit(const Reals *force, const bool *is_inside, size_t terms, double *c) {
    double a[TERMS * TERMS] = {0}, b[TERMS] = {0};
    for (size_t i = 0; i < force->count; i++) {
        if (is_inside[i])
            continue;
        const double u = detection_place((double)i, force->count), power[TERMS] = {1, u, u * u};
        const double left = force->at[i] - detection_baseline(c, (double)i, force->count);
        for (size_t j = 0; j < terms; j++) {
            for (size_t k = 0; k < terms; k++)
                a[j * terms + k] += power[j] * power[k];
            b[j] += power[j] * left;
        }
    }
    if (linear_system_solve(a, b, terms, 1))
        for (size_t j = 0; j < terms; j++)
            c[j] += b[j];
    double sum = 0;
    for (size_t i = 0; i < force->count; i++) {
        const double left = force->at[i] - detection_baseline(c, (double)i, force->count);
        sum += is_inside[i] ? 0 : left * left;
    }
    return sum;
}

// Fits a level, and a slope and a bend where they are significant. Returns the variance of the
// residuals.
static double detection_fit_baseline(const Reals *force, const bool *is_inside, size_t outside,
                                     double *c) {
    double best = detection_fit(force, is_inside, 1, c);
    double variance = best / ((double)outside - 1);
    for (size_t terms = 2; terms <= TERMS && outside >= 6 * terms; terms++) {
        double other[TERMS];
        memcpy(other, c, sizeof other);
        const double left = detection_fit(force, is_inside, terms, other);
        const double freedom = (double)(outside - terms);
        if (!(best - left > 12 * left / freedom))
            continue;
        memcpy(c, other, sizeof other);
        best = left;
        variance = left / freedom;
    }
    return variance;
}

// Marks the samples above the threshold and, on both sides, half of each run's length and two more.
// Returns how many are not marked.
static size_t detection_mark(const ContactDetection *detection, size_t count, double threshold,
                             bool *is_inside) {
    size_t outside = 0, before = 0; // end of the run before
    memset(is_inside, 0, count * sizeof *is_inside);
    for (size_t i = 0; i < count; i++) {
        size_t end = i;
        while (end < count && fabs(detection->force[end]) > threshold)
            end++;
        if (end == i)
            continue;
        const size_t about = (end - i) / 2 + 2, from = i > before + about ? i - about : before;
        for (size_t k = from; k < end + about && k < count; k++)
            is_inside[k] = true;
        before = i = end;
    }
    for (size_t i = 0; i < count; i++)
        outside += !is_inside[i];
    return outside;
}

static Status detection_find_baseline(const Reals *force, ContactDetection *detection) {
    const size_t n = force->count;
    double *scratch = malloc(n * (sizeof *scratch + sizeof(bool)));
    TRY(status_made(scratch != NULL));
    bool *is_inside = (bool *)(void *)(scratch + n);
    double level[TERMS] = {0}, width, line[TERMS] = {0}, line_width;
    memcpy(scratch, force->at, n * sizeof *scratch);
    level[0] = detection_densest(scratch, n, &width);
    bool is_line = false;
    if (n >= PARTS * PART_MIN) {
        detection_line(force->at, n, scratch, line);
        detection_subtract(detection, force, line);
        memcpy(scratch, detection->force, n * sizeof *scratch);
        line[0] += detection_densest(scratch, n, &line_width);
        is_line = line_width < width;
    }
    double *c = is_line ? line : level;
    detection_subtract(detection, force, c);
    // 30 % of a normal distribution are within 0.385 standard deviations of its mean.
    double noise = (is_line ? line_width : width) / 0.77;
    const double min = 1e-6 * detection->largest;
    for (int round = 0; round < 6; round++) {
        const size_t outside = detection_mark(detection, n, fmax(4 * noise, min), is_inside);
        if (outside < 2)
            break;
        noise = sqrt(detection_fit_baseline(force, is_inside, outside, c));
        detection_subtract(detection, force, c);
        detection->noise_count = (double)outside;
    }
    detection->noise = noise;
    free(scratch);
    return STATUS_OK;
}

// Whether `next` belongs to the contact `run`: as its tensile part, which is smaller and
// follows soon, or after noise that fell below the threshold but not to the baseline.
static bool detection_is_same(const ContactDetection *detection, const DetectedContact *run,
                              const DetectedContact *next) {
    const size_t length = run->last - run->first + 1, other = next->last - next->first + 1;
    const size_t longer = length > other ? length : other, gap = next->first - run->last - 1;
    if (gap > 2 + longer)
        return false;
    if ((run->peak > 0) != (next->peak > 0))
        return fabs(next->peak) < fabs(run->peak);
    if (run->pressed != run->last)
        return false;
    double sum = 0;
    for (size_t i = run->last + 1; i < next->first; i++)
        sum += detection->force[i];
    return fabs(sum) > detection->threshold / 2 * (double)gap && (sum > 0) == (run->peak > 0);
}

static void detection_find_runs(size_t count, ContactDetection *detection) {
    for (size_t i = 0; i < count; i++) {
        const double value = detection->force[i];
        if (!(fabs(value) > detection->threshold))
            continue;
        DetectedContact run = {.first = i, .last = i, .pressed = i, .peak = value};
        while (run.last + 1 < count &&
               fabs(detection->force[run.last + 1]) > detection->threshold &&
               (detection->force[run.last + 1] > 0) == (value > 0)) {
            run.last++;
            if (fabs(detection->force[run.last]) > fabs(run.peak))
                run.peak = detection->force[run.last];
        }
        run.pressed = run.last;
        i = run.last;
        DetectedContact *before =
            detection->count > 0 ? &detection->runs[detection->count - 1] : NULL;
        if (before == NULL || detection->is_full || !detection_is_same(detection, before, &run)) {
            detection->is_full = detection->count == TRACE_CONTACTS_MAX;
            if (!detection->is_full)
                detection->runs[detection->count++] = run;
            continue;
        }
        before->last = run.last;
        if ((before->peak > 0) == (run.peak > 0)) {
            before->pressed = run.last;
            if (fabs(run.peak) > fabs(before->peak))
                before->peak = run.peak;
        }
    }
}

// `threshold` [N]; NAN: from the noise.
static Status detection_run(const Reals *force, double threshold, ContactDetection *detection) {
    *detection = (ContactDetection){.samples = force->count};
    detection->force = malloc((force->count + 1) * sizeof *detection->force);
    TRY(status_made(detection->force != NULL));
    TRY(detection_find_baseline(force, detection));
    detection->threshold =
        isnan(threshold) ? fmax(6 * detection->noise, 0.002 * detection->largest) : threshold;
    detection_find_runs(force->count, detection);
    return STATUS_OK;
}

// The largest part of a contact below `level` of its peak, and its largest part before the visible
// one, both relative to the visible part.
static double trace_hidden(double level, int separation, double *before) {
    double most = 0;
    *before = 0;
    for (int i = 0; i <= 4; i++) {
        const PulseModel model = pulse_model_make(i * 0.75, 0, false, separation);
        const PulseVisible visible = pulse_model_visible(&model, fmin(level, 0.95));
        const double seen = fmax(visible.to - visible.from, 0.02);
        most = fmax(most, (1 - seen) / seen);
        *before = fmax(*before, visible.from / seen);
    }
    return most;
}

// Fills the window in which contact `number` is fitted. Returns its first sample.
static size_t trace_fill_window(const ContactDetection *found, size_t number, int separation,
                                FitWindow *window) {
    const DetectedContact *run = &found->runs[number];
    const double level = found->threshold / fabs(run->peak);
    const size_t run_length = run->last - run->first + 1, count = found->samples;
    double before, after = trace_hidden(level, SEPARATION_ZERO_PENETRATION, &before);
    const size_t about = (size_t)((double)run_length * (4 + 2 * after)) + 24;
    size_t from = run->first > about ? run->first - about : 0;
    size_t to = count - run->last > about ? run->last + about : count;
    // A contact may continue below the threshold: it gets two thirds of the gap behind it.
    if (number > 0) {
        const size_t wall = run->first - (run->first - found->runs[number - 1].last) / 3;
        from = from > wall ? from : wall;
    }
    if (number + 1 < found->count) {
        const size_t gap = found->runs[number + 1].first - run->last - 1;
        const size_t wall = run->last + 1 + gap * 2 / 3;
        to = to < wall ? to : wall;
    }
    const size_t samples = to - from;
    const size_t m = (samples + FIT_BLOCKS_MAX - 1) / FIT_BLOCKS_MAX;
    *window = (FitWindow){
        .blocks = samples / m,
        .per_block = m,
        .separation = separation,
        .first = (long)(run->first - from),
        .last = (long)(run->last - from),
    };
    for (size_t k = 0; k < window->blocks; k++) {
        const double *force = found->force + from + k * m;
        double sum = 0;
        for (size_t i = 0; i < m; i++)
            sum += force[i] / run->peak;
        const double mean = sum / (double)m;
        window->mean[k] = mean;
        window->sum += mean;
    }
    const double noise = found->noise / run->peak;
    window->noise_freedom = fmax(found->noise_count - (double)samples, 0);
    window->noise_square = noise * noise * window->noise_freedom;
    after = trace_hidden(level, separation, &before);
    const double length = (double)run_length;
    const long end = (long)(window->blocks * m) - 1;
    window->least_start = window->first - (long)ceil(1.5 * before * length) - 2 - (long)length / 8;
    window->most_end = window->last + (long)ceil(1.5 * after * length) + 2 + (long)length / 8;
    // At least one sample on each side must be out of contact.
    window->least_start = window->least_start > 1 ? window->least_start : 1;
    window->most_end = window->most_end < end - 1 ? window->most_end : end - 1;
    return from;
}

// rms of the residuals of the *count means of the window during contact [peak].
static double trace_misfit(const FitWindow *window, const PulseFit *fit, const PulseModel *model,
                           double T, size_t *count) {
    double sum = 0;
    const long m = (long)window->per_block;
    *count = 0;
    for (long k = (fit->first + m - 1) / m; (k + 1) * m - 1 <= fit->last; k++) {
        const double at = (double)(k * m) + (double)(m - 1) / 2;
        const double force = pulse_model_force(model, (at - fit->at.part[0]) / T);
        const double left =
            window->mean[k] - fit->residual.amplitude * force - fit->residual.baseline;
        sum += left * left;
        ++*count;
    }
    return sqrt(sum / fmax((double)*count - 4, 1));
}

// Withdraws a figure that is no use, and extends its interval to the one without a fit.
static Status trace_conclude(const FitConfidence *likely, bool is_form_sure, double noise,
                             int separation, const TraceContact *counted, TraceContact *contact) {
    const double width = contact->most_contact_time - contact->least_contact_time;
    const bool is_wide = !(width < width_max * contact->contact_time);
    const bool is_endless = likely->decay.mean + 2 * likely->decay.deviation > decay_max;
    if (is_wide || (is_form_sure && is_endless)) {
        contact->least_contact_time =
            fmin(contact->least_contact_time, counted->least_contact_time);
        contact->most_contact_time = fmax(contact->most_contact_time, counted->most_contact_time);
        contact->contact_time = contact->contact_time_uncertainty = (double)NAN;
        contact->restitution = contact->restitution_uncertainty = (double)NAN;
    }
    return status_made(
        !is_form_sure
            ? text_format(&contact->why,
                          "the trace differs from every pulse of the model under the rule %s: the "
                          "rms residual of the best one is %.2g %% of the peak, and the noise is "
                          "%.2g %% of it",
                          separation_names[separation], 100 * contact->seen.misfit_share,
                          100 * noise)
        : is_wide
            ? text_format(&contact->why,
                          "pulses from %.3g s to %.3g s fit the trace about equally well: "
                          "less noise or more samples in contact would distinguish them",
                          contact->least_contact_time, contact->most_contact_time)
            : !is_endless || text_format(&contact->why,
                                         "the force has no distinct end: pulses with a restitution "
                                         "of nearly 0 fit the trace as well"));
}

// The best pulse on the baseline, from its start to its end; the window begins at sample `origin`.
static Status trace_draw(const PulseFit *fit, const PulseModel *model,
                         const ContactDetection *found, const DetectedContact *run, double origin,
                         Reals *pulse) {
    TRY(status_made(reals_allocate(pulse, TRACE_PULSE)));
    for (size_t i = 0; i < TRACE_PULSE; i++) {
        const double share = (double)i / (TRACE_PULSE - 1), *part = fit->at.part;
        const double place = origin + part[0] + share * (part[1] - part[0]);
        const double force =
            fit->residual.amplitude * pulse_model_force(model, model->length * share);
        pulse->at[i] = detection_baseline(found->baseline, place, found->samples) +
                       run->peak * (fit->residual.baseline + force);
    }
    return STATUS_OK;
}

static Status trace_fit_contact(FitWindow *window, const ContactDetection *found,
                                const DetectedContact *run, double origin, double interval,
                                const PulseFit *fits, size_t count, TraceContact *contact) {
    if (count == 0)
        return status_made(text_format(&contact->why, "no pulse of the model fits"));
    const PulseFit *fit = &fits[0];
    contact->seen.samples = (uint64_t)(fit->last - fit->first + 1);
    contact->seen.first = (origin + (double)fit->first) * interval;
    contact->seen.last = (origin + (double)fit->last) * interval;
    PulseModel model;
    double T;
    pulse_fit_model(window, &fit->at, &model, &T);
    const PulseVisible visible = pulse_model_visible(&model, found->threshold / fabs(run->peak));
    contact->seen.crossing_shortfall = 1 - (visible.pressed - visible.from);
    contact->seen.impulse =
        fit->residual.amplitude * T * pulse_model_impulse(&model) * run->peak * interval;
    size_t means;
    contact->seen.misfit_share = trace_misfit(window, fit, &model, T, &means);
    const double noise = found->noise / fabs(run->peak) / sqrt((double)window->per_block);
    contact->seen.misfit = noise > 0 ? contact->seen.misfit_share / noise : (double)NAN;
    if (contact->seen.samples < SAMPLES_MIN)
        return status_made(
            text_format(&contact->why,
                        "only %d samples are in contact, and pulses of very different "
                        "length fit so few: at least 5 are needed, 20 are better",
                        (int)contact->seen.samples));
    if (contact->seen.misfit_share > misfit_max && contact->seen.misfit_share > 2 * noise)
        return status_made(
            text_format(&contact->why,
                        "the trace is no pulse of the model under the separation rule "
                        "%s: the rms residual of the best one is %.2g %% of the peak",
                        separation_names[window->separation], 100 * contact->seen.misfit_share));
    // Residuals rarely exceed this by chance, given the number of means and of samples of noise.
    const double freedom = fmax((double)means - 4, 1), known_from = fmax(found->noise_count - 1, 1);
    const double chance = 1 + 3.7 * sqrt(1 / freedom + 1 / known_from) / sqrt(2);
    const bool is_form_sure =
        !(contact->seen.misfit_share > 0.01 && contact->seen.misfit_share > noise * chance);
    FitConfidence likely;
    TRY(pulse_fit_confidence(window, fits, count, is_form_sure, &likely));
    TRY(trace_draw(fit, &model, found, run, origin, &contact->seen.pulse));
    const TraceContact counted = *contact;
    contact->seen.start = (origin + fit->at.part[0]) * interval;
    contact->seen.end = (origin + fit->at.part[1]) * interval;
    contact->contact_time = likely.contact_time.mean * interval;
    contact->contact_time_uncertainty = likely.contact_time.deviation * interval;
    contact->least_contact_time = likely.least * interval;
    contact->most_contact_time = likely.most * interval;
    contact->restitution = fmin(exp(-likely.decay.mean), 1);
    contact->restitution_uncertainty = exp(-likely.decay.mean) * likely.decay.deviation;
    return trace_conclude(&likely, is_form_sure, noise, window->separation, &counted, contact);
}

// Iterates a fit and the pull that follows from it, m_e g over the fitted m_e v0, until they agree;
// false: they do not. The fitted m_e v0 depends only weakly on the pull.
static bool trace_settle_pull(double weight, double unit, FitWindow *window, PulseFit *fit) {
    double rate_before = 0, gap_before = 0;
    for (int round = 0; round < 12; round++) {
        PulseModel model;
        double T;
        if (!isfinite(fit->residual.sum) || !pulse_fit_model(window, &fit->at, &model, &T))
            return false;
        const double rate = window->pull_rate;
        const double gap = weight / (fit->residual.amplitude * T * unit) - rate;
        if (fabs(gap) < 1e-4 * rate)
            return true;
        // The secant method: under a strong pull plain iteration only halves the gap.
        const double slope = round > 0 ? (gap - gap_before) / (rate - rate_before) : -1;
        rate_before = rate;
        gap_before = gap;
        window->pull_rate = fmax(rate - gap / fmin(slope, -0.1), 0);
        pulse_fit_continue(window, fit);
    }
    return false;
}

// The fits under gravity. The pull is g / v0; without v0 it follows from the best fit, until that
// is the best under its own pull; *is_settled: there is such a fit.
static size_t trace_fit_pulled(const TraceOptions *options, size_t number, double interval,
                               double peak, FitWindow *window, PulseFit *fits, bool *is_settled) {
    const bool is_known =
        number < options->approach_speed_count && options->approach_speeds[number] > 0;
    *is_settled = true;
    if (is_known)
        window->pull_rate = options->gravity / options->approach_speeds[number] * interval;
    size_t count = pulse_fit_run(window, fits);
    if (is_known || !(options->effective_mass > 0))
        return count;
    for (int round = 0; round < 4 && count > 0; round++) {
        PulseFit best = fits[0];
        const double before = window->pull_rate;
        *is_settled =
            trace_settle_pull(options->effective_mass * options->gravity, peak, window, &best);
        if (*is_settled && window->pull_rate == before)
            return count;
        count = pulse_fit_run(window, fits);
    }
    *is_settled = false;
    return count;
}

static Status trace_read_contact(double interval, const TraceOptions *options,
                                 const ContactDetection *found, size_t number, FitWindow *window,
                                 TraceContact *contact) {
    const DetectedContact *run = &found->runs[number];
    const double none = (double)NAN;
    *contact = (TraceContact){.contact_time = none,
                              .contact_time_uncertainty = none,
                              .restitution = none,
                              .restitution_uncertainty = none};
    fields_clear(trace_detection_fields, &contact->seen);
    contact->seen.baseline = found->baseline[0];
    contact->seen.noise = found->noise;
    contact->seen.threshold = found->threshold;
    contact->seen.peak = run->peak;
    contact->seen.samples = run->last - run->first + 1;
    contact->seen.first = (double)run->first * interval;
    contact->seen.last = (double)run->last * interval;
    contact->seen.crossing_time = (double)(run->pressed - run->first + 1) * interval;
    contact->seen.crossing_uncertainty = interval / sqrt(6);
    // The interval without a fit: from the samples above the threshold.
    const double seen = (double)(run->last - run->first);
    double before;
    const double after =
        trace_hidden(found->threshold / fabs(run->peak), options->separation, &before);
    contact->least_contact_time = seen * interval;
    contact->most_contact_time = (seen + 2) * (1 + after) * interval;
    if (run->first == 0 || run->last == found->samples - 1) {
        contact->most_contact_time = (double)NAN;
        return status_made(text_format(&contact->why, "the trace %s during the contact",
                                       run->first == 0 ? "begins" : "ends"));
    }
    const size_t from = trace_fill_window(found, number, options->separation, window);
    PulseFit fits[FITS_MAX];
    bool is_settled = true;
    const size_t count = options->gravity > 0
                             ? trace_fit_pulled(options, number, interval, fabs(run->peak), window,
                                                fits, &is_settled)
                             : pulse_fit_run(window, fits);
    TRY(trace_fit_contact(window, found, run, (double)from, interval, fits, count, contact));
    if (!is_settled && !isnan(contact->contact_time))
        return status_made(text_format(
            &contact->why, "gravity is only partly corrected: the masses and this force "
                           "do not lead to one approach speed; check them, or give it"));
    if (options->gravity > 0 && !(window->pull_rate > 0) && !isnan(contact->contact_time))
        return status_made(text_format(
            &contact->why,
            "gravity is not corrected: neither the approach speed nor the masses are known"));
    return STATUS_OK;
}

Status trace_validate(double interval, const Reals *force, const char *pointer, Problem *problem) {
    if (!(interval > 0) || !isfinite(interval))
        return problem_add(problem, STATUS_INVALID, pointer,
                           "its interval must be above 0 s, is %g", interval);
    if (force->count < TRACE_MIN)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "must have at least %d samples, has %zu", TRACE_MIN, force->count);
    for (size_t i = 0; i < force->count; i++)
        if (!(fabs(force->at[i]) < 1e150))
            return problem_add(problem, STATUS_INVALID, pointer,
                               "its sample %zu must be a force below 1e150 N", i);
    return STATUS_OK;
}

Status trace_analysis_run(double interval, const Reals *force, const TraceOptions *options,
                          const char *pointer, TraceAnalysis *analysis, Problem *problem) {
    *analysis = (TraceAnalysis){.why = NULL};
    TRY(trace_validate(interval, force, pointer, problem));
    TraceContacts *list = &analysis->contacts;
    ContactDetection found;
    Status status = detection_run(force, options->threshold, &found);
    FitWindow *window = malloc(sizeof *window);
    list->at = status == STATUS_OK ? calloc(found.count + 1, sizeof *list->at) : NULL;
    if (window == NULL || list->at == NULL)
        status = STATUS_NO_MEMORY;
    for (size_t i = 0; status == STATUS_OK && i < found.count; i++) {
        if (!progress_advance(options->progress, (double)i / (double)found.count)) {
            status = STATUS_CANCELLED;
            break;
        }
        list->count++;
        status = trace_read_contact(interval, options, &found, i, window, &list->at[i]);
    }
    if (status == STATUS_OK && found.count == 0)
        status = status_made(text_format(&analysis->why, "no force exceeds the threshold of %.3g N",
                                         found.threshold));
    if (status == STATUS_OK && found.is_full)
        status = status_made(text_format(&analysis->why, "only the first %d contacts are evaluated",
                                         TRACE_CONTACTS_MAX));
    free(found.force);
    free(window);
    return status;
}

void trace_analysis_clear(TraceAnalysis *analysis) {
    for (size_t i = 0; i < analysis->contacts.count; i++) {
        fields_clear(trace_detection_fields, &analysis->contacts.at[i].seen);
        free(analysis->contacts.at[i].why);
    }
    free(analysis->contacts.at);
    free(analysis->why);
    *analysis = (TraceAnalysis){.why = NULL};
}
