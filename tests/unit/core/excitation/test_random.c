// The random base: its samples against a slow sum of their definition, its statistics against the
// density that was asked for, and what is refused. Seeds are fixed, so nothing here is left to
// chance.
#include "core/excitation/excitation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "core/result/welch.h"
#include "tests/support/test.h"

static double band[2];

static ExcitationRandom random_with(double f0, double f1, double rms, uint64_t seed, double rate) {
    band[0] = f0;
    band[1] = f1;
    return (ExcitationRandom){.start.variant.kind = &excitation_random.kind,
                              .band = {band, 2},
                              .rms = rms,
                              .seed = seed,
                              .rate = rate};
}

static Base base_of(const ExcitationRandom *random, double duration) {
    const Span span = {.duration = duration, .sample_rate = 1000};
    Base base = {0};
    assert_int_equal(excitation_random.make(&random->start, &span, NULL, &base, NULL), STATUS_OK);
    return base;
}

// y_m[i] of the definition, bin by bin.
static long double slow_block(const ExcitationRandom *random, uint64_t m, size_t i) {
    const RandomBlocks blocks = random_blocks(random);
    long double sum = 0;
    for (size_t k = blocks.first_bin; k < blocks.first_bin + blocks.bins; k++) {
        double normal[2];
        philox_normal_pair(random->seed, m, k, normal);
        const long double turn = (long double)(k * i % blocks.length) / (long double)blocks.length;
        const long double angle = 2 * acosl(-1) * turn;
        sum += normal[0] * cosl(angle) - normal[1] * sinl(angle);
    }
    return sum * random->rms / sqrtl((long double)blocks.bins);
}

static long double slow_sample(const ExcitationRandom *random, size_t j) {
    const size_t length = random_blocks(random).length, hop = length / 2, h = j / hop, i = j % hop;
    const long double angle = acosl(-1) * ((long double)i + 0.5L) / (long double)length;
    return cosl(angle) * slow_block(random, h, hop + i) +
           sinl(angle) * slow_block(random, h + 1, i);
}

TEST(samples_equal_a_slow_sum_over_the_bins) {
    static const struct {
        double f0, f1, rate, duration;
    } cases[] = {
        {0, 15, 1000, 60},   {3, 4.5, 1000, 150}, {0, 500, 1000, 20},
        {20, 100, 250, 100}, {0.5, 0.6, 2, 7000},
    };
    for (size_t c = 0; c < COUNT(cases); c++) {
        const ExcitationRandom random =
            random_with(cases[c].f0, cases[c].f1, 2.5, 40 + c, cases[c].rate);
        const size_t hop = random_blocks(&random).length / 2;
        Base base = base_of(&random, cases[c].duration);
        const size_t at[] = {0,       1,           hop / 3, hop / 2,        hop - 1,       hop,
                             hop + 1, 2 * hop - 1, 2 * hop, base.count - 2, base.count - 1};
        for (size_t i = 0; i < COUNT(at); i++)
            if (at[i] < base.count)
                assert_true(fabsl(base.values[at[i]] - slow_sample(&random, at[i])) <
                            1e-14L * 2.5L);
        base_clear(&base);
    }
}

TEST(a_longer_run_begins_with_the_same_bits) {
    const ExcitationRandom random = random_with(0, 15, 1, 7, 1000);
    Base longest = base_of(&random, 120);
    for (double duration = 0.05; duration < 120; duration *= 7) {
        Base base = base_of(&random, duration);
        assert_true(base.count < longest.count);
        assert_memory_equal(base.values, longest.values, base.count * sizeof *base.values);
        base_clear(&base);
    }
    base_clear(&longest);
}

TEST(the_samples_reach_past_the_end_of_the_run) {
    const ExcitationRandom random = random_with(0, 15, 1, 7, 1000);
    Base base = base_of(&random, 10);
    assert_int_equal(base.form, BASE_SAMPLED);
    assert_int_equal(base.count, 10002);
    assert_true(base.interval == 1.0 / 1000);
    base_clear(&base);
    // 0.3 s * 1000 Hz falls a rounding short of 300, and sample 300 belongs to the run all the
    // same.
    base = base_of(&random, 0.1 * 3 - 1e-16);
    assert_int_equal(base.count, 302);
    base_clear(&base);
}

