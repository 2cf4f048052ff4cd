// Reads back what was written in the style of reports, where null stands for what is not known.
// Not a reader of what clients send: that is read.h. Used by api/compare.c
// and kept.c.
#ifndef SERVER_JSON_STORED_REPORT_H
#define SERVER_JSON_STORED_REPORT_H

#include "core/base/field.h"

// One object of numbers and texts; `item` gets its defaults first and is clearable in any case.
// What has no row is passed over: another version of the program may have told more.
// STATUS_INTERNAL: it is not what was written.
Status stored_report_read(const char *text, size_t size, const Field *fields, void *item,
                          Problem *problem);

#endif
