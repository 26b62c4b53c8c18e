-- SPDX-License-Identifier: GPL-3.0-or-later
-- 010: what lists look at of every column stands apart from its values, so that it is read at once
-- and the values are not, where a reader still has them.

CREATE TABLE job_ends (                              -- of each row of job_columns, same id
    id      INTEGER PRIMARY KEY,
    version INTEGER NOT NULL,                        -- random; another one for other bytes
    least   ANY,                                     -- smallest and largest value; NULL where that
    most    ANY                                      -- is a text
) STRICT;
INSERT INTO job_ends (id, version, least, most) SELECT id, 0, least, most FROM job_columns;
CREATE TABLE job_values (                            -- job_columns without its ends
    id    INTEGER PRIMARY KEY,                       -- key << 32 | segment
    bytes BLOB NOT NULL
) STRICT;
INSERT INTO job_values (id, bytes) SELECT id, bytes FROM job_columns;
DROP TABLE job_columns;
ALTER TABLE job_values RENAME TO job_columns;

-- Which segments are sealed, without their states.
CREATE INDEX job_segments_sealed ON job_segments (segment);