TEST(an_rms_of_nought_is_a_still_base) {
    const ExcitationRandom random = random_with(0, 15, 0, 7, 1000);
    Base base = base_of(&random, 3);
    assert_int_equal(base.form, BASE_STILL);
    assert_null(base.values);
    base_clear(&base);
}

TEST(moments_are_those_of_a_gaussian_process_of_this_rms) {
    const double duration = 1200, rms = 0.7;
    const ExcitationRandom random = random_with(5, 15, rms, 1, 100);
    Base base = base_of(&random, duration);
    double sum[5] = {0};
    for (size_t i = 0; i < base.count; i++)
        for (int power = 1; power < 5; power++)
            sum[power] += pow(base.values[i] / rms, power) / (double)base.count;
    // A band of width W has 2 W independent samples a second; four standard errors each, which are
    // a little narrower still for the higher powers of a correlated process.
    const double independent = 2 * 10 * duration;
    assert_true(fabs(sum[1]) < 4 / sqrt(independent));
    assert_true(fabs(sum[2] - 1) < 4 * sqrt(2 / independent));
    assert_true(fabs(sum[3]) < 4 * sqrt(15 / independent));
    assert_true(fabs(sum[4] - 3) < 4 * sqrt(96 / independent));
    base_clear(&base);
}

TEST(the_variance_is_the_same_at_every_sample) {
    enum { SEEDS = 1500, PLACES = 9 };
    double variance[PLACES] = {0}, mean[PLACES] = {0};
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        const ExcitationRandom random = random_with(10, 40, 3, seed, 100);
        Base base = base_of(&random, 40.96);
        for (size_t i = 0; i < PLACES; i++) {
            const double x = base.values[i * 512] / 3; // hops begin at 0, 2048 and 4096
            mean[i] += x / SEEDS;
            variance[i] += x * x / SEEDS;
        }
        base_clear(&base);
    }
    for (size_t i = 0; i < PLACES; i++) {
        assert_true(fabs(mean[i]) < 4 * sqrt(1.0 / SEEDS));
        assert_true(fabs(variance[i] - 1) < 4 * sqrt(2.0 / SEEDS));
    }
}

TEST(the_density_is_flat_within_the_band_and_nothing_outside) {
    const double rms = 2, duration = 1200;
    const ExcitationRandom random = random_with(5, 15, rms, 3, 100);
    Base base = base_of(&random, duration);
    Column column = {.name = "base", .values = base.values};
    const Columns series = {.at = &column, .count = 1, .rows = base.count};
    const WelchSettings settings = {
        .segment = 2048, .overlap = 1024, .window = WELCH_BLACKMAN, .detrend = WELCH_DETREND_NONE};
    const char *unit = "(m/s^2)^2/Hz";
    Spectrum spectrum;
    assert_int_equal(welch_spectrum(&series, &unit, 100, &settings, NULL, NULL, &spectrum, NULL),
                     STATUS_OK);
    const double *density = spectrum.densities.at[0].values, asked = rms * rms / 10;
    double sums[10] = {0}, counts[10] = {0}, below = 0, above = 0;
    for (size_t k = 0; k < spectrum.densities.rows; k++) {
        const double f = spectrum.frequency[k];
        if (f > 5.3 && f < 14.7) {
            sums[(int)(f - 5)] += density[k];
            counts[(int)(f - 5)]++;
        }
        // 20 bins of a block of 4096 are 0.49 Hz; Welch's own window takes a few bins of its own.
        if (f < 4.3)
            below = fmax(below, density[k]);
        if (f > 15.7)
            above = fmax(above, density[k]);
    }
    // A band of 1 Hz has 2 * duration degrees of freedom, at both ends of the band fewer.
    for (int i = 0; i < 10; i++)
        assert_true(fabs(sums[i] / counts[i] / asked - 1) < 4 * sqrt(2 / (2 * duration * 0.6)));
    assert_true(below < 1e-6 * asked);
    assert_true(above < 1e-6 * asked);
    spectrum_clear(&spectrum);
    base_clear(&base);
}

