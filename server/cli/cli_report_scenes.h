/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_report_scenes.h - the jobs behind the figures of the 2022 paper (doi
 * 10.1103/PhysRevE.106.054606) and Fig. 7 of the 2024 one (doi 10.1016/j.cpc.2024.109474), so that
 * an installed program needs no files. tests/scenes holds the same jobs as files.
 *
 * UNITS  wavelength, kT and mobility are 1.
 */
#ifndef CLI_REPORT_SCENES_H
#define CLI_REPORT_SCENES_H

#include <stdbool.h>
#include <stddef.h>

/* How long and how finely a job is run. */
struct report_effort {
    double time_step; /* 0 = automatic */
    double time;
    int realizations;
    double last; /* longest lag of an msd */
};

struct report_scene {
    int figure;       /* number in its paper: 7 is of 2024 */
    double diameter;  /* sigma */
    double density;   /* rho = N / L */
    double stickiness; /* gamma; 0 = hard rods */
    struct report_effort effort[2]; /* [0] shortened, [1] full */
};

/* One figure: its panels stand in the order of its scenes, `columns` of them in a row; with two
 * observables the second's row follows below the first's. */
enum { REPORT_OBSERVABLES_MAX = 2 };
struct report_figure {
    int number;
    int year; /* of the paper */
    const char *title, *source;
    const char *method; /* unless the user wants another */
    size_t columns;
    const char *observable[REPORT_OBSERVABLES_MAX]; /* NULL = none */
    double gap;                                     /* window of contact_density */
};

/* By index; NULL past the last. Scenes of one figure follow one another. */
const struct report_scene *report_scene(size_t index);
const struct report_figure *report_figure(size_t index);

/* "2022-fig3-sigma0.2-rho0.5", "2022-fig6-gamma10-sigma0.8-rho0.8",
 * "2024-fig7b-sigma0.8-rho0.5". */
enum { REPORT_NAME_SIZE = 64 };
void report_scene_name(const struct report_scene *scene, char name[REPORT_NAME_SIZE]);

/* The job as JSON, malloc'ed; NULL = out of memory. With a method (not NULL) it is that one's, with
 * a time step of its own choice, in place of the figure's with the table's. */
char *report_scene_json(const struct report_scene *scene, bool full, const char *method);

#endif
