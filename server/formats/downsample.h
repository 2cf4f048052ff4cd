// Columns thinned out without losing a peak: the least and the largest value of each bucket of
// samples. Not an average. Used by api/columns.c.
#ifndef SERVER_FORMATS_DOWNSAMPLE_H
#define SERVER_FORMATS_DOWNSAMPLE_H

#include "core/base/columns.h"

// The least and the largest of `count` values, at least one, all of them finite.
void downsample_extremes(const double *values, size_t count, double *least, double *most);

// Values first ... first + count - 1 of each column in buckets of `bucket`, the last one perhaps
// shorter: two columns for each, "NAME_min" and "NAME_max". Cleared by columns_clear.
Status downsample(const Column *const *columns, size_t column_count, size_t first, size_t count,
                  size_t bucket, Columns *buckets, Problem *problem);

#endif
