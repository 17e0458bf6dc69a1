/* The twist of a drive train whose motor side moves as recorded:
 *
 *     inertia d'' = -load - by_speed d' - by_angle d - force(d, d')
 *
 * by_speed, by_angle: by how much the load grows with the speed and the angle of the joint.
 *
 * Semi-implicit Euler steps, which neither damp nor drive an oscillation. The force is that of a spring or of two
 * walls with play between them. No product is fused with a sum (-ffp-contract=off), so that results
 * are the same on every processor. */

#include <math.h>
#include <stdint.h>

/* stiffness and damping: by the inertia where there is a gap. */
typedef struct {
    double stiffness, damping, gap;
} DriveTrain;

static double force(const DriveTrain *train, double twist, double speed, double inertia) {
    if (train->gap <= 0)
        return train->stiffness * twist + train->damping * speed;
    double half = 0.5 * train->gap, beyond = twist > half ? twist - half : twist < -half ? twist + half : 0.0;
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

/* load, inertia, by_speed, by_angle: (samples). out: (3, samples), twist, its speed, and its acceleration as a mean over the interval
 * about each sample; half_steps: half the number of steps from sample to sample. */
void twist_of_drive_train(const DriveTrain *train, int64_t samples, double interval, int half_steps, const double *load,
                          const double *inertia, const double *by_speed, const double *by_angle, double *out) {
    int steps = 2 * half_steps;
    double step = interval / steps, twist = at_rest(train, load[0], inertia[0]), speed = 0, before = 0;
    double *position = out, *velocity = out + samples, *acceleration = out + 2 * samples;
    for (int64_t sample = 0; sample < samples; sample++) {
        int64_t next = sample + 1 < samples ? sample + 1 : sample;
        position[sample] = twist;
        velocity[sample] = speed;
        for (int number = 0; number < steps; number++) {
            double way = (number + 0.5) / steps;
            double mass = between(inertia, sample, next, way), push = between(load, sample, next, way);
            push += between(by_speed, sample, next, way) * speed + between(by_angle, sample, next, way) * twist;
            speed += step * (-push - force(train, twist, speed, mass)) / mass;
            twist += step * speed;
            if (number + 1 == half_steps) {
                acceleration[sample] = (speed - before) / (sample ? interval : 0.5 * interval);
                before = speed;
            }
        }
    }
}
