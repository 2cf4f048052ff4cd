

#include <string.h>

#include "core/study/ensemble.h"
#include "server/formats/study_formats.h"
#include "tests/support/test.h"

static char unstable[] = "the \"numbers\" grew";

static const StudyFormat *format(const StudyKind *kind, const char *extension) {
    const StudyFormat *found = study_format_find(study_formats(kind->answer), extension);
    assert_non_null(found);
    return found;
}

TEST(a_run_that_failed_is_quoted_in_the_table) {
    RunRecord runs[2] = {{.number = 7, .steps = 100, .summary = {.impacts = 3}},
                         {.number = 8, .steps = (double)NAN, .why = unstable}};
    runs[0].summary.trust_horizon = (double)NAN;
    runs[0].summary.rms_displacement = 0.1;
    assert_int_equal(fields_default(summary_fields, &runs[1].summary), STATUS_OK);
    const Ensemble ensemble = {.table = {runs, 2}};
    Bytes bytes = {0};
    format(&study_ensemble, "csv")->write(&ensemble.variant, &bytes);
    assert_string_equal(
        bytes.at,
        "seed,steps,peak_displacement [m],rms_displacement [m],peak_acceleration [m/s^2],"
        "rms_acceleration [m/s^2],impacts,peak_contact_force [N],peak_storey_drift [m],"
        "peak_base_shear [N],energy_residual,error_estimate,trust_horizon [s],why\n"
        "7,100,0,0.1,0,0,3,0,0,0,0,0,nan,\n"
        "8,nan,nan,nan,nan,nan,nan,nan,nan,nan,nan,nan,nan,\"the \"\"numbers\"\" grew\"\n");
    bytes_clear(&bytes);
}

TEST(a_chart_of_nothing_known_is_whole) {
    Variant *answer = variant_new(study_ensemble.answer);
    assert_non_null(answer);
    ((Ensemble *)(void *)answer)->confidence = 0.95;
    Bytes bytes = {0};
    format(&study_ensemble, "svg")->write(answer, &bytes);
    assert_false(bytes.is_failed);
    assert_null(strstr(bytes.at, "nan"));
    assert_null(strstr(bytes.at, "inf"));
    assert_non_null(strstr(bytes.at, "not known"));
    assert_string_equal(bytes.at + bytes.count - 7, "</svg>\n");
    bytes_clear(&bytes);
    variant_free(answer);
}
