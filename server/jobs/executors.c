// The list of executors.
#include "server/jobs/executor.h"

const Executor *const executors[] = {
    &executor_threads,
    NULL,
};
