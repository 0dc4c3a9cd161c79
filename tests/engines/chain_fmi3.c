/* The chain of examples/fmu/chain.c with the functions of FMI 3.0; `missing.h` has those not offered. */
#include <stdbool.h>
#include <stdint.h>

#include "chain.c"
#include "missing.h"

#ifndef EARLY
#define EARLY false
#endif

typedef const char *Text;

const char *fmi3GetVersion(void) { return "3.0"; }

void *fmi3InstantiateModelExchange(Text name, Text token, Text resources, bool visible, bool logging,
                                   void *environment, void *log) {
    (void)environment, (void)log;
    return fmi2Instantiate(name, 0, token, resources, NULL, visible, logging);
}
void *fmi3InstantiateCoSimulation(Text name, Text token, Text resources, bool visible, bool logging,
                                  bool events, bool early, const uint32_t *needed, size_t count,
                                  void *environment, void *log, void *update) {
    (void)events, (void)early, (void)needed, (void)count, (void)environment, (void)log, (void)update;
    return fmi2Instantiate(name, 1, token, resources, NULL, visible, logging);
}
void fmi3FreeInstance(void *c) { fmi2FreeInstance(c); }
int fmi3Terminate(void *c) { return fmi2Terminate(c); }
int fmi3Reset(void *c) { return fmi2Reset(c); }

int fmi3EnterInitializationMode(void *c, bool has, double tolerance, double start, bool stops,
                                double stop) {
    (void)c, (void)has, (void)tolerance, (void)start, (void)stops, (void)stop;
    return OK;
}
int fmi3ExitInitializationMode(void *c) { return fmi2ExitInitializationMode(c); }

int fmi3GetFloat64(void *c, const uint32_t *which, size_t count, double *values, size_t numbers) {
    return count == numbers ? fmi2GetReal(c, which, count, values) : ERROR;
}
int fmi3SetFloat64(void *c, const uint32_t *which, size_t count, const double *values,
                   size_t numbers) {
    return count == numbers ? fmi2SetReal(c, which, count, values) : ERROR;
}

int fmi3EnterEventMode(void *c) { return fmi2EnterEventMode(c); }
int fmi3UpdateDiscreteStates(void *c, bool *needed, bool *terminate, bool *nominals, bool *values,
                             bool *timed, double *time) {
    (void)c;
    *needed = *terminate = *nominals = *values = *timed = false, *time = 0;
    return OK;
}
int fmi3EnterContinuousTimeMode(void *c) { return fmi2EnterContinuousTimeMode(c); }
int fmi3SetTime(void *c, double time) { return fmi2SetTime(c, time); }
int fmi3SetContinuousStates(void *c, const double *x, size_t count) {
    return fmi2SetContinuousStates(c, x, count);
}
int fmi3GetContinuousStateDerivatives(void *c, double *dx, size_t count) {
    return fmi2GetDerivatives(c, dx, count);
}
int fmi3DoStep(void *c, double time, double size, bool no_set, bool *event, bool *terminate,
               bool *early, double *last) {
    *event = *terminate = false, *early = EARLY, *last = time + (EARLY ? size / 2 : size);
    return fmi2DoStep(c, time, size, no_set);
}