TEST(two_seeds_are_not_correlated) {
    const double duration = 600;
    ExcitationRandom random = random_with(0, 50, 1, 1, 100);
    Base one = base_of(&random, duration);
    random.seed = 2;
    Base other = base_of(&random, duration);
    for (size_t lag = 0; lag < 20; lag++) {
        double product = 0;
        for (size_t i = lag; i < one.count; i++)
            product += one.values[i] * other.values[i - lag] / (double)one.count;
        assert_true(fabs(product) < 4 / sqrt(2 * 50 * duration));
    }
    base_clear(&one);
    base_clear(&other);
}

TEST(the_bins_lie_inside_the_band_and_leave_out_the_mean) {
    ExcitationRandom random = random_with(0, 500, 1, 0, 1000);
    RandomBlocks blocks = random_blocks(&random);
    assert_int_equal(blocks.length, 4096);
    assert_int_equal(blocks.first_bin, 1);
    assert_int_equal(blocks.bins, 2047);
    random = random_with(0, 15, 1, 0, 1000);
    blocks = random_blocks(&random);
    assert_int_equal(blocks.length, 32768);
    assert_int_equal(blocks.bins, 491);
    // The narrowest band: the block meets its limit and still holds eight bins.
    random = random_with(100, 100 + 8 * 0x1p-22 * 1000, 1, 0, 1000);
    blocks = random_blocks(&random);
    assert_int_equal(blocks.length, 1 << 22);
    assert_in_range(blocks.bins, 8, 9);
}

typedef struct Refusal {
    double bounds[3];
    size_t bound_count;
    double rate, duration;
    const char *pointer, *detail;
} Refusal;

TEST(faults_name_the_place_the_number_and_the_limit) {
    static const Refusal refusals[] = {
        {{0, 600},
         2,
         1000,
         10,
         "/excitation/band/1",
         "at most half the rate of the base's samples, 500 Hz, is 600"},
        {{0, 40}, 2, 50, 10, "/excitation/band/1", "25 Hz, is 40"},
        {{15, 5},
         2,
         1000,
         10,
         "/excitation/band/1",
         "must be above the lowest frequency, 15 Hz, is 5"},
        {{5, 5},
         2,
         1000,
         10,
         "/excitation/band/1",
         "must be above the lowest frequency, 5 Hz, is 5"},
        {{1, 1.001}, 2, 1000, 10, "/excitation/band", "must be at least 0.0019"},
        {{1},
         1,
         1000,
         10,
         "/excitation/band",
         "two entries, the lowest and the highest frequency in Hz, has 1"},
        {{1, 2, 3}, 3, 1000, 10, "/excitation/band", "has 3"},
        {{0, 15}, 2, 1e6, 100, "/excitation/rate", "must be at most 335544.31 Hz"},
        {{0, 15}, 2, 1e300, 1e300, "/excitation/rate", "must be at most"},
    };
    static Problem problem;
    for (size_t i = 0; i < COUNT(refusals); i++) {
        const Refusal *refusal = &refusals[i];
        double bounds[3];
        memcpy(bounds, refusal->bounds, sizeof bounds);
        ExcitationRandom random = random_with(0, 0, 1, 0, refusal->rate);
        random.band = (Reals){bounds, refusal->bound_count};
        const Span span = {.duration = refusal->duration, .sample_rate = 1000};
        problem_clear(&problem);
        assert_int_equal(excitation_random.complete(&random.start, &span, "/excitation", &problem),
                         STATUS_INVALID);
        assert_int_equal(problem.count, 1);
        assert_string_equal(problem.faults[0].pointer, refusal->pointer);
        assert_non_null(strstr(problem.faults[0].detail, refusal->detail));
    }
}

