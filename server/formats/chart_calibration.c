// The chart and the table of a calibration.
#include <math.h>

#include "core/study/calibrate.h"
#include "server/formats/chart.h"
#include "server/formats/study_formats.h"

enum { MOTIONS_DRAWN = 3 };

// "POINTER = VALUE UNIT (LOW to HIGH)"
static const char *calibration_parameter_text(Chart *chart, const CalibratedParameter *parameter) {
    const Reals *interval = &parameter->interval_95;
    const char *unit = parameter->unit != NULL ? parameter->unit : "";
    const char *space = unit[0] != '\0' ? " " : "";
    if (isnan(parameter->value))
        return chart_text(chart, "%.80s is unknown", parameter->member.pointer);
    if (interval->count != 2 || !parameter->identifiable)
        return chart_text(chart, "%.80s = %.4g%s%s%s", parameter->member.pointer, parameter->value,
                          space, unit, parameter->identifiable ? "" : " (not determined)");
    return chart_text(chart, "%.80s = %.4g%s%s (%.4g to %.4g)", parameter->member.pointer,
                      parameter->value, space, unit, interval->at[0], interval->at[1]);
}

static size_t calibration_motion_count(const CalibrationMotion *motion) {
    const size_t count =
        motion->at.count < motion->measured.count ? motion->at.count : motion->measured.count;
    return count < motion->fitted.count ? count : motion->fitted.count;
}

static void calibration_add_motion(Chart *chart, const CalibrationMotion *motion) {
    const size_t count = calibration_motion_count(motion);
    const char *quantity = chart_quantity(chart, motion->channel, motion->unit);
    ChartPanel *panel = motion->is_spectrum ? chart_spectra(chart, quantity, 180)
                                            : chart_panel(chart, quantity, 180);
    chart_add(panel, (ChartSeries){CHART_LINE, motion->at.at, motion->fitted.at, NULL, count,
                                   .colour = CHART_STRONG, .name = "fitted", .legend = "fitted"});
    chart_add(panel, (ChartSeries){CHART_LINE, motion->at.at, motion->measured.at, NULL, count,
                                   .colour = 0, .name = "measured", .legend = "measured"});
    if (motion->is_spectrum)
        return;
    double *difference = chart_new(chart, count + 1, sizeof *difference);
    for (size_t i = 0; difference != NULL && i < count; i++)
        difference[i] = motion->fitted.at[i] - motion->measured.at[i];
    panel->x.is_unlabelled = true;
    panel = chart_panel(
        chart,
        chart_text(chart, "fitted less measured%s%s%s", motion->unit != NULL ? " [" : "",
                   motion->unit != NULL ? motion->unit : "", motion->unit != NULL ? "]" : ""),
        90);
    panel->x.title = "time [s]";
    if (difference != NULL)
        chart_add(panel, (ChartSeries){CHART_LINE, motion->at.at, difference, NULL, count,
                                       .colour = 1, .name = "difference"});
}

void chart_calibration(const Variant *answer, Chart *chart) {
    const Calibration *calibration = (const Calibration *)(const void *)answer;
    *chart = (Chart){.width = 760, .left = 80, .right = 110, .title = "Calibration"};
    chart->heading = calibration->parameters.count > 0
                         ? calibration_parameter_text(chart, &calibration->parameters.at[0])
                         : NULL;
    if (calibration->parameters.count > 1)
        chart->heading = chart_text(chart, "%s, and %zu more", chart->heading,
                                    calibration->parameters.count - 1);
    chart_note(chart, "", calibration->detail);
    for (size_t i = 0; i < calibration->parameters.count; i++)
        chart_note(chart, " ", calibration_parameter_text(chart, &calibration->parameters.at[i]));
    for (size_t i = 0; i < calibration->motions.count; i++)
        if (i < MOTIONS_DRAWN)
            calibration_add_motion(chart, &calibration->motions.at[i]);
        else
            chart_note(chart, " Not drawn: ", calibration->motions.at[i].channel);
    if (calibration->motions.count == 0) // every run failed
        chart_panel(chart, "no fit", 60);
}

// A row for each parameter.
void calibration_table(const Variant *answer, StudyTable *table) {
    const Calibration *calibration = (const Calibration *)(const void *)answer;
    for (size_t i = 0; i < calibration->parameters.count; i++) {
        const CalibratedParameter *parameter = &calibration->parameters.at[i];
        const Reals *interval = &parameter->interval_95;
        const bool has_interval = interval->count == 2;
        study_table_row(table);
        study_table_text(table, "pointer", parameter->member.pointer);
        study_table_text(table, "unit", parameter->unit != NULL ? parameter->unit : "1");
        study_table_number(table, "value", NULL, parameter->value);
        study_table_number(table, "standard_error", NULL, parameter->standard_error);
        study_table_number(table, "low", NULL, has_interval ? interval->at[0] : (double)NAN);
        study_table_number(table, "high", NULL, has_interval ? interval->at[1] : (double)NAN);
        study_table_text(
            table, "identifiable",
            parameter->identifiable == CHOICE_ABSENT ? NULL : field_flags[parameter->identifiable]);
    }
}
