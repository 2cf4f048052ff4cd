// Quantiles of Student's t, for intervals about the mean of a few numbers.
// Not a table and not an approximation. Used by study/.
#ifndef CORE_MATH_STUDENT_T_H
#define CORE_MATH_STUDENT_T_H

#include <stddef.h>

// The share of Student's t with so many degrees of freedom that lies within [-t, t]; 0 degrees
// stand for infinitely many, the normal distribution.
double student_share(double t, size_t freedom);

// The t within which that share lies, 0 < share < 1.
double student_quantile(double share, size_t freedom);

#endif
