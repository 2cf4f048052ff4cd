// Search for the best of few expensive candidates. Each candidate is proposed by a statistical
// model of those before it, whose results may come later.
#ifndef CORE_STUDY_SEARCH_H
#define CORE_STUDY_SEARCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

enum {
    SEARCH_VARIABLES = 16,
    SEARCH_OBJECTIVES = 2,
    SEARCH_CONSTRAINTS = 32,
    SEARCH_RESULTS = SEARCH_OBJECTIVES + SEARCH_CONSTRAINTS,
};

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

// Read by all, changed by the functions below. A point has a number for each variable: 0 to 1 of a
// real one, the index of the value of a choice.
typedef struct Search {
    SearchSpace space;      // no more candidates than it has points
    size_t sample;          // the first candidates, which need no results of others
    size_t proposed, added; // candidates; of these, with results
    double *points, *results;
    struct SearchModel *model;
} Search;

// Freed by search_free, which accepts NULL. STATUS_NO_MEMORY.
Status search_new(const SearchSpace *space, Search **search);
void search_free(Search *search);

// Adds the next candidate, of which there must be one left. STATUS_NO_MEMORY.
Status search_propose(Search *search);

// Adds the results of the first candidate that has none: objectives, then constraints. A result
// that is NAN marks the candidate as failed. There must be a candidate without results.
void search_add(Search *search, const double *results);

const double *search_point(const Search *search, size_t candidate);
const double *search_results(const Search *search, size_t candidate);

// By how much results, or those of a candidate, violate their worst constraint; 0: none; INFINITY:
// one is NAN.
double search_excess(const SearchSpace *space, const double *results);
double search_violation(const Search *search, size_t candidate);

// The best feasible candidate by one objective; SIZE_MAX: there is none.
size_t search_best(const Search *search, size_t objective);

// The largest difference of two points in any variable; the whole range, or another value of a
// choice without order, is 1.
double search_distance(const Search *search, const double *a, const double *b);

#endif
