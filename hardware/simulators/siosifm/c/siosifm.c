/* A stub with the public C interface of the vendor's library `siosifm`.
 *
 * It plays the part of the library alone: handles, error codes, the input buffer of values, the
 * intermediate buffer that one call fills and others read. The device is elsewhere: a bench that
 * is asked over a TCP socket, one line of text for a request, and answers with
 * { int32 code, uint32 bytes } and the bytes.
 *
 * BONDSIGHT_BENCH_SIOS=host:port   the bench, for all ways to open but the network
 * BONDSIGHT_BENCH_SIOS_TIMEOUT=s   time after which a silent bench counts as unplugged (2)
 * BONDSIGHT_BENCH_SIOS_STATUS=device   IfmStatus tells the device's present state instead of that
 *                                  of the value read last; which of the two holds is not public
 */
#define _POSIX_C_SOURCE 200809L
#include <arpa/inet.h>
#include <math.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

enum { DEVICES = 8, BUFFER = 65536, INFOS = 128, TEXT = 64 };
enum {
    INVALID = -1,
    BAD_CHANNEL = -2,
    DATALEN = -4,
    DEVICECOUNT = -10,
    BAD_REQUEST = -11,
    BAD_USB = -12,
    CREATE_HANDLE = -13,
    NOT_IMPLEMENTED = -100
};
enum { STATUS_BAD_REQUEST = 0x8000 };

typedef struct {
    double length;
    int64_t raw;
    int32_t cosine, sine, norm;
    uint32_t clock, sample, status;
} row;

typedef struct {
    int used, alive, fd, interface, has_current, block;
    int head, count;
    row *ring;
    row current;
    double infos[INFOS];
    char text[TEXT];
} device;

static device devices[DEVICES];
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int first_error, usb_count;

static int failed(int code)
{
    if (code < 0 && first_error == 0) first_error = code;
    return code;
}

static double timeout(void)
{
    const char *text = getenv("BONDSIGHT_BENCH_SIOS_TIMEOUT");
    double s = text ? atof(text) : 0.0;
    return s > 0.0 ? s : 2.0;
}

static int connected(const char *host, const char *port)
{
    struct addrinfo hint, *found = NULL;
    memset(&hint, 0, sizeof hint);
    hint.ai_socktype = SOCK_STREAM;
    if (getaddrinfo(host, port, &hint, &found) != 0) return -1;
    int fd = socket(found->ai_family, found->ai_socktype, found->ai_protocol);
    double s = timeout();
    struct timeval limit = {(time_t)s, (suseconds_t)(1e6 * (s - (double)(time_t)s))};
    int one = 1;
    if (fd >= 0) {
        setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
        setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
        setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
        if (connect(fd, found->ai_addr, found->ai_addrlen) != 0) {
            close(fd);
            fd = -1;
        }
    }
    freeaddrinfo(found);
    return fd;
}

static int bench(void)
{
    const char *address = getenv("BONDSIGHT_BENCH_SIOS");
    char host[256];
    const char *colon = address ? strrchr(address, ':') : NULL;
    if (!colon || (size_t)(colon - address) >= sizeof host) return -1;
    memcpy(host, address, (size_t)(colon - address));
    host[colon - address] = 0;
    return connected(host, colon + 1);
}

static void unplugged(device *d)
{
    if (d->alive) close(d->fd);
    d->alive = 0;
}

static size_t received(int fd, void *target, size_t bytes)
{
    size_t done = 0;
    while (done < bytes) {
        ssize_t k = recv(fd, (char *)target + done, bytes - done, 0);
        if (k <= 0) break;
        done += (size_t)k;
    }
    return done;
}

/* Ask; up to `room` bytes of the answer go to `target`; `got` tells how many came. */
static int ask(device *d, void *target, size_t room, size_t *got, const char *form, ...)
{
    char line[256];
    int32_t code;
    uint32_t bytes;
    char head[8];
    va_list list;
    if (got) *got = 0;
    if (!d->alive) return INVALID;
    va_start(list, form);
    int n = vsnprintf(line, sizeof line - 1, form, list);
    va_end(list);
    line[n++] = '\n';
    if (send(d->fd, line, (size_t)n, MSG_NOSIGNAL) != n || received(d->fd, head, 8) != 8) {
        unplugged(d);
        return INVALID;
    }
    memcpy(&code, head, 4);
    memcpy(&bytes, head + 4, 4);
    if (bytes > room) {
        unplugged(d);
        return INVALID;
    }
    size_t came = bytes ? received(d->fd, target, bytes) : 0;
    if (got) *got = came;
    if (came != bytes) {
        unplugged(d);
        return INVALID;
    }
    return code;
}

