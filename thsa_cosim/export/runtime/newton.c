/* newton.c - damped Newton iteration from the last solution (Deuflhard, Newton Methods for Nonlinear Problems, 3.3).
 *
 * A step is accepted when the simplified correction that follows it is smaller than the step itself (natural
 * monotonicity), halved otherwise. Converged: the correction is rounding noise of the unknowns.
 */
#include <float.h>
#include <math.h>
#include <string.h>
#include "newton.h"

enum { MOST_TURNS = 200, MOST_HALVINGS = 40 };

/* v becomes the solution for one right-hand side, given the LU factors in matrix. */
static void substitute(int n, const double *matrix, const int *pivot, double *v) {
    for (int k = 0; k < n; k++) {
        const double swap = v[k];
        v[k] = v[pivot[k]];
        v[pivot[k]] = swap;
        for (int i = k + 1; i < n; i++) v[i] -= matrix[k * n + i] * v[k];
    }
    for (int k = n - 1; k >= 0; k--) {
        v[k] /= matrix[k * n + k];
        for (int i = 0; i < k; i++) v[i] -= matrix[k * n + i] * v[k];
    }
}

int newton_linear(int n, int columns, double *matrix, double *b, int *pivot) {
    for (int k = 0; k < n; k++) {
        double *col = matrix + k * n;
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(col[i]) > fabs(col[best])) best = i;
        pivot[k] = best;
        if (!(fabs(col[best]) > 0.0) || col[best] - col[best] != 0.0) return 1;
        if (best != k)
            for (int j = k; j < n; j++) { /* factors found already stay: substitute() swaps in this order, too */
                const double swap = matrix[j * n + k];
                matrix[j * n + k] = matrix[j * n + best];
                matrix[j * n + best] = swap;
            }
        for (int i = k + 1; i < n; i++) col[i] /= col[k];
        for (int j = k + 1; j < n; j++) {
            const double factor = matrix[j * n + k];
            if (factor == 0.0) continue;
            for (int i = k + 1; i < n; i++) matrix[j * n + i] -= factor * col[i];
        }
    }
    for (int c = 0; c < columns; c++) substitute(n, matrix, pivot, b + c * n);
    return 0;
}

static double size_of(int n, const double *step, const double *y) {
    double worst = 0.0;
    for (int i = 0; i < n; i++) {
        const double scaled = fabs(step[i]) / (1e-3 + fabs(y[i]));
        if (!(scaled <= worst)) worst = scaled;
    }
    return worst;
}

static int all_numbers(int n, const double *v) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += v[i] - v[i];
    return sum == 0.0;
}

int newton_solve(int n, double *y, Residual residual, const Point *at, double *work, int *pivot) {
    double *matrix = work, *step = work + n * n, *from = step + n, *first = from + n, *next = first + n;
    memcpy(first, y, sizeof(double) * n);
    for (int turn = 0; turn < MOST_TURNS; turn++) {
        double lambda = 1.0;
        int halvings = 0;
        if (residual(at, step, matrix) || !all_numbers(n, step)) break;
        if (newton_linear(n, 1, matrix, step, pivot) || !all_numbers(n, step)) break;
        const double length = size_of(n, step, y);
        memcpy(from, y, sizeof(double) * n);
        if (length < 1e-13) return 0;
        for (;; halvings++) {
            double correction = 0.0; /* the simplified one that follows, in next */
            int good;
            for (int i = 0; i < n; i++) y[i] = from[i] - lambda * step[i];
            good = !residual(at, next, NULL) && all_numbers(n, next);
            if (good) {
                substitute(n, matrix, pivot, next);
                good = all_numbers(n, next);
                correction = size_of(n, next, from); /* in the units of the step, or the two cannot be compared */
            }
            if (good && (correction <= (1.0 - 0.25 * lambda) * length || correction < 1e-13)) {
                if (lambda == 1.0 && correction < 1e-10) { /* the simplified correction is exact enough to be taken */
                    for (int i = 0; i < n; i++) y[i] -= next[i];
                    return 0;
                }
                break;
            }
            if (length < 1e-9 && good) return 0; /* rounding noise of the residual: no step gains any more */
            if (halvings >= MOST_HALVINGS) {
                memcpy(y, first, sizeof(double) * n);
                return 1;
            }
            lambda *= 0.5;
        }
    }
    memcpy(y, first, sizeof(double) * n);
    return 1;
}
