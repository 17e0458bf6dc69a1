/* Closed-loop replay of one joint in windows of measured motion, for many sets of servo parameters.
 *
 * One step of Moreau's time stepping: friction is an impulse bounded by its level, damping implicit, gravity and drive
 * explicit (the equations stand in joint_replay.py). No product is fused with a sum (-ffp-contract=off), so that
 * results are the same on every processor. */

#include <math.h>
#include <stdint.h>

/* In the order of PARAMETERS in servo.py. */
typedef struct {
    double kp, damping, friction, kd, armature, limit, delay, offset, dead_band, load_friction;
} Servo;

/* One joint in all windows. command: (windows, columns); inertia, load, slope, measured, supply: (windows, steps), supply
 * may be null; begin: (windows + 1), first sample of each window; row, fraction: (samples), where each lies. */
typedef struct {
    int64_t windows, steps, columns, history;
    double step;
    const double *command, *inertia, *load, *slope, *measured, *supply, *first_velocity;
    const int64_t *begin, *row;
    const double *fraction;
} Stretch;

static double clip(double value, double bound) { return value > bound ? bound : value < -bound ? -bound : value; }

/* The command at a step, `late` steps late, linear between two steps. */
static double command_at(const double *command, int64_t columns, double place) {
    double whole = floor(place);
    int64_t row = (int64_t)whole;
    if (row < 0)
        return command[0];
    if (row >= columns - 1)
        return command[columns - 1];
    return command[row] + (place - whole) * (command[row + 1] - command[row]);
}

static void replay_window(const Stretch *at, int64_t window, const Servo *servo, double *out) {
    const int64_t from = window * at->steps;
    const double *command = at->command + window * at->columns, h = at->step, late = servo->delay / h;
    double position = at->measured[from], velocity = at->first_velocity[window];
    int64_t sample = at->begin[window];
    for (int64_t step = 0; sample < at->begin[window + 1] && step < at->steps; step++) {
        double before = position, mass = at->inertia[from + step] + servo->armature;
        double error = command_at(command, at->columns, (double)(at->history + step) - late) + servo->offset - position;
        if (servo->dead_band > 0)
            error -= clip(error, 0.5 * servo->dead_band);
        double supply = at->supply ? at->supply[from + step] : 1.0;
        double load = at->load[from + step] + at->slope[from + step] * (position - at->measured[from + step]);
        double pull = servo->kp * error, weight = mass + h * (servo->damping + supply * servo->kd);
        double free = (mass * velocity + h * (supply * pull - load)) / weight;
        double torque = pull - servo->kd * free;
        if (fabs(torque) > servo->limit) {
            weight = mass + h * servo->damping;
            free = (mass * velocity + h * (supply * clip(torque, servo->limit) - load)) / weight;
        }
        double level = h * (servo->friction + servo->load_friction * fabs(load)) / weight;
        velocity = free;
        velocity -= clip(velocity, level);
        position += h * velocity;
        for (; sample < at->begin[window + 1] && at->row[sample] == step; sample++)
            out[sample] = before + at->fraction[sample] * (position - before);
    }
}

/* servos: (sets). out: (sets, samples), simulated positions. */
void replay_joint(const Stretch *at, int64_t sets, const Servo *servos, double *out) {
    for (int64_t set = 0; set < sets; set++)
        for (int64_t window = 0; window < at->windows; window++)
            replay_window(at, window, servos + set, out + set * at->begin[at->windows]);
}
