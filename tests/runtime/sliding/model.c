/* x' = -1 where x > 0, else +1: outside the contract (discontinuous), chatters for ever in exact event handling. */
#include "model.h"
#include "unused.h"
const double model_p_start[] = {0.0}, model_u_start[] = {0.0}, model_x_start[] = {0.3}, model_x_nominal[] = {1.0};
const unsigned char model_p_tunable[] = {0};
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
int model_rhs(MODEL_POINT, double *dx) {
    UNUSED_POINT;
    dx[0] = m[0] > 0.5 ? -1.0 : 1.0;
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
    g[0] = x[0];
    return 0;
}
int model_jacobian(MODEL_POINT, double *A, double *B, double *ft) {
    UNUSED_POINT;
    (void)B;
    A[0] = ft[0] = 0.0;
    return 0;
}
int model_directional(MODEL_POINT, const double *sx, const double *su, const double *sp, double *ddx, double *dw) {
    UNUSED_POINT;
    (void)su, (void)sp;
    ddx[0] = 0.0;
    dw[0] = sx[0];
    return 0;
}
