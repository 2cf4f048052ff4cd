// What a force trace is read as: contacts of either sign above any baseline, what is refused and
// why. How often its intervals hold is truth/test_traces.c's.
#include "core/drop_test/force_trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "core/contact/identification.h"
#include "tests/support/test.h"

enum { MOST = 4096 };

typedef struct Record {
    double interval;
    double values[MOST];
    Reals force;
} Record;

static void record_new(Record *record, double interval, size_t count, double noise) {
    assert_in_range(count, 1, MOST - 1);
    *record = (Record){.interval = interval, .force = {record->values, count}};
    philox_normal_pairs(5, 7, 0, (count + 1) / 2, record->values);
    for (size_t i = 0; i < count; i++)
        record->values[i] *= noise;
}

// m_e y'' + c y' + k y = m_e g from y = 0, y' = v0 by Runge and Kutta's method in small steps,
// until y, or the force, is back at 0. Returns how long that took.
static double record_add(Record *record, double start, double e, double T_c, double m_e, double v0,
                         double g, int separation) {
    const Identification pair =
        identification_from_restitution(m_e, e, T_c, (Separation)separation);
    const double k = pair.stiffness / m_e, c = pair.damping / m_e, h = T_c / 20000;
    double y = 0, v = v0, time = 0;
    size_t next = (size_t)ceil(start / record->interval);
    for (;;) {
        const double n = k * y + c * v;
        if (time > T_c / 100 && (separation == SEPARATION_ZERO_FORCE ? n < 0 : y < 0))
            return time;
        if (next < record->force.count && start + time >= (double)next * record->interval)
            record->values[next++] += m_e * n;
        const double v1 = v + h / 2 * (g - n), a1 = g - k * (y + h / 2 * v) - c * v1;
        const double v2 = v + h / 2 * a1, a2 = g - k * (y + h / 2 * v1) - c * v2;
        const double v3 = v + h * a2, a3 = g - k * (y + h * v2) - c * v3;
        y += h / 6 * (v + 2 * v1 + 2 * v2 + v3);
        v += h / 6 * (g - n + 2 * a1 + 2 * a2 + a3);
        time += h;
    }
}

static TraceAnalysis look(const Record *record, const TraceOptions *way) {
    TraceAnalysis reading;
    assert_int_equal(
        trace_analysis_run(record->interval, &record->force, way, "/force", &reading, NULL),
        STATUS_OK);
    return reading;
}

static const TraceOptions usual = {.separation = SEPARATION_ZERO_PENETRATION, .threshold = NAN};

TEST(several_contacts_are_found_whatever_sign_and_baseline) {
    for (int sign = -1; sign <= 1; sign += 2) {
        Record record;
        record_new(&record, 1e-4, 3000, 0.3);
        double starts[4], v0 = 1;
        for (size_t i = 0; i < 4; i++, v0 *= 0.61) {
            starts[i] = 0.02 + 0.07 * (double)i + 3.7e-5 * (double)i;
            record_add(&record, starts[i], 0.61, 0.004, 0.1, v0, 0, SEPARATION_ZERO_PENETRATION);
        }
        for (size_t i = 0; i < record.force.count; i++) {
            const double u = (double)i / 3000;
            record.values[i] = sign * record.values[i] + 250 + 40 * u - 25 * u * u;
        }
        TraceAnalysis reading = look(&record, &usual);
        assert_int_equal(reading.contacts.count, 4);
        assert_null(reading.why);
        v0 = 1;
        for (size_t i = 0; i < 4; i++, v0 *= 0.61) {
            const TraceContact *contact = &reading.contacts.at[i];
            assert_null(contact->why);
            assert_true(fabs(contact->seen.noise - 0.3) < 0.02);
            assert_true(contact->seen.peak * sign > 0 && contact->seen.impulse * sign > 0);
            assert_true(fabs(contact->seen.start - starts[i]) < 1e-4);
            assert_true(fabs(contact->seen.end - starts[i] - 0.004) < 1.5e-4);
            assert_true(contact->contact_time_uncertainty < 1e-4);
            assert_true(fabs(contact->contact_time - 0.004) <
                        3.5 * contact->contact_time_uncertainty);
            assert_true(fabs(contact->seen.impulse) > 0.97 * 0.1 * v0 * 1.61 &&
                        fabs(contact->seen.impulse) < 1.03 * 0.1 * v0 * 1.61);
            assert_true(contact->seen.misfit > 0.6 && contact->seen.misfit < 1.5);
        }
        trace_analysis_clear(&reading);
    }
}

