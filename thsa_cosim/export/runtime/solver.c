/* solver.c - Rodas5P: one stiffly accurate, L-stable Rosenbrock-Wanner step for x' = f(t, x, u(t)).
 *
 * Method and coefficients: G. Steinebach, "Construction of Rosenbrock-Wanner method Rodas5P and numerical
 * benchmarks within the Julia Differential Equations package", BIT Numer. Math. 63 (2023) 27; order 5(4), dense
 * output of order 4. Notation of Hairer and Wanner, Solving ODE II, IV.7, eq. (7.25): with W = I/(gamma h) - J
 *     W U_i = f(t + c_i h, x + sum a_ij U_j) + sum (C_ij/h) U_j + d_i h f_t,   f_t = df/dt + df/du u'.
 * Stages 6 to 8 share their row of a (each adds the previous U), so x_new = last argument + U_8 and the embedded
 * error is U_8 itself. Inputs are piecewise linear in time, hence exact at every stage.
 */
#include <math.h>
#include <string.h>
#include "solver.h"

#if defined(_MSC_VER) && !defined(__clang__)
#define restrict __restrict
#endif

#if N_X > 0

enum { STAGES = RODAS_STAGES, FULL_ROWS = 6 }; /* rows of a that are not "previous row plus last stage" */

static const double gamma_ = 0.21193756319429014;
static const double a[FULL_ROWS][5] = {
    {0},
    {3.0},
    {2.849394379747939, 0.45842242204463923},
    {-6.954028509809101, 2.489845061869568, -10.358996098473584},
    {2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641},
    {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946},
};
static const double C[STAGES][STAGES - 1] = {
    {0},
    {-14.155112264123755},
    {-17.97296035885952, -2.859693295451294},
    {147.12150275711716, -1.41221402718213, 71.68940251302358},
    {165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306},
    {24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471},
    {30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
     -28.087943162872662},
    {37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
     -54.66780262877968, -9.48861652309627},
};
static const double c_[STAGES] = {0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716,
                                  0.4288403609558664, 1, 1, 1};
static const double d_[STAGES] = {0.21193756319429014, -0.42387512638858027, -0.3384627126235924,
                                  1.8046452872882734, 2.325825639765069, 0, 0, 0};
/* x(theta) = (1-theta) x0 + theta (x1 + (1-theta) (k1 + theta (k2 + theta k3))), k_r = sum H_rj U_j */
static const double H[3][STAGES] = {
    {25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204, 0.524948541321073,
     1.1241088310450404, 0.4272876194431874, -0.17202221070155493},
    {-9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796, 20.176138334709044,
     15.98066361424651, -6.789040303419874, -6.710236069923372},
    {11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643, -52.072871366152654,
     -59.78993625266729, -0.15582684282751913, 4.883087185713722},
};

double solver_tolerance(const Instance *c) { return c->s.tolerance; }

void solver_inputs(const Instance *c, double h, double *u) {
    for (int k = 0; k < N_U; k++) u[k] = c->s.now.u[k] + h * c->s.du[k];
}

/* LU with partial pivoting, column-major, reciprocals on the diagonal; structural zeros are skipped. */
static int factorize(int n_x, double *restrict w, int *restrict pivot) {
    for (int k = 0; k < n_x; k++) {
        double *col = w + k * n_x;
        int best = k;
        for (int i = k + 1; i < n_x; i++)
            if (fabs(col[i]) > fabs(col[best])) best = i;
        if (!(fabs(col[best]) > 0.0) || !is_finite(col[best])) return 1;
        pivot[k] = best;
        if (best != k)
            for (int j = 0; j < n_x; j++) {
                double swap = w[j * n_x + k];
                w[j * n_x + k] = w[j * n_x + best];
                w[j * n_x + best] = swap;
            }
        const double inverse = 1.0 / col[k];
        int below[N_X], n = 0;
        col[k] = inverse;
        for (int i = k + 1; i < n_x; i++)
            if (col[i] != 0.0) col[i] *= inverse, below[n++] = i;
        for (int j = k + 1; n && j < n_x; j++) {
            double *restrict right = w + j * n_x;
            const double factor = right[k];
            if (factor == 0.0) continue;
            for (int e = 0; e < n; e++) right[below[e]] -= factor * col[below[e]];
        }
    }
    return 0;
}

/* P W = L D U: the entries of L and U beside the diagonal that are not 0, in the order in which they are used, row by row,
 * U's over the diagonal D; the swaps as one order. row[k]: where the k-th of all rows ends, U's from the last one up. */
