/* FMI 3.0 model exchange: the only file to compile, it includes the others.
   Memory moves in fmi3CompletedIntegratorStep and, for jumps of inputs, in event mode. */
#include "fmi3_types.h"
#include "model.h"
#include "linear.c"
#include "model.c"
#include "values.c"

typedef struct {
  Model model;
  fmi3LogMessageCallback log;
  fmi3InstanceEnvironment environment;
} Instance;

static fmi3Status complain(Instance* s, fmi3String where) {
  char text[256];
  snprintf(text, sizeof text, "%s at t = %.9g s: %s", where, s->model.now.time, s->model.trouble);
  if (s->log) s->log(s->environment, fmi3Error, "logStatusError", text);
  return fmi3Error;
}

static fmi3Status refuse(Instance* s, fmi3String where, const char* why) {
  s->model.trouble = why;
  return complain(s, where);
}

#define NOT_NOW "not allowed in the present mode"

/* An indicator crosses zero when an argument moves against its direction by more than rounding, and
   where a law without memory changes its piece: then nothing changes but the rates. */
static int indicators(Model* c, double* values) {
  double rates[N_S + 1];
  if (!argument_rates(c, rates)) return 0;
  for (int i = 0; i < N_T; ++i) {
    int j = EVENT_OF[i];
    values[i] = rates[j] * c->now.direction[j] + 1e-6 * c->now.turn_size[j];
  }
  return N_E == N_T || switches(c, values + N_T);
}

static int take_directions(Model* c) {
  double rates[N_S + 1];
  if (!argument_rates(c, rates)) return 0;
  for (int j = 0; j < N_S; ++j)
    if (rates[j] != 0.0) c->now.direction[j] = rates[j] > 0.0 ? 1 : -1;
  return 1;
}

static int note_rates(Model* c) {
  double rates[N_S + 1];
  if (!argument_rates(c, rates)) return 0;
  for (int j = 0; j < N_S; ++j) c->now.turn_size[j] = fmax(c->now.turn_size[j], fabs(rates[j]));
  return 1;
}

FMI_EXPORT const char* FMI3(fmi3GetVersion)(void) { return "3.0"; }

FMI_EXPORT fmi3Status FMI3(fmi3SetDebugLogging)(fmi3Instance c, fmi3Boolean on, size_t n,
                                                const fmi3String categories[]) {
  (void)c, (void)on, (void)n, (void)categories;
  return fmi3OK;
}

FMI_EXPORT fmi3Instance FMI3(fmi3InstantiateModelExchange)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
  (void)name, (void)resources, (void)visible, (void)logging;
  if (!token || strcmp(token, MODEL_TOKEN)) {
    if (log)
      log(environment, fmi3Error, "logStatusError",
          "the instantiation token is not that of this binary");
    return 0;
  }
  Instance* s = calloc(1, sizeof(Instance));
  if (!s) return 0;
  s->log = log;
  s->environment = environment;
  set_up(&s->model);
  return s;
}

FMI_EXPORT void FMI3(fmi3FreeInstance)(fmi3Instance c) { free(c); }

