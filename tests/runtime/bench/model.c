/* No states: F = F_C sgn(v) + b v (sgn linear within |v| <= v_r), power = F v. */
#include "model.h"
#include "unused.h"
enum { F_C, V_R, B_V };
const double model_p_start[] = {2700.0, 1e-7, 4e4}, model_u_start[] = {0.0}, model_x_start[] = {0.0},
             model_x_nominal[] = {1.0};
const unsigned char model_p_tunable[] = {1, 0, 1};
int model_dependent(const double *p, double *d) {
    (void)p, (void)d;
    return 0;
}
int model_initial(double t, const double *u, const double *p, const double *d, const double *m,
                  const double *x_start, double *x) {
    UNUSED_POINT;
    (void)x_start;
    return 0;
}
int model_rhs(MODEL_POINT, double *dx) {
    UNUSED_POINT;
    (void)dx;
    return 0;
}
static double sign(const double *p, const double *m, double v) {
    return m[0] > 0.5 ? 1.0 : m[1] > 0.5 ? -1.0 : v / p[V_R];
}
int model_outputs(MODEL_POINT, double *y) {
    UNUSED_POINT;
    y[0] = p[F_C] * sign(p, m, u[0]) + p[B_V] * u[0];
    return 0;
}
int model_algebraic(MODEL_POINT, double *w) {
    model_outputs(t, x, u, p, d, m, w);
    w[1] = w[0] * u[0];
    return 0;
}
int model_indicators(MODEL_POINT, double *g) {
    UNUSED_POINT;
    g[0] = u[0] - p[V_R];
    g[1] = -p[V_R] - u[0];
    return 0;
}
int model_jacobian(MODEL_POINT, double *A, double *B, double *ft) {
    UNUSED_POINT;
    (void)A, (void)B, (void)ft;
    return 0;
}
int model_directional(MODEL_POINT, const double *sx, const double *su, const double *sp, double *ddx, double *dw) {
    UNUSED_POINT;
    (void)sx, (void)ddx;
    const double steep = m[0] > 0.5 || m[1] > 0.5 ? 0.0 : 1.0 / p[V_R], sg = sign(p, m, u[0]);
    dw[0] = (p[F_C] * steep + p[B_V]) * su[0] + sg * sp[F_C] - p[F_C] * steep * u[0] / p[V_R] * sp[V_R] + u[0] * sp[B_V];
    dw[1] = dw[0] * u[0] + (p[F_C] * sg + p[B_V] * u[0]) * su[0];
    return 0;
}
