/* x' = 1 + k max(0, a - c (t - 1)^2): the relation is touched (a = 0), missed (a < 0) or crossed twice, shortly. */
#include "model.h"
#include "unused.h"
enum { A, C, K };
const double model_p_start[] = {0.0, 1.0, 1.0}, model_u_start[] = {0.0}, model_x_start[] = {0.0},
             model_x_nominal[] = {1.0};
const unsigned char model_p_tunable[] = {1, 1, 1};
int model_dependent(const double *p, double *d) {
    (void)p, (void)d;
    return 0;
}
int model_initial(double t, const double *u, const double *p, const double *d, const double *m,
                  const double *x_start, double *x) {
    UNUSED_POINT;
    x[0] = x_start[0];
    return 0;
}
static double excess(double t, const double *p) { return p[A] - p[C] * (t - 1.0) * (t - 1.0); }
int model_rhs(MODEL_POINT, double *dx) {
    UNUSED_POINT;
    dx[0] = 1.0 + p[K] * m[0] * excess(t, p);
    return 0;
}
int model_algebraic(MODEL_POINT, double *w) {
    UNUSED_POINT;
    w[0] = x[0];
    return 0;
}
int model_outputs(MODEL_POINT, double *y) { return model_algebraic(t, x, u, p, d, m, y); }
int model_indicators(MODEL_POINT, double *g) {
    UNUSED_POINT;
    g[0] = excess(t, p);
    return 0;
}
int model_jacobian(MODEL_POINT, double *a, double *b, double *ft) {
    UNUSED_POINT;
    (void)b;
    a[0] = 0.0;
    ft[0] = -2.0 * p[K] * m[0] * p[C] * (t - 1.0);
    return 0;
}
int model_directional(MODEL_POINT, const double *sx, const double *su, const double *sp, double *ddx, double *dw) {
    UNUSED_POINT;
    (void)su;
    ddx[0] = m[0] * (excess(t, p) * sp[K] + p[K] * (sp[A] - (t - 1.0) * (t - 1.0) * sp[C]));
    dw[0] = sx[0];
    return 0;
}
