/* Second-order sections of a linear filter in the transposed direct form II, each fed by the one before:
 *
 *     y = b0 x + u,    u' = b1 x - a1 y + v,    v' = b2 x - a2 y
 *
 * A sample waits for the one before it; columns are filtered side by side to fill the wait. No product is fused with a
 * sum (-ffp-contract=off), so that results are the same on every processor and in any company of columns. */

#include <stdint.h>

#define MAX_SECTIONS 4
#define MAX_LANES 8

typedef struct {
    double b0, b1, b2, a1, a2;
} Section;

typedef double State[MAX_SECTIONS][2][MAX_LANES];

static inline __attribute__((always_inline)) void
pass(int sections, const Section *section, State state, double *value, const int lanes) {
    for (int each = 0; each < sections; each++) {
        const Section by = section[each];
        double *u = state[each][0], *v = state[each][1];
        for (int lane = 0; lane < lanes; lane++) {
            double in = value[lane], out = by.b0 * in + u[lane];
            u[lane] = by.b1 * in - by.a1 * out + v[lane];
            v[lane] = by.b2 * in - by.a2 * out;
            value[lane] = out;
        }
    }
}

static inline __attribute__((always_inline)) void
settle(int sections, const double *settled, const double *value, State state, const int lanes) {
    for (int each = 0; each < sections; each++)
        for (int order = 0; order < 2; order++)
            for (int lane = 0; lane < lanes; lane++)
                state[each][order][lane] = settled[2 * each + order] * value[lane];
}

/* A sample of a signal that is continued at both ends by its mirror image through the end. */
static inline __attribute__((always_inline)) void
extended(const double *signal, int64_t samples, int64_t columns, int64_t place, double *out, const int lanes) {
    int64_t end = place < 0 ? 0 : samples - 1;
    if (place >= 0 && place < samples)
        for (int lane = 0; lane < lanes; lane++)
            out[lane] = signal[place * columns + lane];
    else
        for (int lane = 0; lane < lanes; lane++)
            out[lane] = 2 * signal[end * columns + lane] - signal[(2 * end - place) * columns + lane];
}

static inline __attribute__((always_inline)) void
both_ways(int sections, const Section *section, const double *settled, int64_t samples, int64_t columns,
          int64_t padding, const double *signal, int64_t first, int64_t step, int64_t kept, double *scratch,
          double *out, const int lanes) {
    State state;
    double value[MAX_LANES];
    int64_t next = first + (kept - 1) * step;
    extended(signal, samples, columns, -padding, value, lanes);
    settle(sections, settled, value, state, lanes);
    for (int64_t place = -padding; place < samples + padding; place++) {
        extended(signal, samples, columns, place, value, lanes);
        pass(sections, section, state, value, lanes);
        for (int lane = 0; lane < lanes; lane++)
            scratch[(place + padding) * lanes + lane] = value[lane];
    }
    settle(sections, settled, value, state, lanes);
    for (int64_t place = samples + padding - 1; place >= first; place--) {
        for (int lane = 0; lane < lanes; lane++)
            value[lane] = scratch[(place + padding) * lanes + lane];
        pass(sections, section, state, value, lanes);
        if (place != next)
            continue;
        for (int lane = 0; lane < lanes; lane++)
            out[(place - first) / step * columns + lane] = value[lane];
        next -= step;
    }
}

/* Columns forwards and backwards, from settled states. signal: samples by columns; out: the kept samples, each
 * step-th from the first, by columns. scratch: (samples + 2 padding) * MAX_LANES numbers. */
void filter_both_ways(int sections, const Section *section, const double *settled, int64_t samples, int64_t columns,
                      int64_t padding, const double *signal, int64_t first, int64_t step, int64_t kept,
                      double *scratch, double *out) {
#define FILTER(lanes)                                                                                                  \
    for (; column + lanes <= columns; column += lanes)                                                                 \
        both_ways(sections, section, settled, samples, columns, padding, signal + column, first, step, kept, scratch,  \
                  out + column, lanes);
    int64_t column = 0;
    FILTER(8)
    FILTER(4)
    FILTER(2)
    FILTER(1)
#undef FILTER
}

/* One signal forwards, from states (sections, 2). */
void filter_forwards(int sections, const Section *section, const double *start, int64_t samples, const double *signal,
                     double *out) {
    State state;
    double one = 1.0;
    settle(sections, start, &one, state, 1);
    for (int64_t place = 0; place < samples; place++) {
        out[place] = signal[place];
        pass(sections, section, state, out + place, 1);
    }
}
