// Days and times of RFC 3339 as texts. Not the time it is (server/base/clock.h), and not how one is
// written. Used wherever somebody gives one.
#ifndef CORE_BASE_RFC3339_H
#define CORE_BASE_RFC3339_H

#include <stdbool.h>
#include <stdint.h>

// "2026-11-21T09:00:00.123Z" in milliseconds since 1970, with any fraction and offset, and a day
// alone ("2026-11-21", its beginning); a blank stands for the "+" that a query would have needed
// escaped. False for anything else.
bool date_read(const char *text, int64_t *unix_ms);

#endif
