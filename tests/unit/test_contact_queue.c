/* SPDX-License-Identifier: GPL-3.0-or-later
 * The queue of contacts against a search through all pairs. */
#include "kernels/contact_queue.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>

#include <cmocka.h>

enum { PAIRS = 37 };

static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

static int64_t first_of(const double *times)
{
    int64_t first = -1;
    for (int64_t i = 0; i < PAIRS; i++)
        if (times[i] < (first < 0 ? INFINITY : times[first]))
            first = i;
    return first;
}

/* Times that are set, moved both ways, equal to others, taken out, taken out twice. */
static void test_against_search(void **state)
{
    (void)state;
    double time[PAIRS], truth[PAIRS];
    int64_t heap[PAIRS], place[PAIRS];
    struct contact_queue queue = {time, heap, place, 12345};
    contact_queue_clear(&queue, PAIRS);
    assert_int_equal(contact_queue_first(&queue), -1);
    for (int i = 0; i < PAIRS; i++)
        truth[i] = INFINITY;
    uint64_t random = 1;
    int empty = 0, full = 0;
    for (int i = 0; i < 200000; i++) {
        int64_t pair = (int64_t)(PAIRS * uniform(&random));
        /* Fills up and empties in turns. */
        bool leave = uniform(&random) < (i / 500 % 2 ? 0.95 : 0.05);
        double at = leave ? INFINITY : floor(20 * uniform(&random)) / 20;
        truth[pair] = at;
        contact_queue_set(&queue, pair, at);
        assert_int_equal(contact_queue_first(&queue), first_of(truth));
        empty += queue.count == 0;
        full += queue.count == PAIRS;
    }
    assert_true(empty > 100 && full > 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_search),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