static device *get(int number)
{
    if (number < 0 || number >= DEVICES || !devices[number].used) return NULL;
    return &devices[number];
}

/* Enter with a valid device, or leave with an error. */
#define ENTER(failure)                 \
    pthread_mutex_lock(&lock);         \
    device *d = get(dev);              \
    if (!d) {                          \
        pthread_mutex_unlock(&lock);   \
        failed(INVALID);               \
        return failure;                \
    }
#define LEAVE(value)               \
    do {                           \
        pthread_mutex_unlock(&lock); \
        return value;              \
    } while (0)

#define SIMPLE(name, parameters, ...)                          \
    int name parameters                                        \
    {                                                          \
        ENTER(INVALID)                                         \
        int code = failed(ask(d, NULL, 0, NULL, __VA_ARGS__)); \
        LEAVE(code);                                           \
    }

#define NUMBER(name, word)                                          \
    double name(int dev, int channel)                               \
    {                                                               \
        double value = 0.0;                                         \
        ENTER(0.0)                                                  \
        failed(ask(d, &value, 8, NULL, word " %d", channel));       \
        LEAVE(value);                                               \
    }

/* ---------------------------------------------------------------- the library itself */

int IfmDLLVersion(void) { return 0x0200; }
const char *IfmDLLVersionString(void) { return "siosifm stub of Bondsight 2.0"; }
void IfmSetOption(int option, int value) { (void)option, (void)value; }
int IfmInit(void) { return 0; }
int IfmPoll(void) { return 0; }
int IfmMaxDeviceCount(void) { return DEVICES; }
void IfmCloseDevice(int dev);

void IfmClose(void)
{
    for (int k = 0; k < DEVICES; k++) IfmCloseDevice(k);
}

int IfmGetError(void)
{
    int code = first_error;
    first_error = 0;
    return code;
}

const char *IfmGetErrorString(int code)
{
    switch (code) {
    case 0: return "no error";
    case INVALID: return "device not valid, closed or unplugged";
    case BAD_CHANNEL: return "no such channel";
    case -3: return "not possible with this type of device";
    case DATALEN: return "block too long";
    case DEVICECOUNT: return "too many devices open";
    case BAD_REQUEST: return "no such information";
    case BAD_USB: return "no such USB device";
    case CREATE_HANDLE: return "device cannot be opened";
    case -18: return "output word rate too high";
    case -19: return "information not available yet";
    case -22: return "bad parameter";
    case NOT_IMPLEMENTED: return "not implemented";
    default: return "unknown error";
    }
}

/* ---------------------------------------------------------------- open and close */

static int opened(int fd, int interface, const char *how, int number)
{
    int k = 0;
    if (fd < 0) return failed(CREATE_HANDLE);
    while (k < DEVICES && devices[k].used) k++;
    if (k == DEVICES) {
        close(fd);
        return failed(DEVICECOUNT);
    }
    device *d = &devices[k];
    memset(d, 0, sizeof *d);
    d->ring = malloc(BUFFER * sizeof(row));
    d->used = d->alive = 1;
    d->fd = fd;
    d->interface = interface;
    int code = ask(d, NULL, 0, NULL, "OPEN %s %d", how, number);
    if (code < 0) {
        unplugged(d);
        free(d->ring);
        d->used = 0;
        return failed(code);
    }
    return k;
}

int IfmSearchUSBDevices(void)
{
    device d;
    pthread_mutex_lock(&lock);
    memset(&d, 0, sizeof d);
    d.fd = bench();
    d.alive = d.fd >= 0;
    usb_count = d.alive ? ask(&d, NULL, 0, NULL, "SEARCH") : 0;
    unplugged(&d);
    LEAVE(usb_count);
}

int IfmUSBDeviceCount(void) { return usb_count; }

int IfmUSBDeviceSerial(int id)
{
    device d;
    if (id < 0 || id >= usb_count) return failed(BAD_USB);
    pthread_mutex_lock(&lock);
    memset(&d, 0, sizeof d);
    d.fd = bench();
    d.alive = d.fd >= 0;
    int code = failed(ask(&d, NULL, 0, NULL, "USBSERIAL %d", id));
    unplugged(&d);
    LEAVE(code);
}

