/* trajectory.h - a whole run in one call, beside the FMI functions (Co-Simulation; trajectory.c).
 *
 * An importer that knows all inputs beforehand need not communicate at every sample: the solver steps across samples
 * and stops where an input bends or jumps and at events; rows between are read from its dense output.
 * fmi2.c and fmi3.c export
 *
 *     int thsaTrajectory1(instance, Trajectory *)        1: this struct's version, part of the name
 *
 * to be called in place of doStep, once, after leaving Initialization Mode, with the first inputs set. It returns an
 * FMI status; after Discard the rows before `done` are right and the log says why it ended at `reached`.
 */
#ifndef THSA_TRAJECTORY_H
#define THSA_TRAJECTORY_H

#include <stddef.h>
#include "instance.h"

typedef struct {
    size_t n_inputs, n_segments, n_outputs, n_times;
    const unsigned *inputs;  /* (n_inputs) value references */
    const double *starts;    /* (n_segments) increasing; from starts[j] on input k is values + slopes (t - starts[j]) */
    const double *values, *slopes; /* (n_segments, n_inputs), row by row */
    const unsigned *outputs; /* (n_outputs) value references of any causality */
    const double *times;     /* (n_times) increasing; the first is the present time */
    double *results;         /* (n_outputs, n_times): what belongs to one variable is contiguous */
    double *progress;        /* time reached, written while running; or NULL */
    size_t done;             /* rows that are filled */
    size_t steps;            /* in: at most so many attempts at a step, 0 for no limit; out: steps of this run */
    size_t rejected, events; /* of this run */
    double reached;          /* time reached */
} Trajectory;

Status trajectory_run(Instance *c, Trajectory *run);

#endif
