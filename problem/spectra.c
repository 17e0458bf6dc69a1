/* Smallest and largest singular values of many matrices from their Gram matrices, which are small and symmetric.
 *
 * Four matrices at a time, one in each lane of a vector. A matrix is made tridiagonal by reflections (Householder 1958),
 * and Laguerre's iteration goes from outside the spectrum to its first and its last eigenvalue (Parlett 1964). The order
 * of every sum is fixed and no product is fused with a sum, so that both are the same to the bit on every processor and
 * in every batch. */

#include <math.h>
#include <stdint.h>
#include <string.h>

#define LANES 4
#define MAX_SIZE 208       /* 16 joints with ten columns and three of their own each */
#define MAX_STEPS 400      /* of the iteration: a handful, but hundreds where half of all eigenvalues meet */
#define SMALL_STEP 0x1p-50 /* of the eigenvalue: four units in its last place */
typedef double V __attribute__((vector_size(8 * LANES)));
typedef int64_t I __attribute__((vector_size(8 * LANES)));
#define INLINE static inline __attribute__((always_inline))

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
#define FOR_EACH_PROCESSOR __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define FOR_EACH_PROCESSOR
#endif

/* A double is a sign, an exponent and the bits of a mantissa. */
#define MANTISSA_BITS 52
#define EXPONENT_BIAS 1023
#define EXPONENT 0x7ff0000000000000
#define WITHOUT_SIGN 0x7fffffffffffffff

INLINE V choose(I where, V chosen, V other) { return (V)(((I)chosen & where) | ((I)other & ~where)); }
INLINE V size(V x) { return (V)((I)x & WITHOUT_SIGN); }
INLINE V root(V x) { return (V){sqrt(x[0]), sqrt(x[1]), sqrt(x[2]), sqrt(x[3])}; }
INLINE int any(I where) { return (where[0] | where[1] | where[2] | where[3]) != 0; }

/* A power of two that brings a positive number between one and two. */
INLINE V scale_of(V x) { return (V)((2LL * EXPONENT_BIAS << MANTISSA_BITS) - ((I)x & EXPONENT)); }

/* Upper triangle (n, n) to the diagonal (n,), and the squares of what stands beside it (n,), of a tridiagonal matrix with
 * the same eigenvalues. Step k takes A to H A H with H = 1 - v v' / h, and v from the row of k:
 *     p = A v / h,   w = p - v (v' p) / (2 h),   H A H = A - v w' - w v'
 * The product A v of the next step comes from the same pass over the matrix as the update of this one. */
INLINE void make_tridiagonal(int n, V *a, V *diagonal, V *beside) {
    V zero = {0};
    V vectors[2][MAX_SIZE], w[MAX_SIZE], p[MAX_SIZE];
    V *v = vectors[0], *next = vectors[1];
    for (int j = 0; j < n; j++) v[j] = w[j] = zero;
    for (int k = 0; k < n; k++) {
        V *row = a + (int64_t)k * n;
        for (int j = k; j < n; j++) row[j] -= v[k] * w[j] + w[k] * v[j];
        diagonal[k] = row[k], beside[k] = zero;
        if (k == n - 1) break;
        V square = zero;
        for (int j = k + 1; j < n; j++) square += row[j] * row[j], next[j] = row[j], p[j] = zero;
        beside[k] = square;
        V first = row[k + 1], length = root(square), h = square + size(first) * length;
        V inverse = 1.0 / choose(h > 0, h, zero + 1.0);
        next[k + 1] = choose(first < 0, first - length, first + length);
        for (int i = k + 1; i < n; i++) {
            V *r = a + (int64_t)i * n, vi = v[i], wi = w[i], ni = next[i];
            r[i] -= vi * wi + wi * vi;
            V sum = r[i] * ni;
            for (int j = i + 1; j < n; j++) {
                V entry = r[j] - (vi * w[j] + wi * v[j]);
                r[j] = entry;
                sum += entry * next[j];
                p[j] += entry * ni;
            }
            p[i] += sum;
        }
        V along = zero;
        for (int j = k + 1; j < n; j++) along += next[j] * p[j];
        V share = 0.5 * inverse * inverse * along;
        for (int j = k + 1; j < n; j++) w[j] = p[j] * inverse - share * next[j];
        V *last = v;
        v = next, next = last;
    }
}

/* Sums of 1 / (y - x) and of its square over the eigenvalues x of a tridiagonal matrix; positive: where all pivots of
 * y - matrix are, that is, where y is above all eigenvalues. */
typedef struct { V first, second; I positive; } Sums;

/* The last eigenvalues of the matrix and of its negative: a pivot waits for the one before it, so both are found at once.
 * pivot q_i = (y - d_i) - e_i^2 / q_(i-1); r = q' / q and u = 2 r^2 - q'' / q with derivatives by y. */
#define ENDS 2

