/* x' = -k x, x(0) = 1: one state, no input; time constant 1/k as a calculated parameter. */
#include "model.h"
#include "unused.h"
const double model_p_start[] = {1.0}, model_u_start[] = {0.0}, model_x_start[] = {1.0}, model_x_nominal[] = {1.0};
const unsigned char model_p_tunable[] = {1};
int model_dependent(const double *p, double *d) { return p[0] == 0.0 ? 1 : (d[0] = 1.0 / p[0], 0); }
int model_initial(double t, const double *u, const double *p, const double *d, const double *m,
                  const double *x_start, double *x) {
    UNUSED_POINT;
    x[0] = x_start[0];
    return 0;
}
int model_rhs(MODEL_POINT, double *dx) {
    UNUSED_POINT;
    dx[0] = -p[0] * x[0];
    return 0;
}
int model_outputs(MODEL_POINT, double *w) {
    UNUSED_POINT;
    w[0] = x[0];
    return 0;
}
int model_algebraic(MODEL_POINT, double *w) {
    UNUSED_POINT;
    w[0] = x[0];
    w[1] = x[0] * x[0] * d[0];
    return 0;
}
int model_indicators(MODEL_POINT, double *g) {
    UNUSED_POINT;
    (void)g;
    return 0;
}
int model_jacobian(MODEL_POINT, double *A, double *B, double *ft) {
    UNUSED_POINT;
    (void)B;
    A[0] = -p[0];
    ft[0] = 0.0;
    return 0;
}
int model_directional(MODEL_POINT, const double *sx, const double *su, const double *sp, double *ddx, double *dw) {
    UNUSED_POINT;
    (void)su;
    ddx[0] = -p[0] * sx[0] - x[0] * sp[0];
    dw[0] = sx[0];
    dw[1] = 2.0 * x[0] * d[0] * sx[0] - x[0] * x[0] / (p[0] * p[0]) * sp[0];
    return 0;
}
