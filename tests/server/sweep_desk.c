/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sweep_desk.h"

#include "store_internal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

int ask_sweep(struct desk *f, const char *method, const char *rest, const char *body)
{
    char path[128];
    snprintf(path, sizeof(path), "/v1/sweeps/%s%s", f->id, rest);
    return ask(f, method, path, body);
}

int sweep_submit(struct desk *f, const char *body)
{
    int status = ask(f, "POST", "/v1/sweeps", body);
    if (status < 300)
        desk_take_id(f, f->id);
    return status;
}

int64_t ask_sql(struct desk *f, const char *sql)
{
    sqlite3 *db = store_read_begin(f->service.store);
    struct stmt row = stmt_init(db, sql);
    assert_true(stmt_step(&row));
    int64_t number = stmt_integer(&row, 0);
    stmt_fini(&row);
    store_read_end(f->service.store, db);
    return number;
}

void assert_counted(struct desk *f)
{
    static const char *const wrong[] = {
        "SELECT count(*) FROM job_counts AS c WHERE jobs <>"
        " (SELECT count(*) FROM jobs AS j WHERE j.state = c.state)",
        "SELECT count(*) FROM owners AS o WHERE queued <>"
        " (SELECT count(*) FROM jobs AS j WHERE j.owner = o.owner AND j.state = 'queued')"
        " OR bytes <> (SELECT total(bytes) FROM jobs AS j WHERE j.owner = o.owner)"
        " + (SELECT total(bytes) FROM sweeps AS s WHERE s.owner = o.owner)"
        " OR abs(waiting_seconds - (SELECT total(core_seconds) FROM jobs AS j"
        " WHERE j.owner = o.owner AND j.state IN ('queued', 'running'))) > 1e-9",
        "SELECT count(*) FROM sweep_counts AS c WHERE points <>"
        " (SELECT count(*) FROM sweep_points AS p JOIN jobs AS j ON j.seq = p.job"
        "  WHERE p.sweep = c.sweep AND j.state = c.state)",
        "SELECT count(*) FROM sweeps AS s WHERE points <>"
        " (SELECT count(*) FROM sweep_points AS p WHERE p.sweep = s.seq)",
        "SELECT count(*) FROM sweeps AS s WHERE bytes <> length(base) + length(axes) + length(zip)"
        " + (SELECT sum(length(place) + 48) FROM sweep_points AS p WHERE p.sweep = s.seq)",
    };
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++)
        if (ask_sql(f, wrong[i]) != 0)
            fail_msg("%s", wrong[i]);
}
