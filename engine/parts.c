/* SPDX-License-Identifier: GPL-3.0-or-later
 * parts.c - see parts.h. A new part: copy the nearest file, fill its table, add one line here. */
#include "parts.h"

extern const struct method_type method_lm;
extern const struct method_type method_strang;
extern const struct method_type method_strang_bonds;
extern const struct method_type method_elastic;
extern const struct method_type method_bcd;
extern const struct method_type method_bcd_chronological;
extern const struct method_type method_bcd_premerging;
extern const struct method_type method_strating;
extern const struct method_type method_tao;
extern const struct method_type method_metropolis;

extern const struct potential_type potential_cosine;
extern const struct potential_type potential_fourier;
extern const struct potential_type potential_table;
extern const struct potential_type potential_expression;

extern const struct pair_type pair_sticky;
extern const struct pair_type pair_yukawa;
extern const struct pair_type pair_power;
extern const struct pair_type pair_table;
extern const struct pair_type pair_expression;

extern const struct observable_type observable_density;
extern const struct observable_type observable_contact_density;
extern const struct observable_type observable_msd;
extern const struct observable_type observable_pair_distribution;
extern const struct observable_type observable_energy;
extern const struct observable_type observable_current;
extern const struct observable_type observable_cluster_sizes;
extern const struct observable_type observable_contact_force;
extern const struct observable_type observable_trajectory;

const struct method_type *const method_types[] = {
    &method_lm, &method_strang, &method_strang_bonds, &method_elastic, &method_bcd,
    &method_bcd_chronological, &method_bcd_premerging, &method_strating, &method_tao,
    &method_metropolis, NULL,
};

const struct potential_type *const potential_types[] = {
    &potential_cosine, &potential_fourier, &potential_table, &potential_expression, NULL};

const struct pair_type *const pair_types[] = {&pair_sticky, &pair_yukawa,     &pair_power,
                                             &pair_table,  &pair_expression, NULL};

const struct observable_type *const observable_types[] = {
    &observable_msd,     &observable_density,       &observable_contact_density,
    &observable_pair_distribution,
    &observable_energy,  &observable_current,       &observable_cluster_sizes,
    &observable_trajectory,
    &observable_contact_force,
    NULL,
};
