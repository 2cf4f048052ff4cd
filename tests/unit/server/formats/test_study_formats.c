#include <string.h>

#include "core/study/ensemble.h"
#include "core/study/fragility.h"
#include "core/study/optimize.h"
#include "server/formats/study_formats.h"
#include "tests/support/test.h"

static char unstable[] = "the \"numbers\" grew";

static void write(const Variant *answer, const char *extension, Bytes *bytes) {
    const TableFormat *found = study_format_find(answer->kind, extension);
    assert_non_null(found);
    study_format_write(found, &(StudyDocument){.answer = answer}, bytes);
    assert_false(bytes->is_failed);
}

TEST(a_run_that_failed_is_quoted_in_the_table) {
    RunRecord runs[2] = {{.number = 7, .steps = 100, .summary = {.impacts = 3}},
                         {.number = 8, .steps = (double)NAN, .why = unstable}};
    runs[0].summary.trust_horizon = (double)NAN;
    runs[0].summary.rms_displacement = 0.1;
    assert_int_equal(fields_default(summary_fields, &runs[1].summary), STATUS_OK);
    const Ensemble ensemble = {.variant = {study_ensemble.answer}, .table = {runs, 2}};
    Bytes bytes = {0};
    write(&ensemble.variant, "csv", &bytes);
    assert_string_equal(
        bytes.at,
        "seed,steps,peak_displacement [m],rms_displacement [m],peak_acceleration [m/s^2],"
        "rms_acceleration [m/s^2],impacts,peak_contact_force [N],peak_storey_drift [m],"
        "peak_base_shear [N],energy_residual,error_estimate,trust_horizon [s],why\n"
        "7,100,0,0.1,0,0,3,0,0,0,0,0,nan,\n"
        "8,nan,nan,nan,nan,nan,nan,nan,nan,nan,nan,nan,nan,\"the \"\"numbers\"\" grew\"\n");
    bytes_clear(&bytes);
}

TEST(columns_without_a_word_stay_texts_and_factors_say_so) {
    char pointer[] = "/dampers/0/clearance", unit[] = "m";
    double drawn[] = {1.25};
    RunRecord run = {.number = 7, .inputs = {drawn, 1}};
    EnsembleInput input = {.pointer = pointer, .unit = unit, .is_factor = true};
    const Ensemble ensemble = {
        .variant = {study_ensemble.answer}, .table = {&run, 1}, .inputs = {&input, 1}};
    Bytes csv = {0}, npz = {0};
    write(&ensemble.variant, "csv", &csv);
    assert_non_null(strstr(csv.at, ",/dampers/0/clearance [factor],why\n"));
    write(&ensemble.variant, "npz", &npz);
    size_t texts = 0;
    for (size_t i = 0; i + 5 < npz.count; i++)
        texts += memcmp(npz.at + i, "'|S1'", 5) == 0;
    assert_int_equal(texts, 1);
    bytes_clear(&csv);
    bytes_clear(&npz);
}

TEST(a_word_of_a_candidate_is_the_text_itself) {
    char clearance[] = "/dampers/0/clearance", buffer[] = "/dampers/0/buffer";
    char near[] = "0.01", far[] = "2e-2", sponge[] = "\"sponge@1\"",
         rubber[] = "\"rubber, soft@2\"";
    OptimumValue values[2][2] = {
        {{.member.pointer = clearance, .value = near}, {.member.pointer = buffer, .value = sponge}},
        {{.member.pointer = clearance, .value = far}, {.member.pointer = buffer, .value = rubber}}};
    double rms[] = {0.003};
    OptimumCandidate history[] = {
        {.index = 0, .values = {values[0], 2}, .objectives = {rms, 1}, .feasible = true},
        {.index = 1, .values = {values[1], 2}}}; // has failed
    OptimizeObjective objective = {.metric = 1};
    const Optimum optimum = {
        .variant = {study_optimize.answer}, .objectives = {&objective, 1}, .history = {history, 2}};
    Bytes csv = {0};
    write(&optimum.variant, "csv", &csv);
    assert_string_equal(
        csv.at, "index,/dampers/0/clearance,/dampers/0/buffer,rms_displacement [m],feasible\n"
                "0,0.01,sponge@1,0.003,true\n"
                "1,2e-2,\"rubber, soft@2\",nan,false\n");
    bytes_clear(&csv);
}

TEST(a_chart_of_nothing_known_is_whole) {
    Variant *answer = variant_new(study_ensemble.answer);
    assert_non_null(answer);
    ((Ensemble *)(void *)answer)->confidence = 0.95;
    Bytes bytes = {0};
    write(answer, "svg", &bytes);
    assert_null(strstr(bytes.at, "nan"));
    assert_null(strstr(bytes.at, "inf"));
    assert_non_null(strstr(bytes.at, "not known"));
    assert_string_equal(bytes.at + bytes.count - 7, "</svg>\n");
    bytes_clear(&bytes);
    variant_free(answer);
}

TEST(what_the_chart_of_a_fragility_leaves_out_is_named) {
    Variant *variant = variant_new(study_fragility.answer);
    assert_non_null(variant);
    Fragility *answer = (Fragility *)(void *)variant;
    FragilityCurve *curve = list_append(&answer->curves, sizeof *curve);
    assert_non_null(curve);
    assert_non_null(curve->points.at = calloc(2, sizeof *curve->points.at));
    curve->points.count = 2;
    for (size_t l = 0; l < 2; l++)
        curve->points.at[l].level = 1 + (double)l;
    for (size_t i = 0; i < 9; i++) {
        FragilityState *limit = list_append(&answer->limits, sizeof *limit);
        assert_non_null(limit);
        *limit = (FragilityState){
            .metric = (int)i % 6, .value = (double)i, .median = 1.5, .dispersion = 0.3};
    }
    Bytes bytes = {0};
    write(variant, "svg", &bytes);
    assert_non_null(strstr(bytes.at, "Not drawn: peak_acceleration above 8 m/s^2."));
    assert_null(strstr(bytes.at, "Not drawn: rms_displacement"));
    assert_non_null(strstr(bytes.at, "Not drawn: fractiles of peak_contact_force."));
    assert_null(strstr(bytes.at, "fractiles of impacts"));
    bytes_clear(&bytes);
    variant_free(variant);
}