TEST(a_threshold_reads_contact_times_short_and_by_how_much_is_told) {
    static const double facts[][2] = {{0.95, 0.03}, {0.5, 0.16}, {0.1, 0.45}};
    for (size_t i = 0; i < COUNT(facts); i++) {
        Record record;
        record_new(&record, 1e-5, 2000, 0);
        record_add(&record, 0.007003, facts[i][0], 0.004, 0.1, 1, 0, SEPARATION_ZERO_PENETRATION);
        double peak = 0;
        for (size_t n = 0; n < record.force.count; n++)
            peak = fmax(peak, record.values[n]);
        TraceOptions way = usual;
        way.threshold = 0.05 * peak;
        TraceAnalysis reading = look(&record, &way);
        assert_int_equal(reading.contacts.count, 1);
        const TraceContact *contact = reading.contacts.at;
        assert_true(fabs(contact->seen.crossing_shortfall - facts[i][1]) < 0.01);
        assert_true(fabs(1 - contact->seen.crossing_time / 0.004 - facts[i][1]) < 0.01);
        assert_true(fabs(contact->seen.crossing_uncertainty - 1e-5 * 0.408248) < 1e-10);
        assert_true(fabs(contact->contact_time / 0.004 - 1) < 1e-3);
        trace_analysis_clear(&reading);
    }
}

TEST(contacts_cut_off_by_the_trace_get_no_figure) {
    Record record;
    record_new(&record, 1e-4, 400, 0.2);
    record_add(&record, 0.02, 0.5, 0.004, 0.1, 1, 0, SEPARATION_ZERO_PENETRATION);
    for (int end = 0; end < 2; end++) {
        Record part = record;
        part.force = (Reals){part.values + (end == 0 ? 215 : 0), end == 0 ? 185 : 215};
        TraceAnalysis reading = look(&part, &usual);
        assert_int_equal(reading.contacts.count, 1);
        const TraceContact *contact = reading.contacts.at;
        assert_non_null(strstr(contact->why, end == 0 ? "begins during" : "ends during"));
        assert_true(isnan(contact->contact_time) && isnan(contact->most_contact_time));
        assert_true(contact->least_contact_time > 0 && contact->least_contact_time < 0.004);
        trace_analysis_clear(&reading);
    }
}

TEST(few_samples_get_an_interval_and_a_plain_sentence) {
    Record record;
    record_new(&record, 1e-3, 60, 0.05);
    record_add(&record, 0.0303, 0.5, 0.003, 0.1, 1, 0, SEPARATION_ZERO_PENETRATION);
    TraceAnalysis reading = look(&record, &usual);
    assert_int_equal(reading.contacts.count, 1);
    const TraceContact *contact = reading.contacts.at;
    assert_non_null(strstr(contact->why, "samples are in contact"));
    assert_true(isnan(contact->contact_time) && isnan(contact->restitution));
    assert_true(contact->least_contact_time <= 0.003 && contact->most_contact_time >= 0.003);
    assert_true(contact->most_contact_time < 0.012);
    trace_analysis_clear(&reading);
}

