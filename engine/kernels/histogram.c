/* SPDX-License-Identifier: GPL-3.0-or-later
 * histogram.c - see histogram.h. Bins are found for a tile of rods at once, then counted. */
#include "histogram.h"
#include "elementary.h"
#include "simd.h"

enum { TILE = 256 };

static inline int32_t bin_of(double turns, double bins)
{
    double u = turns - round_whole(turns);
    u = u < 0 ? u + 1 : u;
    double bin = u * bins;
    /* u + 1 may round to 1: the first bin again. So is whatever has no place: NaN, |turns| beyond
     * 2^51. */
    return (int32_t)(bin >= 0 && bin < bins ? bin : 0);
}

/* Between walls: what rounding puts beyond one of them belongs to the bin there. */
static inline int32_t bin_between_walls(double share, double bins)
{
    double bin = share * bins;
    bin = bin < bins ? bin : bins - 1;
    return (int32_t)(bin >= 0 ? bin : 0);
}

int64_t fold_bin(const struct fold *fold, double x)
{
    if (fold->walls)
        return bin_between_walls(x * fold->inverse_period, (double)fold->bins);
    return bin_of(x * fold->inverse_period, (double)fold->bins);
}

KERNEL_CLONES
void histogram_add(int64_t *counts, const struct fold *fold, const double *y, int64_t n,
                   double diameter)
{
    const double k = fold->inverse_period, bins = (double)fold->bins;
    int32_t bin[TILE];
    for (int64_t start = 0; start < n; start += TILE) {
        int count = n - start < TILE ? (int)(n - start) : TILE;
        for (int j = 0; j < count && fold->walls; j++)
            bin[j] = bin_between_walls((y[start + j] + ((double)start + (double)j) * diameter) * k,
                                       bins);
        for (int j = 0; j < count && !fold->walls; j++)
            bin[j] = bin_of((y[start + j] + ((double)start + (double)j) * diameter) * k, bins);
        for (int j = 0; j < count; j++)
            counts[bin[j]]++;
    }
}
