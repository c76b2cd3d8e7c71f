/* Random FMI 3.0 calls, valid and not, in random order; meant for AddressSanitizer and UBSan.
 * Arguments: number of sequences, calls in each. Values that are returned as OK are finite. */
#include "fuzz.h"
#include "fmi3Functions.h"
#include "trajectory.h"

fmi3Status thsaTrajectory1(fmi3Instance, Trajectory *);

static long messages;
static unsigned long long first;

static void logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    (void)environment, (void)status;
    messages += (long)(strlen(category) + strlen(message));
}

static void update(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean may_set, fmi3Boolean may_get,
                   fmi3Boolean finished, fmi3Boolean may_return, fmi3Boolean *asked, fmi3Float64 *at) {
    fmi3Instance c = *(fmi3Instance *)environment;
    const unsigned vr = any(VR_END);
    double v = sin(3.0 * time);
    (void)may_set, (void)may_get, (void)finished, (void)may_return, (void)asked, (void)at;
    if (any(2)) fmi3SetFloat64(c, &vr, 1, &v, 1);
    else fmi3GetFloat64(c, &vr, 1, &v, 1);
    if (!any(50)) fmi3Reset(c); /* forbidden here */
}

static void sequence(int calls) {
    fmi3Instance c = NULL;
    const unsigned required[] = {VR_U, VR_W};
    fmi3FMUState saved[3] = {NULL, NULL, NULL};
    fmi3Byte bytes[20000];
    double now = 0.0;
    if (any(2))
        c = fmi3InstantiateModelExchange("fuzz", MODEL_GUID, NULL, fmi3False, any(4) == 0, &c, logger);
    else
        c = fmi3InstantiateCoSimulation("fuzz", MODEL_GUID, NULL, fmi3False, any(4) == 0, any(2), any(2), required,
                                        any(3), &c, logger, any(2) ? update : NULL);
    CHECK(c);
    for (int i = 0; i < calls; i++) {
        unsigned vr[MOST], wr[MOST];
        double v[MOST], w[N_X + N_G + MOST];
        int order[MOST] = {1, 1, 1, 1};
        fmi3Boolean flag[5];
        const size_t n = any(MOST + 1), m = any(MOST + 1), slot = any(3);
        size_t size = 0;
        references(vr);
        references(wr);
        values(v);
        memset(w, 0, sizeof w);
        switch (any(32)) {
        case 0: case 1: case 2:
            fmi3EnterInitializationMode(c, any(2), value(), any(4) ? 0.0 : value(), any(2), 100.0 * value());
            break;
        case 3: case 4: fmi3ExitInitializationMode(c); break;
        case 5: if (!any(8)) fmi3Terminate(c); break;
        case 6: if (!any(8)) fmi3Reset(c); break;
        case 7: case 8: case 9: {
            const unsigned *asked = MAYBE(vr);
            double *filled = MAYBE(w);
            if (fmi3GetFloat64(c, asked, n, filled, any(20) ? n : n + 1) == fmi3OK)
                for (size_t k = 0; k < n; k++) CHECK(isfinite(w[k]));
            break;
        }
        case 10: case 11: fmi3SetFloat64(c, MAYBE(vr), n, MAYBE(v), any(20) ? n : n + 1); break;
        case 12: fmi3GetInt32(c, vr, any(2), NULL, 0); fmi3SetString(c, vr, any(2), NULL, 0); break;
        case 13: fmi3GetFMUState(c, MAYBE(&saved[slot])); break;
        case 14: fmi3SetFMUState(c, saved[slot]); break;
        case 15: fmi3FreeFMUState(c, MAYBE(&saved[slot])); break;
        case 16:
            if (fmi3SerializedFMUStateSize(c, saved[slot], MAYBE(&size)) != fmi3OK) break;
            CHECK(size <= sizeof bytes);
            CHECK(fmi3SerializeFMUState(c, saved[slot], bytes, size) == fmi3OK);
            if (!any(3)) bytes[any((unsigned)size)] ^= (fmi3Byte)(1 << any(8));
            fmi3DeserializeFMUState(c, bytes, any(4) ? size : any((unsigned)size), &saved[any(3)]);
            break;
        case 17: fmi3GetDirectionalDerivative(c, MAYBE(vr), n, MAYBE(wr), m, MAYBE(v), m, MAYBE(w), n); break;
        case 18: fmi3GetAdjointDerivative(c, MAYBE(vr), n, MAYBE(wr), m, MAYBE(v), n, MAYBE(w), m); break;
        case 19: fmi3EnterEventMode(c); break;
        case 20:
            fmi3UpdateDiscreteStates(c, MAYBE(flag), flag + 1, flag + 2, flag + 3, flag + 4, MAYBE(w));
            fmi3EvaluateDiscreteStates(c);
            break;
        case 21: fmi3EnterContinuousTimeMode(c); fmi3EnterStepMode(c); break;
        case 22: fmi3CompletedIntegratorStep(c, any(2), MAYBE(flag), MAYBE(flag + 1)); break;
        case 23: fmi3SetTime(c, value()); break;
        case 24: {
            double x[N_X + 1];
            for (int k = 0; k < N_X; k++) x[k] = value();
            fmi3SetContinuousStates(c, MAYBE(x), any(10) ? N_X : 0);
            break;
        }
        case 25:
            fmi3GetContinuousStateDerivatives(c, MAYBE(w), any(10) ? N_X : 0);
            fmi3GetContinuousStates(c, MAYBE(w), N_X);
            fmi3GetNominalsOfContinuousStates(c, MAYBE(w), N_X);
            break;
        case 26: fmi3GetEventIndicators(c, MAYBE(w), any(10) ? N_G : 0); break;
        case 27: fmi3GetOutputDerivatives(c, MAYBE(vr), n, order, MAYBE(w), n); break;
        case 28: fmi3EnterConfigurationMode(c); fmi3GetShiftDecimal(c, vr, n, w); break;
        case 29: {
            const double zero[MOST] = {0.0};
            double times[MOST], starts[2], course[2 * MOST], slopes[2 * MOST], rows[MOST * MOST];
            Trajectory run = {any(3), 1 + any(2), n, 1 + any(MOST), wr, starts, course, slopes, vr, times, rows,
                              NULL, 0, 0, 0, 0, 0.0};
            const unsigned time = 0;
            if (fmi3GetFloat64(c, &time, 1, &now, 1) != fmi3OK) break;
            starts[0] = now, starts[1] = now + 0.05;
            for (int k = 0; k < MOST; k++) times[k] = now + (any(30) ? 0.03 * k : value());
            for (int k = 0; k < 2 * MOST; k++) {
                course[k] = any(50) ? 0.1 * (double)any(9) : value();
                slopes[k] = (double)any(3);
            }
            for (size_t k = 0; k < run.n_inputs; k++) wr[k] = any(20) ? VR_U + any(N_U + 1) : wr[k];
            if (!any(20)) run.times = zero;
            if (!any(40)) run.n_times = 0;
            if (thsaTrajectory1(c, any(40) ? &run : NULL) == fmi3OK)
                for (size_t k = 0; k < run.n_outputs * run.n_times; k++) CHECK(isfinite(rows[k]));
            break;
        }
        default: {
            const double steps[] = {0.0, 1e-3, 1e-2, 0.1, 0.1, 1e-9};
            const unsigned time = 0;
            if (fmi3GetFloat64(c, &time, 1, &now, 1) != fmi3OK) break;
            fmi3DoStep(c, any(30) ? now : value(), any(30) ? steps[any(6)] : value(), any(2), MAYBE(flag), flag + 1,
                       flag + 2, MAYBE(w));
        }
        }
    }
    for (int k = 0; k < 3; k++) fmi3FreeFMUState(c, &saved[k]);
    fmi3FreeInstance(c);
}

int main(int count, char **arguments) {
    const int sequences = count > 1 ? atoi(arguments[1]) : 100, calls = count > 2 ? atoi(arguments[2]) : 200;
    for (int i = 0; i < sequences; i++) {
        seed_ = first = (unsigned long long)i + 1;
        sequence(calls);
    }
    printf("%d sequences, %ld bytes of messages\n", sequences, messages);
    return 0;
}
