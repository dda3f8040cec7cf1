/* FMI 2.0 co-simulation: the only file to compile, it includes the others.
   Inputs are held over a communication step unless the importer gives their slopes. */
#include "fmi2_types.h"
#include "model.h"
#include "linear.c"
#include "model.c"
#include "radau.c"
#include "values.c"

typedef struct {
  Model model;
  fmi2CallbackFunctions callbacks;
  char* name;
  int logging;
} Slave;

static fmi2Status complain(Slave* s, fmi2String where) {
  char text[256];
  snprintf(text, sizeof text, "%s at t = %.9g s: %s", where, s->model.now.time, s->model.trouble);
  if (s->callbacks.logger)
    s->callbacks.logger(s->callbacks.componentEnvironment, s->name, fmi2Error, "logStatusError",
                        "%s", text);
  return fmi2Error;
}

static fmi2Status wrong_time(Slave* s, fmi2String where) {
  s->model.trouble = "not allowed in the present mode";
  return complain(s, where);
}

FMI_EXPORT const char* FMI2(fmi2GetTypesPlatform)(void) { return "default"; }

FMI_EXPORT const char* FMI2(fmi2GetVersion)(void) { return "2.0"; }

FMI_EXPORT fmi2Status FMI2(fmi2SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t n,
                                                const fmi2String categories[]) {
  (void)n;
  (void)categories;
  ((Slave*)c)->logging = on;
  return fmi2OK;
}

FMI_EXPORT fmi2Component FMI2(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String guid,
                                               fmi2String resources,
                                               const fmi2CallbackFunctions* callbacks,
                                               fmi2Boolean visible, fmi2Boolean logging) {
  (void)resources;
  (void)visible;
  if (type != fmi2CoSimulation || !guid || strcmp(guid, MODEL_TOKEN)) {
    if (callbacks && callbacks->logger)
      callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "logStatusError",
                        "the GUID is not that of this binary, or co-simulation is not wanted");
    return 0;
  }
  Slave* s = calloc(1, sizeof(Slave));
  if (!s) return 0;
  if (callbacks) s->callbacks = *callbacks;
  s->logging = logging;
  s->name = malloc(strlen(name ? name : "") + 1);
  if (!s->name) {
    free(s);
    return 0;
  }
  strcpy(s->name, name ? name : "");
  set_up(&s->model);
  return s;
}

FMI_EXPORT void FMI2(fmi2FreeInstance)(fmi2Component c) {
  if (!c) return;
  free(((Slave*)c)->name);
  free(c);
}

FMI_EXPORT fmi2Status FMI2(fmi2SetupExperiment)(fmi2Component c, fmi2Boolean has_tolerance,
                                                fmi2Real tolerance, fmi2Real start,
                                                fmi2Boolean has_stop, fmi2Real stop) {
  Slave* s = c;
  Numbers* q = &s->model.now;
  (void)has_stop;
  (void)stop;
  if (q->mode != CREATED) return wrong_time(s, "fmi2SetupExperiment");
  q->time = start;
  if (has_tolerance && tolerance > 0.0) q->tolerance = fmin(1e-2, fmax(1e-12, tolerance));
  s->model.fresh = 0;
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2EnterInitializationMode)(fmi2Component c) {
  Slave* s = c;
  if (s->model.now.mode != CREATED) return wrong_time(s, "fmi2EnterInitializationMode");
  s->model.now.mode = INITIALISING;
  s->model.now.memory_time = s->model.now.time;
  s->model.now.slope_time = s->model.now.time;
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2ExitInitializationMode)(fmi2Component c) {
  Slave* s = c;
  if (s->model.now.mode != INITIALISING) return wrong_time(s, "fmi2ExitInitializationMode");
  if (!begin(&s->model)) return complain(s, "fmi2ExitInitializationMode");
  s->model.now.mode = RUNNING;
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2Terminate)(fmi2Component c) {
  ((Slave*)c)->model.now.mode = ENDED;
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2Reset)(fmi2Component c) {
  set_up(&((Slave*)c)->model);
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2GetReal)(fmi2Component c, const fmi2ValueReference at[], size_t n,
                                        fmi2Real value[]) {
  Slave* s = c;
  for (size_t i = 0; i < n; ++i)
    if (!read_value(&s->model, at[i], value + i)) return complain(s, "fmi2GetReal");
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2SetReal)(fmi2Component c, const fmi2ValueReference at[], size_t n,
                                        const fmi2Real value[]) {
  Slave* s = c;
  for (size_t i = 0; i < n; ++i)
    if (!write_value(&s->model, at[i], value[i])) return complain(s, "fmi2SetReal");
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2GetFMUstate)(fmi2Component c, fmi2FMUstate* state) {
  Slave* s = c;
  s->model.trouble = "no memory left";
  *state = kept(&s->model, *state);
  return *state ? fmi2OK : complain(s, "fmi2GetFMUstate");
}

