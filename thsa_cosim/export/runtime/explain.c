/* explain.c - why something cannot be computed, in the words of the model: its loops, states and relations. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "explain.h"

enum { LONG = 480, WATCHED = 20, MOST_NAMED = 4 };

static const char *name_of(Group group, int k, char *text, size_t size) {
    static const char *const kinds[] = {"state", "derivative", "relation", "discrete variable"};
    static const int first[] = {0, 0, N_X, N_X + N_G};
#if N_TEXTS
    const char *shown = model_text[first[group] + k];
    (void)kinds;
    if (group == DERIVATIVES)
        snprintf(text, size, "der(%s)", shown);
    else
        snprintf(text, size, "%s", shown);
#else
    (void)first;
    snprintf(text, size, "%s %d", kinds[group], k);
#endif
    return text;
}

const char *explain_relation(int k, char *text, size_t size) { return name_of(RELATIONS, k, text, size); }

/* The loop whose solution was last sought in vain, NULL = none: model.c notes it behind the cache. */
static const char *unsolved(const Instance *c) {
#if N_TEXTS && N_LOOPS
    const double noted = c->s.d[N_D + N_CACHE - 1];
    if (noted >= 1.0 && noted <= N_LOOPS) return model_text[N_X + N_G + N_Z + (int)noted - 1];
#else
    (void)c;
#endif
    return NULL;
}

/* The first division by 0 at the present point, NULL = none. */
static const char *divided(const Instance *c) {
#if N_PIVOTS
    const State *s = &c->s;
    double by[N_PIVOTS];
    if (model_pivots(s->now.time, s->now.x, s->now.u, s->p, s->d, s->now.m, by)) return NULL;
    for (int k = 0; k < N_PIVOTS; k++)
        if (by[k] == 0.0) return model_text[N_X + N_G + N_Z + N_LOOPS + k];
#else
    (void)c;
#endif
    return NULL;
}

Status explain_failure(Instance *c, Status status, const char *why, Group group, const double *values, int n) {
    const Category category = status == DISCARD ? LOG_DISCARD : LOG_ERROR;
    const char *reason = unsolved(c);
    char text[LONG] = "", name[LONG];
    int k = 0;
    while (k < n && is_finite(values[k])) k++;
    if (!reason) reason = divided(c);
    if (reason)
        snprintf(text, sizeof text, ": %s", reason);
    else if (k < n)
        snprintf(text, sizeof text, ": %.400s is not a finite number", name_of(group, k, name, sizeof name));
    instance_log(c, status, category, "%s at time %.15g%s", why, c->s.now.time, text);
    return status;
}

void explain_watch(Instance *c, int turn, int most) {
    if (turn < most - WATCHED) return;
    if (turn == most - WATCHED) memset(c->restless, 0, sizeof c->restless);
    for (int k = 0; turn > most - WATCHED && k < N_M; k++) c->restless[k] |= c->watched[k] != c->s.now.m[k];
    memcpy(c->watched, c->s.now.m, sizeof c->watched);
}

Status explain_unsettled(Instance *c, Status status, const char *why) {
    char text[LONG] = "", name[LONG];
    int named = 0;
    size_t used = 0;
    for (int k = 0; k < N_G + N_Z && named < MOST_NAMED; k++) {
        if (!c->restless[k]) continue;
        name_of(k < N_G ? RELATIONS : DISCRETES, k < N_G ? k : k - N_G, name, sizeof name);
        const int more = snprintf(text + used, sizeof text - used, "%s%.100s", named++ ? ", " : ": ", name);
        used += (size_t)(more > 0 ? more : 0);
    }
    if (named) snprintf(text + used, sizeof text - used, " change%s again and again", named > 1 ? "" : "s");
    instance_log(c, status, status == DISCARD ? LOG_DISCARD : LOG_ERROR, "%s at time %.15g%s", why, c->s.now.time, text);
    return status;
}

Status explain_slowness(Instance *c, const char *why) {
    char relation[LONG / 2] = "", state[LONG / 2] = "", name[LONG / 4];
    int often = 0, worst = 0;
    for (int k = 1; k < N_G; k++) often = c->sought[k] > c->sought[often] ? k : often;
    if (N_G && c->sought[often] > 1)
        snprintf(relation, sizeof relation, "; %ld events of %s", c->sought[often],
                 explain_relation(often, name, sizeof name));
#if N_X
    double most = 0.0;
    for (int k = 0; k < MOVERS(c); k++) {
        const int n = MOVER(c, k);
        const double size = fmax(fabs(c->s.now.x[n]), fabs(c->x_new[n]));
        const double scaled = fabs(c->stage[RODAS_STAGES - 1][k]) / (model_x_nominal[n] + size);
        if (!(scaled <= most)) most = scaled, worst = n; /* what is no number is the worst */
    }
    snprintf(state, sizeof state, "; %s limits the step size", name_of(STATES, worst, name, sizeof name));
#endif
    (void)worst;
    instance_log(c, DISCARD, LOG_DISCARD, "%s at time %.15g%s%s", why, c->s.now.time, relation, state);
    return DISCARD;
}
