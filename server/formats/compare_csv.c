#include "server/formats/compare_csv.h"

#include <math.h>

#include "server/formats/csv_cells.h"

static void put_stop(Bytes *bytes, const DerivedList *derived) {
    bytes_text(bytes, ",");
    csv_cells_real(bytes, derived->count > 0 ? derived->at[0].stiffness : (double)NAN);
    bytes_text(bytes, ",");
    csv_cells_real(bytes, derived->count > 0 ? derived->at[0].damping : (double)NAN);
}

void compare_csv(const Comparison *comparison, Bytes *bytes) {
    bytes_text(bytes, "model,separation,status,stiffness,damping [N s/m],steps");
    csv_cells_header(bytes, summary_fields);
    csv_cells_header_of(bytes, "contacts", compare_contacts_fields);
    csv_cells_header_of(bytes, "difference", compare_differences_fields);
    csv_cells_header_of(bytes, "psd", spectrum_distance_fields);
    csv_cells_header_of(bytes, "displacement", signal_comparison_fields);
    bytes_text(bytes, ",divergence [s],why\n");
    for (size_t i = 0; i < comparison->entries.count; i++) {
        const CompareEntry *entry = &comparison->entries.at[i];
        bytes_format(bytes, "%s,%s,%s", entry->contact_model,
                     entry->separation != CHOICE_ABSENT ? separation_names[entry->separation] : "",
                     compare_status_names[entry->status]);
        put_stop(bytes, &entry->derived);
        bytes_text(bytes, ",");
        csv_cells_real(bytes, entry->steps);
        csv_cells_members(bytes, summary_fields, &entry->summary);
        csv_cells_members(bytes, compare_contacts_fields, &entry->contacts);
        csv_cells_members(bytes, compare_differences_fields, &entry->differences);
        csv_cells_members(bytes, spectrum_distance_fields, &entry->psd);
        csv_cells_members(bytes, signal_comparison_fields, &entry->displacement);
        bytes_text(bytes, ",");
        csv_cells_real(bytes, entry->divergence.time);
        bytes_text(bytes, ",");
        csv_cells_text(bytes, entry->why);
        bytes_text(bytes, "\n");
    }
}
