

#include <string.h>

#include "server/formats/study_formats.h"
#include "tests/support/test.h"

static char clearance[] = "/dampers/0/clearance", metre[] = "m", buffer[] = "/dampers/0/buffer";
static char narrow[] = "0.01", wide[] = "0.02", soft[] = "\"soft, A\"", hard[] = "\"hard\"";
static char rms[] = "rms_displacement", impacts[] = "impacts", grew[] = "the \"numbers\" grew";

// Two clearances, two buffers; point 1 is not there yet and point 2 failed.
static Sweep sweep_make(void) {
    static char *lengths[] = {narrow, wide}, *names[] = {soft, hard}, *metrics[] = {rms, impacts};
    static SweepAxisValues axes[] = {{.pointer = clearance, .unit = metre, .values = {lengths, 2}},
                                     {.pointer = buffer, .values = {names, 2}}};
    static double points[] = {0, 2, 3}, statuses[] = {SWEEP_MADE, SWEEP_UNSTABLE, SWEEP_MADE};
    static double values[] = {0.1, 7, (double)NAN, (double)NAN, 0.3, 9};
    static StudyFailure failures[] = {{SWEEP_UNSTABLE, NULL, 1, 2, grew}};
    return (Sweep){.variant = {study_sweep.answer},
                   .points = 4,
                   .axes = {axes, 2},
                   .metrics = {metrics, 2},
                   .table = {.failed = 1,
                             .points = {points, 3},
                             .statuses = {statuses, 3},
                             .values = {values, 6},
                             .failures = {failures, 1}}};
}

TEST(rows_that_are_there_are_in_the_table_with_their_status) {
    const Sweep sweep = sweep_make();
    Bytes bytes = {0};
    study_format_write(study_format_find(study_sweep.answer, "csv"),
                       &(StudyDocument){.answer = (const Variant *)(const void *)&sweep}, &bytes);
    assert_string_equal(bytes.at,
                        "index,/dampers/0/clearance [m],/dampers/0/buffer,rms_displacement "
                        "[m],impacts,status\n"
                        "0,0.01,\"soft, A\",0.1,7,made\n"
                        "2,0.02,\"soft, A\",nan,nan,unstable\n"
                        "3,0.02,hard,0.3,9,made\n");
    bytes_clear(&bytes);
    SweepDocument document = sweep_document(&sweep);
    document.result = "r-1";
    const Table table = sweep_document_table(&document);
    assert_int_equal(format_write(format_find("json"), &table, &bytes, NULL), STATUS_OK);
    assert_non_null(strstr(bytes.at,
                           "\"status\": \"partial\", \"points\": 4, \"done\": 3, \"failed\""
                           ": 1"));
    assert_non_null(strstr(bytes.at, "\"detail\": \"the \\\"numbers\\\" grew\""));
    assert_non_null(strstr(bytes.at, "\"rms_displacement\": {\"unit\": \"m\", \"values\": "
                                     "[0.1,null,0.3]}"));
    assert_non_null(strstr(bytes.at, "/v1/results/r-1/points/{index}/scene"));
    bytes_clear(&bytes);
}

static void draw(const Sweep *sweep, Bytes *bytes) {
    const SweepDocument document = sweep_document(sweep);
    Chart chart;
    assert_true(chart_sweep(&document, &chart));
    chart_write(&chart, bytes);
}

static size_t count_of(const char *text, const char *what) {
    size_t count = 0;
    while ((text = strstr(text, what)) != NULL) {
        text += strlen(what);
        count++;
    }
    return count;
}

TEST(a_chart_has_a_map_or_a_line_for_each_metric_and_no_cell_for_what_is_missing) {
    Sweep sweep = sweep_make();
    Bytes bytes = {0};
    draw(&sweep, &bytes);
    assert_int_equal(count_of(bytes.at, "<rect class=\"bad\""), 2);
    // Two cells a map, and 24 of its legend.
    assert_int_equal(count_of(bytes.at, "<rect fill="), 2 * (2 + 24));
    assert_null(strstr(bytes.at, "nan"));
    bytes_clear(&bytes);
    sweep.mode = SWEEP_LIST;
    sweep.points = 2;
    sweep.table.points.count = sweep.table.statuses.count = 1;
    draw(&sweep, &bytes);
    assert_int_equal(count_of(bytes.at, "<path class=\"line area s0\""), 2);
    assert_null(strstr(bytes.at, "nan"));
    bytes_clear(&bytes);
    sweep.table = (SweepTable){.failed = 0};
    draw(&sweep, &bytes);
    assert_non_null(strstr(bytes.at, "not known"));
    assert_string_equal(bytes.at + bytes.count - 7, "</svg>\n");
    bytes_clear(&bytes);
}