FMI_EXPORT fmi3Status FMI3(fmi3EnterInitializationMode)(fmi3Instance c, fmi3Boolean has_tolerance,
                                                        fmi3Float64 tolerance, fmi3Float64 start,
                                                        fmi3Boolean has_stop, fmi3Float64 stop) {
  Instance* s = c;
  Numbers* q = &s->model.now;
  (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
  if (q->mode != CREATED) return refuse(s, "fmi3EnterInitializationMode", NOT_NOW);
  q->time = q->memory_time = q->slope_time = start;
  q->mode = INITIALISING;
  s->model.fresh = 0;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3ExitInitializationMode)(fmi3Instance c) {
  Instance* s = c;
  if (s->model.now.mode != INITIALISING) return refuse(s, "fmi3ExitInitializationMode", NOT_NOW);
  if (!begin(&s->model) || !take_directions(&s->model) || !note_rates(&s->model))
    return complain(s, "fmi3ExitInitializationMode");
  s->model.now.mode = EVENTS;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3EnterEventMode)(fmi3Instance c) {
  Instance* s = c;
  if (s->model.now.mode != RUNNING) return refuse(s, "fmi3EnterEventMode", NOT_NOW);
  s->model.now.mode = EVENTS;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3EnterContinuousTimeMode)(fmi3Instance c) {
  Instance* s = c;
  if (s->model.now.mode != EVENTS) return refuse(s, "fmi3EnterContinuousTimeMode", NOT_NOW);
  s->model.now.mode = RUNNING;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3Terminate)(fmi3Instance c) {
  ((Instance*)c)->model.now.mode = ENDED;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3Reset)(fmi3Instance c) {
  set_up(&((Instance*)c)->model);
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3GetFloat64)(fmi3Instance c, const fmi3ValueReference at[], size_t n,
                                           fmi3Float64 values[], size_t n_values) {
  Instance* s = c;
  if (n != n_values) return refuse(s, "fmi3GetFloat64", "all variables are scalars");
  for (size_t i = 0; i < n; ++i) {
    if (at[i] >= AT_EVENT && at[i] < AT_END) {
      double all[N_E + 1];
      if (!indicators(&s->model, all)) return complain(s, "fmi3GetFloat64");
      values[i] = all[at[i] - AT_EVENT];
    } else if (!read_value(&s->model, at[i], values + i)) {
      return complain(s, "fmi3GetFloat64");
    }
  }
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3SetFloat64)(fmi3Instance c, const fmi3ValueReference at[], size_t n,
                                           const fmi3Float64 values[], size_t n_values) {
  Instance* s = c;
  if (n != n_values) return refuse(s, "fmi3SetFloat64", "all variables are scalars");
  for (size_t i = 0; i < n; ++i)
    if (!write_value(&s->model, at[i], values[i])) return complain(s, "fmi3SetFloat64");
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3GetFMUState)(fmi3Instance c, fmi3FMUState* state) {
  Instance* s = c;
  *state = kept(&s->model, *state);
  return *state ? fmi3OK : refuse(s, "fmi3GetFMUState", "no memory left");
}

FMI_EXPORT fmi3Status FMI3(fmi3SetFMUState)(fmi3Instance c, fmi3FMUState state) {
  Instance* s = c;
  if (!state) return refuse(s, "fmi3SetFMUState", "no state given");
  restore(&s->model, state);
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3FreeFMUState)(fmi3Instance c, fmi3FMUState* state) {
  (void)c;
  if (state) {
    free(*state);
    *state = 0;
  }
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3SerializedFMUStateSize)(fmi3Instance c, fmi3FMUState state,
                                                       size_t* size) {
  (void)c, (void)state;
  *size = SERIAL_SIZE;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3SerializeFMUState)(fmi3Instance c, fmi3FMUState state,
                                                  fmi3Byte bytes[], size_t size) {
  if (size < SERIAL_SIZE || !state)
    return refuse(c, "fmi3SerializeFMUState", "the buffer is too small, or no state given");
  serialise(state, (char*)bytes);
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3DeserializeFMUState)(fmi3Instance c, const fmi3Byte bytes[],
                                                    size_t size, fmi3FMUState* state) {
  Instance* s = c;
  *state = deserialise(&s->model, (const char*)bytes, size);
  return *state ? fmi3OK : complain(s, "fmi3DeserializeFMUState");
}

FMI_EXPORT fmi3Status FMI3(fmi3EvaluateDiscreteStates)(fmi3Instance c) {
  (void)c;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3UpdateDiscreteStates)(fmi3Instance c, fmi3Boolean* again,
                                                     fmi3Boolean* stop, fmi3Boolean* nominals,
                                                     fmi3Boolean* values, fmi3Boolean* has_next,
                                                     fmi3Float64* next) {
  Instance* s = c;
  if (s->model.now.mode != EVENTS) return refuse(s, "fmi3UpdateDiscreteStates", NOT_NOW);
  *again = *stop = *nominals = *values = *has_next = false;
  *next = 0.0;
  if (!take_jump(&s->model) || !take_directions(&s->model) || !note_rates(&s->model))
    return complain(s, "fmi3UpdateDiscreteStates");
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3CompletedIntegratorStep)(fmi3Instance c, fmi3Boolean no_way_back,
                                                        fmi3Boolean* events, fmi3Boolean* stop) {
  Instance* s = c;
  Model* model = &s->model;
  double values[N_E + 1];
  (void)no_way_back;
  *events = *stop = false;
  if (model->now.mode != RUNNING) return refuse(s, "fmi3CompletedIntegratorStep", NOT_NOW);
  if (!refresh(model)) return complain(s, "fmi3CompletedIntegratorStep");
  remember(model);
  model->now.jumped = 0;
  model->fresh = 0;
  if (!note_rates(model) || !indicators(model, values))
    return complain(s, "fmi3CompletedIntegratorStep");
  for (int i = 0; i < N_T; ++i)
    if (values[i] < 0.0) *events = true; /* turned without an event: take the new direction */
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3SetTime)(fmi3Instance c, fmi3Float64 time) {
  Instance* s = c;
  s->model.now.time = time;
  s->model.now.slope_time = time;
  s->model.fresh = 0;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3SetContinuousStates)(fmi3Instance c, const fmi3Float64 x[],
                                                    size_t n) {
  Instance* s = c;
  if (n != N_X) return refuse(s, "fmi3SetContinuousStates", "wrong number of states");
  if (n > 0) memcpy(s->model.now.v, x, n * sizeof(double));
  s->model.fresh = 0;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3GetContinuousStates)(fmi3Instance c, fmi3Float64 x[], size_t n) {
  Instance* s = c;
  if (n != N_X) return refuse(s, "fmi3GetContinuousStates", "wrong number of states");
  if (n > 0) memcpy(x, s->model.now.v, n * sizeof(double));
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3GetContinuousStateDerivatives)(fmi3Instance c, fmi3Float64 dx[],
                                                              size_t n) {
  Instance* s = c;
  if (n != N_X)
    return refuse(s, "fmi3GetContinuousStateDerivatives", "wrong number of states");
  if (!refresh(&s->model)) return complain(s, "fmi3GetContinuousStateDerivatives");
  if (n > 0) memcpy(dx, s->model.fg, n * sizeof(double));
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3GetEventIndicators)(fmi3Instance c, fmi3Float64 values[],
                                                   size_t n) {
  Instance* s = c;
  if (n != N_E) return refuse(s, "fmi3GetEventIndicators", "wrong number of indicators");
  if (n > 0 && !indicators(&s->model, values)) return complain(s, "fmi3GetEventIndicators");
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3GetNominalsOfContinuousStates)(fmi3Instance c, fmi3Float64 size[],
                                                              size_t n) {
  Instance* s = c;
  if (n != N_X)
    return refuse(s, "fmi3GetNominalsOfContinuousStates", "wrong number of states");
  for (size_t i = 0; i < n; ++i) size[i] = NOMINAL_X[i];
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3GetNumberOfEventIndicators)(fmi3Instance c, size_t* n) {
  (void)c;
  *n = N_E;
  return fmi3OK;
}

FMI_EXPORT fmi3Status FMI3(fmi3GetNumberOfContinuousStates)(fmi3Instance c, size_t* n) {
  (void)c;
  *n = N_X;
  return fmi3OK;
}

#include "fmi3_refused.c"
