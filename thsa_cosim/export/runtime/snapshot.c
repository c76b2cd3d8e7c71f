/* snapshot.c - saved FMU states (FMI 2.0.4 section 2.1.8, FMI 3.0.1 section 2.2.10).
 *
 * A snapshot is a header and a copy of State, which holds no pointers. The byte form carries a checksum; reading
 * bytes of another model, kind, build layout, or damaged bytes is refused.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "instance.h"

typedef struct {
    char magic[8];
    uint64_t model;     /* hash of the GUID and the sizes */
    uint64_t checksum;  /* of the State that follows */
    int32_t kind, size;
} Header;

struct Snapshot {
    Header header;
    State state;
};

static uint64_t hash(uint64_t seed, const void *bytes, size_t n) { /* FNV-1a, 64 bit */
    const unsigned char *p = bytes;
    for (size_t i = 0; i < n; i++) seed = (seed ^ p[i]) * UINT64_C(1099511628211);
    return seed;
}

static uint64_t model_hash(void) {
    const int sizes[] = {N_X, N_U, N_P, N_D, N_W, N_Y, N_G};
    const uint64_t seed = hash(UINT64_C(14695981039346656037), model_guid, strlen(model_guid) + 1);
    return hash(seed, sizes, sizeof sizes);
}

static void describe(const Instance *c, const State *state, Header *out) {
    memset(out, 0, sizeof *out);
    memcpy(out->magic, "thsaFMU1", 8);
    out->model = model_hash();
    out->checksum = hash(UINT64_C(14695981039346656037), state, sizeof *state);
    out->kind = (int32_t)c->kind;
    out->size = (int32_t)sizeof *state;
}

static Status refuse(Instance *c, const char *why) {
    instance_log(c, FAILED, LOG_ERROR, "%s", why);
    return FAILED;
}

Status snapshot_take(Instance *c, Snapshot **out) {
    if (!*out) *out = calloc(1, sizeof(Snapshot));
    if (!*out) return refuse(c, "out of memory for an FMU state");
    memcpy(&(*out)->state, &c->s, sizeof c->s);
    describe(c, &(*out)->state, &(*out)->header);
    return OK;
}

Status snapshot_restore(Instance *c, const Snapshot *in) {
    Header expected;
    describe(c, &in->state, &expected);
    if (memcmp(&expected, &in->header, sizeof expected) != 0)
        return refuse(c, "the FMU state does not belong to this model and kind of instance");
    memcpy(&c->s, &in->state, sizeof c->s);
    c->factors_of = -1;
    instance_changed(c);
    return OK;
}

void snapshot_free(Snapshot **in) {
    free(*in);
    *in = NULL;
}

size_t snapshot_size(void) { return sizeof(Snapshot); }

void snapshot_write(const Snapshot *in, unsigned char *bytes) { memcpy(bytes, in, sizeof *in); }

Status snapshot_read(Instance *c, const unsigned char *bytes, size_t size, Snapshot **out) {
    Header expected, found;
    Snapshot *copy;
    if (size != sizeof(Snapshot)) return refuse(c, "the serialized FMU state has the wrong size");
    copy = malloc(sizeof *copy);
    if (!copy) return refuse(c, "out of memory for an FMU state");
    memcpy(copy, bytes, sizeof *copy);
    found = copy->header;
    describe(c, &copy->state, &expected);
    if (memcmp(&expected, &found, sizeof expected) != 0) {
        free(copy);
        return refuse(c, "the serialized FMU state is damaged or belongs to another model");
    }
    if (*out) free(*out);
    *out = copy;
    return OK;
}
