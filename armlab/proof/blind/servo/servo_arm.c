/* A serial arm whose joints stick, driven by position servos.
 *
 * Each step is the midpoint rule of Moreau (1988) for all joints together, h the step:
 *
 *     q_m = q + h/2 v
 *     M(q_m) (v' - v) = h (tau - c(q_m, v_m) - damping (v' + v)/2 - f),   f_i in F_i Sgn(v'_i)
 *     q' = q_m + h/2 v'
 *
 * v_m = 3/2 v - 1/2 v(before). Friction is set-valued: at v'_i = 0 any f_i between -F_i and F_i. The problem is strictly
 * convex. Sweeps of projected Gauss-Seidel guess which joints stick and which way the others slide, and the linear
 * system of the guess gives the exact solution as soon as it agrees with it.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

#define MAX_JOINTS 8
#define MAX_SWEEPS 2000

typedef double Row[3];

static void cross(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void turn(const double R[9], const double *a, double *out)
{
    for (int i = 0; i < 3; i++)
        out[i] = R[3 * i] * a[0] + R[3 * i + 1] * a[1] + R[3 * i + 2] * a[2];
}

/* R times the rotation by an angle about a unit axis (Rodrigues) */
static void turned(const double R[9], const double *axis, double angle, double out[9])
{
    double c = cos(angle), s = sin(angle), t = 1 - c, x = axis[0], y = axis[1], z = axis[2];
    double own[9] = {t * x * x + c,     t * x * y - s * z, t * x * z + s * y, t * x * y + s * z, t * y * y + c,
                     t * y * z - s * x, t * x * z - s * y, t * y * z + s * x, t * z * z + c};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[3 * i + j] = R[3 * i] * own[j] + R[3 * i + 1] * own[3 + j] + R[3 * i + 2] * own[6 + j];
}

/* Mass matrix (joints, joints) without rotors, and torques of gravity and of velocity (joints). */
void mass_and_bias(int joints, const BodyData *body, const double *gravity, const double *q, const double *v,
    double *mass, double *bias)
{
    Row origin[MAX_JOINTS], axis[MAX_JOINTS], centre[MAX_JOINTS], spin_part[MAX_JOINTS], force[MAX_JOINTS];
    double inertia[MAX_JOINTS][9];
    double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, at[3] = {0}, w[3] = {0}, dw[3] = {0}, a[3];
    for (int i = 0; i < 3; i++)
        a[i] = -gravity[i];
    for (int k = 0; k < joints; k++) {
        double shift[3], next[9], part[3], part2[3], arm[3], local[9];
        turn(R, body[k].shift, shift);
        cross(dw, shift, part);
        for (int i = 0; i < 3; i++)
            a[i] += part[i];
        cross(w, shift, part);
        cross(w, part, part2);
        for (int i = 0; i < 3; i++) {
            a[i] += part2[i];
            at[i] += shift[i];
            origin[k][i] = at[i];
        }
        turn(R, body[k].axis, axis[k]);
        cross(w, axis[k], part);
        for (int i = 0; i < 3; i++) {
            dw[i] += part[i] * v[k];
            w[i] += axis[k][i] * v[k];
        }
        turned(R, body[k].axis, q[k], next);
        memcpy(R, next, sizeof R);
        turn(R, body[k].centre, arm);
        const double *s = body[k].inertia;
        double own[9] = {s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]};
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                local[3 * i + j] = R[3 * i] * own[j] + R[3 * i + 1] * own[3 + j] + R[3 * i + 2] * own[6 + j];
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                inertia[k][3 * i + j] = dot(local + 3 * i, R + 3 * j);
        double ac[3], moment[3];
        cross(dw, arm, part);
        for (int i = 0; i < 3; i++)
            ac[i] = a[i] + part[i];
        cross(w, arm, part);
        cross(w, part, part2);
        for (int i = 0; i < 3; i++) {
            centre[k][i] = at[i] + arm[i];
            force[k][i] = body[k].mass * (ac[i] + part2[i]);
        }
        turn(inertia[k], w, moment);
        cross(w, moment, part);
        turn(inertia[k], dw, moment);
        for (int i = 0; i < 3; i++)
            spin_part[k][i] = moment[i] + part[i];
    }
    for (int i = 0; i < joints; i++) {
        bias[i] = 0;
        for (int j = 0; j < joints; j++)
            mass[i * joints + j] = 0;
    }
    for (int k = 0; k < joints; k++) {
        Row linear[MAX_JOINTS], angular[MAX_JOINTS];
        for (int i = 0; i <= k; i++) {
            double arm[3] = {centre[k][0] - origin[i][0], centre[k][1] - origin[i][1], centre[k][2] - origin[i][2]};
            cross(axis[i], arm, linear[i]);
            turn(inertia[k], axis[i], angular[i]);
            bias[i] += dot(linear[i], force[k]) + dot(axis[i], spin_part[k]);
        }
        for (int i = 0; i <= k; i++)
            for (int j = 0; j <= i; j++) {
                double own = body[k].mass * dot(linear[i], linear[j]) + dot(axis[i], angular[j]);
                mass[i * joints + j] += own;
                if (i != j)
                    mass[j * joints + i] += own;
            }
    }
}

