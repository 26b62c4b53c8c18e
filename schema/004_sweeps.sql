-- SPDX-License-Identifier: GPL-3.0-or-later
-- 004: sweeps: many jobs from one request, and what becomes of them. Times are milliseconds since
-- 1970 UTC.

-- Was it submitted by itself, too? Else it is wanted by its sweeps alone and ends with the last.
ALTER TABLE jobs ADD COLUMN alone INTEGER NOT NULL DEFAULT 1 CHECK (alone IN (0, 1));

CREATE TABLE sweeps (
    seq          INTEGER PRIMARY KEY AUTOINCREMENT,  -- order of submission
    id           TEXT NOT NULL UNIQUE                -- what users see
                 CHECK (length(id) BETWEEN 2 AND 23 AND id NOT GLOB '*[^a-z0-9-]*'),
    hash         BLOB NOT NULL CHECK (length(hash) = 32),  -- SHA-256 of owner, axes and jobs as
                                                     -- they were when it was submitted
    owner        TEXT NOT NULL
                 CHECK (length(owner) BETWEEN 1 AND 32 AND owner NOT GLOB '*[^a-z0-9_-]*'),
    label        TEXT,
    tags         TEXT,                               -- one space between two; NULL = none
    priority     INTEGER NOT NULL,
    submitted_ms INTEGER NOT NULL,
    cancelled_ms INTEGER,                            -- NULL = it was not
    base         TEXT NOT NULL,                      -- JSON: the job that its points vary
    axes         TEXT NOT NULL,                      -- JSON: {pointer: [values]}, in order
    zip          TEXT NOT NULL,                      -- JSON: [[pointers]] that go together
    points       INTEGER NOT NULL DEFAULT 0          -- how many it has
) STRICT;

-- The same sweep stands only once, unless it was cancelled.
CREATE UNIQUE INDEX sweeps_live_hash ON sweeps (hash) WHERE cancelled_ms IS NULL;

CREATE TABLE sweep_points (
    sweep INTEGER NOT NULL REFERENCES sweeps (seq),
    point INTEGER NOT NULL CHECK (point >= 0),       -- in order, extensions last
    job   INTEGER NOT NULL REFERENCES jobs (seq),    -- several points and sweeps may have one job
    place TEXT NOT NULL,                             -- JSON: indices into the values of the axes,
    PRIMARY KEY (sweep, point)                       -- one for all that go together
) STRICT, WITHOUT ROWID;
CREATE INDEX sweep_points_job ON sweep_points (job, sweep);

-- How many points have jobs of each state. Counted when points are put in or get other jobs (which
-- come by the thousands); after that each job's changes of state are followed.
CREATE TABLE sweep_counts (
    sweep  INTEGER NOT NULL REFERENCES sweeps (seq),
    state  TEXT NOT NULL
           CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled')),
    points INTEGER NOT NULL CHECK (points >= 0),
    PRIMARY KEY (sweep, state)
) STRICT, WITHOUT ROWID;

CREATE TRIGGER sweeps_count AFTER INSERT ON sweeps
BEGIN
    INSERT INTO sweep_counts (sweep, state, points)
    VALUES (new.seq, 'queued', 0), (new.seq, 'running', 0), (new.seq, 'done', 0),
           (new.seq, 'failed', 0), (new.seq, 'cancelled', 0);
END;
CREATE TRIGGER jobs_sweep_move AFTER UPDATE OF state ON jobs
WHEN EXISTS (SELECT 1 FROM sweep_points WHERE job = new.seq)
BEGIN
    UPDATE sweep_counts
    SET points = points - (SELECT count(*) FROM sweep_points AS p
                           WHERE p.job = new.seq AND p.sweep = sweep_counts.sweep)
    WHERE state = old.state AND sweep IN (SELECT sweep FROM sweep_points WHERE job = new.seq);
    UPDATE sweep_counts
    SET points = points + (SELECT count(*) FROM sweep_points AS p
                           WHERE p.job = new.seq AND p.sweep = sweep_counts.sweep)
    WHERE state = new.state AND sweep IN (SELECT sweep FROM sweep_points WHERE job = new.seq);
END;

CREATE TABLE sweep_keys (                            -- Idempotency-Key headers seen with sweeps
    owner TEXT NOT NULL,
    key   TEXT NOT NULL CHECK (length(key) BETWEEN 1 AND 255),
    sweep INTEGER NOT NULL REFERENCES sweeps (seq),  -- the sweep it was answered with
    hash  BLOB NOT NULL CHECK (length(hash) = 32),   -- and what was submitted
    PRIMARY KEY (owner, key)
) STRICT, WITHOUT ROWID;
