// A job and a dry run as JSON documents, which commands print too.
#ifndef SERVER_API_JOB_JSON_H
#define SERVER_API_JOB_JSON_H

#include "server/jobs/jobs.h"
#include "server/util/bytes.h"

enum {
    JOB_PUT_WHOLE =
        1, // with plan, summary, work and warnings, as one job is shown; without, as in a list
    JOB_PUT_LINKS = 2,   // where a server has it; without, "links" is empty
    JOB_PUT_SENDER = 4,  // its sender, if it had a token
    JOB_PUT_DETAILS = 8, // its scene and its summary, null where they are not known
};

void job_json_put(Bytes *bytes, const JobView *show, int parts);
void job_json_put_dry_run(Bytes *bytes, const DryRun *run);

#endif
