/* Writes a waveform to a memory-mapped card at absolute instants of CLOCK_MONOTONIC.

   Runs without the interpreter's lock in a thread of its own. Every access to the card is a single
   volatile one of the register's width. */

#define _GNU_SOURCE
#include <stdint.h>
#include <time.h>

enum { PLAYING = 0, DONE = 1, STOPPED = 2, GONE = 3, ENDLESS = 4 };
enum { NO_CLOCK = 0, TOGGLE = 1, PULSE = 2 };

typedef struct {
    volatile uint16_t *output, *digital, *start, *inputs;
    volatile uint32_t *control;
    const uint16_t *codes;
    double *instants, *lateness; /* (total) */
    uint16_t *readings;          /* (total, monitors) */
    int64_t total;
    double period, closest, lead, spin, patience;
    uint32_t converting, enable, hold;
    int32_t monitors;
    int32_t lines, trigger, clock, clocking;
    int64_t position;
    int32_t stop, state;
} Playback;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int stopped(Playback *p) { return __atomic_load_n(&p->stop, __ATOMIC_ACQUIRE); }

/* Sleeps until shortly before the instant, in pieces so that a stop is heard, then spins. */
static double until(Playback *p, double instant)
{
    double t = now();
    while (instant - t > p->spin) {
        double end = instant - p->spin;
        if (end > t + 5e-3)
            end = t + 5e-3;
        struct timespec wake;
        wake.tv_sec = (time_t)end;
        wake.tv_nsec = (long)(1e9 * (end - (double)wake.tv_sec));
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, 0);
        t = now();
        if (stopped(p))
            return t;
    }
    while (t < instant)
        t = now();
    return t;
}

/* Waits for the conversion; the control word shows a card that is gone. */
static int settled(Playback *p)
{
    double since = 0.0;
    for (long looks = 0;; looks++) {
        uint32_t word = *p->control;
        if (word == 0xFFFFFFFFu || (word & (p->enable | p->hold)) != p->enable)
            return GONE;
        if (!p->monitors || !(word & p->converting))
            return PLAYING;
        if (looks == 64)
            since = now();
        if (looks > 64 && now() - since > p->patience)
            return ENDLESS;
    }
}

static void lines_at(Playback *p, int64_t k)
{
    int32_t lines = p->lines | p->trigger;
    if (p->clocking == PULSE || (p->clocking == TOGGLE && k % 2 == 0))
        lines |= p->clock;
    else if (p->clocking == TOGGLE)
        lines &= ~p->clock;
    if (lines != p->lines) {
        *p->digital = (uint16_t)lines;
        p->lines = lines;
    }
    if (p->clocking == PULSE) {
        p->lines = lines & ~p->clock;
        *p->digital = (uint16_t)p->lines;
    }
}

/* writes that tell what one takes */
#define RECENT 16

void play(Playback *p)
{
    double start = now() + p->lead, last = start - 1e9, recent[RECENT];
    int32_t state = DONE;
    for (int64_t k = 0; k < p->total; k++) {
        double due = start + (double)k * p->period, soonest = last + p->closest;
        double t = until(p, due > soonest ? due : soonest);
        if (stopped(p)) {
            state = STOPPED;
            break;
        }
        if (p->monitors)
            (void)*p->start;
        *p->output = p->codes[k];
        /* a stall may have come in between; what the quickest of the last writes took, the next
           one takes too */
        double took = now() - t, least = k > 0 ? took : 0.0; /* the first may be a stall itself */
        for (int64_t i = 0; i < RECENT && i < k; i++)
            if (recent[i] < least) least = recent[i];
        recent[k % RECENT] = took;
        last = t + took - least;
        lines_at(p, k);
        p->instants[k] = t;
        p->lateness[k] = t - due;
        int found = settled(p);
        for (int32_t m = 0; m < p->monitors && found == PLAYING; m++)
            p->readings[k * p->monitors + m] = *p->inputs;
        __atomic_store_n(&p->position, k + 1, __ATOMIC_RELEASE);
        if (found != PLAYING) {
            state = found;
            break;
        }
    }
    __atomic_store_n(&p->state, state, __ATOMIC_RELEASE);
}
