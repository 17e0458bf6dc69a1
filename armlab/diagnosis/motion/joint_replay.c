/* Closed-loop replay of one joint in windows of measured motion, for many sets of servo parameters.
 *
 * One step of Moreau's midpoint rule: friction is an impulse bounded by its level, damping implicit, gravity and drive
 * explicit (the equations stand in joint_replay.py). No product is fused with a sum (-ffp-contract=off), so that
 * results are the same on every processor. */

#include <math.h>
#include <stdint.h>

#define LEAST_MASS 0.5 /* of an inertia: what a negative payload leaves of it */

/* In the order of PARAMETERS in servo.py. */
typedef struct {
    double kp, damping, friction, kd, armature, limit, delay, offset, dead_band, load_friction, ki, integral_limit,
        payload;
} Servo;

/* One joint in all windows. command: (windows, columns); measured, supply: (windows, steps), supply may be null; inertia,
 * load, slope: the same in the middle of each step; unit_inertia, unit_load, unit_slope: the same of 1 kg at the tool. begin: (windows + 1), first sample of
 * each window; row, fraction: (samples), where each lies. path_command: (runs, path_columns), path_measured: (runs,
 * path_columns - history): a run from its first sample on; integral: (runs), of the drive there, N m; run, start:
 * (windows), the run of a window and its first step there. */
typedef struct {
    int64_t windows, steps, columns, history, path_columns;
    double step;
    const double *command, *inertia, *load, *slope, *measured, *supply, *first_velocity;
    const double *unit_inertia, *unit_load, *unit_slope, *path_command, *path_measured, *integral;
    const int64_t *begin, *row, *run, *start;
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

/* The error that the drive acts on: what its dead band leaves. */
static double acting_error(const Servo *servo, double command, double position) {
    double error = command + servo->offset - position;
    return servo->dead_band > 0 ? error - clip(error, 0.5 * servo->dead_band) : error;
}

/* Integrals of the drive at the first step of each window, (windows), along the measured motion of its run. */
static void integrate_runs(const Stretch *at, const Servo *servo, double *integrals) {
    const double h = at->step, late = servo->delay / h;
    double integral = 0;
    int64_t step = 0;
    for (int64_t window = 0; window < at->windows; window++) {
        int64_t run = at->run[window];
        if (window == 0 || run != at->run[window - 1]) {
            step = 0;
            integral = clip(at->integral[run], servo->integral_limit);
        }
        const double *command = at->path_command + run * at->path_columns;
        const double *measured = at->path_measured + run * (at->path_columns - at->history);
        for (; step < at->start[window]; step++) {
            double asked = command_at(command, at->path_columns, (double)(at->history + step) - late);
            double error = acting_error(servo, asked, 0.5 * (measured[step] + measured[step + 1]));
            integral = clip(integral + h * servo->ki * error, servo->integral_limit);
        }
        integrals[window] = integral;
    }
}

static void replay_window(const Stretch *at, int64_t window, const Servo *servo, double integral, double *out) {
    const int64_t from = window * at->steps;
    const double *command = at->command + window * at->columns, h = at->step, late = servo->delay / h;
    double position = at->measured[from], velocity = at->first_velocity[window];
    int64_t sample = at->begin[window];
    for (int64_t step = 0; sample < at->begin[window + 1] && step < at->steps; step++) {
        int64_t now = from + step, next = step + 1 < at->steps ? now + 1 : now;
        double before = position, middle = position + 0.5 * h * velocity;
        double away = middle - 0.5 * (at->measured[now] + at->measured[next]);
        double bare = at->inertia[now] + servo->armature;
        double mass = fmax(bare + servo->payload * at->unit_inertia[now], LEAST_MASS * bare);
        double load = at->load[now] + servo->payload * at->unit_load[now];
        load += (at->slope[now] + servo->payload * at->unit_slope[now]) * away;
        double asked = command_at(command, at->columns, (double)(at->history + step) - late);
        double error = acting_error(servo, asked, middle), supply = at->supply ? at->supply[now] : 1.0;
        integral = clip(integral + h * servo->ki * error, servo->integral_limit);
        double pull = servo->kp * error + integral, slow = 0.5 * h * (servo->damping + supply * servo->kd);
        double free = ((mass - slow) * velocity + h * (supply * pull - load)) / (mass + slow);
        double torque = pull - 0.5 * servo->kd * (velocity + free);
        if (fabs(torque) > servo->limit) {
            slow = 0.5 * h * servo->damping;
            free = ((mass - slow) * velocity + h * (supply * clip(torque, servo->limit) - load)) / (mass + slow);
        }
        double level = h * (servo->friction + servo->load_friction * fabs(load)) / (mass + slow);
        velocity = free;
        velocity -= clip(velocity, level);
        position = middle + 0.5 * h * velocity;
        for (; sample < at->begin[window + 1] && at->row[sample] == step; sample++)
            out[sample] = before + at->fraction[sample] * (position - before);
    }
}

/* servos: (sets). out: (sets, samples), simulated positions; integrals: (windows), room for those of a set. */
void replay_joint(const Stretch *at, int64_t sets, const Servo *servos, double *integrals, double *out) {
    for (int64_t set = 0; set < sets; set++) {
        for (int64_t window = 0; window < at->windows; window++)
            integrals[window] = 0;
        if (servos[set].ki > 0)
            integrate_runs(at, servos + set, integrals);
        for (int64_t window = 0; window < at->windows; window++)
            replay_window(at, window, servos + set, integrals[window], out + set * at->begin[at->windows]);
    }
}
