/* The twist of a drive train whose motor side moves as recorded:
 *
 *     inertia d'' = -load - by_speed d' - by_angle d - force(d, d')
 *
 * by_speed, by_angle: by how much the load grows with the speed and the angle of the joint.
 *
 * Semi-implicit Euler steps, which neither damp nor drive an oscillation. The force is that of a spring or of two
 * walls with play between them. No product is fused with a sum (-ffp-contract=off), so that results
 * are the same on every processor. Trains with one load are integrated side by side in lanes of vectors: a step waits for
 * the one before, and the other vectors fill the wait. */

#include <math.h>
#include <stdint.h>

/* stiffness and damping: by the inertia where there is a gap. */
typedef struct {
    double stiffness, damping, gap;
} DriveTrain;

#define LANES 4
#define MOST_PARTS 4 /* vectors side by side */
typedef double Vector __attribute__((vector_size(8 * LANES)));
typedef int64_t Mask __attribute__((vector_size(8 * LANES)));
#define INLINE static inline __attribute__((always_inline))
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
#define FOR_EACH_PROCESSOR __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define FOR_EACH_PROCESSOR
#endif

INLINE Vector where(Mask mask, Vector value) { return (Vector)(mask & (Mask)value); }

/* Of two walls with play between them; a wall does not pull. */
INLINE Vector walls(Vector stiffness, Vector damping, Vector half, Vector twist, Vector speed, double inertia) {
    Vector above = twist - half, below = twist + half;
    Vector beyond = where(above > 0, above) + where(below < 0, below);
    Vector push = inertia * (stiffness * beyond + damping * speed);
    return where(push * beyond > 0, push);
}

static double between(const double *signal, int64_t sample, int64_t next, double way) {
    return signal[sample] + way * (signal[next] - signal[sample]);
}

static double at_rest(const DriveTrain *train, double load, double inertia) {
    if (train->gap > 0)
        return copysign(0.5 * train->gap, -load) - load / (train->stiffness * inertia);
    return -load / train->stiffness;
}

/* The compiler makes one copy of it for each number of `parts` and each `play`. Lanes without a train repeat the last. */
INLINE void integrate(int parts, int play, int trains, const DriveTrain *train, int64_t samples, double interval,
        int half_steps, const double *load, const double *inertia, const double *by_speed, const double *by_angle,
        double *out) {
    int steps = 2 * half_steps;
    double step = interval / steps;
    Vector twist[MOST_PARTS] = {0}, speed[MOST_PARTS] = {0}, before[MOST_PARTS] = {0};
    Vector stiffness[MOST_PARTS] = {0}, damping[MOST_PARTS] = {0}, half[MOST_PARTS] = {0};
    for (int lane = 0; lane < parts * LANES; lane++) {
        int part = lane / LANES, place = lane % LANES;
        const DriveTrain *own = &train[lane < trains ? lane : trains - 1];
        stiffness[part][place] = own->stiffness;
        damping[part][place] = own->damping;
        half[part][place] = 0.5 * own->gap;
        twist[part][place] = at_rest(own, load[0], inertia[0]);
    }
    for (int64_t sample = 0; sample < samples; sample++) {
        int64_t next = sample + 1 < samples ? sample + 1 : sample;
        double *to = out + sample;
        for (int lane = 0; lane < trains; lane++) {
            to[3 * lane * samples] = twist[lane / LANES][lane % LANES];
            to[(3 * lane + 1) * samples] = speed[lane / LANES][lane % LANES];
        }
        for (int number = 0; number < steps; number++) {
            double way = (number + 0.5) / steps;
            double mass = between(inertia, sample, next, way), push = between(load, sample, next, way);
            double slope = between(by_angle, sample, next, way), rate = between(by_speed, sample, next, way);
            double share = step / mass;
            for (int part = 0; part < parts; part++) {
                Vector force = play ? walls(stiffness[part], damping[part], half[part], twist[part], speed[part], mass)
                                    : stiffness[part] * twist[part] + damping[part] * speed[part];
                speed[part] -= share * ((push + (rate * speed[part] + slope * twist[part])) + force);
                twist[part] += step * speed[part];
            }
            if (number + 1 == half_steps) {
                double time = sample ? interval : 0.5 * interval;
                for (int lane = 0; lane < trains; lane++)
                    to[(3 * lane + 2) * samples] =
                        (speed[lane / LANES][lane % LANES] - before[lane / LANES][lane % LANES]) / time;
                for (int part = 0; part < parts; part++)
                    before[part] = speed[part];
            }
        }
    }
}

/* Trains that all have a gap, or all have none. load, inertia, by_speed, by_angle: (samples). out: (trains, 3, samples),
 * twist, its speed, and its acceleration as a mean over the interval about each sample; half_steps: half the number of
 * steps from sample to sample. */
FOR_EACH_PROCESSOR
void twists_of_drive_trains(int trains, const DriveTrain *train, int64_t samples, double interval, int half_steps,
        const double *load, const double *inertia, const double *by_speed, const double *by_angle, double *out) {
#define INTEGRATE(parts, play, some) \
    integrate(parts, play, some, train, samples, interval, half_steps, load, inertia, by_speed, by_angle, out)
    int play = train->gap > 0;
    for (int some; trains > 0; trains -= some, train += some, out += 3 * some * samples) {
        some = trains < MOST_PARTS * LANES ? trains : MOST_PARTS * LANES;
        if (!play) INTEGRATE(1, 0, some = some < LANES ? some : LANES);
        else if (some <= LANES) INTEGRATE(1, 1, some);
        else if (some <= 2 * LANES) INTEGRATE(2, 1, some);
        else INTEGRATE(MOST_PARTS, 1, some);
    }
}