FMI_EXPORT fmi2Status FMI2(fmi2SetFMUstate)(fmi2Component c, fmi2FMUstate state) {
  Slave* s = c;
  s->model.trouble = "no state given";
  if (!state) return complain(s, "fmi2SetFMUstate");
  restore(&s->model, state);
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2FreeFMUstate)(fmi2Component c, fmi2FMUstate* state) {
  (void)c;
  if (state) {
    free(*state);
    *state = 0;
  }
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state,
                                                       size_t* size) {
  (void)c;
  (void)state;
  *size = SERIAL_SIZE;
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2SerializeFMUstate)(fmi2Component c, fmi2FMUstate state,
                                                  fmi2Byte bytes[], size_t size) {
  Slave* s = c;
  s->model.trouble = "the buffer is too small, or no state given";
  if (size < SERIAL_SIZE || !state) return complain(s, "fmi2SerializeFMUstate");
  serialise(state, bytes);
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[],
                                                    size_t size, fmi2FMUstate* state) {
  Slave* s = c;
  *state = deserialise(&s->model, bytes, size);
  return *state ? fmi2OK : complain(s, "fmi2DeSerializeFMUstate");
}

FMI_EXPORT fmi2Status FMI2(fmi2SetRealInputDerivatives)(fmi2Component c,
                                                        const fmi2ValueReference at[], size_t n,
                                                        const fmi2Integer order[],
                                                        const fmi2Real value[]) {
  Slave* s = c;
  Numbers* q = &s->model.now;
  for (size_t i = 0; i < n; ++i) {
    s->model.trouble = "only finite first derivatives of inputs are taken";
    if (at[i] < AT_U || at[i] >= AT_Y || order[i] != 1 || !isfinite(value[i]))
      return complain(s, "fmi2SetRealInputDerivatives");
    q->slope[at[i] - AT_U] = value[i];
    q->sloped[at[i] - AT_U] = 1;
    q->slope_time = q->time;
  }
  s->model.fresh = 0;
  return fmi2OK;
}

/* A slope holds for one communication step; afterwards the input stays where it led. */
static void end_slopes(Numbers* q) {
  double u[N_U + 1];
  inputs_at(q, q->time, u);
  for (int i = 0; i < N_U; ++i) {
    if (RATE_OF[i] < 0) q->u[i] = u[i];
    q->slope[i] = 0.0;
  }
  for (int i = 0; i < N_U; ++i)
    if (RATE_OF[i] >= 0) q->u[i] = u[i];
  memset(q->sloped, 0, sizeof q->sloped);
  q->slope_time = q->time;
}

FMI_EXPORT fmi2Status FMI2(fmi2DoStep)(fmi2Component c, fmi2Real now, fmi2Real size,
                                       fmi2Boolean no_way_back) {
  Slave* s = c;
  Numbers before;
  (void)no_way_back;
  if (s->model.now.mode != RUNNING) return wrong_time(s, "fmi2DoStep");
  s->model.trouble = "the communication point is not where the last step ended";
  if (!(fabs(now - s->model.now.time) <= 1e-6 * (fabs(now) + size)))
    return complain(s, "fmi2DoStep");
  s->model.trouble = "the communication step must be positive";
  if (!(size > 0.0) || !isfinite(size)) return complain(s, "fmi2DoStep");
  kept(&s->model, &before);
  if (!integrate(&s->model, now + size)) {
    fmi2Status status = complain(s, "fmi2DoStep");
    restore(&s->model, &before);
    return status;
  }
  end_slopes(&s->model.now);
  return fmi2OK;
}

#include "fmi2_refused.c"
