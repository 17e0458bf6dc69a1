/* Closed-loop replay of one joint in windows of measured motion, for many sets of servo parameters.
 *
 * One step of Moreau's midpoint rule: friction is an impulse bounded by its level, damping implicit, gravity and drive
 * explicit (the equations stand in joint_replay.py). No product is fused with a sum (-ffp-contract=off), so that
 * results are the same on every processor. */

#include <math.h>
#include <stdint.h>
#include <string.h>

#define LEAST_MASS 0.5 /* of an inertia: what a negative payload leaves of it */

/* Compiled for processors with and without AVX2, whichever runs it: the operations and their results are the same. */
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define SEVERAL_PROCESSORS __attribute__((target_clones("avx2", "default")))
#else
#define SEVERAL_PROCESSORS
#endif
#define INLINE static inline __attribute__((always_inline))

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

/* A vector of numbers, and a mask with all bits of a number set or none (extensions of GCC and Clang). */
typedef double Vector __attribute__((vector_size(32)));
typedef int64_t Mask __attribute__((vector_size(32)));
#define WIDTH 4
#define PARTS (LANES / WIDTH)
#define EACH_PART for (int part = 0; part < PARTS; part++)

INLINE Vector choose(Mask mask, Vector yes, Vector no) {
    return (Vector)((mask & (Mask)yes) | (~mask & (Mask)no));
}

INLINE Vector clip_each(Vector value, Vector bound) {
    return choose(value > bound, bound, choose(value < -bound, -bound, value));
}

INLINE Vector size_of(Vector value) { return choose(value < 0, -value, value); }

/* What the drive asks of an error, its integral not counted: the dead band takes half its width, `band`. */
INLINE Vector pull_of(const Servo *servo, Vector error, Vector band) {
    return servo->kp * (servo->dead_band > 0 ? error - clip_each(error, band) : error);
}

INLINE int64_t column_at(int64_t column, int64_t last) { return column < 0 ? 0 : column < last ? column : last; }

/* Column `step` of LANES rows of a table, each from its place on. */
INLINE void take(const double *table, const int64_t from[LANES], int64_t step, Vector out[PARTS]) {
    EACH_PART {
        const int64_t *own = from + part * WIDTH;
        const double *at = table + step;
        out[part] = (Vector){at[own[0]], at[own[1]], at[own[2]], at[own[3]]};
    }
}

/* Positions at the beginning of each step, (steps + 1, LANES), of LANES windows at once, which are independent of each
 * other: a processor computes several in one instruction.
 *
 * The torque limit acts on the command before its change within a step and on that after it, which are the means of the
 * steps around it: a limit on the torque of the mean command would cut too little, and a fit would find it too low. */
