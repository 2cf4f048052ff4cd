#include <string.h>

#include "server/formats/csv.h"
#include "server/formats/format.h"
#include "server/formats/json.h"
#include "server/formats/mat.h"
#include "server/formats/npy.h"
#include "server/formats/npz.h"
#include "server/formats/svg.h"

const TableFormat *const encoders[] = {
    &encoder_json, &encoder_csv, &encoder_npy, &encoder_npz, &encoder_mat, &encoder_svg, NULL,
};

const TableFormat *format_find(const char *extension) {
    for (size_t i = 0; encoders[i] != NULL; i++)
        if (strcmp(encoders[i]->extension, extension) == 0)
            return encoders[i];
    return NULL;
}