TEST(the_rate_and_the_band_are_judged_at_once) {
    static Problem problem;
    ExcitationRandom random = random_with(20, 10, 1, 0, 1e9);
    const Span span = {.duration = 10, .sample_rate = 1000};
    assert_int_equal(excitation_random.complete(&random.start, &span, "/excitation", &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 2);
}

// No row checks a default.
TEST(a_sample_rate_too_low_for_the_base_is_a_fault) {
    static Problem problem;
    ExcitationRandom random = random_with(1, 10, 1, 0, NAN);
    const Span span = {.duration = 1, .sample_rate = 1e-12};
    problem_clear(&problem);
    assert_int_equal(excitation_random.complete(&random.start, &span, "/excitation", &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, "/excitation/rate");
    assert_string_equal(problem.faults[0].detail,
                        "must be at least 1e-09 Hz, is the sample_rate, 1e-12");
}

TEST(the_rate_is_the_sample_rate_if_absent) {
    static Problem problem;
    ExcitationRandom random = random_with(0, 250, 1, 0, NAN);
    Span span = {.duration = 10, .sample_rate = 500, .most = 5001};
    assert_int_equal(excitation_random.complete(&random.start, &span, "/excitation", &problem),
                     STATUS_OK);
    assert_true(random.rate == 500);
    assert_int_equal(problem.count, 0);
    // One sample less is allowed: the run itself would have too many.
    span.most = 5000;
    assert_int_equal(excitation_random.complete(&random.start, &span, "/excitation", &problem),
                     STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/excitation/rate");
}

TEST(what_other_rows_refused_is_not_judged_again_and_does_no_harm) {
    static const double bad[] = {NAN, INFINITY, -INFINITY, -1, 0, 1e-320, 1e308};
    for (size_t i = 0; i < COUNT(bad); i++)
        for (size_t j = 0; j < COUNT(bad); j++)
            for (size_t k = 0; k < COUNT(bad); k++)
                for (size_t l = 0; l < COUNT(bad); l++) {
                    ExcitationRandom random = random_with(bad[i], bad[j], 1, 0, bad[k]);
                    const Span span = {.duration = bad[l], .sample_rate = bad[k]};
                    excitation_random.complete(&random.start, &span, "/excitation", NULL);
                }
    ExcitationRandom random = random_with(0, 15, 1, 0, 1000);
    random.band = (Reals){NULL, 0};
    const Span span = {.duration = 10, .sample_rate = 1000};
    assert_int_equal(excitation_random.complete(&random.start, &span, "", NULL), STATUS_INVALID);
}

TEST(the_rows_fill_in_seed_and_start) {
    ExcitationRandom random;
    assert_int_equal(fields_default(excitation_random.kind.fields, &random), STATUS_OK);
    assert_int_equal(random.seed, 0);
    assert_true(isnan(random.rate) && isnan(random.rms) && random.band.count == 0);
    assert_true(random.start.displacement.count == 0 && random.start.velocity.count == 0);
    fields_clear(excitation_random.kind.fields, &random);
}

static bool stop_at_once(void *context, double fraction) {
    (void)fraction;
    ++*(int *)context;
    return false;
}

static bool go_on(void *context, double fraction) {
    assert_true(fraction >= *(double *)context && fraction <= 1);
    *(double *)context = fraction;
    return true;
}

TEST(the_watch_sees_every_block_and_can_stop) {
    static Problem problem;
    const ExcitationRandom random = random_with(0, 15, 1, 0, 1000);
    const Span span = {.duration = 100, .sample_rate = 1000};
    Base base = {0};
    int looks = 0;
    const Progress stopping = {&looks, stop_at_once};
    assert_int_equal(excitation_random.make(&random.start, &span, &stopping, &base, &problem),
                     STATUS_CANCELLED);
    assert_int_equal(looks, 1);
    assert_null(base.values);
    assert_int_equal(base.count, 0);
    double fraction = 0;
    const Progress going = {&fraction, go_on};
    assert_int_equal(excitation_random.make(&random.start, &span, &going, &base, NULL), STATUS_OK);
    assert_true(fraction > 0.8);
    base_clear(&base);
}

TEST(a_base_without_end_is_refused_when_made) {
    const ExcitationRandom random = random_with(0, 15, 1, 0, 1000);
    const Span span = {.duration = 1e9, .sample_rate = 1000};
    Base base = {0};
    assert_int_equal(excitation_random.make(&random.start, &span, NULL, &base, NULL), STATUS_LIMIT);
    assert_null(base.values);
}