TEST(the_other_rule_s_pulse_is_told_to_be_none_of_this) {
    for (int rule = 0; rule < 2; rule++) {
        Record record;
        record_new(&record, 1e-4, 400, 0.2);
        record_add(&record, 0.02, 0.4, 0.004, 0.1, 1, 0, rule);
        TraceOptions way = usual;
        way.separation = rule;
        TraceAnalysis right = look(&record, &way);
        way.separation = !rule;
        TraceAnalysis wrong = look(&record, &way);
        assert_null(right.contacts.at[0].why);
        assert_non_null(wrong.contacts.at[0].why);
        assert_non_null(strstr(wrong.contacts.at[0].why, rule == 0 ? "zero_force" : "zero_pene"));
        assert_true(wrong.contacts.at[0].seen.misfit > 2);
        trace_analysis_clear(&right);
        trace_analysis_clear(&wrong);
    }
}

TEST(what_is_no_pulse_gets_no_figure) {
    Record record;
    record_new(&record, 1e-4, 400, 0.001);
    for (size_t i = 100; i < 140; i++)
        record.values[i] += i % 8 < 4 ? 1 : 0.2;
    TraceAnalysis reading = look(&record, &usual);
    assert_true(reading.contacts.count >= 1);
    for (size_t i = 0; i < reading.contacts.count; i++) {
        const TraceContact *contact = &reading.contacts.at[i];
        assert_non_null(contact->why);
        assert_true(isnan(contact->contact_time) && isnan(contact->restitution));
        assert_true(isnan(contact->seen.start) && isnan(contact->seen.end));
        assert_int_equal(contact->seen.pulse.count, 0);
    }
    trace_analysis_clear(&reading);
}

TEST(no_contact_at_all_is_said) {
    for (int kind = 0; kind < 4; kind++) {
        Record record;
        record_new(&record, 1e-4, 2000, kind == 0 ? 1 : 0);
        for (size_t i = 0; i < 2000; i++)
            record.values[i] += kind == 2 ? 0.3 * (double)i : kind == 3 ? sin(0.7 * (double)i) : 4;
        TraceAnalysis reading = look(&record, &usual);
        assert_int_equal(reading.contacts.count, 0);
        assert_non_null(strstr(reading.why, "threshold"));
        trace_analysis_clear(&reading);
    }
}

// A sponge dropped slowly: gravity lengthens the contact by a quarter.
TEST(gravity_is_taken_out_where_it_is_told) {
    static const double speeds[] = {0.3, 1};
    for (int rule = 0; rule < 2; rule++)
        for (size_t i = 0; i < COUNT(speeds); i++) {
            Record record;
            record_new(&record, 5e-4, 1000, 0);
            const double lasted =
                record_add(&record, 0.2001, 0.61, 0.025, 0.1107, speeds[i], 9.81, rule);
            assert_true(lasted > 0.026);
            TraceOptions way = usual;
            way.separation = rule;
            way.gravity = 9.81;
            way.approach_speeds = &speeds[i];
            way.approach_speed_count = 1;
            way.effective_mass = (double)NAN;
            for (int by_mass = 0; by_mass < 2; by_mass++) {
                TraceAnalysis reading = look(&record, &way);
                assert_int_equal(reading.contacts.count, 1);
                const TraceContact *contact = reading.contacts.at;
                assert_null(contact->why);
                assert_true(fabs(contact->seen.end - contact->seen.start - lasted) < 1e-3 * lasted);
                if (!(fabs(contact->contact_time - 0.025) < 2e-3 * 0.025))
                    fail_msg("rule %d at %g m/s, %s: %g s", rule, speeds[i],
                             by_mass ? "by mass" : "by speed", contact->contact_time);
                assert_true(fabs(contact->restitution - 0.61) < 5e-3);
                trace_analysis_clear(&reading);
                way.approach_speed_count = 0;
                way.effective_mass = 0.1107;
            }
            way.effective_mass = (double)NAN;
            TraceAnalysis reading = look(&record, &way);
            assert_true(reading.contacts.at[0].contact_time > 0);
            assert_non_null(strstr(reading.contacts.at[0].why, "gravity"));
            trace_analysis_clear(&reading);
        }
}

