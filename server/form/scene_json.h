/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * scene_json.h - jobs as JSON, read and written from the engine's parameter rows alone: a new
 * parameter or part needs no change here.
 */
#ifndef SCENE_JSON_H
#define SCENE_JSON_H

#include "bcd.h"
#include "ticket.h"

/* Reads a job (UTF-8 text of `size` bytes), completes and prepares it, hands over a finished scene.
 * Refuses (BCD_INVALID, every fault in errors with its JSON pointer): text that is not one JSON
 * object, duplicate keys, unknown keys, wrong types, numbers that are not finite or would silently
 * become 0. Text that is no JSON at all is one fault whose code is BCD_CORRUPT. */
enum bcd_status scene_json_parse(const char *text, size_t size, struct bcd_scene **scene,
                                 struct bcd_errors *errors);

/* The same, and what hangs on the job (see ticket_json.h), which scene_json_parse reads and
 * forgets. The ticket comes empty or with its owner set; on failure it is left as it was. */
enum bcd_status scene_json_parse_ticket(const char *text, size_t size, struct bcd_scene **scene,
                                        struct ticket *ticket, struct bcd_errors *errors);

/* Both of these without preparation: the scene is good for everything but runs (see bcd.h). cache
 * may be NULL. */
enum bcd_status scene_json_complete_ticket(const char *text, size_t size,
                                           struct bcd_scene **scene, struct ticket *ticket,
                                           struct bcd_errors *errors);
enum bcd_status scene_json_complete(const char *text, size_t size, struct bcd_scene_cache *cache,
                                    struct bcd_scene **scene, struct bcd_errors *errors);

/* The completed job, and what was derived from it, as compact JSON objects (malloc'ed, NULL = out
 * of memory). Parsing the first again gives a scene with the same bcd_scene_encode() bytes. */
char *scene_json_job(const struct bcd_scene *scene);
char *scene_json_derived(const struct bcd_scene *scene);

#endif
