/* instance.h - an FMI-independent instance of the model: its state, its caches and its services.
 *
 * Everything a run depends on lives in the plain struct State (no pointers), so that saving, restoring and
 * serialising an FMU state is a copy. No global variables: instances are independent of each other.
 * Status values and phases are numbered so that fmi2.c and fmi3.c only cast them.
 */
#ifndef THSA_INSTANCE_H
#define THSA_INSTANCE_H

#include <math.h>
#include <stddef.h>
#include "model.h"

typedef enum { OK = 0, WARNING = 1, DISCARD = 2, FAILED = 3, FATAL = 4 } Status; /* = fmi2Status, fmi3Status */

typedef enum {
    INSTANTIATED = 1, INITIALIZATION = 2, EVENT_MODE = 4, CONTINUOUS = 8, STEP_MODE = 16,
    STEP_FAILED = 32, TERMINATED = 64, IN_ERROR = 128, INTERMEDIATE = 256, IN_STEP = 512
} Phase;

typedef enum { CO_SIMULATION = 1, MODEL_EXCHANGE = 2 } Kind;

typedef enum {
    LOG_WARNING = 1, LOG_DISCARD = 2, LOG_ERROR = 4, LOG_FATAL = 8, LOG_EVENTS = 16, LOG_SOLVER = 32, LOG_ALL = 63
} Category;

enum { RODAS_STAGES = 8 };

/* What integration changes: copied at the start of each communication step, restored when it fails. */
typedef struct {
    double time;
    double step;             /* step size the controller remembers; 0 = none yet */
    double x[N_X + 1], u[N_U + 1], m[N_M + 1];
    double next[N_T + 1];    /* time of the next tick of each sample */
    double span[N_G + 1];    /* largest |g| seen: scale of the dead band that rounding noise cannot leave */
    double reach[N_G + 1];   /* largest |g| since the relation changed (Model Exchange) */
    double band[N_G + 1];    /* dead band of a relation that chatters, else 0 */
    int returns[N_G + 1];    /* times in a row that it changed back before g had left the band */
    int caught[N_G + 1];     /* the same with the widest band, since the time that follows */
    double since[N_G + 1];
    int bends;               /* a time event was just met: the next step is a careful one */
    int endless;             /* 1 + the relation that changes too often to go on, else 0 */
} Motion;

typedef struct {
    double p[N_P + 1], d[N_D + N_CACHE + 1], x_start[N_X + 1];
    double du[N_U + 1];      /* input derivatives of the next communication step */
    Motion now;
    double start_time, stop_time, tolerance;
    double last_step_end;    /* time reached by the last successful communication step */
    int phase;
    int tolerance_defined, stop_defined;
    int inputs_moving;       /* some du != 0 */
    int derivatives_used;    /* du belong to the step just done; the next one starts with du = 0 */
    int dependent_due;       /* p changed: d is out of date */
    int initial_due;         /* initial equations not solved for the present start values */
    int states_jumped;       /* an event has reinitialized states since this was last asked (Model Exchange) */
    int modes_due;           /* inputs or parameters jumped: relations have to be checked (Co-Simulation) */
#if N_RESTING
    int movers, mover[N_X + 1]; /* number and indices of the states that the parameters let move */
#endif
} State;

/* The solver's vectors hold the moving states alone; the k-th of them is state MOVER(c, k). */
#if N_RESTING
#define MOVERS(c) ((c)->s.movers)
#define MOVER(c, k) ((c)->s.mover[k])
#else
#define MOVERS(c) N_X
#define MOVER(c, k) (k)
#endif

typedef struct Instance Instance;
typedef struct Recorder Recorder;

enum { STAGE_WIDTH = N_X / 4 * 4 + 4 }; /* whole lanes: solver.c, add_stages */

struct Instance {
    State s;
    Kind kind;
    unsigned categories;     /* enabled log categories */
    void (*emit)(Instance *, Status, const char *category, const char *message);
    void (*before_step)(Instance *, double time);  /* FMI 3 intermediate update: inputs wanted at `time` */
    void (*after_step)(Instance *);                /* FMI 3 intermediate update: an internal step is done */
    int return_early;        /* after_step was told to end the communication step where it is */
    Recorder *recorder;      /* of the trajectory that is running (trajectory.c), else NULL */

    /* caches: valid for the present (time, x, u, p, m) */
    int dx_valid, y_valid, w_valid, g_valid;
    double dx[N_X + 1], w[N_W + 1], g[N_G + 1];
    double slope[N_G + 1];   /* dg/dt of time events, 0 of other relations; as of the last event */
    double due;              /* the next time event, which an event within a step may move */

