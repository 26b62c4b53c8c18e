-- SPDX-License-Identifier: GPL-3.0-or-later
-- 011: what attempts cost.

ALTER TABLE attempts ADD COLUMN core_seconds REAL NOT NULL DEFAULT 0
    CHECK (core_seconds >= 0);                       -- used in it, as far as they were written down
