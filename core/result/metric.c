#include "core/result/metric.h"

#include <stddef.h>

const char *const metric_names[] = {
    "displacement", "mean_acceleration", "peak_force", "impacts", "psd", "rms_displacement", NULL,
};
const char *const metric_units[] = {"", "", "", "", " dB", "", NULL};