/* minus_diagonals: (ENDS, n), of the matrix and of its negative. */
INLINE void sum_over_spectra(int n, V (*minus_diagonals)[MAX_SIZE], const V *beside, const V *y, Sums *sums) {
    V zero = {0}, r[ENDS], u[ENDS], inverse[ENDS];
    for (int e = 0; e < ENDS; e++) {
        r[e] = u[e] = inverse[e] = zero;
        sums[e] = (Sums){zero, zero, ~(I){0}};
    }
    for (int i = 0; i < n; i++)
        for (int e = 0; e < ENDS; e++) {
            V ratio = i ? beside[i - 1] * inverse[e] : zero;
            V pivot = (minus_diagonals[e][i] + y[e]) - ratio;
            inverse[e] = 1.0 / pivot;
            V bend = ratio * u[e] * inverse[e]; /* -q'' / q */
            r[e] = (1.0 + ratio * r[e]) * inverse[e];
            V square = r[e] * r[e];
            u[e] = square + square + bend;
            sums[e].first += r[e];
            sums[e].second += square + bend;
            sums[e].positive &= pivot > 0;
        }
}

/* last: (ENDS,), bounds from above of the last eigenvalues of a tridiagonal matrix and of its negative, to these
 * eigenvalues; returns where both are found. Each step ends above the eigenvalue but for rounding. */
INLINE I find_last_eigenvalues(int n, V (*minus_diagonals)[MAX_SIZE], const V *beside, V *last) {
    double count = n;
    V zero = {0};
    I moving[ENDS] = {~(I){0}, ~(I){0}};
    for (int step = 0; step < MAX_STEPS && any(moving[0] | moving[1]); step++) {
        Sums sums[ENDS];
        sum_over_spectra(n, minus_diagonals, beside, last, sums);
        for (int e = 0; e < ENDS; e++) {
            V first = sums[e].first, spread = (count - 1) * (count * sums[e].second - first * first);
            V way = count / (first + root(choose(spread > 0, spread, zero)));
            moving[e] &= sums[e].positive;
            last[e] = choose(moving[e], last[e] - way, last[e]);
            moving[e] &= way > SMALL_STEP * size(last[e]);
        }
    }
    return ~moving[0] & ~moving[1];
}

/* Product of the pivots of a tridiagonal matrix as mantissa * 2^exponent; returns where all of them are positive. */
INLINE I multiply_pivots(int n, const V *diagonal, const V *beside, V *mantissa, I *exponent) {
    I positive = ~(I){0};
    V pivot = diagonal[0];
    *mantissa = (V){1, 1, 1, 1}, *exponent = (I){0};
    for (int i = 0; i < n; i++) {
        if (i) pivot = diagonal[i] - beside[i - 1] / pivot;
        positive &= pivot > 0;
        *exponent += ((I)pivot >> MANTISSA_BITS) - EXPONENT_BIAS;
        *mantissa *= (V)(((I)pivot & ~EXPONENT) | (I)(V){1, 1, 1, 1}); /* from 1 to 2: no overflow, n being small */
    }
    return positive;
}

/* Smallest and largest singular value, their ratio, and the mean of the logarithms of all, (4, count), of matrices whose
 * Gram matrices are given, (count, n, n). Not a number where a Gram matrix is not positive definite, or where the ratio
 * is above max_condition; returns how many these are. scratch: n * n + 1 vectors. */
FOR_EACH_PROCESSOR
int64_t spectra(int64_t count, int n, const double *grams, double max_condition, double *scratch, double *out) {
    int64_t unknown = 0;
    V *a = (V *)(((uintptr_t)scratch + sizeof(V) - 1) & ~(uintptr_t)(sizeof(V) - 1));
    V minus_diagonals[ENDS][MAX_SIZE], beside[MAX_SIZE];
    V *diagonal = minus_diagonals[1], zero = {0};
    for (int64_t from = 0; from < count; from += LANES) {
        const double *lane[LANES];
        for (int l = 0; l < LANES; l++) lane[l] = grams + (from + l < count ? from + l : count - 1) * n * n;
        V trace = zero, power = zero;
        for (int k = 0; k < n * n; k += n + 1) trace += (V){lane[0][k], lane[1][k], lane[2][k], lane[3][k]};
        V scale = scale_of(trace);
        for (int k = 0; k < n; k++)
            for (int i = k * n + k; i < k * n + n; i++)
                a[i] = (V){lane[0][i], lane[1][i], lane[2][i], lane[3][i]} * scale;
        make_tridiagonal(n, a, diagonal, beside);
        for (int k = 0; k < n; k++) {
            minus_diagonals[0][k] = -diagonal[k];
            power += diagonal[k] * diagonal[k] + beside[k] + beside[k]; /* the sum of all squared eigenvalues */
        }
        V mantissa, last[ENDS] = {root(power), zero};
        I exponent;
        I known = multiply_pivots(n, diagonal, beside, &mantissa, &exponent);
        known &= find_last_eigenvalues(n, minus_diagonals, beside, last);
        V largest = root(last[0] / scale), smallest = root(-last[1] / scale), condition = largest / smallest;
        known &= condition <= max_condition;
        for (int l = 0; l < LANES && from + l < count; l++) {
            double *found = out + from + l;
            double logarithm = (log(mantissa[l]) + (double)exponent[l] * M_LN2) / n - log(scale[l]);
            found[0] = known[l] ? smallest[l] : NAN;
            found[count] = known[l] ? largest[l] : NAN;
            found[2 * count] = known[l] ? condition[l] : NAN;
            found[3 * count] = known[l] ? 0.5 * logarithm : NAN;
            unknown += !known[l];
        }
    }
    return unknown;
}
