#include "server/formats/sensitivity_csv.h"

#include <math.h>

#include "server/formats/csv_cells.h"

static void put_closed(Bytes *bytes, const char *parameter, const char *what,
                       const SensitivityStop *stop, double value, double derivative) {
    bytes_format(bytes, "%s,%s %llu %s,", parameter, what, (unsigned long long)stop->damper,
                 side_names[stop->side]);
    csv_cells_real(bytes, value);
    bytes_text(bytes, ",");
    csv_cells_real(bytes, derivative);
    bytes_format(bytes, ",0,%s\n", isnan(derivative) ? "false" : "true");
}

static void put_stop(Bytes *bytes, const SensitivityStop *stop) {
    const double k = stop->stiffness, c = stop->damping;
    put_closed(bytes, "restitution", "stiffness", stop, k, stop->stiffness_by_restitution);
    put_closed(bytes, "contact_time", "stiffness", stop, k, stop->stiffness_by_contact_time);
    put_closed(bytes, "mass", "stiffness", stop, k, stop->by_damper_mass);
    put_closed(bytes, "restitution", "damping", stop, c, stop->damping_by_restitution);
    put_closed(bytes, "contact_time", "damping", stop, c, stop->damping_by_contact_time);
    put_closed(bytes, "mass", "damping", stop, c, stop->by_damper_mass);
}

void sensitivity_csv(const Sensitivity *sensitivity, Bytes *bytes) {
    bytes_text(bytes, "parameter,statistic,value,derivative,spread,is_settled\n");
    for (size_t i = 0; i < sensitivity->contact.count; i++)
        if (sensitivity->contact.at[i].why == NULL)
            put_stop(bytes, &sensitivity->contact.at[i]);
    for (size_t i = 0; i < sensitivity->response.count; i++) {
        const SensitivityRow *row = &sensitivity->response.at[i];
        for (size_t k = 0; k < row->slopes.count; k++) {
            const SensitivitySlope *slope = &row->slopes.at[k];
            bytes_format(bytes, "%s,%s,", sensitivity_parameter_names[row->parameter],
                         statistics_metric_names[slope->metric]);
            csv_cells_real(bytes, slope->value);
            bytes_text(bytes, ",");
            csv_cells_real(bytes, slope->derivative);
            bytes_text(bytes, ",");
            csv_cells_real(bytes, slope->spread);
            bytes_format(bytes, ",%s\n", slope->is_settled ? "true" : "false");
        }
    }
}
