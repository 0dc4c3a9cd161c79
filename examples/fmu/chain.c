/* A planar two-link chain as an FMU of FMI 2.0, for Model Exchange and Co-Simulation: closed forms.
 *
 *     mkdir -p binaries/linux64
 *     cc -O2 -shared -fPIC -o binaries/linux64/chain.so chain.c -lm
 *     python -m zipfile -c chain.fmu modelDescription.xml binaries
 *     twolink conform fmu:chain.fmu
 *
 * On macOS, the binary is binaries/darwin64/chain.dylib. The numbers of the variables are those of
 * modelDescription.xml. Joint angles: angle1 from x, angle2 from link 1; y points down. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { OK = 0, ERROR = 3 };
enum {
    MASS, LENGTH = 2, ALONG = 4, ACROSS = 6, INERTIA = 8, GRAVITY = 10, DAMPING, ARMATURE = 13,
    TORQUE = 15, STATE = 17, RATE = 21, OUTPUT = 25, COUNT = 31
};

typedef struct { double v[COUNT]; int exchange; } Chain;

/* M (M11, M12, M22) with rotors, and the torques of gravity, centrifugal and Coriolis forces and dampers. */
static void equations(const double *v, const double *x, double *M, double *R) {
    const double *m = v + MASS, *a = v + ALONG, *b = v + ACROSS, L = v[LENGTH], *w = x + 2;
    double c2 = cos(x[1]), s2 = sin(x[1]), c12 = cos(x[0] + x[1]), s12 = sin(x[0] + x[1]);
    double X = m[1] * L * (a[1] * c2 - b[1] * s2), h = m[1] * L * (a[1] * s2 + b[1] * c2);
    double G2 = -v[GRAVITY] * m[1] * (a[1] * c12 - b[1] * s12);
    double G1 = -v[GRAVITY] * (m[0] * (a[0] * cos(x[0]) - b[0] * sin(x[0])) + m[1] * L * cos(x[0])) + G2;
    double J = v[INERTIA + 1] + m[1] * (a[1] * a[1] + b[1] * b[1]);
    M[0] = v[INERTIA] + m[0] * (a[0] * a[0] + b[0] * b[0]) + m[1] * L * L + 2 * X + J + v[ARMATURE];
    M[1] = J + X;
    M[2] = J + v[ARMATURE + 1];
    R[0] = G1 - h * (2 * w[0] * w[1] + w[1] * w[1]) + v[DAMPING] * w[0];
    R[1] = G2 + h * w[0] * w[0] + v[DAMPING + 1] * w[1];
}

/* The rates of a state: angles, then speeds. */
static void rates(const double *v, const double *x, double *dx) {
    double M[3], R[2];
    equations(v, x, M, R);
    double r1 = v[TORQUE] - R[0], r2 = v[TORQUE + 1] - R[1], det = M[0] * M[2] - M[1] * M[1];
    dx[0] = x[2], dx[1] = x[3];
    dx[2] = (M[2] * r1 - M[1] * r2) / det, dx[3] = (M[0] * r2 - M[1] * r1) / det;
}

/* Kinetic and potential energy, position and velocity of the end. */
static void outputs(const double *v, double *out) {
    const double *m = v + MASS, *L = v + LENGTH, *a = v + ALONG, *b = v + ACROSS, *x = v + STATE;
    double c1 = cos(x[0]), s1 = sin(x[0]), c12 = cos(x[0] + x[1]), s12 = sin(x[0] + x[1]);
    double w1 = x[2], w2 = x[2] + x[3], M[3], R[2];
    equations(v, x, M, R);
    out[0] = (M[0] * w1 * w1 + 2 * M[1] * w1 * x[3] + M[2] * x[3] * x[3]) / 2;
    out[1] = -v[GRAVITY] * (m[0] * (a[0] * s1 + b[0] * c1)
                            + m[1] * (L[0] * s1 + a[1] * s12 + b[1] * c12));
    out[2] = L[0] * c1 + L[1] * c12, out[3] = L[0] * s1 + L[1] * s12;
    out[4] = -L[0] * s1 * w1 - L[1] * s12 * w2, out[5] = L[0] * c1 * w1 + L[1] * c12 * w2;
}

/* One step of the classical Runge-Kutta method. */
static void step(double *v, double h) {
    double k[4][4], y[4], *x = v + STATE;
    const double at[4] = {0, h / 2, h / 2, h};
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < 4; i++) y[i] = x[i] + (stage ? at[stage] * k[stage - 1][i] : 0);
        rates(v, y, k[stage]);
    }
    for (int i = 0; i < 4; i++) x[i] += h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
}

