/* Values by reference, for both standards. Every function returns 0 if it cannot. */

enum { CREATED, INITIALISING, RUNNING, EVENTS, ENDED };

static int read_value(Model* c, unsigned at, double* value) {
  Numbers* q = &c->now;
  int computed = (at >= AT_Y && at < AT_P) || (at >= AT_DX && at < AT_M);
  if (computed && !refresh(c)) return 0;
  if (at == AT_TIME) *value = q->time;
  else if (at < AT_Y) *value = q->u[at - AT_U];
  else if (at < AT_P) *value = c->y[at - AT_Y];
  else if (at < AT_X) *value = q->p[at - AT_P];
  else if (at < AT_DX) *value = q->v[at - AT_X];
  else if (at < AT_Z) *value = c->fg[at - AT_DX];
  else if (at < AT_M) *value = q->v[N_X + (at - AT_Z)];
  else if (at < AT_OPTION) *value = q->m[at - AT_M];
  else if (at == AT_OPTION) *value = q->largest_step;
  else if (at == AT_OPTION + 1) *value = q->tolerance;
  else {
    c->trouble = "no variable has this value reference";
    return 0;
  }
  return 1;
}

static int write_value(Model* c, unsigned at, double value) {
  Numbers* q = &c->now;
  int start = q->mode == CREATED || q->mode == INITIALISING;
  c->trouble = "this variable cannot be set, or not at this time";
  if (!isfinite(value)) {
    c->trouble = "a value to set is not finite";
    return 0;
  }
  if (at >= AT_U && at < AT_Y) {
    int i = (int)(at - AT_U);
    if (q->u[i] != value || q->sloped[i]) q->jumped = 1;
    q->u[i] = value;
    q->slope[i] = 0.0;
    q->sloped[i] = 0;
  } else if (at >= AT_P && at < AT_X) {
    q->p[at - AT_P] = value;
  } else if (at >= AT_X && at < AT_DX && start) {
    q->v[at - AT_X] = value;
  } else if (at >= AT_M && at < AT_OPTION && start) {
    q->m[at - AT_M] = value;
  } else if (at == AT_OPTION && start && value >= 0.0) {
    q->largest_step = value;
  } else if (at == AT_OPTION + 1 && start && value >= 1e-12 && value <= 1e-2) {
    q->tolerance = value;
  } else {
    return 0;
  }
  c->fresh = 0;
  return 1;
}

static Numbers* kept(const Model* c, Numbers* into) {
  if (!into) into = malloc(sizeof(Numbers));
  if (into) memcpy(into, &c->now, sizeof(Numbers));
  return into;
}

static void restore(Model* c, const Numbers* from) {
  memcpy(&c->now, from, sizeof(Numbers));
  c->fresh = 0;
}

/* Serialised: the token, so that no other model takes it, then the numbers of this machine. */
#define SERIAL_SIZE (sizeof(MODEL_TOKEN) + sizeof(Numbers))

static void serialise(const Numbers* from, char* bytes) {
  memcpy(bytes, MODEL_TOKEN, sizeof(MODEL_TOKEN));
  memcpy(bytes + sizeof(MODEL_TOKEN), from, sizeof(Numbers));
}

static Numbers* deserialise(Model* c, const char* bytes, size_t size) {
  Numbers* found = 0;
  if (size != SERIAL_SIZE || memcmp(bytes, MODEL_TOKEN, sizeof(MODEL_TOKEN))) {
    c->trouble = "the serialised state belongs to another model or is cut short";
    return 0;
  }
  found = malloc(sizeof(Numbers));
  if (found) memcpy(found, bytes + sizeof(MODEL_TOKEN), sizeof(Numbers));
  return found;
}
