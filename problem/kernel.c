/* Observation matrix, Gram matrix, torques and Fourier series for whole populations of trajectories.
 *
 * Four samples at a time in one vector, which is as wide as the registers of most processors: wider ones are split into
 * scalars. The order of every sum is fixed and no product is fused with a sum (-ffp-contract=off), so that the results
 * are the same to the bit on every processor and for every batch. */

#include <stdint.h>
#include <string.h>

#define LANES 4
#define HALVES 2 /* vectors of sums of a Gram matrix: eight partial sums of every eighth sample */
#define MAX_JOINTS 16
#define MAX_OWNED 3
#define MAX_COLUMNS (MAX_JOINTS * (10 + MAX_OWNED))
typedef double V __attribute__((vector_size(8 * LANES)));
typedef int64_t I __attribute__((vector_size(8 * LANES)));
#define INLINE static inline __attribute__((always_inline))

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
#define FOR_EACH_PROCESSOR __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define FOR_EACH_PROCESSOR
#endif

/* A joint as two fixed transforms about a motion along or about z; see problem/arm.py. */
typedef struct {
    int prismatic, shifted_before, shifted_after;
    double before_rotation[9], before_shift[3];
    double after_rotation[9], after_shift[3]; /* the shift in coordinates of the link's own frame */
    double axis[3];                           /* z of the joint in the link's own frame */
} JointData;

typedef struct { V x, y, z; } Vec;
typedef struct { V m[9]; } Mat;

