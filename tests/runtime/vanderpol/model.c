/* Van der Pol: x0' = x1, x1' = mu (1 - x0^2) x1 - x0, mu = 1000 (stiff relaxation oscillation). */
#include "model.h"
#include "unused.h"
const double model_p_start[] = {1000.0}, model_u_start[] = {0.0}, model_x_start[] = {2.0, 0.0},
             model_x_nominal[] = {1.0, 1e-3};
const unsigned char model_p_tunable[] = {0};
int model_dependent(const double *p, double *d) {
    (void)p, (void)d;
    return 0;
}
int model_initial(double t, const double *u, const double *p, const double *d, const double *m,
                  const double *x_start, double *x) {
    UNUSED_POINT;
    x[0] = x_start[0];
    x[1] = x_start[1];
    return 0;
}
int model_rhs(MODEL_POINT, double *dx) {
    UNUSED_POINT;
    dx[0] = x[1];
    dx[1] = p[0] * (1.0 - x[0] * x[0]) * x[1] - x[0];
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
    (void)g;
    return 0;
}
int model_jacobian(MODEL_POINT, double *A, double *B, double *ft) {
    UNUSED_POINT;
    (void)B;
    A[0] = 0.0;
    A[1] = -2.0 * p[0] * x[0] * x[1] - 1.0;
    A[2] = 1.0;
    A[3] = p[0] * (1.0 - x[0] * x[0]);
    ft[0] = ft[1] = 0.0;
    return 0;
}
int model_directional(MODEL_POINT, const double *sx, const double *su, const double *sp, double *ddx, double *dw) {
    UNUSED_POINT;
    (void)su;
    ddx[0] = sx[1];
    ddx[1] = (-2.0 * p[0] * x[0] * x[1] - 1.0) * sx[0] + p[0] * (1.0 - x[0] * x[0]) * sx[1] +
             (1.0 - x[0] * x[0]) * x[1] * sp[0];
    dw[0] = sx[0];
    return 0;
}
