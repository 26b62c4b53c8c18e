/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fuzz.h"

#include "scene_json.h"
#include "ticket_json.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

static void look_at_faults(const struct bcd_errors *errors)
{
    FUZZ_CHECK(errors->count > 0 && errors->count <= BCD_ERRORS_MAX);
    for (size_t i = 0; i < errors->count; i++) {
        FUZZ_CHECK(errors->items[i].text[0]);
        FUZZ_CHECK(strnlen(errors->items[i].text, sizeof(errors->items[i].text)) <
                   sizeof(errors->items[i].text));
        FUZZ_CHECK(errors->items[i].field[0] == '\0' || errors->items[i].field[0] == '/');
    }
}

/* The encoding, malloc'ed. */
static char *encode(const struct bcd_scene *scene, size_t *size)
{
    *size = bcd_scene_encode(scene, NULL, 0);
    FUZZ_CHECK(*size > 0);
    char *bytes = malloc(*size);
    FUZZ_CHECK(bytes && bcd_scene_encode(scene, bytes, *size) == *size);
    return bytes;
}

/* The completed job is a job, and the same one. */
static void check_printed(const struct bcd_scene *scene)
{
    struct bcd_scene *again = NULL;
    struct bcd_errors errors = {0};
    size_t size, size_again;
    char *bytes = encode(scene, &size), *json = scene_json_job(scene);
    FUZZ_CHECK(json);
    enum bcd_status status = scene_json_complete(json, strlen(json), NULL, &again, &errors);
    if (status != BCD_OK)
        fprintf(stderr, "%s\n%s: %s\n", json, errors.items[0].field, errors.items[0].text);
    FUZZ_CHECK(status == BCD_OK);
    char *bytes_again = encode(again, &size_again);
    FUZZ_CHECK(size == size_again && memcmp(bytes, bytes_again, size) == 0);
    char *json_again = scene_json_job(again);
    FUZZ_CHECK(json_again && strcmp(json, json_again) == 0);
    free(json_again);
    free(bytes_again);
    free(json);
    free(bytes);
    bcd_scene_free(again);
}

static void check_facts(const struct bcd_scene *scene)
{
    struct bcd_estimate estimate;
    char *derived = scene_json_derived(scene);
    json_t *read = derived ? json_loads(derived, JSON_REJECT_DUPLICATES, NULL) : NULL;
    FUZZ_CHECK(json_is_object(read));
    json_decref(read);
    free(derived);
    bcd_scene_estimate(scene, &estimate);
    FUZZ_CHECK(estimate.run_bytes > 0 && estimate.steps >= 0 && estimate.core_seconds >= 0);
    FUZZ_CHECK(isfinite(estimate.run_bytes) && isfinite(estimate.result_bytes) &&
               isfinite(estimate.tally_bytes) && isfinite(estimate.rod_steps));
    int64_t chunks = bcd_scene_chunks(scene);
    FUZZ_CHECK(chunks > 0 && bcd_scene_realizations(scene, chunks) > 0);
}

void fuzz_job(const uint8_t *data, size_t size)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    enum bcd_status status = scene_json_complete((const char *)data, size, NULL, &scene, &errors);
    FUZZ_CHECK(status == BCD_OK || status == BCD_INVALID);
    FUZZ_CHECK((status == BCD_OK) == (scene != NULL) && (scene || errors.count > 0));
    if (!scene) {
        look_at_faults(&errors);
        return;
    }
    check_printed(scene);
    check_facts(scene);
    status = bcd_scene_prepare(scene, NULL, &errors);
    FUZZ_CHECK(status == BCD_OK || (status == BCD_INVALID && errors.count > 0));
    bcd_scene_free(scene);
}

void fuzz_ticket(const uint8_t *data, size_t size)
{
    struct ticket ticket = {.owner = "anna"}, again = {.owner = "anna"};
    struct bcd_errors errors = {0}, none = {0};
    struct text text = {0};
    json_t *object =
        json_loadb((const char *)data, size, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, NULL);
    if (json_is_object(object)) {
        ticket_json_take(object, &ticket, &errors);
        for (int i = 0; i < 3; i++)
            FUZZ_CHECK(!json_object_get(object, (const char *[]){"label", "tags", "priority"}[i]));
        FUZZ_CHECK(strcmp(ticket.owner, "anna") == 0);
    }
    json_decref(object);
    if (!object || errors.count > 0) {
        ticket_fini(&ticket);
        return;
    }
    text_add(&text, "{");
    ticket_json_add(&text, &ticket);
    text_add(&text, "}");
    char *printed = text_take(&text);
    object = printed ? json_loads(printed, JSON_REJECT_DUPLICATES, NULL) : NULL;
    FUZZ_CHECK(json_is_object(object));
    if (json_is_null(json_object_get(object, "label")))
        json_object_del(object, "label");
    ticket_json_take(object, &again, &none);
    FUZZ_CHECK(none.count == 0 && ticket.priority == again.priority);
    FUZZ_CHECK(!ticket.label == !again.label &&
               (!ticket.label || strcmp(ticket.label, again.label) == 0));
    FUZZ_CHECK(!ticket.tags == !again.tags &&
               (!ticket.tags || strcmp(ticket.tags, again.tags) == 0));
    json_decref(object);
    free(printed);
    ticket_fini(&ticket);
    ticket_fini(&again);
}