static void compress(Instance *c) {
    const int n_x = MOVERS(c);
    int n = 0, at = 0;
    for (int k = 0; k < n_x; k++) c->order[k] = k;
    for (int k = 0; k < n_x; k++) {
        const int swap = c->order[k];
        c->order[k] = c->order[c->pivot[k]];
        c->order[c->pivot[k]] = swap;
    }
    for (int i = 0; i < n_x; i++) {
        for (int k = 0; k < i; k++) {
            const double value = c->lu[k * n_x + i];
            if (value != 0.0) c->entry[n] = value, c->from[n++] = k;
        }
        c->row[at++] = n;
    }
    for (int i = n_x - 1; i >= 0; i--) {
        for (int k = n_x - 1; k > i; k--) {
            const double value = c->lu[k * n_x + i];
            if (value != 0.0) c->entry[n] = value * c->lu[i * (n_x + 1)], c->from[n++] = k;
        }
        c->row[at++] = n;
    }
}

static void solve(const Instance *c, double *restrict b) {
    const int n_x = MOVERS(c);
    double v[N_X];
    int e = 0, at = 0;
    for (int k = 0; k < n_x; k++) v[k] = b[c->order[k]];
    for (int i = 0; i < n_x; i++, at++) {
        double sum = v[i];
        for (; e < c->row[at]; e++) sum -= v[c->from[e]] * c->entry[e];
        v[i] = sum;
    }
    for (int i = n_x - 1; i >= 0; i--, at++) {
        double sum = v[i] * c->lu[i * (n_x + 1)];
        for (; e < c->row[at]; e++) sum -= v[c->from[e]] * c->entry[e];
        b[i] = v[i] = sum;
    }
}

/* By value: terms whose coefficient is 0 may change from 0.0 to -0.0, which is no reason to factorize anew. */
static int differ(const Instance *c, const double *restrict one, const double *restrict other) {
    int found = 0;
#if N_RESTING
    for (int j = 0; j < MOVERS(c); j++)
        for (int i = 0; i < MOVERS(c); i++) {
            const int at = MOVER(c, j) * N_X + MOVER(c, i);
            found |= one[at] != other[at];
        }
#else
    (void)c;
    for (int i = 0; i < N_X * N_X; i++) found |= one[i] != other[i];
#endif
    return found;
}

int solver_linearize(Instance *c) {
    State *s = &c->s;
    if (!c->dx_valid && instance_derivatives(c) != OK) return 1;
    if (c->jacobian_valid) return 0;
    const int fresh = 1 - c->current;
    if (model_jacobian(s->now.time, s->now.x, s->now.u, s->p, s->d, s->now.m, c->J[fresh], c->B, c->ft)) return 1;
    if (differ(c, c->J[fresh], c->J[c->current])) {
        if (c->factors_of == fresh) c->factors_of = -1;
        c->current = fresh;
    }
    if (s->inputs_moving)
        for (int k = 0; k < N_U; k++) {
            const double slope = s->du[k];
            if (slope == 0.0) continue;
            for (int i = 0; i < N_X; i++) c->ft[i] += slope * c->B[k * N_X + i];
        }
    c->jacobian_valid = 1;
    return 0;
}

/* The first 33 bits (T. Dekker, Numer. Math. 18 (1971) 224): equal for communication steps that differ by the rounding of
 * time only, so that their matrix is factorized once, and close enough to h for a tolerance of 1e-11. */
static double leading_digits(double h) {
    const double wide = 1048577.0 * h; /* 2^20 + 1 */
    return wide - (wide - h);
}

/* U = dx of the moving states at their values v. */
static int rates(const Instance *c, double time, const double *v, const double *u, double *U) {
    const State *s = &c->s;
#if N_RESTING
    double x[N_X], dx[N_X];
    memcpy(x, s->now.x, sizeof x);
    for (int n = 0; n < MOVERS(c); n++) x[MOVER(c, n)] = v[n];
    if (model_rhs(time, x, u, s->p, s->d, s->now.m, dx)) return 1;
    for (int n = 0; n < MOVERS(c); n++) U[n] = dx[MOVER(c, n)];
    return 0;
#else
    return model_rhs(time, v, u, s->p, s->d, s->now.m, U);
#endif
}

/* v += the weighted sum of the first n stages, in lanes that a compiler turns into vectors; what is behind the moving states
 * in the last lanes is 0. */
static void add_stages(const Instance *c, int n, const double *restrict weight, double *restrict v) {
    enum { LANES = 4 };
    const int n_x = MOVERS(c);
    for (int k = 0; k < n_x; k += LANES) {
        double sum[LANES];
        for (int i = 0; i < LANES; i++) sum[i] = v[k + i];
        for (int j = 0; j < n; j++)
            for (int i = 0; i < LANES; i++) sum[i] += weight[j] * c->stage[j][k + i];
        for (int i = 0; i < LANES; i++) v[k + i] = sum[i];
    }
}

