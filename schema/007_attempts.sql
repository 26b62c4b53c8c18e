-- SPDX-License-Identifier: GPL-3.0-or-later
-- 007: attempts: each time that a job was in motion, and how that ended. Times are milliseconds
-- since 1970 UTC.

CREATE TABLE attempts (
    job        INTEGER NOT NULL REFERENCES jobs (seq),
    number     INTEGER NOT NULL CHECK (number > 0),  -- of the job: 1, 2, ..
    started_ms INTEGER NOT NULL,
    ended_ms   INTEGER,                              -- lost, crashed: when that was found out
    ended      TEXT CHECK (ended IN ('done', 'failed', 'cancelled',
                                     'stopped',      -- the server ended, and saved what there was
                                     'lost',         -- the server did not end by itself
                                     'crashed')),    -- the job ended the server; NULL = in motion
    saves      INTEGER NOT NULL DEFAULT 0,           -- chunks finished and checkpoints made in it
    reason     TEXT,                                 -- of failed and crashed
    PRIMARY KEY (job, number),
    CHECK ((ended IS NULL) = (ended_ms IS NULL))
) STRICT, WITHOUT ROWID;
CREATE INDEX attempts_open ON attempts (job) WHERE ended IS NULL;

ALTER TABLE jobs ADD COLUMN attempts_lost INTEGER NOT NULL DEFAULT 0
    CHECK (attempts_lost >= 0);                      -- lost: no fault of the job's
ALTER TABLE jobs ADD COLUMN attempts_failed INTEGER NOT NULL DEFAULT 0
    CHECK (attempts_failed >= 0);                    -- failed or crashed

CREATE TRIGGER jobs_attempt_begin AFTER UPDATE OF state ON jobs
WHEN new.state = 'running'
BEGIN
    INSERT INTO attempts (job, number, started_ms)
    SELECT new.seq, coalesce(max(number), 0) + 1, new.started_ms
    FROM attempts WHERE job = new.seq;
END;
CREATE TRIGGER jobs_attempt_end AFTER UPDATE OF state ON jobs
WHEN new.state IN ('done', 'failed', 'cancelled')
BEGIN
    UPDATE attempts SET ended = new.state, ended_ms = new.finished_ms, reason = new.error
    WHERE job = new.seq AND ended IS NULL;
END;
CREATE TRIGGER attempts_count AFTER UPDATE OF ended ON attempts
WHEN new.ended IN ('lost', 'failed', 'crashed')
BEGIN
    UPDATE jobs SET attempts_lost = attempts_lost + (new.ended = 'lost'),
                    attempts_failed = attempts_failed + (new.ended <> 'lost')
    WHERE seq = new.job;
END;
CREATE TRIGGER chunks_saved AFTER INSERT ON chunks
BEGIN
    UPDATE attempts SET saves = saves + 1 WHERE job = new.job AND ended IS NULL;
END;
CREATE TRIGGER checkpoints_first_saved AFTER INSERT ON checkpoints
BEGIN
    UPDATE attempts SET saves = saves + 1 WHERE job = new.job AND ended IS NULL;
END;
CREATE TRIGGER checkpoints_saved AFTER UPDATE OF bytes ON checkpoints
BEGIN
    UPDATE attempts SET saves = saves + 1 WHERE job = new.job AND ended IS NULL;
END;
CREATE TRIGGER jobs_attempts_delete BEFORE DELETE ON jobs
BEGIN
    DELETE FROM attempts WHERE job = old.seq;
END;
