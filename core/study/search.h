// Search for the best of few expensive candidates. Each candidate is proposed by a statistical
// model of those before it, whose results may come later.
#ifndef CORE_STUDY_SEARCH_H
#define CORE_STUDY_SEARCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

enum { SEARCH_VARIABLES = 16, SEARCH_OBJECTIVES = 2, SEARCH_CONSTRAINTS = 32 };

typedef struct SearchVariable {
    size_t values;   // of a choice; 0: a real number
    bool is_ordered; // neighbouring values of the choice are alike
} SearchVariable;

typedef struct SearchSpace {
    SearchVariable variable[SEARCH_VARIABLES];
    size_t variables;
    size_t objectives;  // 1, or 2 for a front; the smaller the better
    size_t constraints; // each a number that must be at most 0
    size_t candidates;  // at most
    uint64_t seed;
} SearchSpace;

// A point has a number for each variable: 0 to 1 of a real one, the index of the value of a choice.
typedef struct Search Search;

// Freed by search_free, which accepts NULL. STATUS_NO_MEMORY.
Status search_new(const SearchSpace *space, Search **search);
void search_free(Search *search);

// Adds the next candidate, of which there must be one left. STATUS_NO_MEMORY.
Status search_propose(Search *search);

// How many of the first candidates are proposed without results of others.
size_t search_sample(const Search *search);

// Adds the results of the first candidate that has none: objectives, then constraints. One of NAN:
// it has failed.
void search_add(Search *search, const double *results);

size_t search_candidates(const Search *search); // at most
size_t search_proposed(const Search *search);
size_t search_added(const Search *search);
const double *search_point(const Search *search, size_t candidate);
const double *search_results(const Search *search, size_t candidate);

// By how much a candidate violates its worst constraint; 0: none; INFINITY: it has failed.
double search_violation(const Search *search, size_t candidate);

// The best feasible candidate by one objective; SIZE_MAX: there is none.
size_t search_best(const Search *search, size_t objective);

// The largest difference of two candidates in any variable; the whole range, or another value of a
// choice without order, is 1.
double search_distance(const Search *search, size_t a, size_t b);

// Ends of the interval of one variable around a candidate, by the model: its first objective grows
// by at most `tolerance` there and the constraints hold. Numbers of the variable as in a point.
// STATUS_NO_MEMORY.
Status search_region(Search *search, size_t candidate, size_t variable, double tolerance,
                     double *low, double *high);

#endif
