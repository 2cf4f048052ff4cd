// A known answer is given to the very body it was made for.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/base/deflate.h"
#include "server/jobs/known.h"
#include "tests/support/scratch.h"

// Room for all that differs from job to job.
static const char answer_text[] =
    "A ................................ ................................ "
    "........................ ........................ "
    "........................ ........";
static const JobSlots slots = {
    .id = 2, .self = 35, .created = 68, .started = 93, .finished = 118, .total = 143};

static void learn(Known *known, const Submission *submission, char mark) {
    char warnings[] = "[]", scene[] = "";
    const JobRow row = {.result = "r-1", .state = 2, .warnings = warnings, .scene = scene};
    char text[sizeof answer_text];
    memcpy(text, answer_text, sizeof text);
    text[0] = mark;
    known_put(known, submission, 1, &row, text, sizeof text - 1, &slots);
}

// The mark of the answer, 0 for none.
static char ask(Known *known, Store *store, const Submission *submission, uint64_t mark) {
    KnownAnswer answer;
    if (!known_answer(known, store, submission, mark, &answer))
        return 0;
    const char first = answer.body[0];
    assert_int_equal(answer.size, sizeof answer_text - 1);
    free(answer.body);
    return first;
}

static void bodies_of_one_checksum_are_told_apart(void **state) {
    (void)state;
    Store *store;
    char directory[SCRATCH_SIZE];
    scratch_make(directory);
    assert_int_equal(store_open(directory, &store, NULL), STATUS_OK);
    Known *known = known_new(1 << 20);
    assert_non_null(known);
    char one[65], two[65];
    memset(one, 'a', sizeof one - 1);
    one[64] = '\0';
    memcpy(two, one, sizeof two);
    // The generator polynomial: what differs by it has the same CRC-32.
    static const unsigned char polynomial[] = {0x41, 0x06, 0x71, 0xDB, 0x01};
    for (size_t i = 0; i < sizeof polynomial; i++)
        two[20 + i] = (char)(two[20 + i] ^ polynomial[i]);
    assert_int_equal(deflate_crc32(0, one, 64), deflate_crc32(0, two, 64));
    const Submission first = {.text = one, .size = 64}, second = {.text = two, .size = 64};
    const Submission shorter = {.text = one, .size = 63};

    learn(known, &first, 'A');
    assert_int_equal(ask(known, store, &first, 1), 'A');
    assert_int_equal(ask(known, store, &second, 1), 0);
    assert_int_equal(ask(known, store, &shorter, 1), 0);
    assert_int_equal(ask(known, store, &first, 1), 'A');
    learn(known, &second, 'B');
    assert_int_equal(ask(known, store, &second, 1), 'B');
    assert_int_equal(ask(known, store, &first, 1), 0);
    assert_int_equal(ask(known, store, &second, 2), 0); // something changed meanwhile
    LayerTally tally;
    known_tally(known, &tally);
    assert_int_equal(tally.count, 0);
    assert_int_equal(tally.bytes, 0);
    known_free(known);
    store_close(store);
    scratch_remove(directory);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(bodies_of_one_checksum_are_told_apart)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