int IfmOpenUSB(int id)
{
    if (id < 0 || id >= usb_count) return failed(BAD_USB);
    pthread_mutex_lock(&lock);
    int k = opened(bench(), 3, "USB", id);
    LEAVE(k);
}

int IfmSetBaudrate(int baud) { return baud < 0 ? -22 : 0; }

int IfmOpenCOM(const char *name)
{
    (void)name;
    pthread_mutex_lock(&lock);
    int k = opened(bench(), 2, "COM", 0);
    LEAVE(k);
}

int IfmOpenNetwork(const char *ip, int port)
{
    char text[16];
    snprintf(text, sizeof text, "%d", port);
    pthread_mutex_lock(&lock);
    int k = opened(connected(ip, text), 4, "NET", 0);
    LEAVE(k);
}

int IfmOpenDemo(int channels)
{
    pthread_mutex_lock(&lock);
    int k = opened(bench(), 1, "DEMO", channels);
    LEAVE(k);
}

void IfmCloseDevice(int dev)
{
    pthread_mutex_lock(&lock);
    device *d = get(dev);
    if (d) {
        if (d->alive) ask(d, NULL, 0, NULL, "CLOSE");
        unplugged(d);
        free(d->ring);
        d->used = 0;
    }
    pthread_mutex_unlock(&lock);
}

int IfmDeviceCount(void)
{
    int n = 0;
    for (int k = 0; k < DEVICES; k++) n += devices[k].used;
    return n;
}

int IfmDeviceValid(int dev)
{
    pthread_mutex_lock(&lock);
    device *d = get(dev);
    int valid = d && d->alive;
    LEAVE(valid);
}

int IfmDeviceInterface(int dev)
{
    ENTER(INVALID)
    int kind = d->interface;
    LEAVE(kind);
}

SIMPLE(IfmFirmwareVersion, (int dev), "FIRMWARE")
SIMPLE(IfmChannels, (int dev), "CHANNELS")
SIMPLE(IfmDeviceType, (int dev), "TYPE")
SIMPLE(IfmHasDeviceProperty, (int dev, int number), "PROPERTY %d", number)
SIMPLE(IfmSetDeviceInfo, (int dev, int info, int value), "SETINFO %d %d", info, value)

intptr_t IfmDeviceInfo(int dev, int info)
{
    int number = info & 0xff;
    ENTER(0)
    switch (number) {
    case 12: case 32: { /* texts */
        size_t got = 0;
        memset(d->text, 0, TEXT);
        failed(ask(d, d->text, TEXT - 1, &got, "TEXT %d", number));
        LEAVE((intptr_t)d->text);
    }
    case 14: case 17: case 18: case 21: case 25: case 26: case 27: case 28: case 29: { /* pointers */
        int code = failed(ask(d, &d->infos[number], 8, NULL, "NUMBER %d", number));
        LEAVE(code < 0 ? 0 : (intptr_t)&d->infos[number]);
    }
    default: {
        int code = failed(ask(d, NULL, 0, NULL, "INFO %d %d", number, info >> 8));
        LEAVE(code < 0 ? 0 : (intptr_t)code);
    }
    }
}

/* ---------------------------------------------------------------- settings */

SIMPLE(IfmSetTrigger, (int dev, unsigned mode), "TRIGGER %u", mode)
SIMPLE(IfmFireTrigger, (int dev), "FIRE")
SIMPLE(IfmSetFilter, (int dev, unsigned f, int a, int b), "FILTER %u %d %d", f, a, b)
SIMPLE(IfmSetFilterNotchFrequency, (int dev, int channel, double f), "NOTCH %d %.17g", channel, f)
SIMPLE(IfmSetDeadPath, (int dev, int channel, int mm), "DEADPATH %d %d", channel, mm)
SIMPLE(IfmGetDeadPath, (int dev, int channel), "GETDEADPATH %d", channel)
SIMPLE(IfmSetPreset, (int dev, int channel, double nm), "PRESET %d %.17g", channel, nm)
NUMBER(IfmGetPreset, "GETPRESET")
SIMPLE(IfmSetRefMirrorVibration, (int dev, int channel, int on), "REFMIRROR %d %d", channel, on)

int IfmSetToZero(int dev, int mask)
{
    ENTER(INVALID)
    int code = failed(ask(d, NULL, 0, NULL, "ZERO %d", mask));
    d->has_current = 0;
    LEAVE(code);
}