/* The functions of FMI 2.0. */
typedef struct { int needed, terminate, nominals, values, timed; double time; } Events;

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *resources,
                      const void *functions, int visible, int logging) {
    (void)name, (void)guid, (void)resources, (void)functions, (void)visible, (void)logging;
    Chain *c = calloc(1, sizeof *c);
    if (c) c->exchange = kind == 0;
    return c;
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2Reset(void *c) { return memset(((Chain *)c)->v, 0, sizeof ((Chain *)c)->v), OK; }

int fmi2SetupExperiment(void *c, int has, double tolerance, double start, int stops, double stop) {
    (void)c, (void)has, (void)tolerance, (void)start, (void)stops, (void)stop;
    return OK;
}
int fmi2EnterInitializationMode(void *c) { return (void)c, OK; }
int fmi2ExitInitializationMode(void *c) {
    const double *m = ((Chain *)c)->v + MASS;
    return m[0] > 0 && m[1] > 0 ? OK : ERROR;
}
int fmi2Terminate(void *c) { return (void)c, OK; }
int fmi2SetDebugLogging(void *c, int on, size_t count, const char *const *categories) {
    return (void)c, (void)on, (void)count, (void)categories, OK;
}

int fmi2GetReal(void *c, const unsigned *which, size_t count, double *values) {
    double *v = ((Chain *)c)->v;
    rates(v, v + STATE, v + RATE);
    outputs(v, v + OUTPUT);
    for (size_t i = 0; i < count; i++) {
        if (which[i] >= COUNT) return ERROR;
        values[i] = v[which[i]];
    }
    return OK;
}
int fmi2SetReal(void *c, const unsigned *which, size_t count, const double *values) {
    for (size_t i = 0; i < count; i++) {
        if (which[i] >= RATE) return ERROR;
        ((Chain *)c)->v[which[i]] = values[i];
    }
    return OK;
}

int fmi2EnterEventMode(void *c) { return (void)c, OK; }
int fmi2NewDiscreteStates(void *c, Events *events) {
    (void)c;
    memset(events, 0, sizeof *events);
    return OK;
}
int fmi2EnterContinuousTimeMode(void *c) { return (void)c, OK; }
int fmi2CompletedIntegratorStep(void *c, int no_set, int *enter_event_mode, int *terminate) {
    (void)c, (void)no_set;
    *enter_event_mode = *terminate = 0;
    return OK;
}
int fmi2SetTime(void *c, double time) { return (void)c, (void)time, OK; }
int fmi2SetContinuousStates(void *c, const double *x, size_t count) {
    return memcpy(((Chain *)c)->v + STATE, x, count * sizeof *x), OK;
}
int fmi2GetContinuousStates(void *c, double *x, size_t count) {
    return memcpy(x, ((Chain *)c)->v + STATE, count * sizeof *x), OK;
}
int fmi2GetDerivatives(void *c, double *dx, size_t count) {
    if (count != 4) return ERROR;
    return rates(((Chain *)c)->v, ((Chain *)c)->v + STATE, dx), OK;
}
int fmi2GetEventIndicators(void *c, double *z, size_t count) { return (void)c, (void)z, (void)count, OK; }
int fmi2GetNominalsOfContinuousStates(void *c, double *nominal, size_t count) {
    (void)c;
    for (size_t i = 0; i < count; i++) nominal[i] = 1;
    return OK;
}
int fmi2DoStep(void *c, double time, double size, int no_set) {
    (void)time, (void)no_set;
    if (((Chain *)c)->exchange) return ERROR;
    return step(((Chain *)c)->v, size), OK;
}

/* The standard requires them to exist; the description says that they are not offered. */
#define NOT_OFFERED(function) int function(void *c) { return (void)c, ERROR; }
NOT_OFFERED(fmi2GetInteger) NOT_OFFERED(fmi2GetBoolean) NOT_OFFERED(fmi2GetString)
NOT_OFFERED(fmi2SetInteger) NOT_OFFERED(fmi2SetBoolean) NOT_OFFERED(fmi2SetString)
NOT_OFFERED(fmi2GetFMUstate) NOT_OFFERED(fmi2SetFMUstate) NOT_OFFERED(fmi2FreeFMUstate)
NOT_OFFERED(fmi2SerializedFMUstateSize) NOT_OFFERED(fmi2SerializeFMUstate)
NOT_OFFERED(fmi2DeSerializeFMUstate) NOT_OFFERED(fmi2GetDirectionalDerivative)
NOT_OFFERED(fmi2SetRealInputDerivatives) NOT_OFFERED(fmi2GetRealOutputDerivatives)
NOT_OFFERED(fmi2CancelStep) NOT_OFFERED(fmi2GetStatus) NOT_OFFERED(fmi2GetRealStatus)
NOT_OFFERED(fmi2GetIntegerStatus) NOT_OFFERED(fmi2GetBooleanStatus) NOT_OFFERED(fmi2GetStringStatus)