double solver_step(Instance *c, double h) {
    const State *s = &c->s;
    const double *restrict x0 = s->now.x;
    const int n_x = MOVERS(c);
    double argument[STAGE_WIDTH] = {0.0}, weight[STAGES], moved[N_U + 1];
    const double per_h = 1.0 / h, rounded = leading_digits(h);

    c->dense_ready = 0;
    if (c->factors_of != c->current || c->factored_step != rounded) {
        const double shift = 1.0 / (gamma_ * rounded);
        const double *J = c->J[c->current];
#if N_RESTING
        for (int j = 0; j < n_x; j++)
            for (int i = 0; i < n_x; i++) c->lu[j * n_x + i] = -J[MOVER(c, j) * N_X + MOVER(c, i)];
#else
        for (int i = 0; i < N_X * N_X; i++) c->lu[i] = -J[i];
#endif
        for (int i = 0; i < n_x; i++) c->lu[i * (n_x + 1)] += shift;
        c->factors_of = -1;
        if (factorize(n_x, c->lu, c->pivot)) return -1.0;
        compress(c);
        c->factors_of = c->current;
        c->factored_step = rounded;
    }

    for (int i = 0; i < STAGES; i++) {
        double *restrict U = c->stage[i];
        if (i == 0) {
            for (int n = 0; n < n_x; n++) U[n] = c->dx[MOVER(c, n)];
        } else {
            if (i < FULL_ROWS) {
                for (int n = 0; n < n_x; n++) argument[n] = x0[MOVER(c, n)];
                add_stages(c, i, a[i], argument);
            } else {
                for (int n = 0; n < n_x; n++) argument[n] += c->stage[i - 1][n];
            }
            const double *u = s->now.u;
            if (s->inputs_moving) {
                solver_inputs(c, c_[i] * h, moved);
                u = moved;
            }
            if (rates(c, s->now.time + c_[i] * h, argument, u, U)) return -1.0;
            for (int j = 0; j < i; j++) weight[j] = C[i][j] * per_h;
            add_stages(c, i, weight, U);
        }
        if (d_[i] != 0.0)
            for (int n = 0; n < n_x; n++) U[n] += d_[i] * h * c->ft[MOVER(c, n)];
        solve(c, U);
    }

    const double tolerance = solver_tolerance(c);
    const double *error = c->stage[STAGES - 1];
    double worst = 0.0, finite = 0.0;
#if N_RESTING
    memcpy(c->x_new, x0, sizeof(double) * N_X);
#endif
    for (int n = 0; n < n_x; n++) {
        const int at = MOVER(c, n);
        c->x_new[at] = argument[n] + error[n];
        const double size = fmax(fabs(x0[at]), fabs(c->x_new[at]));
        const double scaled = fabs(error[n]) / (tolerance * (model_x_nominal[at] + size));
        worst = scaled > worst ? scaled : worst;
        finite += c->x_new[at] - c->x_new[at];
    }
    return finite == 0.0 ? worst : -1.0;
}

/* The states at rest stay where they are. */
static void at_rest(const Instance *c, double *x) {
#if N_RESTING
    memcpy(x, c->s.now.x, sizeof(double) * N_X);
#else
    (void)c, (void)x;
#endif
}

void solver_dense_middle(const Instance *c, double *x) {
    at_rest(c, x);
    for (int k = 0; k < MOVERS(c); k++) {
        const int n = MOVER(c, k);
        x[n] = 0.5 * (c->s.now.x[n] + c->x_new[n]);
    }
    for (int j = 0; j < STAGES; j++) {
        const double weight = 0.25 * (H[0][j] + 0.5 * (H[1][j] + 0.5 * H[2][j]));
        for (int k = 0; k < MOVERS(c); k++) x[MOVER(c, k)] += weight * c->stage[j][k];
    }
}

void solver_dense_prepare(Instance *c) {
    if (c->dense_ready) return;
    c->dense_ready = 1;
    for (int n = 0; n < MOVERS(c); n++) {
        double k[3] = {0.0, 0.0, 0.0};
        for (int j = 0; j < STAGES; j++)
            for (int r = 0; r < 3; r++) k[r] += H[r][j] * c->stage[j][n];
        for (int r = 0; r < 3; r++) c->stage[r][n] = k[r]; /* the stages are not needed any more */
    }
}

void solver_dense(const Instance *c, double theta, double *x) {
    const double rest = 1.0 - theta;
    at_rest(c, x);
    for (int k = 0; k < MOVERS(c); k++) {
        const int n = MOVER(c, k);
        const double bend = c->stage[0][k] + theta * (c->stage[1][k] + theta * c->stage[2][k]);
        x[n] = rest * c->s.now.x[n] + theta * (c->x_new[n] + rest * bend);
    }
}

#endif
