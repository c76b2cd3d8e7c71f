/* What the two random callers share: a reproducible generator and random arguments. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model_config.h"

enum { MOST = 4 };

static uint64_t seed_;

static unsigned any(unsigned n) { /* 0 .. n-1 */
    seed_ = seed_ * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (unsigned)(seed_ >> 33) % n;
}

static double value(void) {
    static const double special[] = {0.0, 1.0, -1.0, 1e-7, -1e-7, 50.0, 0.05, 1e-3, (double)NAN, (double)INFINITY};
    return any(3) ? special[any(any(8) ? 8 : 10)] : any(1000001) * 4e-6 - 2.0;
}

static void references(unsigned *vr) {
    for (int i = 0; i < MOST; i++) vr[i] = any(60) ? any(VR_END) : any(2) ? VR_END + any(3) : 4294967295u;
}

static void values(double *v) {
    for (int i = 0; i < MOST; i++) v[i] = value();
}

#define MAYBE(pointer) (any(40) ? (pointer) : NULL)
#define CHECK(condition)                                                             \
    do {                                                                             \
        if (!(condition)) {                                                          \
            printf("line %d: %s fails (seed %llu)\n", __LINE__, #condition, first);  \
            exit(1);                                                                 \
        }                                                                            \
    } while (0)
