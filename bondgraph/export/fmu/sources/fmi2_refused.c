/* What FMI 2.0 asks a slave to have and this one has no use for. */

/* There are no variables of the other types: an empty request is fine. */
#define NO_SUCH(verb, type, constant)                                                            \
  FMI_EXPORT fmi2Status FMI2(fmi2##verb##type)(fmi2Component c, const fmi2ValueReference at[],   \
                                               size_t n, constant fmi2##type value[]) {          \
    Slave* s = c;                                                                                \
    (void)at;                                                                                    \
    (void)value;                                                                                 \
    if (n == 0) return fmi2OK;                                                                   \
    s->model.trouble = "all variables of this model are real";                                   \
    return complain(s, "fmi2" #verb #type);                                                      \
  }
NO_SUCH(Get, Integer, )
NO_SUCH(Get, Boolean, )
NO_SUCH(Get, String, )
NO_SUCH(Set, Integer, const)
NO_SUCH(Set, Boolean, const)
NO_SUCH(Set, String, const)

FMI_EXPORT fmi2Status FMI2(fmi2GetDirectionalDerivative)(
    fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
    const fmi2ValueReference known[], size_t n_known, const fmi2Real seed[], fmi2Real value[]) {
  Slave* s = c;
  (void)unknown, (void)n_unknown, (void)known, (void)n_known, (void)seed, (void)value;
  s->model.trouble = "directional derivatives are not offered";
  return complain(s, "fmi2GetDirectionalDerivative");
}

FMI_EXPORT fmi2Status FMI2(fmi2GetRealOutputDerivatives)(fmi2Component c,
                                                         const fmi2ValueReference at[], size_t n,
                                                         const fmi2Integer order[],
                                                         fmi2Real value[]) {
  Slave* s = c;
  (void)at, (void)order, (void)value;
  if (n == 0) return fmi2OK;
  s->model.trouble = "derivatives of outputs are not offered";
  return complain(s, "fmi2GetRealOutputDerivatives");
}

FMI_EXPORT fmi2Status FMI2(fmi2CancelStep)(fmi2Component c) {
  return wrong_time(c, "fmi2CancelStep");
}

FMI_EXPORT fmi2Status FMI2(fmi2GetStatus)(fmi2Component c, const fmi2StatusKind kind,
                                          fmi2Status* value) {
  (void)c, (void)kind, (void)value;
  return fmi2Discard;
}

FMI_EXPORT fmi2Status FMI2(fmi2GetRealStatus)(fmi2Component c, const fmi2StatusKind kind,
                                              fmi2Real* value) {
  if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = ((Slave*)c)->model.now.time;
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind,
                                                 fmi2Integer* value) {
  (void)c, (void)kind, (void)value;
  return fmi2Discard;
}

FMI_EXPORT fmi2Status FMI2(fmi2GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind,
                                                 fmi2Boolean* value) {
  (void)c;
  if (kind != fmi2Terminated) return fmi2Discard;
  *value = 0;
  return fmi2OK;
}

FMI_EXPORT fmi2Status FMI2(fmi2GetStringStatus)(fmi2Component c, const fmi2StatusKind kind,
                                                fmi2String* value) {
  (void)c, (void)kind, (void)value;
  return fmi2Discard;
}
