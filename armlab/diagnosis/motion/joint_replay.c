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
    double kp, damping, friction, kd, armature, limit, limit_slope, delay, offset, dead_band, load_friction,
        static_excess, stribeck_speed, ki, ki_speed, integral_limit, payload;
} Servo;

/* One joint in all windows. command: (windows, columns); measured, supply: (windows, steps), supply may be null; inertia,
 * load, slope: the same in the middle of each step; unit_inertia, unit_load, unit_slope: the same of 1 kg at the tool. begin: (windows + 1), first sample of
 * each window; row, fraction: (samples), where each lies. path_command: (runs, path_columns), path_measured: (runs,
 * path_columns - history): a run from its first sample on; encoder_step: in which the drive reads its position, 0 for none; integral: (runs), of the drive there, N m; run, start:
 * (windows), the run of a window and its first step there. */
typedef struct {
    int64_t windows, steps, columns, history, path_columns;
    double step, encoder_step, encoder_phase;
    const double *command, *inertia, *load, *slope, *measured, *supply, *first_velocity;
    const double *unit_inertia, *unit_load, *unit_slope, *path_command, *path_measured, *integral;
    const int64_t *begin, *row, *run, *start;
    const double *fraction;
} Stretch;

/* Masses of an arm at every `every` steps. mass: (windows, rows, joints, joints), two rows at least, and one after the
 * last step; moves: (windows, joints), 1 for a joint that is replayed, else 0. */
typedef struct {
    int64_t rows, every;
    const double *mass, *moves;
} MassTable;

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
            double moved = measured[step + 1] - measured[step];
            integral = clip(integral + h * servo->ki * error - servo->ki_speed * moved, servo->integral_limit);
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

#define ROUNDS 6755399441055744.0 /* 1.5 2^52: a sum with it has no digits after the point */

/* A position as an encoder reads it: the nearest of its steps. */
INLINE Vector read_position(const Stretch *at, Vector position) {
    if (at->encoder_step <= 0)
        return position;
    return ((position - at->encoder_phase) / at->encoder_step + ROUNDS - ROUNDS) * at->encoder_step + at->encoder_phase;
}

/* A torque within the limit of the drive, which may be less where the drive does work: `working`, at a velocity. */
INLINE Vector clip_torque(Vector torque, Vector velocity, Vector limit, Vector working) {
    return clip_each(torque, choose(torque * velocity > 0, working, limit));
}

/* The level of friction at a velocity, without that of the load. */
INLINE Vector level_at(const Servo *servo, Vector velocity) {
    Vector level = {0};
    level += servo->friction;
    if (servo->static_excess > 0)
        for (int lane = 0; lane < WIDTH; lane++) {
            const double slip = velocity[lane] / servo->stribeck_speed;
            level[lane] += servo->static_excess * exp(-slip * slip);
        }
    return level;
}

