-- SPDX-License-Identifier: GPL-3.0-or-later
-- 006: what finished jobs measured, for jobs that differ from them in realizations or target alone.

CREATE TABLE samples (
    seq          INTEGER PRIMARY KEY,
    family       BLOB NOT NULL CHECK (length(family) = 32),  -- SHA-256 of bcd_scene_encode_family
    realizations INTEGER NOT NULL CHECK (realizations > 0),  -- the first so many of the family's
    chunks       INTEGER NOT NULL CHECK (chunks >= 0),       -- whole chunks among them
    job          INTEGER NOT NULL REFERENCES jobs (seq),     -- who measured them
    whole        BLOB CHECK ((whole IS NULL) = (chunks = 0)),  -- bcd_tally_save: those chunks, merged
    rest         BLOB CHECK (whole IS NOT NULL OR rest IS NOT NULL),  -- that of the chunk begun after
    UNIQUE (family, realizations)
) STRICT;

CREATE TABLE bases (                                 -- what a job that runs took over
    job    INTEGER PRIMARY KEY REFERENCES jobs (seq),
    sample INTEGER NOT NULL REFERENCES samples (seq)
) STRICT;
CREATE INDEX bases_sample ON bases (sample);
CREATE TRIGGER jobs_base AFTER UPDATE OF state ON jobs
WHEN new.state IN ('done', 'failed', 'cancelled')
BEGIN
    DELETE FROM bases WHERE job = new.seq;
END;

ALTER TABLE jobs ADD COLUMN outcome TEXT;            -- JSON: realizations run and taken over, target
ALTER TABLE jobs ADD COLUMN forced INTEGER NOT NULL DEFAULT 0
    CHECK (forced IN (0, 1));                        -- run anew by force: takes nothing over

-- One that was run anew and came to nothing leaves the place to the newest it had pushed out.
CREATE INDEX jobs_superseded ON jobs (hash) WHERE superseded = 1;
CREATE TRIGGER jobs_stand_again AFTER UPDATE OF state ON jobs
WHEN new.forced = 1 AND new.superseded = 0 AND new.state IN ('failed', 'cancelled')
BEGIN
    UPDATE jobs SET superseded = 0
    WHERE seq = (SELECT max(seq) FROM jobs WHERE hash = new.hash AND superseded = 1
                 AND state IN ('queued', 'running', 'done'));
END;
