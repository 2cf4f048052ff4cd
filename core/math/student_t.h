// Student's t distribution, to rounding; for confidence intervals of a mean.
#ifndef CORE_MATH_STUDENT_T_H
#define CORE_MATH_STUDENT_T_H

#include <stddef.h>

// The probability of [-t, t] with `freedom` degrees of freedom; 0 means infinitely many, the normal
// distribution.
double student_t_probability(double t, size_t freedom);

// The t for which [-t, t] has this probability, 0 < probability < 1.
double student_t_quantile(double probability, size_t freedom);

#endif
