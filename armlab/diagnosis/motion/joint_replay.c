/* Closed-loop replay of one joint in windows of measured motion, for many sets of servo parameters.
 *
 * One step of Moreau's midpoint rule: friction is an impulse bounded by its level, damping implicit, gravity and drive
 * explicit (the equations stand in joint_replay.py). No product is fused with a sum (-ffp-contract=off), so that
 * results are the same on every processor. */

#include <math.h>
#include <stdint.h>
#include <string.h>

#define LEAST_MASS 0.5 /* of an inertia: what a negative payload leaves of it */

/* Compiled for processors with AVX-512, with AVX2 and with neither, whichever runs it: the operations and their results
 * are the same. */
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12 /* knows v4 */
#define SEVERAL_PROCESSORS __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#elif defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
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
typedef double Vector __attribute__((vector_size(8 * LANES)));
typedef int64_t Mask __attribute__((vector_size(8 * LANES)));

INLINE Vector choose(Mask mask, Vector yes, Vector no) {
    return (Vector)((mask & (Mask)yes) | (~mask & (Mask)no));
}

INLINE Vector clip_each(Vector value, Vector bound) {
    return choose(value > bound, bound, choose(value < -bound, -bound, value));
}

INLINE int any_of(Mask mask) {
    int64_t any = 0;
    for (int lane = 0; lane < LANES; lane++)
        any |= mask[lane];
    return any != 0;
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

/* Of numbers that are not positive, to 1e-13 of the value: 2^n of the nearest n, and the series of what is left. It is
 * the same on every processor. */
INLINE Vector exponential(Vector power) {
    const Vector none = {0}, least = none - 700.0;
    const Vector clipped = choose(power > least, power, least), whole = clipped * (1 / M_LN2) + ROUNDS;
    const Vector x = clipped - (whole - ROUNDS) * M_LN2, square = x * x, fourth = square * square;
    const Vector first = (1.0 + x) + (1.0 / 2 + x * (1.0 / 6)) * square;
    const Vector second = (1.0 / 24 + x * (1.0 / 120)) + (1.0 / 720 + x * (1.0 / 5040)) * square;
    const Vector third = (1.0 / 40320 + x * (1.0 / 362880)) + (1.0 / 3628800 + x * (1.0 / 39916800)) * square;
    return (Vector)((Mask)(first + (second + third * fourth) * fourth) + ((Mask)whole << 52));
}

/* The level of friction at a velocity, without that of the load. */
INLINE Vector level_at(const Servo *servo, Vector velocity) {
    Vector level = {0};
    level += servo->friction;
    if (servo->static_excess > 0) {
        const Vector slip = velocity / servo->stribeck_speed;
        level += servo->static_excess * exponential(-slip * slip);
    }
    return level;
}

/* What the drive acts on of an error: the dead band takes half its width, `band`. */
INLINE Vector left_of(const Servo *servo, Vector error, Vector band) {
    return servo->dead_band > 0 ? error - clip_each(error, band) : error;
}

INLINE int64_t column_at(int64_t column, int64_t last) { return column < 0 ? 0 : column < last ? column : last; }

/* LANES windows of one joint that are replayed at once: a processor computes several in one instruction. Each table has
 * the numbers of all lanes at a step side by side, (steps, LANES); command: (columns, LANES). */
typedef struct {
    const double *command, *measured, *inertia, *load, *slope, *supply, *unit_inertia, *unit_load, *unit_slope;
    const int64_t *window;
} Lanes; /* TABLES beside the commands */

/* The first `taken` columns of the rows of a table that belong to windows, (taken, LANES), in `room`; where they end, the
 * room of the next table. */
static double *lay_side_by_side(const double *table, int64_t columns, int64_t taken, const int64_t window[LANES],
    double *room) {
    for (int64_t column = 0; column < taken; column++)
        for (int lane = 0; lane < LANES; lane++)
            room[column * LANES + lane] = table[window[lane] * columns + column];
    return room + taken * LANES;
}

/* Windows for the first `steps` steps. room: (columns + TABLES steps, LANES). loaded: whether a servo has a payload. */
static Lanes lanes_of(const Stretch *at, const int64_t window[LANES], int64_t steps, int loaded, double *room) {
    const int64_t taken = steps < at->steps ? steps + 1 : steps; /* the next measured position is in each step */
    const double *own[TABLES] = {at->measured, at->inertia, at->load, at->slope, at->supply,
        loaded ? at->unit_inertia : 0, loaded ? at->unit_load : 0, loaded ? at->unit_slope : 0};
    const double *laid[TABLES] = {0}, *commands = room;
    room = lay_side_by_side(at->command, at->columns, at->columns, window, room);
    for (int table = 0; table < TABLES; table++)
        if (own[table]) {
            laid[table] = room;
            room = lay_side_by_side(own[table], at->steps, taken, window, room);
        }
    return (Lanes){commands, laid[0], laid[1], laid[2], laid[3], laid[4], laid[5], laid[6], laid[7], window};
}

/* A row of a table of Lanes. */
INLINE Vector take(const double *table, int64_t row) {
    Vector taken;
    memcpy(&taken, table + row * LANES, sizeof taken);
    return taken;
}

/* The own number of each window, (windows), of the lanes. */
INLINE Vector take_own(const double *table, const Lanes *lanes) {
    Vector taken;
    for (int lane = 0; lane < LANES; lane++)
        taken[lane] = table[lanes->window[lane]];
    return taken;
}

/* At the beginning of a step. passed: the measured position there; earlier, thrust: the command and the torque that
 * accelerated the link in the step before. */
typedef struct {
    Vector position, velocity, integral, passed, earlier, thrust;
} State;

INLINE State first_state(const Stretch *at, const Lanes *lanes, const Servo *servo, const double *integrals) {
    const int64_t last = at->columns - 1, before = (int64_t)floor((double)at->history - servo->delay / at->step) - 1;
    State state;
    state.position = take(lanes->measured, 0);
    state.passed = take(lanes->measured, 0);
    state.velocity = take_own(at->first_velocity, lanes);
    state.integral = take_own(integrals, lanes);
    state.earlier = take(lanes->command, column_at(before, last));
    state.thrust = (Vector){0};
    return state;
}

/* The velocity after half a step, if the link keeps its acceleration. mass: with the rotor. */
INLINE Vector middle_velocity(const Servo *servo, const State *state, Vector mass, double half) {
    return state->velocity + half * state->thrust / (mass - servo->armature);
}

/* One step of a joint. pushed: torque by the accelerations of other joints beside the load.
 *
 * The torque limit acts on the command before its change within a step and on that after it, which are the means of the
 * steps around it: a limit on the torque of the mean command would cut too little, and a fit would find it too low. */
INLINE void advance(const Stretch *at, const Lanes *lanes, int64_t step, const Servo *servo,
    const Vector pushed, State *state) {
    const double h = at->step, half = 0.5 * h, gain = servo->kp - servo->ki_speed;
    const Vector none = {0}, full = none + 1.0, widest = none + servo->limit, band = none + 0.5 * servo->dead_band;
    const Vector wound_up = none + servo->integral_limit;
    const int64_t last = at->columns - 1;
    const double place = (double)(at->history + step) - servo->delay / h, whole = floor(place), share = place - whole;
    const int64_t row = (int64_t)whole;
    const Vector before = take(lanes->command, column_at(row, last));
    const Vector after = take(lanes->command, row < 0 ? 0 : column_at(row + 1, last));
    const Vector later = share > 0 ? take(lanes->command, column_at(row + 2, last)) : after;
    const Vector next = take(lanes->measured, step + 1 < at->steps ? step + 1 : step);
    const Vector supply = lanes->supply ? take(lanes->supply, step) : full;
    Vector mass = take(lanes->inertia, step) + servo->armature;
    Vector load = take(lanes->load, step) + pushed, slope = take(lanes->slope, step);
    if (servo->payload != 0) {
        const Vector least = LEAST_MASS * mass, loaded = mass + servo->payload * take(lanes->unit_inertia, step);
        mass = choose(loaded > least, loaded, least);
        load += servo->payload * take(lanes->unit_load, step);
        slope += servo->payload * take(lanes->unit_slope, step);
    }
    const Vector velocity = state->velocity, earlier = state->earlier, middle = state->position + half * velocity;
    load += slope * (middle - 0.5 * (state->passed + next));
    state->passed = next;
    const Vector away = servo->offset - read_position(at, middle), asked = before + share * (after - before);
    const Vector error = left_of(servo, asked + away, band);
    Vector pull = gain * error;
    if (servo->ki > 0) {
        const Vector more = half * (servo->ki * error - servo->ki_speed * velocity);
        pull += clip_each(state->integral + more, wound_up);
    }
    Vector slow = half * (servo->damping + supply * servo->kd);
    Vector free = (mass - slow) * velocity + h * (supply * pull - load);
    free /= mass + slow;
    const Vector torque = pull - 0.5 * servo->kd * (velocity + free);
    Vector working = widest;
    if (servo->limit_slope != 0) {
        working -= servo->limit_slope * size_of(middle_velocity(servo, state, mass, half));
        working = choose(working > 0, working, none);
    }
    if (any_of(size_of(torque) + gain * size_of(later - earlier) > working)) {
        const Vector done = (asked - earlier) / (later - earlier), rest = torque - gain * error;
        const Mask changes = (done > 0) & (done < 1);
        const Vector old = choose(changes, earlier, asked), new = choose(changes, later, asked);
        const Vector first = rest + gain * left_of(servo, old + away, band);
        const Vector second = rest + gain * left_of(servo, new + away, band);
        const Vector speed = middle_velocity(servo, state, mass, half);
        const Vector begun = clip_torque(first, speed, widest, working);
        const Vector ended = clip_torque(second, speed, widest, working);
        const Mask over = (first != begun) | (second != ended);
        const Vector held = supply * (begun + choose(changes, done, none) * (ended - begun));
        const Vector outside = none + half * servo->damping;
        const Vector driven = (mass - outside) * velocity + h * (held - load);
        free = choose(over, driven / (mass + outside), free);
        slow = choose(over, outside, slow);
    }
    const Vector friction = level_at(servo, velocity) + servo->load_friction * size_of(load + state->thrust);
    state->velocity = free - clip_each(free, h * friction / (mass + slow));
    if (servo->ki > 0) {
        const Vector mean = 0.5 * (velocity + state->velocity);
        const Vector more = h * (servo->ki * error - servo->ki_speed * mean);
        state->integral = clip_each(state->integral + more, wound_up);
    }
    state->position = middle + half * state->velocity;
    state->thrust = (mass - servo->armature) * (state->velocity - velocity) / h;
    state->earlier = before;
}

/* Positions of a joint at the beginning of each step, (steps + 1, LANES) of each group. The groups take turns in each
 * step: a processor works at one while another waits for a result. */
SEVERAL_PROCESSORS
static void replay_groups(const Stretch *at, const Lanes lanes[GROUPS], int64_t steps, const Servo *servo,
    const double *integrals, double *path) {
    const Vector nothing = {0};
    const int64_t size = (steps + 1) * LANES;
    State states[GROUPS];
    for (int group = 0; group < GROUPS; group++)
        states[group] = first_state(at, lanes + group, servo, integrals);
    for (int64_t step = 0; step <= steps; step++)
        for (int group = 0; group < GROUPS; group++) {
            memcpy(path + group * size + step * LANES, &states[group].position, sizeof(Vector));
            if (step < steps)
                advance(at, lanes + group, step, servo, nothing, states + group);
        }
}

#define MOST_SWEEPS 200
#define SAME_VELOCITY 1e-8 /* rad/s (m/s): a change of all velocities below it ends the sweeps */
#define FARTHEST 1e6       /* rad (m): a joint that would go farther is there */

/* One step of all joints that push each other: a step of one joint after the other with the accelerations of the others
 * (Gauss-Seidel), which converges because a mass matrix is positive definite. mass: (joints, joints). */
INLINE void advance_arm(const Stretch *at, const Lanes *lanes, int64_t step, int64_t joints, const Servo *servos,
    const Vector *mass, const Vector *moves, State *states, Vector *accelerations) {
    const double h = at->step;
    State next[MOST_JOINTS];
    for (int sweep = 0; sweep < MOST_SWEEPS; sweep++) {
        Mask changed = {0};
        for (int64_t joint = 0; joint < joints; joint++) {
            Vector pushed = {0};
            for (int64_t other = 0; other < joints; other++)
                if (other != joint)
                    pushed += mass[joint * joints + other] * accelerations[other];
            next[joint] = states[joint];
            advance(at + joint, lanes + joint, step, servos + joint, pushed, next + joint);
            const Vector change = moves[joint] * (next[joint].velocity - states[joint].velocity);
            changed |= size_of(change - h * accelerations[joint]) > SAME_VELOCITY;
            accelerations[joint] = change / h;
        }
        if (!any_of(changed))
            break;
    }
    for (int64_t joint = 0; joint < joints; joint++) {
        const Vector none = {0}, farthest = none + FARTHEST;
        const Mask near = size_of(next[joint].position) < FARTHEST, goes = moves[joint] != 0;
        next[joint].position = choose(near, next[joint].position, farthest);
        next[joint].velocity = choose(near & goes, next[joint].velocity, none);
        next[joint].position = choose(goes, next[joint].position, states[joint].position);
        states[joint] = next[joint];
    }
}

/* The next LANES windows, or the last one again; how many they are. */
static int next_windows(int64_t windows, int64_t first, int64_t window[LANES]) {
    const int64_t left = windows > first ? windows - first : 0;
    for (int lane = 0; lane < LANES; lane++)
        window[lane] = lane < left ? first + lane : windows - 1;
    return left < LANES ? (int)left : LANES;
}

static void start_integrals(const Stretch *at, const Servo *servo, double *integrals) {
    for (int64_t window = 0; window < at->windows; window++)
        integrals[window] = 0;
    if (servo->ki > 0)
        integrate_runs(at, servo, integrals);
}

/* Whether one of servos has a payload. */
static int any_loaded(int64_t count, const Servo *servos) {
    for (int64_t each = 0; each < count; each++)
        if (servos[each].payload != 0)
            return 1;
    return 0;
}

/* servos: (sets). out: (sets, samples), simulated positions; integrals: (sets, windows), room for those of the sets;
 * room: (GROUPS, columns + (TABLES + 1) steps + 1, LANES). */
void replay_joint(const Stretch *at, int64_t sets, const Servo *servos, double *integrals, double *room, double *out) {
    const int64_t samples = at->begin[at->windows], size = (at->columns + TABLES * at->steps) * LANES;
    const int loaded = any_loaded(sets, servos);
    double *path = room + GROUPS * size;
    for (int64_t set = 0; set < sets; set++)
        start_integrals(at, servos + set, integrals + set * at->windows);
    for (int64_t first = 0; first < at->windows; first += GROUPS * LANES) {
        const int64_t end = first + GROUPS * LANES < at->windows ? first + GROUPS * LANES : at->windows;
        int64_t window[GROUPS][LANES], steps = 0;
        for (int64_t each = first; each < end; each++) {
            const int64_t last = at->begin[each + 1] - 1;
            if (last >= at->begin[each] && at->row[last] >= steps)
                steps = at->row[last] + 1;
        }
        Lanes lanes[GROUPS];
        for (int group = 0; group < GROUPS; group++) {
            next_windows(at->windows, first + group * LANES, window[group]);
            lanes[group] = lanes_of(at, window[group], steps, loaded, room + group * size);
        }
        for (int64_t set = 0; set < sets; set++) {
            replay_groups(at, lanes, steps, servos + set, integrals + set * at->windows, path);
            for (int64_t each = first; each < end; each++) {
                const double *own = path + (each - first) / LANES * (steps + 1) * LANES + (each - first) % LANES;
                for (int64_t sample = at->begin[each]; sample < at->begin[each + 1]; sample++) {
                    const double *before = own + at->row[sample] * LANES;
                    out[set * samples + sample] = before[0] + at->fraction[sample] * (before[LANES] - before[0]);
                }
            }
        }
    }
}

/* All joints of LANES windows. As in replay_arm. */
SEVERAL_PROCESSORS
static void replay_arm_lanes(int64_t joints, const Stretch *at, const Servo *servos, const MassTable *table,
    const int64_t window[LANES], int count, const double *integrals, double *room, double *position, double *velocity) {
    const int64_t steps = at->steps, windows = at->windows, square = joints * joints;
    const int loaded = any_loaded(joints, servos);
    Lanes lanes[MOST_JOINTS];
    State states[MOST_JOINTS];
    Vector mass[MOST_JOINTS * MOST_JOINTS], moves[MOST_JOINTS], accelerations[MOST_JOINTS] = {{0}};
    for (int64_t joint = 0; joint < joints; joint++) {
        lanes[joint] = lanes_of(at + joint, window, steps, loaded, room + joint * LANES * (at->columns + TABLES * steps));
        states[joint] = first_state(at + joint, lanes + joint, servos + joint, integrals + joint * windows);
        for (int lane = 0; lane < LANES; lane++)
            moves[joint][lane] = table->moves[window[lane] * joints + joint];
    }
    for (int64_t step = 0; step < steps; step++) {
        const int64_t row = step / table->every;
        const double share = (double)(step % table->every) / (double)table->every;
        for (int64_t entry = 0; entry < square; entry++)
            for (int lane = 0; lane < LANES; lane++) {
                const double *before = table->mass + (window[lane] * table->rows + row) * square + entry;
                mass[entry][lane] = before[0] + share * (before[square] - before[0]);
            }
        for (int64_t joint = 0; joint < joints; joint++)
            for (int lane = 0; lane < count; lane++) {
                const int64_t place = (joint * windows + window[lane]) * steps + step;
                position[place] = states[joint].position[lane];
                velocity[place] = states[joint].velocity[lane];
            }
        advance_arm(at, lanes, step, joints, servos, mass, moves, states, accelerations);
    }
}

/* servos, at: (joints). position, velocity: (joints, windows, steps), at the beginning of each step; integrals: (joints,
 * windows), room for those of the drives; room: (joints, columns + TABLES steps, LANES). */
void replay_arm(int64_t joints, const Stretch *at, const Servo *servos, const MassTable *table, double *integrals,
    double *room, double *position, double *velocity) {
    for (int64_t joint = 0; joint < joints; joint++)
        start_integrals(at + joint, servos + joint, integrals + joint * at->windows);
    for (int64_t first = 0; first < at->windows; first += LANES) {
        int64_t window[LANES];
        const int lanes = next_windows(at->windows, first, window);
        replay_arm_lanes(joints, at, servos, table, window, lanes, integrals, room, position, velocity);
    }
}
