/* First-order plant y' = (r - F - y)/T under a PI controller with saturation and integrator hold.
 * e = w - y, z = K e + I, r = z limited to +-L, I' = K_i e h; the hold factor h fades linearly from 1 to 0 while z
 * passes the band beyond the limit. states y, I; inputs w (set point), F (disturbance).
 * relations: 0: z > L, 1: z > L + band, 2: z < -L, 3: z < -L - band. Output y, local r. */
#include "model.h"
#include "unused.h"
enum { K, KI, L, BAND, T, SPARE };
const double model_p_start[] = {5.0, 20.0, 1.0, 1e-3, 0.1, 0.0}, model_u_start[] = {0.0, 0.0},
             model_x_start[] = {0.0, 0.0}, model_x_nominal[] = {1.0, 1.0};
const unsigned char model_p_tunable[] = {1, 1, 1, 0, 1, 1};
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
typedef struct {
    double e, z, r, slope, hold, hold_slope; /* slope = dr/dz, hold_slope = dh/dz */
} Control;
static Control control(const double *x, const double *u, const double *p, const double *m) {
    Control c = {0};
    c.e = u[0] - x[0];
    c.z = p[K] * c.e + x[1];
    c.r = m[0] > 0.5 ? p[L] : m[2] > 0.5 ? -p[L] : c.z;
    c.slope = m[0] > 0.5 || m[2] > 0.5 ? 0.0 : 1.0;
    c.hold = m[1] > 0.5 || m[3] > 0.5 ? 0.0
             : m[0] > 0.5            ? 1.0 - (c.z - p[L]) / p[BAND]
             : m[2] > 0.5            ? 1.0 + (c.z + p[L]) / p[BAND]
                                     : 1.0;
    c.hold_slope = m[1] > 0.5 || m[3] > 0.5 ? 0.0 : m[0] > 0.5 ? -1.0 / p[BAND] : m[2] > 0.5 ? 1.0 / p[BAND] : 0.0;
    return c;
}
int model_rhs(MODEL_POINT, double *dx) {
    UNUSED_POINT;
    const Control c = control(x, u, p, m);
    dx[0] = (c.r - u[1] - x[0]) / p[T];
    dx[1] = p[KI] * c.e * c.hold;
    return 0;
}
int model_outputs(MODEL_POINT, double *y) {
    UNUSED_POINT;
    y[0] = x[0];
    return 0;
}
int model_algebraic(MODEL_POINT, double *w) {
    UNUSED_POINT;
    w[0] = x[0];
    w[1] = control(x, u, p, m).r;
    return 0;
}
int model_indicators(MODEL_POINT, double *g) {
    UNUSED_POINT;
    const double z = p[K] * (u[0] - x[0]) + x[1];
    g[0] = z - p[L];
    g[1] = z - (p[L] + p[BAND]);
    g[2] = -p[L] - z;
    g[3] = -(p[L] + p[BAND]) - z;
    return 0;
}
int model_jacobian(MODEL_POINT, double *A, double *B, double *ft) {
    UNUSED_POINT;
    const Control c = control(x, u, p, m);
    const double steep = p[KI] * c.e * c.hold_slope;
    A[0] = (-c.slope * p[K] - 1.0) / p[T];
    A[1] = -p[KI] * c.hold - steep * p[K];
    A[2] = c.slope / p[T];
    A[3] = steep;
    B[0] = c.slope * p[K] / p[T];
    B[1] = p[KI] * c.hold + steep * p[K];
    B[2] = -1.0 / p[T];
    B[3] = 0.0;
    ft[0] = ft[1] = 0.0;
    return 0;
}
int model_directional(MODEL_POINT, const double *sx, const double *su, const double *sp, double *ddx, double *dw) {
    UNUSED_POINT;
    const Control c = control(x, u, p, m);
    const double limit = m[0] > 0.5 ? 1.0 : m[2] > 0.5 ? -1.0 : 0.0;
    const double inside = c.hold_slope != 0.0 ? 1.0 / p[BAND] : 0.0;
    const double se = su[0] - sx[0], sz = p[K] * se + c.e * sp[K] + sx[1], sr = c.slope * sz + limit * sp[L];
    const double beyond = (limit > 0.0 ? c.z - p[L] : -c.z - p[L]);
    const double sh = c.hold_slope * sz + inside * (sp[L] + beyond / p[BAND] * sp[BAND]);
    ddx[0] = (sr - su[1] - sx[0]) / p[T] - (c.r - u[1] - x[0]) / (p[T] * p[T]) * sp[T];
    ddx[1] = p[KI] * (se * c.hold + c.e * sh) + c.e * c.hold * sp[KI];
    dw[0] = sx[0];
    dw[1] = sr;
    return 0;
}
