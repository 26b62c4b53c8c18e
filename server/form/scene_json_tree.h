/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * scene_json_tree.h - jobs as trees of JSON, for the readers of form/ that change a tree before it
 * becomes a scene. Nobody else includes this.
 */
#ifndef SCENE_JSON_TREE_H
#define SCENE_JSON_TREE_H

#include "bcd.h"

struct json_t;

/* The text as one JSON object ("job", "sweep": what it is called in faults), the caller's; NULL
 * with at least one fault. Numbers that doubles cannot hold are faults, too: check errors->count.
 */
struct json_t *scene_json_load(const char *text, size_t size, const char *what,
                               struct bcd_errors *errors);

/* A completed scene of a tree that holds nothing but physics; borrows nothing. */
enum bcd_status scene_json_read(struct json_t *object, struct bcd_scene_cache *cache,
                                struct bcd_scene **scene, struct bcd_errors *errors);

#endif
