#include "server/api/job_json.h"

#include "server/jobs/documents.h"
#include "server/json/encode.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

static void job_json_put_links(Bytes *bytes, const JobView *show, bool has_result) {
    const char *base = base_path();
    const JobRow *row = &show->row;
    bytes_json(bytes, "\"self\": \"%s/v1/jobs/%s\"", base, row->id);
    if (show->points > 0)
        bytes_json(bytes, ", \"table\": \"%s/v1/jobs/%s/table.json\"", base, row->id);
    if (has_result)
        bytes_json(bytes,
                   ", \"result\": \"%s/v1/results/%s\", \"series\": "
                   "\"%s/v1/results/%s/series.json\"",
                   base, row->result, base, row->result);
}

// Of a failed job: without memory for the document that says why, none is stored.
static const char *job_problem(const JobRow *row) {
    static const char unknown[] =
        "{\"type\": \"/problems/no-memory\", \"title\": \"Out of memory\", \"status\": 503, "
        "\"detail\": \"the job failed, and there was no memory for the reason; submit it again\"}";
    return row->problem == NULL && row->state == JOB_FAILED ? unknown : row->problem;
}

void job_json_put(Bytes *bytes, const JobView *show, int parts) {
    const JobRow *row = &show->row;
    const bool has_result = row->state == JOB_SUCCESSFUL && row->result[0] != '\0';
    bytes_json(bytes, "{\"id\": %s", row->id);
    if (row->title != NULL)
        bytes_json(bytes, ", \"title\": %s", row->title);
    if (row->labels != NULL)
        bytes_json(bytes, ", \"labels\": %p", row->labels);
    if ((parts & JOB_PUT_SENDER) != 0 && row->client != NULL)
        bytes_json(bytes, ", \"client\": %s", row->client);
    if (row->study != NULL)
        bytes_json(bytes, ", \"study\": %s", row->study);
    bytes_json(bytes, ", \"status\": %s, \"progress\": %g", job_state_names[row->state],
               show->progress);
    if (show->points > 0)
        bytes_json(bytes, ", \"points\": {\"all\": %llu, \"done\": %llu, \"failed\": %llu}",
                   (unsigned long long)show->points, (unsigned long long)show->points_done,
                   (unsigned long long)show->points_failed);
    if (show->cluster.chunks > 0)
        bytes_json(bytes,
                   ", \"cluster\": {\"chunks\": %llu, \"done\": %llu, \"running\": %llu, "
                   "\"queued\": %llu, \"reason\": %s}",
                   (unsigned long long)show->cluster.chunks, (unsigned long long)show->cluster.done,
                   (unsigned long long)show->cluster.running,
                   (unsigned long long)show->cluster.queued,
                   show->cluster.reason[0] != '\0' ? show->cluster.reason : NULL);
    bytes_json(bytes, ", \"cached\": %p, \"result\": %s", json_flag(row->is_cached),
               has_result ? row->result : NULL);
    if (has_result && !row->has_result)
        bytes_json(bytes, ", \"result_deleted\": true");
    bytes_json(bytes, ", \"created\": %s, \"started\": %s, \"finished\": %s, \"problem\": %p",
               row->created_unix_ms > 0 ? clock_rfc3339(row->created_unix_ms).at : NULL,
               row->started_unix_ms > 0 ? clock_rfc3339(row->started_unix_ms).at : NULL,
               row->finished_unix_ms > 0 ? clock_rfc3339(row->finished_unix_ms).at : NULL,
               job_problem(row));
    if (parts & JOB_PUT_WHOLE) {
        bytes_json(bytes,
                   ", \"plan\": %p, \"summary\": %p, \"work\": %p, \"warnings\": ", show->plan,
                   show->summary, show->work);
        document_join(bytes, row->warnings, show->notes);
    }
    if (parts & JOB_PUT_DETAILS)
        bytes_json(bytes, ", \"scene\": %p, \"summary\": %p", row->scene, show->summary);
    bytes_json(bytes, ", \"timing\": {\"queued\": %g, \"run\": %g, \"total\": %g}, \"links\": {",
               row->queued, row->run, row->total);
    if (parts & JOB_PUT_LINKS)
        job_json_put_links(bytes, show, has_result && row->has_result);
    bytes_text(bytes, "}}");
}

void job_json_put_dry_run(Bytes *bytes, const DryRun *run) {
    bytes_text(bytes, "{\"dry_run\": true, \"scene\": ");
    encode_item(bytes, study_request_fields, &run->inquiry, WRITE_SCENE);
    bytes_json(bytes, ", \"result\": %s, \"cached\": %p, \"plan\": ", run->result,
               json_flag(run->is_cached));
    encode_item(bytes, plan_report_fields, &run->plan, WRITE_REPORT);
    bytes_json(
        bytes, ", \"samples\": %zu, \"cost\": {\"cpu_seconds\": %g, \"bytes\": %g}, \"warnings\": ",
        scene_sample_count(&run->inquiry.simulation.scene), run->cost.cpu_seconds, run->cost.bytes);
    encode_list(bytes, warning_fields, run->warnings.at, run->warnings.count,
                sizeof *run->warnings.at, WRITE_REPORT);
    bytes_text(bytes, "}");
}