SEVERAL_PROCESSORS
static void replay_lanes(const Stretch *at, const int64_t window[LANES], int64_t steps, const Servo *servo,
    const double *integrals, double *path) {
    const double h = at->step, half = 0.5 * h, late = servo->delay / h, limit = servo->limit;
    const Vector none = {0}, full = none + 1.0, widest = none + limit, band = none + 0.5 * servo->dead_band;
    const Vector wound_up = none + servo->integral_limit;
    const int64_t last = at->columns - 1;
    Vector position[PARTS], velocity[PARTS], integral[PARTS], passed[PARTS], earlier[PARTS];
    int64_t from[LANES], commands[LANES], own[LANES];
    for (int lane = 0; lane < LANES; lane++) {
        from[lane] = window[lane] * at->steps;
        commands[lane] = window[lane] * at->columns;
        own[lane] = window[lane];
    }
    take(at->measured, from, 0, position);
    take(at->measured, from, 0, passed);
    take(at->first_velocity, own, 0, velocity);
    take(integrals, own, 0, integral);
    take(at->command, commands, column_at((int64_t)floor((double)at->history - late) - 1, last), earlier);
    for (int64_t step = 0; step < steps; step++) {
        Vector before[PARTS], after[PARTS], mass[PARTS], load[PARTS], slope[PARTS], next[PARTS], supply[PARTS];
        Vector free[PARTS], slow[PARTS], torque[PARTS], later[PARTS], asked[PARTS], away[PARTS];
        const double place = (double)(at->history + step) - late, whole = floor(place), share = place - whole;
        const int64_t row = (int64_t)whole;
        take(at->command, commands, column_at(row, last), before);
        take(at->command, commands, row < 0 ? 0 : column_at(row + 1, last), after);
        if (share > 0)
            take(at->command, commands, column_at(row + 2, last), later);
        else
            EACH_PART later[part] = after[part];
        take(at->inertia, from, step, mass);
        take(at->load, from, step, load);
        take(at->slope, from, step, slope);
        take(at->measured, from, step + 1 < at->steps ? step + 1 : step, next);
        EACH_PART mass[part] += servo->armature;
        if (servo->payload != 0) {
            Vector unit_mass[PARTS], unit_load[PARTS], unit_slope[PARTS];
            take(at->unit_inertia, from, step, unit_mass);
            take(at->unit_load, from, step, unit_load);
            take(at->unit_slope, from, step, unit_slope);
            EACH_PART {
                const Vector least = LEAST_MASS * mass[part], loaded = mass[part] + servo->payload * unit_mass[part];
                mass[part] = choose(loaded > least, loaded, least);
                load[part] += servo->payload * unit_load[part];
                slope[part] += servo->payload * unit_slope[part];
            }
        }
        EACH_PART supply[part] = full;
        if (at->supply)
            take(at->supply, from, step, supply);
        Mask beyond = {0};
        EACH_PART {
            const Vector middle = position[part] + half * velocity[part];
            load[part] += slope[part] * (middle - 0.5 * (passed[part] + next[part]));
            passed[part] = next[part];
            away[part] = servo->offset - middle;
            asked[part] = before[part] + share * (after[part] - before[part]);
            const Vector proportional = pull_of(servo, asked[part] + away[part], band);
            Vector pull = proportional;
            if (servo->ki > 0) {
                integral[part] = clip_each(integral[part] + h * servo->ki / servo->kp * proportional, wound_up);
                pull += integral[part];
            }
            slow[part] = half * (servo->damping + supply[part] * servo->kd);
            free[part] = (mass[part] - slow[part]) * velocity[part] + h * (supply[part] * pull - load[part]);
            free[part] /= mass[part] + slow[part];
            torque[part] = pull - 0.5 * servo->kd * (velocity[part] + free[part]);
            beyond |= size_of(torque[part]) + servo->kp * size_of(later[part] - earlier[part]) > widest;
        }
        if (beyond[0] | beyond[1] | beyond[2] | beyond[3])
            EACH_PART {
                const Vector done = (asked[part] - earlier[part]) / (later[part] - earlier[part]);
                const Vector rest = torque[part] - pull_of(servo, asked[part] + away[part], band);
                const Mask changes = (done > 0) & (done < 1);
                const Vector old = choose(changes, earlier[part], asked[part]);
                const Vector new = choose(changes, later[part], asked[part]);
                const Vector first = rest + pull_of(servo, old + away[part], band);
                const Vector second = rest + pull_of(servo, new + away[part], band);
                const Mask over = (size_of(first) > widest) | (size_of(second) > widest);
                const Vector begun = clip_each(first, widest), ended = clip_each(second, widest);
                const Vector held = supply[part] * (begun + choose(changes, done, none) * (ended - begun));
                const Vector outside = none + half * servo->damping;
                const Vector pushed = (mass[part] - outside) * velocity[part] + h * (held - load[part]);
                free[part] = choose(over, pushed / (mass[part] + outside), free[part]);
                slow[part] = choose(over, outside, slow[part]);
            }
        EACH_PART {
            const Vector friction = servo->friction + servo->load_friction * size_of(load[part]);
            const Vector moved = position[part] + half * velocity[part];
            memcpy(path + step * LANES + part * WIDTH, position + part, sizeof(Vector));
            velocity[part] = free[part] - clip_each(free[part], h * friction / (mass[part] + slow[part]));
            position[part] = moved + half * velocity[part];
            earlier[part] = before[part];
        }
    }
    memcpy(path + steps * LANES, position, sizeof position);
}

/* servos: (sets). out: (sets, samples), simulated positions; integrals: (sets, windows), room for those of the sets;
 * path: (steps + 1, LANES), room for positions. */
void replay_joint(const Stretch *at, int64_t sets, const Servo *servos, double *integrals, double *path, double *out) {
    const int64_t samples = at->begin[at->windows];
    for (int64_t set = 0; set < sets; set++) {
        for (int64_t window = 0; window < at->windows; window++)
            integrals[set * at->windows + window] = 0;
        if (servos[set].ki > 0)
            integrate_runs(at, servos + set, integrals + set * at->windows);
    }
    for (int64_t first = 0; first < at->windows; first += LANES) {
        int64_t window[LANES], steps = 0;
        int lanes = at->windows - first < LANES ? (int)(at->windows - first) : LANES;
        for (int lane = 0; lane < LANES; lane++) {
            window[lane] = first + (lane < lanes ? lane : lanes - 1);
            int64_t end = at->begin[window[lane] + 1];
            if (end > at->begin[window[lane]] && at->row[end - 1] >= steps)
                steps = at->row[end - 1] + 1;
        }
        for (int64_t set = 0; set < sets; set++) {
            replay_lanes(at, window, steps, servos + set, integrals + set * at->windows, path);
            for (int lane = 0; lane < lanes; lane++)
                for (int64_t sample = at->begin[window[lane]]; sample < at->begin[window[lane] + 1]; sample++) {
                    const double *before = path + at->row[sample] * LANES + lane;
                    out[set * samples + sample] = before[0] + at->fraction[sample] * (before[LANES] - before[0]);
                }
        }
    }
}
