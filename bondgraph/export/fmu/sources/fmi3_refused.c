/* What FMI 3.0 asks a library to have and this model has no use for. */

FMI_EXPORT fmi3Instance FMI3(fmi3InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference at[],
    size_t n, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    void (*intermediate)(void)) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)events;
  (void)early, (void)at, (void)n, (void)environment, (void)log, (void)intermediate;
  return 0;
}

FMI_EXPORT fmi3Instance FMI3(fmi3InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    void (*clock)(void), void (*lock)(void), void (*unlock)(void)) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment;
  (void)log, (void)clock, (void)lock, (void)unlock;
  return 0;
}

FMI_EXPORT fmi3Status FMI3(fmi3EnterStepMode)(fmi3Instance c) {
  return refuse(c, "fmi3EnterStepMode", "this is model exchange");
}

FMI_EXPORT fmi3Status FMI3(fmi3EnterConfigurationMode)(fmi3Instance c) {
  return refuse(c, "fmi3EnterConfigurationMode", "there are no structural parameters");
}

FMI_EXPORT fmi3Status FMI3(fmi3ExitConfigurationMode)(fmi3Instance c) {
  return refuse(c, "fmi3ExitConfigurationMode", "there are no structural parameters");
}

#define ONLY_FLOATS "all variables of this model are of type Float64"
#define NO_SUCH(verb, type, constant)                                                            \
  FMI_EXPORT fmi3Status FMI3(fmi3##verb##type)(fmi3Instance c, const fmi3ValueReference at[],    \
                                               size_t n, constant fmi3##type values[],           \
                                               size_t n_values) {                                \
    (void)at, (void)values, (void)n_values;                                                      \
    return n == 0 ? fmi3OK : refuse(c, "fmi3" #verb #type, ONLY_FLOATS);                         \
  }
#define NO_SUCH_PAIR(type) NO_SUCH(Get, type, ) NO_SUCH(Set, type, const)
NO_SUCH_PAIR(Float32)
NO_SUCH_PAIR(Int8)
NO_SUCH_PAIR(UInt8)
NO_SUCH_PAIR(Int16)
NO_SUCH_PAIR(UInt16)
NO_SUCH_PAIR(Int32)
NO_SUCH_PAIR(UInt32)
NO_SUCH_PAIR(Int64)
NO_SUCH_PAIR(UInt64)
NO_SUCH_PAIR(Boolean)
NO_SUCH_PAIR(String)

FMI_EXPORT fmi3Status FMI3(fmi3GetBinary)(fmi3Instance c, const fmi3ValueReference at[], size_t n,
                                          size_t sizes[], fmi3Binary values[], size_t n_values) {
  (void)at, (void)sizes, (void)values, (void)n_values;
  return n == 0 ? fmi3OK : refuse(c, "fmi3GetBinary", ONLY_FLOATS);
}

FMI_EXPORT fmi3Status FMI3(fmi3SetBinary)(fmi3Instance c, const fmi3ValueReference at[], size_t n,
                                          const size_t sizes[], const fmi3Binary values[],
                                          size_t n_values) {
  (void)at, (void)sizes, (void)values, (void)n_values;
  return n == 0 ? fmi3OK : refuse(c, "fmi3SetBinary", ONLY_FLOATS);
}

FMI_EXPORT fmi3Status FMI3(fmi3GetClock)(fmi3Instance c, const fmi3ValueReference at[], size_t n,
                                         fmi3Clock values[]) {
  (void)at, (void)values;
  return n == 0 ? fmi3OK : refuse(c, "fmi3GetClock", ONLY_FLOATS);
}

FMI_EXPORT fmi3Status FMI3(fmi3SetClock)(fmi3Instance c, const fmi3ValueReference at[], size_t n,
                                         const fmi3Clock values[]) {
  (void)at, (void)values;
  return n == 0 ? fmi3OK : refuse(c, "fmi3SetClock", ONLY_FLOATS);
}

#define NOT_OFFERED(name, ...)                                                                   \
  FMI_EXPORT fmi3Status FMI3(name)(fmi3Instance c, __VA_ARGS__) {                                \
    return refuse(c, #name, "not offered by this model");                                        \
  }
NOT_OFFERED(fmi3GetNumberOfVariableDependencies, fmi3ValueReference a, size_t* b)
NOT_OFFERED(fmi3GetVariableDependencies, fmi3ValueReference a, size_t b[], fmi3ValueReference d[],
            size_t e[], fmi3DependencyKind f[], size_t g)
NOT_OFFERED(fmi3GetDirectionalDerivative, const fmi3ValueReference a[], size_t b,
            const fmi3ValueReference d[], size_t e, const fmi3Float64 f[], size_t g,
            fmi3Float64 h[], size_t i)
NOT_OFFERED(fmi3GetAdjointDerivative, const fmi3ValueReference a[], size_t b,
            const fmi3ValueReference d[], size_t e, const fmi3Float64 f[], size_t g,
            fmi3Float64 h[], size_t i)
NOT_OFFERED(fmi3GetIntervalDecimal, const fmi3ValueReference a[], size_t b, fmi3Float64 d[],
            fmi3IntervalQualifier e[])
NOT_OFFERED(fmi3GetIntervalFraction, const fmi3ValueReference a[], size_t b, fmi3UInt64 d[],
            fmi3UInt64 e[], fmi3IntervalQualifier f[])
NOT_OFFERED(fmi3GetShiftDecimal, const fmi3ValueReference a[], size_t b, fmi3Float64 d[])
NOT_OFFERED(fmi3GetShiftFraction, const fmi3ValueReference a[], size_t b, fmi3UInt64 d[],
            fmi3UInt64 e[])
NOT_OFFERED(fmi3SetIntervalDecimal, const fmi3ValueReference a[], size_t b,
            const fmi3Float64 d[])
NOT_OFFERED(fmi3SetIntervalFraction, const fmi3ValueReference a[], size_t b,
            const fmi3UInt64 d[], const fmi3UInt64 e[])
NOT_OFFERED(fmi3SetShiftDecimal, const fmi3ValueReference a[], size_t b, const fmi3Float64 d[])
NOT_OFFERED(fmi3SetShiftFraction, const fmi3ValueReference a[], size_t b, const fmi3UInt64 d[],
            const fmi3UInt64 e[])
NOT_OFFERED(fmi3GetOutputDerivatives, const fmi3ValueReference a[], size_t b,
            const fmi3Int32 d[], fmi3Float64 e[], size_t f)
NOT_OFFERED(fmi3DoStep, fmi3Float64 a, fmi3Float64 b, fmi3Boolean d, fmi3Boolean* e,
            fmi3Boolean* f, fmi3Boolean* g, fmi3Float64* h)
NOT_OFFERED(fmi3ActivateModelPartition, fmi3ValueReference a, fmi3Float64 b)