static double sign(double x)
{
    return (x > 0) - (x < 0);
}

static double clip(double x, double limit)
{
    return x > limit ? limit : x < -limit ? -limit : x;
}

/* Solves S x = r for `size` unknowns of a symmetric positive definite S, (size, size), which is overwritten. */
static void solve_definite(int size, double *S, double *r)
{
    for (int k = 0; k < size; k++)
        for (int i = k + 1; i < size; i++) {
            double factor = S[i * size + k] / S[k * size + k];
            for (int j = k; j < size; j++)
                S[i * size + j] -= factor * S[k * size + j];
            r[i] -= factor * r[k];
        }
    for (int k = size - 1; k >= 0; k--) {
        for (int j = k + 1; j < size; j++)
            r[k] -= S[k * size + j] * r[j];
        r[k] /= S[k * size + k];
    }
}

/* The solution where joints stick and slide as in x: 1 and the solution in x if it agrees with that, 0 if not. */
static int solve_as_guessed(int joints, const double *A, const double *b, const double *level, double *x)
{
    int sliding[MAX_JOINTS], slides[MAX_JOINTS], size = 0;
    double S[MAX_JOINTS * MAX_JOINTS], r[MAX_JOINTS], full[MAX_JOINTS] = {0};
    for (int i = 0; i < joints; i++) {
        slides[i] = x[i] != 0 || level[i] == 0;
        if (slides[i])
            sliding[size++] = i;
    }
    for (int i = 0; i < size; i++) {
        r[i] = b[sliding[i]] - sign(x[sliding[i]]) * level[sliding[i]];
        for (int j = 0; j < size; j++)
            S[i * size + j] = A[sliding[i] * joints + sliding[j]];
    }
    solve_definite(size, S, r);
    for (int i = 0; i < size; i++) {
        if (level[sliding[i]] > 0 && r[i] * x[sliding[i]] <= 0)
            return 0;
        full[sliding[i]] = r[i];
    }
    for (int i = 0; i < joints; i++) {
        double held = b[i];
        for (int j = 0; j < joints; j++)
            held -= A[i * joints + j] * full[j];
        if (!slides[i] && fabs(held) > level[i] * (1 + 1e-9))
            return 0;
    }
    memcpy(x, full, joints * sizeof *x);
    return 1;
}

/* Solves A x = b - f with f_i in level_i Sgn(x_i); x holds the start. Returns the sweeps, -1 where it does not end. */
static int solve_friction(int joints, const double *A, const double *b, const double *level, double *x)
{
    for (int sweep = 1; sweep <= MAX_SWEEPS; sweep++) {
        for (int i = 0; i < joints; i++) {
            double free = b[i];
            for (int j = 0; j < joints; j++)
                if (j != i)
                    free -= A[i * joints + j] * x[j];
            x[i] = fabs(free) <= level[i] * (1 + 1e-12) ? 0.0 : (free - sign(free) * level[i]) / A[i * joints + i];
        }
        if (solve_as_guessed(joints, A, b, level, x))
            return sweep;
    }
    return -1;
}

/* The position that a command asks for at an instant: taken over at ticks of `hold` from `phase` on, late by the delay. */
static double wanted(const ServoData *servo, double t, double hold, double phase, double period, int64_t commands,
    const double *command, int joints, int joint)
{
    double tick = floor((t - servo->delay - phase) / hold + 1e-6) * hold + phase;
    int64_t row = (int64_t)floor(tick / period + 1e-6);
    row = row < 0 ? 0 : row >= commands ? commands - 1 : row;
    return command[row * joints + joint] + servo->offset;
}

/* A step from q and v to the next ones under the torques tau, friction as a set. middle, speed: q and v at half of it.
 * load: of the gears, for friction that grows with it. Returns 0, or -1 where the step has no end. */
static int advance(int joints, const BodyData *body, const ServoData *servo, const double *gravity, double h,
    const double *middle, const double *speed, const double *tau, double *q, double *v, double *before, double *load)
{
    double bias[MAX_JOINTS], b[MAX_JOINTS], level[MAX_JOINTS], next[MAX_JOINTS];
    double M[MAX_JOINTS * MAX_JOINTS], A[MAX_JOINTS * MAX_JOINTS];
    mass_and_bias(joints, body, gravity, middle, speed, M, bias);
    for (int i = 0; i < joints; i++) {
        const ServoData *own = servo + i;
        double slip = own->stribeck_velocity > 0 ? speed[i] / own->stribeck_velocity : 0;
        level[i] = own->friction + own->static_extra * exp(-slip * slip) + own->load_friction * fabs(load[i]);
    }
    for (int i = 0; i < joints; i++) {
        M[i * joints + i] += servo[i].armature;
        b[i] = h * (tau[i] - bias[i] - servo[i].damping * v[i] / 2);
        for (int j = 0; j < joints; j++)
            b[i] += M[i * joints + j] * v[j];
        level[i] *= h;
        next[i] = v[i];
    }
    memcpy(A, M, sizeof A);
    for (int i = 0; i < joints; i++)
        A[i * joints + i] += h * servo[i].damping / 2;
    if (solve_friction(joints, A, b, level, next) < 0)
        return -1;
    for (int i = 0; i < joints; i++) {
        double gear = bias[i] - servo[i].armature * (next[i] - v[i]) / h;
        for (int j = 0; j < joints; j++)
            gear += M[i * joints + j] * (next[j] - v[j]) / h;
        load[i] = gear;
    }
    memcpy(before, v, joints * sizeof *v);
    memcpy(v, next, joints * sizeof *v);
    for (int i = 0; i < joints; i++)
        q[i] = middle[i] + h / 2 * v[i];
    return 0;
}

