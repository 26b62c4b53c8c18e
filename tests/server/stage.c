/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "stage.h"

#include "support/experiment.h"

#include "store_results.h"
#include "text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void take_id(const struct desk *desk, char id[JOB_ID_SIZE])
{
    const char *at = desk->reply.body ? strstr(desk->reply.body, "\"id\":\"") : NULL;
    assert_true(at);
    snprintf(id, JOB_ID_SIZE, "%.*s", (int)strcspn(at + 6, "\""), at + 6);
}

static void finish_job(struct stage *stage, const char *text)
{
    struct experiment e = experiment_run(experiment_scene("%s", text), 0);
    struct bcd_table *table = NULL;
    assert_true(bcd_tally_table(e.tally, e.scene, e.theory, 0, &table) == BCD_OK);
    struct result_new result = {.observable = table->name, .size = bcd_table_size(table)};
    void *bytes = malloc(result.size);
    assert_true(bytes);
    bcd_table_save(table, bytes);
    result.table = bytes;
    assert_true(store_jobs_start(stage->desk.service.store, stage->done) == STORE_OK);
    assert_true(store_results_finish(stage->desk.service.store, stage->done, &result, 1) ==
                STORE_OK);
    free(bytes);
    bcd_table_free(table);
    experiment_end(&e);
}

void stage_open(struct stage *stage)
{
    *stage = (struct stage){0};
    struct desk *desk = &stage->desk;
    assert_true(desk_open(desk) == 0);
    assert_true(feed_create(&stage->feed, desk->service.store, desk->service.queue) == STORE_OK);
    desk->service.feed = stage->feed;
    assert_true(ask(desk, "POST", "/v1/jobs", JOB(",\"label\":\"done\",\"tags\":[\"a\"]")) == 202);
    take_id(desk, stage->done);
    finish_job(stage, JOB(""));
    assert_true(ask(desk, "POST", "/v1/jobs", JOB(",\"seed\":2,\"priority\":3")) == 202);
    assert_true(ask(desk, "POST", "/v1/sweeps",
                    "{\"base\":" JOB("") ",\"axes\":{\"/diameter\":[0.25,0.5]}}") == 202);
    take_id(desk, stage->sweep);
}

void stage_close(struct stage *stage)
{
    reply_fini(&stage->desk.reply);
    stage->desk.service.feed = NULL;
    feed_free(stage->feed);
    desk_close(&stage->desk);
}

char *stage_with_ids(const struct stage *stage, const char *text)
{
    struct text out = {0};
    while (*text) {
        bool job = strncmp(text, "jdone", 5) == 0, sweep = strncmp(text, "sdone", 5) == 0;
        if (job || sweep)
            text_add(&out, "%s", job ? stage->done : stage->sweep);
        else
            text_add_bytes(&out, text, 1);
        text += job || sweep ? 5 : 1;
    }
    char *taken = text_take(&out);
    assert_non_null(taken);
    return taken;
}
