/* Three states, two inputs, explicit time: x0' = -a x0 + u0, x1' = x0 - b x1 + 2 u1 + c cos(t), x2' = x1 - 1000 x2.
 * calculated: a*b; outputs x0, x1 + u0 + sin(t), q x2; local x0 + x2. */
#include <math.h>
#include "model.h"
#include "unused.h"
enum { A_, B_, C_, Q_ };
const double model_p_start[] = {0.5, 2.0, 1.0, 3.0}, model_u_start[] = {0.0, 0.0},
             model_x_start[] = {1.0, 0.0, 0.0}, model_x_nominal[] = {1.0, 1.0, 1e-3};
const unsigned char model_p_tunable[] = {1, 1, 1, 1};
int model_dependent(const double *p, double *d) {
    d[0] = p[A_] * p[B_];
    return 0;
}
int model_initial(double t, const double *u, const double *p, const double *d, const double *m,
                  const double *x_start, double *x) {
    UNUSED_POINT;
    for (int i = 0; i < 3; i++) x[i] = x_start[i];
    return 0;
}
int model_rhs(MODEL_POINT, double *dx) {
    UNUSED_POINT;
    dx[0] = -p[A_] * x[0] + u[0];
    dx[1] = x[0] - p[B_] * x[1] + 2.0 * u[1] + p[C_] * cos(t);
    dx[2] = x[1] - 1000.0 * x[2];
    return 0;
}
int model_outputs(MODEL_POINT, double *w) {
    UNUSED_POINT;
    w[0] = x[0];
    w[1] = x[1] + u[0] + sin(t);
    w[2] = p[Q_] * x[2];
    return 0;
}
int model_algebraic(MODEL_POINT, double *w) {
    w[3] = x[0] + x[2];
    return model_outputs(t, x, u, p, d, m, w);
}
int model_indicators(MODEL_POINT, double *g) {
    UNUSED_POINT;
    (void)g;
    return 0;
}
int model_jacobian(MODEL_POINT, double *A, double *B, double *ft) {
    UNUSED_POINT;
    const double a[] = {-p[A_], 1.0, 0.0, 0.0, -p[B_], 1.0, 0.0, 0.0, -1000.0}, b[] = {1.0, 0.0, 0.0, 0.0, 2.0, 0.0};
    for (int i = 0; i < 9; i++) A[i] = a[i];
    for (int i = 0; i < 6; i++) B[i] = b[i];
    ft[0] = ft[2] = 0.0;
    ft[1] = -p[C_] * sin(t);
    return 0;
}
int model_directional(MODEL_POINT, const double *sx, const double *su, const double *sp, double *ddx, double *dw) {
    UNUSED_POINT;
    ddx[0] = -p[A_] * sx[0] + su[0] - x[0] * sp[A_];
    ddx[1] = sx[0] - p[B_] * sx[1] + 2.0 * su[1] - x[1] * sp[B_] + cos(t) * sp[C_];
    ddx[2] = sx[1] - 1000.0 * sx[2];
    dw[0] = sx[0];
    dw[1] = sx[1] + su[0];
    dw[2] = p[Q_] * sx[2] + x[2] * sp[Q_];
    dw[3] = sx[0] + sx[2];
    return 0;
}
