#include "server/api/job_json.h"

#include <string.h>

#include "server/jobs/documents.h"
#include "server/json/encode.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

static void write_time(Bytes *bytes, const char *name, int64_t unix_ms) {
    char text[32];
    if (unix_ms > 0)
        clock_rfc3339(unix_ms, text);
    bytes_format(bytes, ", \"%s\": ", name);
    bytes_json_string(bytes, unix_ms > 0 ? text : NULL);
}

// A member whose value is JSON already.
static void write_raw(Bytes *bytes, const char *name, const char *json) {
    bytes_format(bytes, ", \"%s\": ", name);
    bytes_text(bytes, json != NULL ? json : "null");
}

static void write_links(Bytes *bytes, const char *id, const char *result, bool has_result,
                        bool has_table) {
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/jobs/%s\"", base_path(), id);
    if (has_table)
        bytes_format(bytes, ", \"table\": \"%s/v1/jobs/%s/table.json\"", base_path(), id);
    if (has_result)
        bytes_format(
            bytes,
            ", \"result\": \"%s/v1/results/%s\", \"series\": \"%s/v1/results/%s/series.json\"",
            base_path(), result, base_path(), result);
    bytes_text(bytes, "}");
}

void job_json_put(Bytes *bytes, const JobView *show, int parts) {
    const bool has_result = show->state == JOB_SUCCESSFUL && show->result[0] != '\0';
    bytes_text(bytes, "{\"id\": ");
    bytes_json_string(bytes, show->id);
    if (show->title != NULL) {
        bytes_text(bytes, ", \"title\": ");
        bytes_json_string(bytes, show->title);
    }
    if (show->labels != NULL)
        write_raw(bytes, "labels", show->labels);
    if ((parts & JOB_PUT_SENDER) != 0 && show->client != NULL) {
        bytes_text(bytes, ", \"client\": ");
        bytes_json_string(bytes, show->client);
    }
    if (show->study != NULL)
        bytes_format(bytes, ", \"study\": \"%s\"", show->study);
    bytes_format(bytes, ", \"status\": \"%s\", \"progress\": ", job_state_names[show->state]);
    bytes_real(bytes, show->progress);
    if (show->points > 0)
        bytes_format(bytes, ", \"points\": {\"all\": %llu, \"done\": %llu, \"failed\": %llu}",
                     (unsigned long long)show->points, (unsigned long long)show->points_done,
                     (unsigned long long)show->points_failed);
    bytes_format(bytes, ", \"cached\": %s, \"result\": ", show->is_cached ? "true" : "false");
    bytes_json_string(bytes, has_result ? show->result : NULL);
    if (has_result && show->is_result_deleted)
        bytes_text(bytes, ", \"result_deleted\": true");
    write_time(bytes, "created", show->created_unix_ms);
    write_time(bytes, "started", show->started_unix_ms);
    write_time(bytes, "finished", show->finished_unix_ms);
    write_raw(bytes, "problem", show->problem);
    if (parts & JOB_PUT_WHOLE) {
        write_raw(bytes, "plan", show->plan);
        write_raw(bytes, "summary", show->summary);
        write_raw(bytes, "work", show->work);
        bytes_text(bytes, ", \"warnings\": ");
        document_join(bytes, show->warnings, show->notes);
    }
    bytes_text(bytes, ", \"timing\": {\"queued\": ");
    bytes_real(bytes, show->queued);
    bytes_text(bytes, ", \"run\": ");
    bytes_real(bytes, show->run);
    bytes_text(bytes, ", \"total\": ");
    bytes_real(bytes, show->total);
    bytes_text(bytes, "}");
    if (parts & JOB_PUT_LINKS)
        write_links(bytes, show->id, show->result, has_result && !show->is_result_deleted,
                    show->points > 0);
    else
        bytes_text(bytes, ", \"links\": {}");
    bytes_text(bytes, "}");
}

void job_json_put_dry_run(Bytes *bytes, const DryRun *run) {
    bytes_text(bytes, "{\"dry_run\": true, \"scene\": ");
    encode_item(bytes, study_request_fields, &run->inquiry, WRITE_SCENE);
    bytes_format(bytes, ", \"result\": \"%s\", \"cached\": %s, \"plan\": ", run->result,
                 run->is_cached ? "true" : "false");
    encode_item(bytes, plan_report_fields, &run->plan, WRITE_REPORT);
    bytes_format(bytes, ", \"samples\": %zu, \"cost\": {\"cpu_seconds\": ",
                 scene_sample_count(&run->inquiry.simulation.scene));
    bytes_real(bytes, run->cost.cpu_seconds);
    bytes_text(bytes, ", \"bytes\": ");
    bytes_real(bytes, run->cost.bytes);
    bytes_text(bytes, "}, \"warnings\": ");
    encode_list(bytes, warning_fields, run->warnings.at, run->warnings.count,
                sizeof *run->warnings.at, WRITE_REPORT);
    bytes_text(bytes, "}");
}
