// Names of jobs: they rise with time, so that the database appends them to its index, and cannot be
// guessed. Used by submit.c, known.c and api/job_list.c.
#ifndef SERVER_JOBS_JOB_ID_H
#define SERVER_JOBS_JOB_ID_H

#include <stdbool.h>
#include <stdint.h>

enum { JOB_ID_LENGTH = 32 };

// "j-", 14 hexadecimal digits of microseconds since 1970 (of two in one microsecond the second is
// told the next) and 16 random ones: 64 bits. False without random numbers.
bool job_id_make(char id[40]);

// When the job of this id was submitted; -1 where it is no job's id.
int64_t job_id_unix_ms(const char *id);

#endif
