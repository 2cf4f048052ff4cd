#include <string.h>

#include "server/encode/csv.h"
#include "server/encode/encoder.h"
#include "server/encode/json.h"
#include "server/encode/mat.h"
#include "server/encode/npy.h"
#include "server/encode/npz.h"
#include "server/encode/svg.h"

const Encoder *const encoders[] = {
    &encoder_json, &encoder_csv, &encoder_npy, &encoder_npz, &encoder_mat, &encoder_svg, NULL,
};

const Encoder *encoder_find(const char *extension) {
    for (size_t i = 0; encoders[i] != NULL; i++)
        if (strcmp(encoders[i]->extension, extension) == 0)
            return encoders[i];
    return NULL;
}
