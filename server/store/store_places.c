/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_places.c - see store_places.h. */
#include "store_places.h"

#include <stdlib.h>
#include <string.h>

int places_compare(const struct places *places, const struct place *a, const struct place *b)
{
    int order = scalar_compare(&a->value, &b->value, places->descending);

    if (order)
        return order;
    order = (a->seq > b->seq) - (a->seq < b->seq);
    return places->oldest_first ? order : -order;
}

static void sift_down(struct places *places, size_t i)
{
    struct place *heap = places->heap;

    for (;;) {
        size_t child = 2 * i + 1;
        struct place swap = heap[i];

        if (child >= places->found)
            return;
        if (child + 1 < places->found && places_compare(places, &heap[child + 1], &heap[child]) > 0)
            child++;
        if (places_compare(places, &heap[child], &heap[i]) <= 0)
            return;
        heap[i] = heap[child];
        heap[child] = swap;
        i = child;
    }
}

static void sift_up(struct places *places, size_t i)
{
    struct place *heap = places->heap;

    while (i > 0 && places_compare(places, &heap[(i - 1) / 2], &heap[i]) < 0) {
        struct place swap = heap[i];

        heap[i] = heap[(i - 1) / 2];
        heap[(i - 1) / 2] = swap;
        i = (i - 1) / 2;
    }
}

static void free_text(struct scalar *value)
{
    if (value->type == SCALAR_TEXT)
        free((char *)value->text);
    value->type = SCALAR_NONE;
}

bool places_behind(const struct places *places, const struct place *place)
{
    return places->found == places->room && places_compare(places, place, &places->heap[0]) >= 0;
}

bool places_offer(struct places *places, const struct place *place)
{
    struct place kept = *place;

    if (places_behind(places, place) ||
        (places->after && places_compare(places, place, places->after) <= 0))
        return true;
    if (place->value.type == SCALAR_TEXT) {
        char *copy = malloc(place->value.length + 1);

        if (!copy)
            return false;
        memcpy(copy, place->value.text, place->value.length);
        kept.value.text = copy;
    }
    if (places->found < places->room) {
        places->heap[places->found++] = kept;
        sift_up(places, places->found - 1);
    } else {
        free_text(&places->heap[0].value);
        places->heap[0] = kept;
        sift_down(places, 0);
    }
    return true;
}

static int compare_found(const void *a, const void *b, void *context)
{
    return places_compare(context, a, b);
}

void places_sort(struct places *places)
{
    qsort_r(places->heap, places->found, sizeof places->heap[0], compare_found, places);
}

bool places_init(struct places *places, size_t room)
{
    places->heap = calloc(room, sizeof *places->heap);
    places->room = room;
    return places->heap != NULL;
}

void places_fini(struct places *places)
{
    for (size_t i = 0; i < places->found; i++)
        free_text(&places->heap[i].value);
    free(places->heap);
    places->heap = NULL;
    places->found = 0;
}
