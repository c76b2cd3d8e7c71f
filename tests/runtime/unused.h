/* Silences -Wextra where a hand-written model needs only some of the arguments of the C interface. */
#define UNUSED_POINT (void)t, (void)x, (void)u, (void)p, (void)d, (void)m
