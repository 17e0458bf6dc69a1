/* The twist of a drive train whose motor side moves as recorded:
 *
 *     inertia d'' = -load - by_speed d' - by_angle d - force(d, d')
 *
 * by_speed, by_angle: by how much the load grows with the speed and the angle of the joint.
 *
 * Semi-implicit Euler steps, which neither damp nor drive an oscillation. The force is that of a spring or of two
 * walls with play between them. No product is fused with a sum (-ffp-contract=off), so that results
 * are the same on every processor. Trains with one load are integrated side by side: a step waits for the one before,
 * and lanes fill the wait. */

#include <math.h>
#include <stdint.h>

/* stiffness and damping: by the inertia where there is a gap. */
typedef struct {
    double stiffness, damping, gap;
} DriveTrain;

#define LANES 8

static inline double spring(const DriveTrain *train, double twist, double speed) {
    return train->stiffness * twist + train->damping * speed;
}

static inline double walls(const DriveTrain *train, double twist, double speed, double inertia) {
    double half = 0.5 * train->gap, above = twist - half, below = twist + half;
    double beyond = twist > half ? above : twist < -half ? below : 0.0;
    double push = inertia * (train->stiffness * beyond + train->damping * speed);
    return push * beyond > 0 ? push : 0.0; /* a wall does not pull */
}

static double between(const double *signal, int64_t sample, int64_t next, double way) {
    return signal[sample] + way * (signal[next] - signal[sample]);
}

static double at_rest(const DriveTrain *train, double load, double inertia) {
    if (train->gap > 0)
        return copysign(0.5 * train->gap, -load) - load / (train->stiffness * inertia);
    return -load / train->stiffness;
}

/* The compiler makes one copy of it for each `lanes` and `play`. */
static inline __attribute__((always_inline)) void integrate(int lanes, int play, const DriveTrain *train,
        int64_t samples, double interval, int half_steps, const double *load, const double *inertia,
        const double *by_speed, const double *by_angle, double *out) {
    int steps = 2 * half_steps;
    double step = interval / steps, twist[LANES], speed[LANES], before[LANES];
    for (int lane = 0; lane < lanes; lane++) {
        twist[lane] = at_rest(&train[lane], load[0], inertia[0]);
        speed[lane] = before[lane] = 0;
    }
    for (int64_t sample = 0; sample < samples; sample++) {
        int64_t next = sample + 1 < samples ? sample + 1 : sample;
        for (int lane = 0; lane < lanes; lane++) {
            out[3 * lane * samples + sample] = twist[lane];
            out[(3 * lane + 1) * samples + sample] = speed[lane];
        }
        for (int number = 0; number < steps; number++) {
            double way = (number + 0.5) / steps;
            double mass = between(inertia, sample, next, way), push = between(load, sample, next, way);
            double slope = between(by_angle, sample, next, way), rate = between(by_speed, sample, next, way);
            for (int lane = 0; lane < lanes; lane++) {
                double force = play ? walls(&train[lane], twist[lane], speed[lane], mass)
                                    : spring(&train[lane], twist[lane], speed[lane]);
                double against = push + (rate * speed[lane] + slope * twist[lane]);
                speed[lane] += step * (-against - force) / mass;
                twist[lane] += step * speed[lane];
            }
            if (number + 1 == half_steps)
                for (int lane = 0; lane < lanes; lane++) {
                    double change = speed[lane] - before[lane];
                    out[(3 * lane + 2) * samples + sample] = change / (sample ? interval : 0.5 * interval);
                    before[lane] = speed[lane];
                }
        }
    }
}

/* Trains that all have a gap, or all have none. load, inertia, by_speed, by_angle: (samples). out: (trains, 3, samples),
 * twist, its speed, and its acceleration as a mean over the interval about each sample; half_steps: half the number of
 * steps from sample to sample. */
void twists_of_drive_trains(int trains, const DriveTrain *train, int64_t samples, double interval, int half_steps,
        const double *load, const double *inertia, const double *by_speed, const double *by_angle, double *out) {
#define INTEGRATE(lanes, play) \
    integrate(lanes, play, train, samples, interval, half_steps, load, inertia, by_speed, by_angle, out)
    int play = train->gap > 0;
    for (; trains >= LANES; trains -= LANES, train += LANES, out += 3 * LANES * samples)
        if (play) INTEGRATE(LANES, 1); else INTEGRATE(LANES, 0);
    for (; trains > 0; trains--, train++, out += 3 * samples)
        if (play) INTEGRATE(1, 1); else INTEGRATE(1, 0);
}
