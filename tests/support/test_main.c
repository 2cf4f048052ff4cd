// The main of test programs that have none of their own.
#include "core/math/fft.h"
#include "tests/support/test.h"

int main(int count, char **arguments) {
    fft_start();
    return test_run(count - 1, arguments + 1);
}