TEST(a_coarse_converter_is_no_contact) {
    Record record;
    record_new(&record, 1e-4, 1500, 0.3);
    record_add(&record, 0.05, 0.5, 0.004, 0.1, 1, 0, SEPARATION_ZERO_FORCE);
    for (size_t i = 0; i < record.force.count; i++)
        record.values[i] = round(record.values[i]) + 512;
    TraceOptions way = usual;
    way.separation = SEPARATION_ZERO_FORCE;
    TraceAnalysis reading = look(&record, &way);
    assert_int_equal(reading.contacts.count, 1);
    assert_null(reading.contacts.at[0].why);
    assert_true(fabs(reading.contacts.at[0].contact_time / 0.004 - 1) < 0.05);
    trace_analysis_clear(&reading);
}

TEST(the_pulse_is_drawn_over_the_trace) {
    for (int rule = 0; rule < 2; rule++) {
        // The same contact without the drifting baseline, finely: what the pulse should be at its
        // places.
        Record record, fine;
        const double start = 0.03003, interval = 2e-6;
        record_new(&record, 1e-4, 400, 0);
        record_add(&record, start, 0.7, 0.004, 0.1, 1, 0, rule);
        record_new(&fine, interval, 3000, 0);
        record_add(&fine, 0.001, 0.7, 0.004, 0.1, 1, 0, rule);
        for (size_t i = 0; i < record.force.count; i++)
            record.values[i] = 17 + 0.1 * (double)i - record.values[i];
        TraceOptions way = usual;
        way.separation = rule;
        TraceAnalysis reading = look(&record, &way);
        const TraceDetection *seen = &reading.contacts.at[0].seen;
        assert_int_equal(seen->pulse.count, TRACE_PULSE);
        for (size_t i = 1; i + 1 < TRACE_PULSE; i++) {
            const double share = (double)i / (TRACE_PULSE - 1);
            const double time = seen->start + share * (seen->end - seen->start);
            const double force = fine.values[(size_t)((time - start + 0.001) / interval + 0.5)];
            const double drawn = 17 + 1000 * time - seen->pulse.at[i];
            if (!(fabs(drawn - force) < 3e-3 * fabs(seen->peak)))
                fail_msg("rule %d, point %zu: %g N in place of %g N", rule, i, drawn, force);
        }
        trace_analysis_clear(&reading);
    }
}

static void assert_refused(double interval, double *values, size_t count, const char *words) {
    const Reals force = {values, count};
    TraceAnalysis reading;
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(
        trace_analysis_run(interval, &force, &usual, "/traces/0/force", &reading, &problem),
        STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/traces/0/force");
    if (strstr(problem.faults[0].detail, words) == NULL)
        fail_msg("\"%s\" has no \"%s\"", problem.faults[0].detail, words);
    trace_analysis_clear(&reading);
}

TEST(what_cannot_be_read_is_a_fault) {
    double values[20] = {0};
    assert_refused(0, values, 20, "interval");
    assert_refused((double)NAN, values, 20, "interval");
    assert_refused(1, values, 7, "at least 8");
    values[13] = (double)NAN;
    assert_refused(1, values, 20, "sample 13");
    values[13] = -1e200;
    assert_refused(1, values, 20, "sample 13");
}

TEST(many_contacts_end_at_a_limit_that_is_told) {
    Record record;
    record_new(&record, 1e-4, 4000, 0);
    for (size_t i = 10; i < 4000; i += 10)
        record.values[i] = 1 + 1e-6 * (double)i;
    TraceAnalysis reading = look(&record, &usual);
    assert_int_equal(reading.contacts.count, TRACE_CONTACTS_MAX);
    assert_non_null(strstr(reading.why, "only the first"));
    trace_analysis_clear(&reading);
}