int IfmSetMeasurement(int dev, unsigned flags, double rate)
{
    ENTER(INVALID)
    int code = failed(ask(d, NULL, 0, NULL, "MEASURE %u %.17g", flags, rate));
    if (code >= 0) d->block = 0;
    LEAVE(code);
}

/* ---------------------------------------------------------------- values */

static int cleared(device *d)
{
    d->head = d->count = d->has_current = 0;
    return 0;
}

/* Rows of the answer go behind those in the buffer; those that arrived before a cut are kept. */
static int fetched(device *d, const char *word, int room)
{
    static row answer[BUFFER];
    size_t got;
    int code = failed(ask(d, answer, sizeof answer, &got, "%s %d", word, room));
    int n = (int)(got / sizeof(row));
    for (int k = 0; k < n && d->count < BUFFER; k++) {
        d->ring[(d->head + d->count) % BUFFER] = answer[k];
        d->count++;
    }
    return code;
}

int IfmClearBuffers(int dev)
{
    ENTER(INVALID)
    int code = failed(ask(d, NULL, 0, NULL, "CLEAR"));
    cleared(d);
    LEAVE(code);
}

int IfmStart(int dev)
{
    ENTER(INVALID)
    cleared(d);
    int code = failed(ask(d, NULL, 0, NULL, "START"));
    LEAVE(code);
}

int IfmStop(int dev)
{
    ENTER(INVALID)
    if (!d->block) fetched(d, "FETCH", BUFFER - d->count);
    int code = failed(ask(d, NULL, 0, NULL, "STOP"));
    LEAVE(code);
}

int IfmValueCount(int dev)
{
    ENTER(INVALID)
    int code = d->block ? 0 : fetched(d, "FETCH", BUFFER - d->count);
    int n = d->count > 0 ? d->count : (d->alive ? (code < 0 ? code : 0) : failed(INVALID));
    LEAVE(n);
}

int IfmGetValues(int dev)
{
    ENTER(INVALID)
    if (d->count == 0) LEAVE(d->alive ? 0 : failed(INVALID));
    d->current = d->ring[d->head];
    d->head = (d->head + 1) % BUFFER;
    d->count--;
    d->has_current = 1;
    LEAVE(1);
}

int IfmGetRecentValues(int dev, int index)
{
    ENTER(INVALID)
    if (index < 0 || index >= d->count) LEAVE(d->alive ? 0 : failed(INVALID));
    d->current = d->ring[(d->head + d->count - 1 - index) % BUFFER];
    d->has_current = 1;
    LEAVE(1);
}

double IfmLengthValue(int dev, int channel)
{
    ENTER(0.0)
    double value = channel == 0 ? d->current.length : 0.0;
    LEAVE(value);
}

int64_t IfmRawValue(int dev, int channel)
{
    ENTER(0)
    int64_t value = channel == 0 ? d->current.raw : 0;
    LEAVE(value);
}

int IfmAuxValue(int dev, int channel, int kind)
{
    ENTER(INVALID)
    const row *r = &d->current;
    int value = BAD_REQUEST;
    if (channel != 0) LEAVE(0);
    switch (kind) {
    case 1: value = r->cosine; break;
    case 2: value = r->sine; break;
    case 3: value = r->norm; break;
    case 5: value = (int)r->clock; break;
    case 6: value = (int)r->sample; break;
    }
    LEAVE(value);
}

unsigned IfmStatus(int dev, int channel)
{
    ENTER(STATUS_BAD_REQUEST)
    unsigned bits = STATUS_BAD_REQUEST;
    const char *whose = getenv("BONDSIGHT_BENCH_SIOS_STATUS");
    int present = whose && strcmp(whose, "device") == 0;
    if (channel == 0 && d->has_current && !present) bits = d->current.status;
    else if (channel == 0 && d->alive) {
        int code = ask(d, NULL, 0, NULL, "STATUS");
        if (code >= 0) bits = (unsigned)code;
    }
    LEAVE(bits);
}

/* ---------------------------------------------------------------- blocks */

SIMPLE(IfmSetBlockModeFilter, (int dev, unsigned f, int a, int b), "FILTER %u %d %d", f, a, b)

int IfmSetBlockMode(int dev, int flags, int trigger, int rate)
{
    ENTER(INVALID)
    int code = failed(ask(d, NULL, 0, NULL, "BLOCKMODE %d %d %d", flags, trigger, rate));
    if (code >= 0) d->block = 1;
    LEAVE(code);
}

