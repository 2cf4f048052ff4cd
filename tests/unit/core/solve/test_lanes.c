// Eight samples at once against one arc after the other, and every width of vector against the
// others.
#include <math.h>
#include <string.h>

#include "core/solve/lanes.h"
#include "core/solve/motion_table.h"
#include "tests/support/test.h"

enum { COUNT_MAX = 203 };
static const double INTERVAL = 1e-3;

typedef struct Flown {
    FlightBlock stretch;
    double columns[CHANNEL_COUNT][COUNT_MAX + 1];
    size_t count;
} Flown;

static Motion structure(double damping) {
    Motion motion = {.omega2 = 640, .damping = damping, .share = 0.076};
    motion.rate = fmax(sqrt(motion.omega2), damping);
    return motion;
}

static void make_base(double *base) {
    for (size_t i = 0; i <= COUNT_MAX + 1; i++)
        base[i] = sin(0.07 * (double)i) + 0.3 * cos(1.1 * (double)(i * i % 17));
}

static const Base sine = {.form = BASE_SINE, .amplitude = 1.4, .omega = 7};

// `base` does not matter where the lanes are a sine's.
static void fly(const Lanes *lanes, const State *start, double room, const double *base,
                Flown *flown) {
    static BaseCursor cursor;
    base_cursor_make(&cursor, &sine, 1 / INTERVAL);
    memset(flown, 0, sizeof *flown);
    FlightBlock *s = &flown->stretch;
    *s = (FlightBlock){.x = start->x,
                       .v = start->v,
                       .r = start->r,
                       .z = start->v + start->w,
                       .left = room,
                       .right = room,
                       .middle = 0.001,
                       .mass = 2,
                       .base_max = base == NULL && lanes->base_omega == 0 ? 0 : 1.4,
                       .base = &cursor};
    for (int i = 0; i < CHANNEL_COUNT; i++)
        if (i <= CHANNEL_DAMPER_VELOCITY || i == CHANNEL_BASE_SHEAR)
            s->columns[i] = flown->columns[i];
    flown->count = lanes_fly(lanes, s, 0, COUNT_MAX, base);
}

TEST(lanes_agree_with_pieces) {
    double base[COUNT_MAX + 2];
    make_base(base);
    for (int kind = 0; kind < 6; kind++) {
        const bool is_still = kind < 4 && kind % 2 == 0, is_sine = kind >= 4;
        const Motion motion = structure(kind < 2 || kind == 4 ? 0.8 : 0);
        Lanes lanes = {0};
        static MotionTable table;
        motion_table_make(&table, &motion, is_sine ? sine.omega : 0, INTERVAL);
        lanes_make(&lanes, &table, true, lanes_widest());
        assert_non_null(lanes.run);
        const State start = {0.015, -0.1, 0.002, 0.03};
        static Flown flown;
        fly(&lanes, &start, 1, is_still || is_sine ? NULL : base, &flown);
        assert_int_equal(flown.count, COUNT_MAX);
        State at = start;
        double vv = 0, av = 0, sums[LANE_SUMS], got_vv = 0, got_av = 0, peak = 0;
        for (size_t i = 0; i < COUNT_MAX; i++) {
            const double phase = sine.omega * INTERVAL * (double)i;
            const Slice slice = is_sine ? (Slice){1.4 * sin(phase), 1.4 * cos(phase), sine.omega}
                                : is_still
                                    ? (Slice){0, 0, 0}
                                    : (Slice){base[i], (base[i + 1] - base[i]) / INTERVAL, 0};
            Piece piece;
            PieceSums integrals;
            piece_make(&piece, &table, &at, &slice);
            piece_sums(&piece, 1, &integrals);
            const double before = at.v;
            vv += integrals.vv;
            av += integrals.av;
            piece_end(&table, piece.start, &at);
            const double push = motion.damping * at.v + motion.omega2 * at.x;
            peak = fmax(peak, fabs(at.x + 0.001 + at.r));
            assert_true(fabs(flown.columns[CHANNEL_DISPLACEMENT][i + 1] - at.x) < 1e-15);
            assert_true(fabs(flown.columns[CHANNEL_VELOCITY][i + 1] - at.v) < 1e-14);
            assert_true(fabs(flown.columns[CHANNEL_ACCELERATION][i + 1] + push) < 1e-12);
            assert_true(fabs(flown.columns[CHANNEL_BASE_SHEAR][i + 1] - 2 * push) < 2e-12);
            assert_true(fabs(flown.columns[CHANNEL_MEAN_ACCELERATION][i + 1] -
                             (at.v - before + integrals.a) / INTERVAL) < 1e-11);
            assert_true(fabs(flown.columns[CHANNEL_DAMPER_DISPLACEMENT][i + 1] -
                             (at.x + 0.001 + at.r)) < 1e-15);
            assert_true(fabs(flown.columns[CHANNEL_DAMPER_VELOCITY][i + 1] - (at.v + at.w)) <
                        1e-14);
        }
        lanes_take_sums(&lanes, &flown.stretch, sums);
        for (int i = 0; i < LANE_SUMS; i++) {
            got_vv += lanes.vv[i] * sums[i];
            got_av += lanes.av[i] * sums[i];
        }
        assert_true(fabs(got_vv - vv) < 2e-14 * vv);
        assert_true(fabs(got_av - av) < 1e-13 * (fabs(av) + vv));
        assert_true(fabs(lanes_take_peak(&flown.stretch, OF_DAMPER) - peak) < 1e-15);
    }
}