INLINE Vec add(Vec a, Vec b) { return (Vec){a.x + b.x, a.y + b.y, a.z + b.z}; }
INLINE V dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
INLINE Vec scaled(const double *a, V s) { return (Vec){a[0] * s, a[1] * s, a[2] * s}; }
INLINE Vec cross(Vec a, Vec b) {
    return (Vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
INLINE Vec constant(const double *a) {
    V zero = {0};
    return (Vec){zero + a[0], zero + a[1], zero + a[2]};
}
/* transpose(R) v: from the parent's frame into the link's */
INLINE Vec into(const Mat *r, Vec v) {
    const V *m = r->m;
    return (Vec){m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z,
                 m[2] * v.x + m[5] * v.y + m[8] * v.z};
}

/* R v: from the link's frame into the parent's */
INLINE Vec out_of(const Mat *r, Vec v) {
    const V *m = r->m;
    return (Vec){m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
                 m[6] * v.x + m[7] * v.y + m[8] * v.z};
}

/* Sine and cosine: Cody and Waite's reduction by pi/2 in three parts, then the minimax polynomials of
 * fdlibm's k_sin.c and k_cos.c (Sun Microsystems, 1993); within 2 ulp for |x| < 1e4. */
INLINE void sine_cosine(V x, V *sine, V *cosine) {
    const double magic = 6755399441055744.0; /* 1.5 * 2^52: adding it rounds to the nearest integer */
    V shifted = x * 0.63661977236758134308 + magic;
    V turns = shifted - magic;
    I quadrant = (I)shifted;
    V r = ((x - turns * 1.57079632673412561417e+00) - turns * 6.07710050630396597660e-11) -
          turns * 2.02226624879595063154e-21;
    V z = r * r;
    V s = r + r * z * (-1.66666666666666324348e-01 +
                       z * (8.33333333332248946124e-03 +
                            z * (-1.98412698298579493134e-04 +
                                 z * (2.75573137070700676789e-06 +
                                      z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    V c = 1.0 - (0.5 * z - z * z * (4.16666666666666019037e-02 +
                                    z * (-1.38888888888741095749e-03 +
                                         z * (2.48015872894767294178e-05 +
                                              z * (-2.75573143513906633035e-07 +
                                                   z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))))));
    I odd = (quadrant & 1) != 0;
    I sin_sign = (quadrant & 2) << 62, cos_sign = ((quadrant + 1) & 2) << 62;
    *sine = (V)((((I)c & odd) | ((I)s & ~odd)) ^ sin_sign);
    *cosine = (V)((((I)s & odd) | ((I)c & ~odd)) ^ cos_sign);
}

/* R = before * Rz * after, entry by entry, with the zeros and ones of the fixed rotations left in place. */
INLINE void rotation(const JointData *j, V c, V s, Mat *out) {
    for (int row = 0; row < 3; row++) {
        const double *b = j->before_rotation + 3 * row;
        V bx = b[0] * c + b[1] * s, by = b[1] * c - b[0] * s;
        for (int col = 0; col < 3; col++) {
            const double *a = j->after_rotation + col;
            out->m[3 * row + col] = bx * a[0] + by * a[3] + b[2] * a[6];
        }
    }
}

/* Motion of a joint's axis as seen in a link's frame: turning part, and speed of the frame's origin. */
typedef struct { Vec angular, linear; } Screw;

/* Ten entries of the row of one joint for one link, eq. 29-31 and 39:
 * the wrench of the link about its own origin, projected on the joint's motion; entry k goes to row[places[k]]. */
INLINE void row_of_link(Vec a, Vec al, Vec w, const V *wxx, Screw s, const int64_t *places, V *row) {
    Vec e = cross(s.angular, w);
    Vec g = cross(a, s.angular);
    V xx = wxx[0], yy = wxx[1], zz = wxx[2], xy = wxx[3], xz = wxx[4], yz = wxx[5];
    row[places[0]] = dot(s.linear, a);
    row[places[1]] = (xy + al.z) * s.linear.y + (xz - al.y) * s.linear.z - (yy + zz) * s.linear.x + g.x;
    row[places[2]] = (xy - al.z) * s.linear.x + (yz + al.x) * s.linear.z - (xx + zz) * s.linear.y + g.y;
    row[places[3]] = (xz + al.y) * s.linear.x + (yz - al.x) * s.linear.y - (xx + yy) * s.linear.z + g.z;
    row[places[4]] = s.angular.x * al.x + e.x * w.x;
    row[places[5]] = s.angular.y * al.y + e.y * w.y;
    row[places[6]] = s.angular.z * al.z + e.z * w.z;
    row[places[7]] = s.angular.x * al.y + s.angular.y * al.x + e.x * w.y + e.y * w.x;
    row[places[8]] = s.angular.x * al.z + s.angular.z * al.x + e.x * w.z + e.z * w.x;
    row[places[9]] = s.angular.y * al.z + s.angular.z * al.y + e.y * w.z + e.z * w.y;
}

/* A link's frame in that of its parent: R, and the shift to the joint's axis in the parent's frame. */
typedef struct { Mat r; Vec shift; } Frame;

/* Angular velocity and acceleration of a link, and the acceleration of its frame's origin less gravity. */
typedef struct { Vec w, al, a; } Rates;

INLINE Rates at_rest(const double *gravity) {
    const double still[3] = {0, 0, 0};
    const double upward[3] = {-gravity[0], -gravity[1], -gravity[2]};
    return (Rates){constant(still), constant(still), constant(upward)};
}

/* From the parent's rates to those of a link; also the link's frame (eq. 9-20). */
INLINE void move_to_link(const JointData *d, V q, V qd, V qdd, Frame *frame, Rates *rates) {
    Vec w = rates->w, al = rates->al, a = rates->a;
    V zero = {0}, c = zero + 1.0, s = zero;
    if (!d->prismatic) sine_cosine(q, &s, &c);
    rotation(d, c, s, &frame->r);
    Vec shift = constant(d->before_shift);
    if (d->prismatic) {
        const double along[3] = {d->before_rotation[2], d->before_rotation[5], d->before_rotation[8]};
        shift = add(shift, scaled(along, q));
    }
    frame->shift = shift;
    if (d->prismatic || d->shifted_before)
        a = add(a, add(cross(al, shift), cross(w, cross(w, shift))));
    Vec motion = scaled(d->axis, qd), motion_rate = scaled(d->axis, qdd);
    w = into(&frame->r, w), al = into(&frame->r, al), a = into(&frame->r, a);
    Vec carried = cross(w, motion);
    if (d->prismatic) {
        a = add(a, add(motion_rate, add(carried, carried)));
    } else {
        al = add(al, add(motion_rate, carried));
        w = add(w, motion);
    }
    Vec arm = constant(d->after_shift);
    if (d->shifted_after) a = add(a, add(cross(al, arm), cross(w, cross(w, arm))));
    *rates = (Rates){w, al, a};
}

INLINE Screw axis_of(const JointData *d) {
    const double still[3] = {0, 0, 0};
    Vec angular = constant(d->prismatic ? still : d->axis);
    return (Screw){angular, d->prismatic ? constant(d->axis) : cross(angular, constant(d->after_shift))};
}

/* rows[i * stride + places[10 * j + k]]: joint i, link j >= i, parameter k, for some samples (eq. 9-39). */
INLINE void rows_of_samples(int joints, const JointData *data, const double *gravity, const V *q, const V *qd,
                            const V *qdd, int64_t stride, const int64_t *places, V *rows) {
    Screw screws[MAX_JOINTS];
    Rates rates = at_rest(gravity);
    Frame frame;
    for (int j = 0; j < joints; j++) {
        const JointData *d = data + j;
        move_to_link(d, q[j], qd[j], qdd[j], &frame, &rates);
        Vec a = rates.a, al = rates.al, w = rates.w, arm = constant(d->after_shift);
        for (int i = 0; i < j; i++) {
            Vec linear = screws[i].linear;
            if (d->prismatic || d->shifted_before) linear = add(linear, cross(screws[i].angular, frame.shift));
            screws[i].angular = into(&frame.r, screws[i].angular);
            screws[i].linear = into(&frame.r, linear);
            if (d->shifted_after) screws[i].linear = add(screws[i].linear, cross(screws[i].angular, arm));
        }
        screws[j] = axis_of(d);
        V products[6] = {w.x * w.x, w.y * w.y, w.z * w.z, w.x * w.y, w.x * w.z, w.y * w.z};
        for (int i = 0; i <= j; i++)
            row_of_link(a, al, w, products, screws[i], places + 10 * j, rows + i * stride);
    }
}

/* A force and a moment about the origin of a frame. */
typedef struct { Vec force, moment; } Wrench;

/* What moves a link, from its ten parameters: mass, first moment, inertia about its own origin. */
INLINE Wrench wrench_of_link(const Rates *rates, const double *p) {
    Vec w = rates->w, al = rates->al, first = constant(p + 1);
    Vec turned = {p[4] * w.x + p[7] * w.y + p[8] * w.z, p[7] * w.x + p[5] * w.y + p[9] * w.z,
                  p[8] * w.x + p[9] * w.y + p[6] * w.z};
    Vec pushed = {p[4] * al.x + p[7] * al.y + p[8] * al.z, p[7] * al.x + p[5] * al.y + p[9] * al.z,
                  p[8] * al.x + p[9] * al.y + p[6] * al.z};
    Vec carried = {p[0] * rates->a.x, p[0] * rates->a.y, p[0] * rates->a.z};
    Vec force = add(carried, add(cross(al, first), cross(w, cross(w, first))));
    return (Wrench){force, add(add(pushed, cross(w, turned)), cross(first, rates->a))};
}

/* torque[i]: of joint i, for some samples, from the last link to the first (Luh, Walker and Paul 1980). */
INLINE void torques_of_samples(int joints, const JointData *data, const double *gravity, const V *q, const V *qd,
                               const V *qdd, const double *parameters, V *torque) {
    Frame frames[MAX_JOINTS];
    Wrench wrenches[MAX_JOINTS];
    Rates rates = at_rest(gravity);
    for (int j = 0; j < joints; j++) {
        move_to_link(data + j, q[j], qd[j], qdd[j], frames + j, &rates);
        wrenches[j] = wrench_of_link(&rates, parameters + 10 * j);
    }
    for (int j = joints - 1; j >= 0; j--) {
        const JointData *d = data + j;
        Wrench own = wrenches[j];
        Screw axis = axis_of(d);
        torque[j] = dot(axis.angular, own.moment) + dot(axis.linear, own.force);
        if (j == 0) break;
        Vec moment = own.moment;
        if (d->shifted_after) moment = add(moment, cross(constant(d->after_shift), own.force));
        Vec force = out_of(&frames[j].r, own.force);
        moment = out_of(&frames[j].r, moment);
        if (d->prismatic || d->shifted_before) moment = add(moment, cross(frames[j].shift, force));
        wrenches[j - 1] = (Wrench){add(wrenches[j - 1].force, force), add(wrenches[j - 1].moment, moment)};
    }
}

/* Some samples of one trajectory as one vector a joint; stride: from sample to sample in memory; missing ones are 0. */
INLINE void load(int joints, int count, int64_t stride, const double *from, V *to) {
    if (count == LANES) {
        const double *a = from, *b = a + stride, *c = b + stride, *d = c + stride;
        for (int j = 0; j < joints; j++) to[j] = (V){a[j], b[j], c[j], d[j]};
        return;
    }
    for (int j = 0; j < joints; j++) {
        V lanes = {0};
        for (int l = 0; l < count; l++) lanes[l] = from[l * stride + j];
        to[j] = lanes;
    }
}

INLINE int at_most_lanes(int64_t left) { return left < LANES ? (int)left : LANES; }

/* Full observation matrix of each trajectory: (trajectories, samples, joints, 10 joints). */
FOR_EACH_PROCESSOR
void observation_matrices(int joints, const JointData *data, const double *gravity, int64_t samples,
                          const double *q, const double *qd, const double *qdd, double *out) {
    V vq[MAX_JOINTS], vqd[MAX_JOINTS], vqdd[MAX_JOINTS], rows[MAX_JOINTS * MAX_JOINTS * 10];
    int width = 10 * joints;
    int64_t places[MAX_JOINTS * 10];
    for (int k = 0; k < width; k++) places[k] = k;
    for (int64_t s = 0; s < samples; s += LANES) {
        int count = at_most_lanes(samples - s);
        load(joints, count, joints, q + s * joints, vq);
        load(joints, count, joints, qd + s * joints, vqd);
        load(joints, count, joints, qdd + s * joints, vqdd);
        rows_of_samples(joints, data, gravity, vq, vqd, vqdd, width, places, rows);
        for (int l = 0; l < count; l++)
            for (int i = 0; i < joints; i++) {
                double *row = out + ((s + l) * joints + i) * width;
                for (int k = 10 * i; k < width; k++) row[k] = rows[i * width + k][l];
            }
    }
}

/* A Gram matrix is summed in tiles of TILE by TILE entries, whose sums stay in registers over a chunk of samples. The
 * rows of the chunk are kept in panels of TILE columns: [panel][block of samples][joint][TILE], zero where a column is
 * zero in the row of a joint. */
#define TILE 3
#define CHUNK 8 /* blocks of LANES samples: the panels of seven joints stay in the cache of the core */

/* Adds the products of two panels to the sums of a tile, over the first so many rows of each block, in which alone the
 * left one can be non-zero; stride: from block to block. */
INLINE void add_tile(int blocks, int rows, int64_t stride, const V *left, const V *right, V *sums) {
    for (int half = 0; half < HALVES; half++, sums += TILE * TILE) {
        V s[TILE * TILE];
        memcpy(s, sums, sizeof s);
        for (int b = half; b < blocks; b += HALVES) {
            const V *l = left + b * stride, *r = right + b * stride;
            for (const V *end = l + rows * TILE; l < end; l += TILE, r += TILE)
                for (int k = 0; k < TILE; k++)
                    for (int c = 0; c < TILE; c++) s[k * TILE + c] += l[k] * r[c];
        }
        memcpy(sums, s, sizeof s);
    }
}

INLINE int panels_of(int n) { return (n + TILE - 1) / TILE; }

/* Numbers of scratch memory for Gram matrices of n columns: the panels, the tiles and what aligns them. */
int64_t gram_scratch(int joints, int n) {
    int64_t panels = panels_of(n);
    return LANES * ((panels + 1) * CHUNK * joints * TILE + panels * (panels + 1) / 2 * HALVES * TILE * TILE + 1);
}

/* Gram matrix of chosen columns of each trajectory's observation matrix, and of further columns behind them, joint by
 * joint, that are zero in the rows of all other joints; (trajectories, n, n) with n = chosen + owned * joints.
 * columns: ascending; first[i]: the first chosen column that can be non-zero in the row of joint i.
 * own: the further columns in the rows of their joints, (trajectories, samples, joints, owned), owned <= MAX_OWNED.
 * scratch: as long as gram_scratch says. Each entry is the sum over the samples in order, in eight parts. */
FOR_EACH_PROCESSOR
void gram_matrices(int joints, const JointData *data, const double *gravity, int64_t trajectories, int64_t samples,
                   const double *q, const double *qd, const double *qdd, int chosen, const int *columns,
                   const int *first, int owned, const double *own, double *scratch, double *out) {
    V vq[MAX_JOINTS], vqd[MAX_JOINTS], vqdd[MAX_JOINTS], vown[MAX_JOINTS * MAX_OWNED];
    int n = chosen + owned * joints, panels = panels_of(n);
    int64_t panel = CHUNK * joints * TILE, tiles = panels * (panels + 1) / 2;
    V *chunk = (V *)(((uintptr_t)scratch + sizeof(V) - 1) & ~(uintptr_t)(sizeof(V) - 1));
    V *sums = chunk + (panels + 1) * panel; /* the last panel is for columns that are not chosen */
    int64_t places[MAX_JOINTS * 10], own_places[MAX_JOINTS * MAX_OWNED]; /* in the rows of the first joint and block */
    int rows_of[MAX_COLUMNS]; /* each panel: up to the last joint in whose rows it can be non-zero */
    memset(rows_of, 0, sizeof rows_of);
    for (int k = 0; k < 10 * joints; k++) places[k] = panels * panel;
    for (int k = 0; k < n; k++) {
        int last = k < chosen ? joints - 1 : (k - chosen) / owned;
        while (k < chosen && first[last] > k) last--;
        *(k < chosen ? places + columns[k] : own_places + k - chosen) = k / TILE * panel + k % TILE;
        rows_of[k / TILE] = last + 1 > rows_of[k / TILE] ? last + 1 : rows_of[k / TILE];
    }
    memset(chunk, 0, sizeof(V) * panels * panel);
    for (int64_t p = 0; p < trajectories; p++) {
        memset(sums, 0, sizeof(V) * HALVES * TILE * TILE * tiles);
        for (int64_t from = 0; from < samples; from += CHUNK * LANES) {
            int blocks = 0;
            for (int64_t s = from; s < samples && blocks < CHUNK; s += LANES, blocks++) {
                int64_t at = (p * samples + s) * joints;
                int count = at_most_lanes(samples - s);
                load(joints, count, joints, q + at, vq);
                load(joints, count, joints, qd + at, vqd);
                load(joints, count, joints, qdd + at, vqdd);
                load(joints * owned, count, joints * owned, own + at * owned, vown);
                V *block = chunk + blocks * joints * TILE;
                rows_of_samples(joints, data, gravity, vq, vqd, vqdd, TILE, places, block);
                for (int k = 0; k < joints * owned; k++) block[k / owned * TILE + own_places[k]] = vown[k];
                if (count == LANES) continue;
                V present;
                for (int l = 0; l < LANES; l++) present[l] = l < count;
                for (int t = 0; t < panels; t++)
                    for (int k = 0; k < joints * TILE; k++) block[t * panel + k] *= present;
            }
            V *sum = sums;
            for (int t = 0; t < panels; t++)
                for (int u = t; u < panels; u++, sum += HALVES * TILE * TILE)
                    add_tile(blocks, rows_of[t], joints * TILE, chunk + t * panel, chunk + u * panel, sum);
        }
        double *gram = out + p * n * n;
        const V *sum = sums;
        for (int t = 0; t < panels; t++)
            for (int u = t; u < panels; u++, sum += HALVES * TILE * TILE)
                for (int e = 0; e < TILE * TILE; e++) {
                    int k = TILE * t + e / TILE, c = TILE * u + e % TILE;
                    double a[LANES], b[LANES];
                    memcpy(a, sum + e, sizeof a), memcpy(b, sum + TILE * TILE + e, sizeof b);
                    if (k < n && c < n)
                        gram[k * n + c] = gram[c * n + k] =
                            ((a[0] + a[1]) + (a[2] + a[3])) + ((b[0] + b[1]) + (b[2] + b[3]));
                }
    }
}

/* Torques of given inertial parameters, (samples, joints): the observation matrix times (10 joints,). */
FOR_EACH_PROCESSOR
void torques(int joints, const JointData *data, const double *gravity, int64_t samples, const double *q,
             const double *qd, const double *qdd, const double *parameters, double *out) {
    V vq[MAX_JOINTS], vqd[MAX_JOINTS], vqdd[MAX_JOINTS], torque[MAX_JOINTS];
    for (int64_t s = 0; s < samples; s += LANES) {
        int count = at_most_lanes(samples - s);
        load(joints, count, joints, q + s * joints, vq);
        load(joints, count, joints, qd + s * joints, vqd);
        load(joints, count, joints, qdd + s * joints, vqdd);
        torques_of_samples(joints, data, gravity, vq, vqd, vqdd, parameters, torque);
        for (int i = 0; i < joints; i++)
            for (int l = 0; l < count; l++) out[(s + l) * joints + i] = torque[i][l];
    }
}

/* Sums of basis functions: out (orders, trajectories, samples, joints) = sum over k of
 * basis (orders, samples, terms) * coefficients (trajectories, joints, terms). scratch: terms * (samples + 2 * LANES). */
FOR_EACH_PROCESSOR
void series(int orders, int64_t trajectories, int64_t samples, int joints, int terms, const double *basis,
            const double *coefficients, double *scratch, double *out) {
    V *values = (V *)(((uintptr_t)scratch + sizeof(V) - 1) & ~(uintptr_t)(sizeof(V) - 1)); /* [block][term] */
    for (int order = 0; order < orders; order++, basis += samples * terms) {
        for (int64_t s = 0; s < samples; s += LANES)
            load(terms, at_most_lanes(samples - s), terms, basis + s * terms, values + s / LANES * terms);
        for (int64_t p = 0; p < trajectories; p++, out += samples * joints)
            for (int from = 0; from < joints; from += MAX_JOINTS) {
                const double *own = coefficients + (p * joints + from) * terms;
                int some = joints - from < MAX_JOINTS ? joints - from : MAX_JOINTS;
                for (int64_t s = 0; s < samples; s += LANES) {
                    const V *value = values + s / LANES * terms;
                    V sums[MAX_JOINTS];
                    for (int j = 0; j < some; j++) {
                        V sum = {0};
                        for (int k = 0; k < terms; k++) sum += value[k] * own[j * terms + k];
                        sums[j] = sum;
                    }
                    int count = at_most_lanes(samples - s);
                    for (int l = 0; l < count; l++)
                        for (int j = 0; j < some; j++) out[(s + l) * joints + from + j] = sums[j][l];
                }
            }
    }
}

INLINE V blend(I where, V chosen, V other) { return (V)(((I)chosen & where) | ((I)other & ~where)); }

/* Lowest and highest of sums of basis functions, (trajectories, joints, 2), of the sum over k of
 * coefficients (trajectories, joints, terms) * basis (terms, samples); samples: a multiple of four. */
FOR_EACH_PROCESSOR
void series_extremes(int64_t trajectories, int64_t samples, int joints, int terms, const double *basis,
                     const double *coefficients, double *out) {
    for (int64_t p = 0; p < trajectories * joints; p++) {
        const double *c = coefficients + p * terms;
        V low = {0}, high = {0};
        for (int64_t s = 0; s < samples; s += LANES) {
            V sum = {0}, value;
            for (int k = 0; k < terms; k++) {
                memcpy(&value, basis + k * samples + s, sizeof value);
                sum += value * c[k];
            }
            low = s ? blend(sum < low, sum, low) : sum;
            high = s ? blend(sum > high, sum, high) : sum;
        }
        double lowest = low[0], highest = high[0];
        for (int l = 1; l < LANES; l++) {
            lowest = low[l] < lowest ? low[l] : lowest;
            highest = high[l] > highest ? high[l] : highest;
        }
        out[2 * p] = lowest, out[2 * p + 1] = highest;
    }
}

/* Peaks of each joint of each trajectory: lowest and highest position, largest speed and acceleration;
 * (trajectories, 4, joints). */
FOR_EACH_PROCESSOR
void peaks(int64_t trajectories, int64_t samples, int joints, const double *q, const double *qd, const double *qdd,
           double *out) {
    for (int64_t p = 0; p < trajectories; p++)
        for (int j = 0; j < joints; j++) {
            int64_t at = p * samples * joints + j;
            double low = q[at], high = q[at], speed = 0, acceleration = 0;
            for (int64_t s = 0; s < samples; s++, at += joints) {
                double v = qd[at] < 0 ? -qd[at] : qd[at], a = qdd[at] < 0 ? -qdd[at] : qdd[at];
                low = q[at] < low ? q[at] : low;
                high = q[at] > high ? q[at] : high;
                speed = v > speed ? v : speed;
                acceleration = a > acceleration ? a : acceleration;
            }
            double *peak = out + p * 4 * joints + j;
            peak[0] = low, peak[joints] = high, peak[2 * joints] = speed, peak[3 * joints] = acceleration;
        }
}
