#include "server/formats/ensemble_csv.h"

#include "server/formats/csv_cells.h"

void ensemble_csv(const Ensemble *ensemble, Bytes *bytes) {
    bytes_text(bytes, "seed,steps");
    csv_cells_header(bytes, summary_fields);
    bytes_text(bytes, ",why\n");
    for (size_t i = 0; i < ensemble->table.count; i++) {
        const RunRecord *run = &ensemble->table.at[i];
        bytes_format(bytes, "%llu,", (unsigned long long)run->number);
        csv_cells_real(bytes, run->steps);
        csv_cells_members(bytes, summary_fields, &run->summary);
        bytes_text(bytes, ",");
        csv_cells_text(bytes, run->why);
        bytes_text(bytes, "\n");
    }
}