    /* solver workspace, nothing in it outlives a change of the point except through its validity flags */
    int jacobian_valid, factors_of; /* factors_of: index of the Jacobian that lu holds, -1 = none */
    int current;                    /* index of the present Jacobian in J */
    int dense_ready;                /* stage holds the dense output's polynomials */
    double factored_step;
    double J[2][N_X * N_X + 1], B[N_X * N_U + 1], ft[N_X + 1];
    double lu[N_X * N_X + 1];
    int pivot[N_X + 1], order[N_X + 1];
    double entry[N_X * N_X + 1]; /* of lu beside the diagonal, without zeros: solver.c, compress */
    int from[N_X * N_X + 1], row[2 * N_X + 1]; /* column of each entry; where each row ends */
    double stage[RODAS_STAGES][STAGE_WIDTH]; /* of the moving states */
    double x_new[N_X + 1];
    long events, steps, rejected;
    unsigned char asserted[N_A + 1]; /* violations are reported once */

    /* for messages only (explain.c) */
    double watched[N_M + 1];         /* m before the last turn of an iteration */
    unsigned char restless[N_M + 1]; /* which of m changed in its last turns */
    long sought[N_G + 1];            /* events of each relation that were sought since the communication step began */
};

extern const char *const category_names[6]; /* in the order of the bits of Category */

void instance_log(Instance *c, Status status, Category category, const char *format, ...)
#if defined(__GNUC__) || defined(__clang__)
    __attribute__((format(printf, 4, 5)))
#endif
    ;

void instance_warn(Instance *c, const char *format, ...) /* a warning that is shown whatever is logged */
#if defined(__GNUC__) || defined(__clang__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;

Status instance_set_logging(Instance *c, int on, size_t n, const char *const categories[]);
int instance_allowed(Instance *c, const char *function, int phases, int kind); /* kind 0: both; logs a refusal */
int instance_given(Instance *c, const char *function, size_t n, const void *first, const void *second);

void instance_reset(Instance *c);       /* as freshly instantiated; logging stays */
void instance_changed(Instance *c);     /* the point changed: caches are void */
Status instance_setup(Instance *c, int tolerance_defined, double tolerance, double start, int stop_defined, double stop);
Status instance_initialize(Instance *c);         /* solve the initial equations if they are due */
Status instance_update_modes(Instance *c);       /* event iteration at the present point */
int instance_switch_modes(Instance *c, int report); /* relations that have changed; their number */
Status instance_settle(Instance *c);             /* bring d, x, m up to date as the phase demands */
Status instance_derivatives(Instance *c);        /* fills c->dx */
Status instance_indicators(Instance *c);         /* fills c->g */
Status instance_missed_event(Instance *c, int *missed); /* has a relation changed its sign since its mode was set? */
typedef enum { COPY_STATES, COPY_DERIVATIVES, COPY_INDICATORS, COPY_NOMINALS } Copy;
Status instance_copy(Instance *c, Copy what, double *out, size_t n); /* Model Exchange vectors */
double instance_indicator(const Instance *c, int k); /* g[k] shifted by its dead band: never 0 */
double instance_dead_band(const Instance *c, int k);

Status instance_get(Instance *c, const unsigned *vr, size_t n, double *values);
Status instance_set(Instance *c, const unsigned *vr, size_t n, const double *values);
int instance_is_input(unsigned vr);
Status instance_set_states(Instance *c, const double *x, size_t n);
Status instance_set_time(Instance *c, double time);
Status instance_set_input_derivatives(Instance *c, const unsigned *vr, size_t n, const int *order, const double *values);
Status instance_output_derivatives(Instance *c, const unsigned *vr, size_t n, const int *order, double *values);
Status instance_directional(Instance *c, const unsigned *unknown, size_t n_unknown, const unsigned *known,
                            size_t n_known, const double *seed, double *sensitivity);
Status instance_adjoint(Instance *c, const unsigned *unknown, size_t n_unknown, const unsigned *known,
                        size_t n_known, const double *seed, double *sensitivity);
Status instance_do_step(Instance *c, double from, double size);

/* saved states (snapshot.c) */
typedef struct Snapshot Snapshot;
Status snapshot_take(Instance *c, Snapshot **out);
Status snapshot_restore(Instance *c, const Snapshot *in);
void snapshot_free(Snapshot **in);
size_t snapshot_size(void);
void snapshot_write(const Snapshot *in, unsigned char *bytes);
Status snapshot_read(Instance *c, const unsigned char *bytes, size_t size, Snapshot **out);

static inline int is_finite(double v) { return v - v == 0.0; }

/* The largest |g| so far, of which the dead band is a share; less what stands for infinity ("never", "not yet"). */
static inline void instance_widen_span(Motion *now, int k, double g) {
    if (fabs(g) > now->span[k] && fabs(g) < 1e90) now->span[k] = fabs(g);
}

#endif