/* positions: (steps + 1, joints) out. position: the first one, at rest. Returns 0, or -1 where a step has no end. */
int simulate(int joints, const BodyData *body, const ServoData *servo, const ArmData *arm, int64_t steps,
    int64_t commands, const double *command, const double *first, double *positions)
{
    double q[MAX_JOINTS], v[MAX_JOINTS] = {0}, before[MAX_JOINTS] = {0}, load[MAX_JOINTS] = {0};
    double integral[MAX_JOINTS] = {0}, h = arm->step, used = 0, total = 0;
    memcpy(q, first, joints * sizeof *q);
    memcpy(positions, first, joints * sizeof *q);
    for (int i = 0; i < joints; i++)
        total += servo[i].limit;
    for (int64_t step = 0; step < steps; step++) {
        double middle[MAX_JOINTS], speed[MAX_JOINTS], tau[MAX_JOINTS];
        double supply = 1 - arm->sag * used / total;
        for (int i = 0; i < joints; i++) {
            middle[i] = q[i] + h / 2 * v[i];
            speed[i] = 1.5 * v[i] - 0.5 * before[i];
        }
        used = 0;
        for (int i = 0; i < joints; i++) {
            const ServoData *own = servo + i;
            double read = own->count > 0 ? rint(middle[i] / own->count) * own->count : middle[i];
            double asked = wanted(own, (step + 0.5) * h, arm->hold, arm->phase, arm->period, commands, command, joints, i);
            double error = asked - read;
            error = sign(error) * fmax(fabs(error) - own->dead_band / 2, 0);
            if (own->cascaded) {
                double slow = own->position_gain * error - speed[i];
                integral[i] = clip(integral[i] + h * own->ki * slow, own->integral_limit);
                tau[i] = own->kd * slow + integral[i];
            } else {
                integral[i] = clip(integral[i] + h * own->ki * error, own->integral_limit);
                tau[i] = own->kp * error - own->kd * speed[i] + integral[i];
            }
            double limit = own->limit * supply;
            if (tau[i] * speed[i] > 0)
                limit = fmax(limit - own->limit_slope * fabs(speed[i]), 0);
            tau[i] = clip(tau[i], limit);
            used += fabs(tau[i]);
        }
        if (advance(joints, body, servo, arm->gravity, h, middle, speed, tau, q, v, before, load) < 0)
            return -1;
        memcpy(positions + (step + 1) * joints, q, joints * sizeof *q);
    }
    return 0;
}

/* An arm whose drives add torques of kp and kd to given ones: tau = given - kp q - kd v, at half of each step.
 *
 * given, torques: (steps, joints), in and out. position, velocity: the first ones. positions: (steps + 1, joints) out,
 * velocities: the same. Returns 0, or -1 where a step has no end. */
int follow(int joints, const BodyData *body, const ServoData *servo, const double *gravity, double h, int64_t steps,
    const double *given, const double *position, const double *velocity, double *positions, double *velocities,
    double *torques)
{
    double q[MAX_JOINTS], v[MAX_JOINTS], before[MAX_JOINTS], load[MAX_JOINTS] = {0};
    memcpy(q, position, joints * sizeof *q);
    memcpy(v, velocity, joints * sizeof *v);
    memcpy(before, velocity, joints * sizeof *v);
    memcpy(positions, q, joints * sizeof *q);
    memcpy(velocities, v, joints * sizeof *v);
    for (int64_t step = 0; step < steps; step++) {
        double middle[MAX_JOINTS], speed[MAX_JOINTS], *tau = torques + step * joints;
        for (int i = 0; i < joints; i++) {
            middle[i] = q[i] + h / 2 * v[i];
            speed[i] = 1.5 * v[i] - 0.5 * before[i];
            tau[i] = given[step * joints + i] - servo[i].kp * middle[i] - servo[i].kd * speed[i];
        }
        if (advance(joints, body, servo, gravity, h, middle, speed, tau, q, v, before, load) < 0)
            return -1;
        memcpy(positions + (step + 1) * joints, q, joints * sizeof *q);
        memcpy(velocities + (step + 1) * joints, v, joints * sizeof *v);
    }
    return 0;
}
