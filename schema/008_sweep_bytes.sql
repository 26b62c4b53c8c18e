-- SPDX-License-Identifier: GPL-3.0-or-later
-- 008: what a sweep itself takes up counts as what its owner has stored: its texts, and for each
-- point its place and 48 bytes for the row and its entries in two indexes.

ALTER TABLE sweeps ADD COLUMN bytes INTEGER NOT NULL DEFAULT 0 CHECK (bytes >= 0);

UPDATE sweeps SET bytes = length(CAST(base AS BLOB)) + length(CAST(axes AS BLOB))
    + length(CAST(zip AS BLOB))
    + (SELECT coalesce(sum(length(place) + 48), 0) FROM sweep_points WHERE sweep = sweeps.seq);
INSERT OR IGNORE INTO owners (owner) SELECT DISTINCT owner FROM sweeps;
UPDATE owners SET bytes = bytes
    + (SELECT coalesce(sum(s.bytes), 0) FROM sweeps AS s WHERE s.owner = owners.owner);

CREATE TRIGGER sweeps_owner_bytes AFTER UPDATE OF bytes ON sweeps
BEGIN
    UPDATE owners SET bytes = bytes - old.bytes + new.bytes WHERE owner = new.owner;
END;
CREATE TRIGGER sweeps_owner_delete AFTER DELETE ON sweeps
BEGIN
    UPDATE owners SET bytes = bytes - old.bytes WHERE owner = old.owner;
END;
