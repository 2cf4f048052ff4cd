// A folder of a test's own. Used by tests that open a store.
#ifndef TESTS_SUPPORT_SCRATCH_H
#define TESTS_SUPPORT_SCRATCH_H

enum { SCRATCH_SIZE = 64 }; // bytes of its path at most

// Makes one under /tmp; fails the test if it cannot.
void scratch_make(char target[SCRATCH_SIZE]);
void scratch_remove(const char *folder); // with all that is in it

#endif