int IfmStartBlock(int dev, int length)
{
    ENTER(INVALID)
    cleared(d);
    int code = failed(ask(d, NULL, 0, NULL, "BLOCK %d", length));
    LEAVE(code);
}

int IfmIsBlockAvailable(int dev)
{
    ENTER(INVALID)
    if (d->count > 0 && d->alive) LEAVE(1);
    int ready = failed(ask(d, NULL, 0, NULL, "READY"));
    if (ready > 0) {
        int code = fetched(d, "TAKE", BUFFER);
        if (code < 0) ready = code;
    }
    LEAVE(ready);
}

int IfmCancelBlock(int dev)
{
    ENTER(INVALID)
    cleared(d);
    int code = failed(ask(d, NULL, 0, NULL, "CANCEL"));
    LEAVE(code);
}

/* ---------------------------------------------------------------- health and air */

SIMPLE(IfmSignalQuality, (int dev, int channel, int select), "QUALITY %d %d", channel, select)
SIMPLE(IfmNewSignalQualityAvailable, (int dev), "NEWQUALITY")
SIMPLE(IfmWasBeamBreak, (int dev, int channel), "WASBREAK %d", channel)
SIMPLE(IfmWasLostValues, (int dev), "WASLOST")
SIMPLE(IfmWasLaserUnstable, (int dev, int channel), "WASUNSTABLE %d", channel)
SIMPLE(IfmNewEnvValuesAvailable, (int dev), "NEWAIR")
SIMPLE(IfmEnvSensorCount, (int dev), "SENSORS")
SIMPLE(IfmTemperatureFlags, (int dev, int channel), "AIRFLAGS %d T", channel)
SIMPLE(IfmAirPressureFlags, (int dev, int channel), "AIRFLAGS %d P", channel)
SIMPLE(IfmHumidityFlags, (int dev, int channel), "AIRFLAGS %d H", channel)
SIMPLE(IfmEnvironmentFlags, (int dev, int channel), "MANUAL %d", channel)
SIMPLE(IfmIsEdlenEnabled, (int dev, int channel), "EDLEN %d", channel)
NUMBER(IfmTemperature, "AIR T")
NUMBER(IfmAirPressure, "AIR P")
NUMBER(IfmHumidity, "AIR H")
NUMBER(IfmWaterVapourPressure, "AIR F")
NUMBER(IfmAirRefraction, "AIR N")
NUMBER(IfmWavelength, "AIR L")
NUMBER(IfmVacuumWavelength, "AIR V")
NUMBER(IfmConversionCoeff, "AIR C")
NUMBER(IfmDeadpathCoeff, "AIR D")

#define SETTING(name, word)                                             \
    void name(int dev, int channel, double value)                       \
    {                                                                   \
        pthread_mutex_lock(&lock);                                      \
        device *d = get(dev);                                           \
        if (d) failed(ask(d, NULL, 0, NULL, word " %d %.17g", channel, value)); \
        pthread_mutex_unlock(&lock);                                    \
    }
SETTING(IfmSetTemperature, "SETAIR T")
SETTING(IfmSetAirPressure, "SETAIR P")
SETTING(IfmSetHumidity, "SETAIR H")

void IfmEnableEdlenCorrection(int dev, int channel, int on)
{
    pthread_mutex_lock(&lock);
    device *d = get(dev);
    if (d) failed(ask(d, NULL, 0, NULL, "SETEDLEN %d %d", channel, on));
    pthread_mutex_unlock(&lock);
}

void IfmResetManualEnvironment(int dev, int channel, int mask)
{
    pthread_mutex_lock(&lock);
    device *d = get(dev);
    if (d) failed(ask(d, NULL, 0, NULL, "RESETAIR %d %d", channel, mask));
    pthread_mutex_unlock(&lock);
}

/* Wavelength (nm) in air of T (degC), P (Pa), H (%): Birch and Downs, vapour by Magnus. */
double IfmCalculateWavelength(double vacuum, double T, double P, double H)
{
    double s = 1e6 / (vacuum * vacuum);
    double n = 1e-8 * (8342.54 + 2406147.0 / (130.0 - s) + 15998.0 / (38.9 - s));
    double vapour = H / 100.0 * 611.2 * exp(17.62 * T / (243.12 + T));
    double density = (1.0 + 1e-8 * (0.601 - 0.00972 * T) * P) / (1.0 + 0.003661 * T);
    return vacuum / (1.0 + P * n / 96095.43 * density - vapour * (3.7345 - 0.0401 * s) * 1e-10);
}
