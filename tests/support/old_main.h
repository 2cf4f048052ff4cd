// Put before a test file that still has a main, which CMake renames: adds it to its program. Goes
// with the last such file.
#ifndef TESTS_SUPPORT_OLD_MAIN_H
#define TESTS_SUPPORT_OLD_MAIN_H

void test_main_add(const char *file, int (*run)(void));

int main(void);
__attribute__((constructor)) static void main_add(void) {
    test_main_add(__BASE_FILE__, main);
}

#endif