TEST(no_width_of_vector_moves_a_bit) {
    double base[COUNT_MAX + 2];
    make_base(base);
    const Motion motion = structure(0.8);
    for (int kind = 0; kind < 6; kind++) {
        const State start = {0.015, -0.1, 0.002, 0.03};
        static Flown flown[3];
        for (LanesWidth width = LANES_PLAIN; width <= lanes_widest(); width++) {
            Lanes lanes = {0};
            static MotionTable table;
            motion_table_make(&table, &motion, kind < 4 ? 0 : sine.omega, INTERVAL);
            lanes_make(&lanes, &table, true, width);
            fly(&lanes, &start, kind < 2 || kind == 4 ? 1 : 0.012,
                kind % 2 == 0 || kind > 3 ? NULL : base, &flown[width]);
            flown[width].stretch.base = NULL;
            memset(flown[width].stretch.columns, 0, sizeof flown[width].stretch.columns);
            for (LanePeak i = 0; i < LANE_PEAKS; i++) // the lanes of a peak are no matter
                flown[width].stretch.left += lanes_take_peak(&flown[width].stretch, i);
            assert_memory_equal(&flown[width], &flown[0], sizeof *flown);
        }
    }
}

TEST(lanes_end_before_a_stop) {
    const Motion motion = structure(0.8);
    Lanes lanes = {0};
    static MotionTable table;
    motion_table_make(&table, &motion, 0, INTERVAL);
    lanes_make(&lanes, &table, true, lanes_widest());
    static Flown flown;
    for (int step = 1; step < 100; step++) {
        const double room = 0.0001 * step;
        const State start = {0.015, 0, 0, 0};
        fly(&lanes, &start, room, NULL, &flown);
        // r = x(0) - x(t) until the stop is met.
        State at = start;
        size_t reached = 0;
        for (; fabs(at.r) < room; reached++) {
            const double from[START_SIZE] = {at.x, at.v, at.r, at.w};
            piece_end(&table, from, &at);
        }
        assert_true(flown.count < reached);
        assert_true(flown.count + 2 >= reached);
    }
}

TEST(an_interval_too_long_for_the_structure_is_refused) {
    const Motion motion = structure(0.8);
    Lanes lanes = {0};
    static MotionTable table;
    motion_table_make(&table, &motion, 0, 0.02);
    lanes_make(&lanes, &table, true, lanes_widest());
    assert_null(lanes.run);
}
