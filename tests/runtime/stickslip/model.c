/* A block on a spring whose other end moves at the input velocity; Coulomb plus Stribeck friction.
 * states: spring elongation e, block velocity v, block position s; inputs: pull velocity v_pull, load F
 * e' = v_pull - v, M v' = k e - F - friction(v), s' = v
 * friction = (F_C + (F_S - F_C) exp(-(v/v_S)^2) + b |v|) sgn(v), sgn linear within |v| <= v_r
 * relations: 0: v > v_r, 1: v < -v_r. Outputs s, v; local: friction. */
#include <math.h>
#include "model.h"
#include "unused.h"
enum { M, K, F_C, F_S, V_S, V_R, B_V };
const double model_p_start[] = {1.0, 100.0, 1.0, 1.5, 0.01, 1e-7, 0.5}, model_u_start[] = {0.05, 0.0},
             model_x_start[] = {0.0, 0.0, 0.0}, model_x_nominal[] = {1e-2, 1e-2, 1e-2};
const unsigned char model_p_tunable[] = {0, 0, 1, 1, 0, 0, 1};
int model_dependent(const double *p, double *d) {
    (void)p, (void)d;
    return 0;
}
int model_initial(double t, const double *u, const double *p, const double *d, const double *m,
                  const double *x_start, double *x) {
    UNUSED_POINT;
    for (int i = 0; i < 3; i++) x[i] = x_start[i];
    return 0;
}
static double sign(const double *p, const double *m, double v) {
    return m[0] > 0.5 ? 1.0 : m[1] > 0.5 ? -1.0 : v / p[V_R];
}
static double bell(const double *p, double v) { return exp(-(v / p[V_S]) * (v / p[V_S])); }
static double friction(const double *p, const double *m, double v) {
    return (p[F_C] + (p[F_S] - p[F_C]) * bell(p, v)) * sign(p, m, v) + p[B_V] * v;
}
static double friction_slope(const double *p, const double *m, double v) {
    const double steep = m[0] > 0.5 || m[1] > 0.5 ? 0.0 : 1.0 / p[V_R];
    return (p[F_C] + (p[F_S] - p[F_C]) * bell(p, v)) * steep + p[B_V] -
           (p[F_S] - p[F_C]) * bell(p, v) * 2.0 * v / (p[V_S] * p[V_S]) * sign(p, m, v);
}
int model_rhs(MODEL_POINT, double *dx) {
    UNUSED_POINT;
    dx[0] = u[0] - x[1];
    dx[1] = (p[K] * x[0] - u[1] - friction(p, m, x[1])) / p[M];
    dx[2] = x[1];
    return 0;
}
int model_outputs(MODEL_POINT, double *y) {
    UNUSED_POINT;
    y[0] = x[2];
    y[1] = x[1];
    return 0;
}
int model_algebraic(MODEL_POINT, double *w) {
    UNUSED_POINT;
    w[0] = x[2];
    w[1] = x[1];
    w[2] = friction(p, m, x[1]);
    return 0;
}
int model_indicators(MODEL_POINT, double *g) {
    UNUSED_POINT;
    g[0] = x[1] - p[V_R];
    g[1] = -p[V_R] - x[1];
    return 0;
}
int model_jacobian(MODEL_POINT, double *A, double *B, double *ft) {
    UNUSED_POINT;
    for (int i = 0; i < 9; i++) A[i] = 0.0;
    for (int i = 0; i < 6; i++) B[i] = 0.0;
    A[1] = p[K] / p[M];
    A[3] = -1.0;
    A[4] = -friction_slope(p, m, x[1]) / p[M];
    A[5] = 1.0;
    B[0] = 1.0;
    B[4] = -1.0 / p[M];
    ft[0] = ft[1] = ft[2] = 0.0;
    return 0;
}
int model_directional(MODEL_POINT, const double *sx, const double *su, const double *sp, double *ddx, double *dw) {
    UNUSED_POINT;
    const double e = bell(p, x[1]), sg = sign(p, m, x[1]), r = x[1] / p[V_S];
    const double inside = m[0] > 0.5 || m[1] > 0.5 ? 0.0 : 1.0;
    const double dF = friction_slope(p, m, x[1]) * sx[1] + (1.0 - e) * sg * sp[F_C] + e * sg * sp[F_S] +
                      (p[F_S] - p[F_C]) * e * 2.0 * r * r / p[V_S] * sg * sp[V_S] -
                      inside * (p[F_C] + (p[F_S] - p[F_C]) * e) * x[1] / (p[V_R] * p[V_R]) * sp[V_R] +
                      x[1] * sp[B_V];
    const double force = p[K] * x[0] - u[1] - friction(p, m, x[1]);
    ddx[0] = su[0] - sx[1];
    ddx[1] = (p[K] * sx[0] + x[0] * sp[K] - su[1] - dF) / p[M] - force / (p[M] * p[M]) * sp[M];
    ddx[2] = sx[1];
    dw[0] = sx[2];
    dw[1] = sx[1];
    dw[2] = dF;
    return 0;
}
