/* A swarm flies and lands, one particle after the other; algorithms/spso.py says where the equations come from.
 *
 * The order of every sum is as written and no product is fused with a sum (-ffp-contract=off), so that results are the
 * same to the bit on every processor. */

#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
#define FOR_EACH_PROCESSOR __attribute__((target_clones("avx2", "default")))
#else
#define FOR_EACH_PROCESSOR
#endif

/* n particles in d dimensions: positions x, velocities v and personal bests p, (n, d) each; best (n): fitness of p;
 * limit (d): of the velocities, infinite where walls do not stop a particle. */
typedef struct {
    int64_t n, d;
    double *x, *v, *p, *best, *limit;
} Particles;

static inline void fly_one(int64_t d, double w, double c1, double c2, const double *restrict r1,
                           const double *restrict r2, const double *restrict p, const double *restrict g,
                           const double *restrict limit, double *restrict x, double *restrict v) {
    for (int64_t j = 0; j < d; j++) {
        double next = w * v[j] + c1 * (r1[j] * (p[j] - x[j])) + c2 * (r2[j] * (g[j] - x[j])); /* eq. 2 */
        next = next > limit[j] ? limit[j] : next;
        v[j] = next < -limit[j] ? -limit[j] : next;
        x[j] = x[j] + v[j]; /* eq. 1 */
    }
}

/* leader: the particle whose personal best is the global best g. r: (2, n, d), r1 and r2. */
FOR_EACH_PROCESSOR
void fly(const Particles *all, int64_t leader, double w, double c1, double c2, const double *r) {
    const int64_t d = all->d, size = all->n * d;
    const double *g = all->p + leader * d;
    for (int64_t i = 0; i < size; i += d)
        fly_one(d, w, c1, c2, r + i, r + size + i, all->p + i, g, all->limit, all->x + i, all->v + i);
}

static inline void stop_at_walls(int64_t d, const double *restrict x, const double *restrict told,
                                 const double *restrict limit, double *restrict v) {
    for (int64_t j = 0; j < d; j++)
        v[j] = x[j] != told[j] && limit[j] < INFINITY ? 0.0 : v[j];
}

/* told (n, d): the positions as the bound policy left them; fitness (n): theirs. Returns the leader, the first of
 * equals. */
FOR_EACH_PROCESSOR
int64_t land(const Particles *all, const double *told, const double *fitness) {
    const int64_t d = all->d;
    int64_t leader = 0;
    for (int64_t i = 0; i < all->n; i++, told += d) {
        stop_at_walls(d, all->x + i * d, told, all->limit, all->v + i * d);
        memcpy(all->x + i * d, told, d * sizeof *told);
        if (isfinite(fitness[i]) && fitness[i] < all->best[i]) {
            memcpy(all->p + i * d, told, d * sizeof *told);
            all->best[i] = fitness[i];
        }
        leader = all->best[i] < all->best[leader] ? i : leader;
    }
    return leader;
}