/* What the drive acts on of an error: the dead band takes half its width, `band`. */
INLINE Vector left_of(const Servo *servo, Vector error, Vector band) {
    return servo->dead_band > 0 ? error - clip_each(error, band) : error;
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

/* LANES windows of one joint that are replayed at once: a processor computes several in one instruction. */
typedef struct {
    int64_t from[LANES], commands[LANES], own[LANES]; /* places of their first step, first command, and own number */
} Lanes;

INLINE Lanes lanes_of(const Stretch *at, const int64_t window[LANES]) {
    Lanes lanes;
    for (int lane = 0; lane < LANES; lane++) {
        lanes.from[lane] = window[lane] * at->steps;
        lanes.commands[lane] = window[lane] * at->columns;
        lanes.own[lane] = window[lane];
    }
    return lanes;
}

/* At the beginning of a step. passed: the measured position there; earlier, thrust: the command and the torque that
 * accelerated the link in the step before. */
typedef struct {
    Vector position[PARTS], velocity[PARTS], integral[PARTS], passed[PARTS], earlier[PARTS], thrust[PARTS];
} State;

INLINE State first_state(const Stretch *at, const Lanes *lanes, const Servo *servo, const double *integrals) {
    const int64_t last = at->columns - 1, before = (int64_t)floor((double)at->history - servo->delay / at->step) - 1;
    State state;
    take(at->measured, lanes->from, 0, state.position);
    take(at->measured, lanes->from, 0, state.passed);
    take(at->first_velocity, lanes->own, 0, state.velocity);
    take(integrals, lanes->own, 0, state.integral);
    take(at->command, lanes->commands, column_at(before, last), state.earlier);
    memset(state.thrust, 0, sizeof state.thrust);
    return state;
}

/* One step of a joint. pushed: torque by the accelerations of other joints beside the load.
 *
 * The torque limit acts on the command before its change within a step and on that after it, which are the means of the
 * steps around it: a limit on the torque of the mean command would cut too little, and a fit would find it too low. */
INLINE void advance(const Stretch *at, const Lanes *lanes, int64_t step, const Servo *servo,
    const Vector pushed[PARTS], State *state) {
    const double h = at->step, half = 0.5 * h, gain = servo->kp - servo->ki_speed;
    const Vector none = {0}, full = none + 1.0, widest = none + servo->limit, band = none + 0.5 * servo->dead_band;
    const Vector wound_up = none + servo->integral_limit;
    const int64_t last = at->columns - 1;
    Vector before[PARTS], after[PARTS], mass[PARTS], load[PARTS], slope[PARTS], next[PARTS], supply[PARTS];
    Vector free[PARTS], slow[PARTS], torque[PARTS], later[PARTS], asked[PARTS], away[PARTS], error[PARTS];
    Vector speed[PARTS], working[PARTS];
    const double place = (double)(at->history + step) - servo->delay / h, whole = floor(place), share = place - whole;
    const int64_t row = (int64_t)whole;
    take(at->command, lanes->commands, column_at(row, last), before);
    take(at->command, lanes->commands, row < 0 ? 0 : column_at(row + 1, last), after);
    if (share > 0)
        take(at->command, lanes->commands, column_at(row + 2, last), later);
    else
        EACH_PART later[part] = after[part];
    take(at->inertia, lanes->from, step, mass);
    take(at->load, lanes->from, step, load);
    take(at->slope, lanes->from, step, slope);
    take(at->measured, lanes->from, step + 1 < at->steps ? step + 1 : step, next);
    EACH_PART {
        mass[part] += servo->armature;
        load[part] += pushed[part];
    }
    if (servo->payload != 0) {
        Vector unit_mass[PARTS], unit_load[PARTS], unit_slope[PARTS];
        take(at->unit_inertia, lanes->from, step, unit_mass);
        take(at->unit_load, lanes->from, step, unit_load);
        take(at->unit_slope, lanes->from, step, unit_slope);
        EACH_PART {
            const Vector least = LEAST_MASS * mass[part], loaded = mass[part] + servo->payload * unit_mass[part];
            mass[part] = choose(loaded > least, loaded, least);
            load[part] += servo->payload * unit_load[part];
            slope[part] += servo->payload * unit_slope[part];
        }
    }
    EACH_PART supply[part] = full;
    if (at->supply)
        take(at->supply, lanes->from, step, supply);
    Mask beyond = {0};
    EACH_PART {
        const Vector velocity = state->velocity[part], middle = state->position[part] + half * velocity;
        load[part] += slope[part] * (middle - 0.5 * (state->passed[part] + next[part]));
        state->passed[part] = next[part];
        away[part] = servo->offset - read_position(at, middle);
        asked[part] = before[part] + share * (after[part] - before[part]);
        error[part] = left_of(servo, asked[part] + away[part], band);
        Vector pull = gain * error[part];
        if (servo->ki > 0) {
            const Vector more = half * (servo->ki * error[part] - servo->ki_speed * velocity);
            pull += clip_each(state->integral[part] + more, wound_up);
        }
        slow[part] = half * (servo->damping + supply[part] * servo->kd);
        free[part] = (mass[part] - slow[part]) * velocity + h * (supply[part] * pull - load[part]);
        free[part] /= mass[part] + slow[part];
        torque[part] = pull - 0.5 * servo->kd * (velocity + free[part]);
        speed[part] = velocity + half * state->thrust[part] / (mass[part] - servo->armature);
        working[part] = widest - servo->limit_slope * size_of(speed[part]);
        working[part] = choose(working[part] > 0, working[part], none);
        beyond |= size_of(torque[part]) + gain * size_of(later[part] - state->earlier[part]) > working[part];
    }
    if (beyond[0] | beyond[1] | beyond[2] | beyond[3])
        EACH_PART {
            const Vector earlier = state->earlier[part];
            const Vector done = (asked[part] - earlier) / (later[part] - earlier);
            const Vector rest = torque[part] - gain * error[part];
            const Mask changes = (done > 0) & (done < 1);
            const Vector old = choose(changes, earlier, asked[part]);
            const Vector new = choose(changes, later[part], asked[part]);
            const Vector first = rest + gain * left_of(servo, old + away[part], band);
            const Vector second = rest + gain * left_of(servo, new + away[part], band);
            const Vector begun = clip_torque(first, speed[part], widest, working[part]);
            const Vector ended = clip_torque(second, speed[part], widest, working[part]);
            const Mask over = (first != begun) | (second != ended);
            const Vector held = supply[part] * (begun + choose(changes, done, none) * (ended - begun));
            const Vector outside = none + half * servo->damping;
            const Vector driven = (mass[part] - outside) * state->velocity[part] + h * (held - load[part]);
            free[part] = choose(over, driven / (mass[part] + outside), free[part]);
            slow[part] = choose(over, outside, slow[part]);
        }
    EACH_PART {
        const Vector carried = size_of(load[part] + state->thrust[part]), before_step = state->velocity[part];
        const Vector friction = level_at(servo, before_step) + servo->load_friction * carried;
        const Vector moved = state->position[part] + half * before_step;
        state->velocity[part] = free[part] - clip_each(free[part], h * friction / (mass[part] + slow[part]));
        if (servo->ki > 0) {
            const Vector mean = 0.5 * (before_step + state->velocity[part]);
            const Vector more = h * (servo->ki * error[part] - servo->ki_speed * mean);
            state->integral[part] = clip_each(state->integral[part] + more, wound_up);
        }
        state->position[part] = moved + half * state->velocity[part];
        state->thrust[part] = (mass[part] - servo->armature) * (state->velocity[part] - before_step) / h;
        state->earlier[part] = before[part];
    }
}

/* Positions of a joint at the beginning of each step, (steps + 1, LANES). */
SEVERAL_PROCESSORS
static void replay_lanes(const Stretch *at, const int64_t window[LANES], int64_t steps, const Servo *servo,
    const double *integrals, double *path) {
    const Vector nothing[PARTS] = {{0}};
    const Lanes lanes = lanes_of(at, window);
    State state = first_state(at, &lanes, servo, integrals);
    for (int64_t step = 0; step < steps; step++) {
        memcpy(path + step * LANES, state.position, sizeof state.position);
        advance(at, &lanes, step, servo, nothing, &state);
    }
    memcpy(path + steps * LANES, state.position, sizeof state.position);
}

#define MOST_SWEEPS 200
#define SAME_VELOCITY 1e-8 /* rad/s (m/s): a change of all velocities below it ends the sweeps */
#define FARTHEST 1e6       /* rad (m): a joint that would go farther is there */

/* One step of all joints that push each other: a step of one joint after the other with the accelerations of the others
 * (Gauss-Seidel), which converges because a mass matrix is positive definite. mass: (joints, joints) of each part. */
INLINE void advance_arm(const Stretch *at, const Lanes *lanes, int64_t step, int64_t joints, const Servo *servos,
    const Vector *mass, const Vector *moves, State *states, Vector *accelerations) {
    const double h = at->step;
    State next[MOST_JOINTS];
    for (int sweep = 0; sweep < MOST_SWEEPS; sweep++) {
        Mask changed = {0};
        for (int64_t joint = 0; joint < joints; joint++) {
            Vector pushed[PARTS] = {{0}};
            for (int64_t other = 0; other < joints; other++)
                if (other != joint)
                    EACH_PART pushed[part] += mass[(joint * joints + other) * PARTS + part] *
                        accelerations[other * PARTS + part];
            next[joint] = states[joint];
            advance(at + joint, lanes, step, servos + joint, pushed, next + joint);
            EACH_PART {
                Vector *own = accelerations + joint * PARTS + part;
                const Vector turned = next[joint].velocity[part] - states[joint].velocity[part];
                const Vector change = moves[joint * PARTS + part] * turned;
                changed |= size_of(change - h * *own) > SAME_VELOCITY;
                *own = change / h;
            }
        }
        if (!(changed[0] | changed[1] | changed[2] | changed[3]))
            break;
    }
    for (int64_t joint = 0; joint < joints; joint++) {
        EACH_PART {
            const Vector none = {0}, farthest = none + FARTHEST;
            const Mask near = size_of(next[joint].position[part]) < FARTHEST, goes = moves[joint * PARTS + part] != 0;
            next[joint].position[part] = choose(near, next[joint].position[part], farthest);
            next[joint].velocity[part] = choose(near & goes, next[joint].velocity[part], none);
            next[joint].position[part] = choose(goes, next[joint].position[part], states[joint].position[part]);
        }
        states[joint] = next[joint];
    }
}

/* The next LANES windows, or the last one again; how many they are. */
static int next_windows(int64_t windows, int64_t first, int64_t window[LANES]) {
    const int lanes = windows - first < LANES ? (int)(windows - first) : LANES;
    for (int lane = 0; lane < LANES; lane++)
        window[lane] = first + (lane < lanes ? lane : lanes - 1);
    return lanes;
}

static void start_integrals(const Stretch *at, const Servo *servo, double *integrals) {
    for (int64_t window = 0; window < at->windows; window++)
        integrals[window] = 0;
    if (servo->ki > 0)
        integrate_runs(at, servo, integrals);
}

/* servos: (sets). out: (sets, samples), simulated positions; integrals: (sets, windows), room for those of the sets;
 * path: (steps + 1, LANES), room for positions. */
void replay_joint(const Stretch *at, int64_t sets, const Servo *servos, double *integrals, double *path, double *out) {
    const int64_t samples = at->begin[at->windows];
    for (int64_t set = 0; set < sets; set++)
        start_integrals(at, servos + set, integrals + set * at->windows);
    for (int64_t first = 0; first < at->windows; first += LANES) {
        int64_t window[LANES], steps = 0;
        const int lanes = next_windows(at->windows, first, window);
        for (int lane = 0; lane < LANES; lane++) {
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

/* All joints of LANES windows. As in replay_arm. */
SEVERAL_PROCESSORS
static void replay_arm_lanes(int64_t joints, const Stretch *at, const Servo *servos, const MassTable *table,
    const int64_t window[LANES], int count, const double *integrals, double *position, double *velocity) {
    const int64_t steps = at->steps, windows = at->windows, square = joints * joints;
    const Lanes lanes = lanes_of(at, window);
    State states[MOST_JOINTS];
    Vector mass[MOST_JOINTS * MOST_JOINTS * PARTS], moves[MOST_JOINTS * PARTS], accelerations[MOST_JOINTS * PARTS] = {{0}};
    for (int64_t joint = 0; joint < joints; joint++) {
        states[joint] = first_state(at + joint, &lanes, servos + joint, integrals + joint * windows);
        for (int lane = 0; lane < LANES; lane++)
            ((double *)(moves + joint * PARTS))[lane] = table->moves[window[lane] * joints + joint];
    }
    for (int64_t step = 0; step < steps; step++) {
        const int64_t row = step / table->every;
        const double share = (double)(step % table->every) / (double)table->every;
        for (int64_t entry = 0; entry < square; entry++)
            for (int lane = 0; lane < LANES; lane++) {
                const double *before = table->mass + (window[lane] * table->rows + row) * square + entry;
                ((double *)(mass + entry * PARTS))[lane] = before[0] + share * (before[square] - before[0]);
            }
        for (int64_t joint = 0; joint < joints; joint++)
            for (int lane = 0; lane < count; lane++) {
                const int64_t place = (joint * windows + window[lane]) * steps + step;
                position[place] = ((double *)states[joint].position)[lane];
                velocity[place] = ((double *)states[joint].velocity)[lane];
            }
        advance_arm(at, &lanes, step, joints, servos, mass, moves, states, accelerations);
    }
}

/* servos, at: (joints). position, velocity: (joints, windows, steps), at the beginning of each step; integrals: (joints,
 * windows), room for those of the drives. */
void replay_arm(int64_t joints, const Stretch *at, const Servo *servos, const MassTable *table, double *integrals,
    double *position, double *velocity) {
    for (int64_t joint = 0; joint < joints; joint++)
        start_integrals(at + joint, servos + joint, integrals + joint * at->windows);
    for (int64_t first = 0; first < at->windows; first += LANES) {
        int64_t window[LANES];
        const int lanes = next_windows(at->windows, first, window);
        replay_arm_lanes(joints, at, servos, table, window, lanes, integrals, position, velocity);
    }
}
