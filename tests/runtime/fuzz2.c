/* Random FMI 2.0 calls, valid and not, in random order; meant for AddressSanitizer and UBSan.
 * Arguments: number of sequences, calls in each. Values that are returned as OK are finite. */
#include "fuzz.h"
#include "fmi2Functions.h"
#include "trajectory.h"

fmi2Status thsaTrajectory1(fmi2Component, Trajectory *);

static long messages;

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...) {
    (void)environment, (void)status;
    messages += (long)(strlen(name) + strlen(category) + strlen(message));
}

static unsigned long long first;

static void sequence(int calls) {
    const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    fmi2Component c = fmi2Instantiate("fuzz", any(2) ? fmi2CoSimulation : fmi2ModelExchange, MODEL_GUID, NULL,
                                      &callbacks, fmi2False, any(4) == 0);
    fmi2FMUstate saved[3] = {NULL, NULL, NULL};
    fmi2Byte bytes[20000];
    double now = 0.0;
    CHECK(c);
    for (int i = 0; i < calls; i++) {
        unsigned vr[MOST], wr[MOST];
        double v[MOST], w[N_X + N_G + MOST];
        int order[MOST] = {1, 1, 1, 1}, flag, other;
        const size_t n = any(MOST + 1), slot = any(3);
        size_t size = 0;
        fmi2EventInfo info;
        fmi2Status status = fmi2OK;
        references(vr);
        references(wr);
        values(v);
        memset(w, 0, sizeof w);
        if (!any(10)) order[0] = (int)any(3);
        switch (any(34)) {
        case 0: fmi2SetupExperiment(c, any(2), value(), any(4) ? 0.0 : value(), any(2), 100.0 * value()); break;
        case 1: case 2: fmi2EnterInitializationMode(c); break;
        case 3: case 4: fmi2ExitInitializationMode(c); break;
        case 5: if (!any(8)) fmi2Terminate(c); break;
        case 6: if (!any(8)) fmi2Reset(c); break;
        case 7: case 8: case 9: {
            const unsigned *asked = MAYBE(vr);
            double *filled = MAYBE(w);
            status = fmi2GetReal(c, asked, n, filled);
            if (status == fmi2OK)
                for (size_t k = 0; k < n; k++) CHECK(isfinite(w[k]));
            break;
        }
        case 10: case 11: status = fmi2SetReal(c, MAYBE(vr), n, MAYBE(v)); break;
        case 12: fmi2GetInteger(c, vr, any(2), NULL); fmi2SetBoolean(c, vr, any(2), NULL); break;
        case 13: status = fmi2GetFMUstate(c, MAYBE(&saved[slot])); break;
        case 14: status = fmi2SetFMUstate(c, saved[slot]); break;
        case 15: fmi2FreeFMUstate(c, MAYBE(&saved[slot])); break;
        case 16:
            if (fmi2SerializedFMUstateSize(c, saved[slot], MAYBE(&size)) != fmi2OK) break;
            CHECK(size <= sizeof bytes);
            CHECK(fmi2SerializeFMUstate(c, saved[slot], bytes, size) == fmi2OK);
            if (!any(3)) bytes[any((unsigned)size)] ^= (fmi2Byte)(1 << any(8));
            fmi2DeSerializeFMUstate(c, bytes, any(4) ? size : any((unsigned)size), &saved[any(3)]);
            break;
        case 17: fmi2GetDirectionalDerivative(c, MAYBE(vr), n, MAYBE(wr), any(MOST + 1), MAYBE(v), MAYBE(w)); break;
        case 18: fmi2EnterEventMode(c); break;
        case 19: fmi2NewDiscreteStates(c, MAYBE(&info)); break;
        case 20: case 21: fmi2EnterContinuousTimeMode(c); break;
        case 22: fmi2CompletedIntegratorStep(c, any(2), MAYBE(&flag), MAYBE(&other)); break;
        case 23: fmi2SetTime(c, value()); break;
        case 24: {
            double x[N_X + 1];
            for (int k = 0; k < N_X; k++) x[k] = value();
            fmi2SetContinuousStates(c, MAYBE(x), any(10) ? N_X : 0);
            break;
        }
        case 25:
            fmi2GetDerivatives(c, MAYBE(w), any(10) ? N_X : 0);
            fmi2GetContinuousStates(c, MAYBE(w), N_X);
            fmi2GetNominalsOfContinuousStates(c, MAYBE(w), N_X);
            break;
        case 26: fmi2GetEventIndicators(c, MAYBE(w), any(10) ? N_G : 0); break;
        case 27: fmi2SetRealInputDerivatives(c, MAYBE(vr), n, order, MAYBE(v)); break;
        case 28: fmi2GetRealOutputDerivatives(c, MAYBE(vr), n, order, MAYBE(w)); break;
        case 29: fmi2GetRealStatus(c, (fmi2StatusKind)any(5), MAYBE(w)); fmi2CancelStep(c); break;
        case 30: {
            const double zero[MOST] = {0.0};
            double times[MOST], starts[2], course[2 * MOST], slopes[2 * MOST], rows[MOST * MOST];
            Trajectory run = {any(3), 1 + any(2), n, 1 + any(MOST), wr, starts, course, slopes, vr, times, rows,
                              NULL, 0, 0, 0, 0, 0.0};
            const unsigned time = 0;
            if (fmi2GetReal(c, &time, 1, &now) != fmi2OK) break;
            starts[0] = now, starts[1] = now + 0.05;
            for (int k = 0; k < MOST; k++) times[k] = now + (any(30) ? 0.03 * k : value());
            for (int k = 0; k < 2 * MOST; k++) {
                course[k] = any(50) ? 0.1 * (double)any(9) : value();
                slopes[k] = (double)any(3);
            }
            for (size_t k = 0; k < run.n_inputs; k++) wr[k] = any(20) ? VR_U + any(N_U + 1) : wr[k];
            if (!any(20)) run.times = zero;
            if (!any(40)) run.n_times = 0;
            status = thsaTrajectory1(c, MAYBE(&run));
            if (status == fmi2OK)
                for (size_t k = 0; k < run.n_outputs * run.n_times; k++) CHECK(isfinite(rows[k]));
            break;
        }
        default: {
            const double steps[] = {0.0, 1e-3, 1e-2, 0.1, 0.1, 1e-9};
            const unsigned time = 0;
            if (fmi2GetReal(c, &time, 1, &now) != fmi2OK) break;
            fmi2DoStep(c, any(30) ? now : value(), any(30) ? steps[any(6)] : value(), any(2));
        }
        }
        CHECK(status >= fmi2OK && status <= fmi2Error);
    }
    for (int k = 0; k < 3; k++) fmi2FreeFMUstate(c, &saved[k]);
    fmi2FreeInstance(c);
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
